// What goniod begins with: the scene with its patch and map, as options and the saved show say.
#pragma once

#include "server/app/options.h"
#include "server/scene/light.h"
#include "server/scene/undo_record.h"
#include "server/session/gpu.h"
#include "server/surfaces/control_surfaces.h"

namespace gonio {

struct Scene;

// Result: the scene. With options.state_file it is the one that was saved there, as far as it can be brought back. What
// the command line says explicitly wins. restored_rev gets the revision of that file, undo what
// can be undone of it. Throws std::invalid_argument with one sentence where an option is wrong.
Scene first_scene(const Options& options, Revision* restored_rev = nullptr, UndoRecord* undo = nullptr);

// Reads a scene that undo goes back to, with its steps. Result: null where it cannot be read, which the log says. Any
// thread; takes as long as a scene takes.
std::shared_ptr<const LeftScene> read_left(const Options& options, const LeftScene& kept,
                                           const std::shared_ptr<const Gels>& gels);

// Result: where clients save shows; empty: nowhere.
std::string show_folder(const Options& options);

// Result: what makes the GL context and its renderer, at the start and after a loss. It throws std::runtime_error where
// there is no GPU.
std::function<Gpu::Made()> gpu_maker(const Options& options);

// Captures the frames of options.oneshot, or bakes the maps of options.bake. Result: the exit code.
int run_job(const Options& options, Scene scene);

// Throws std::invalid_argument likewise.
SurfaceOptions surface_options(const Options& options);

}  // namespace gonio
