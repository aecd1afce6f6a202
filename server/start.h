// What goniod begins with: the scene with its patch and map, as options and the saved show say.
#pragma once

#include "server/control/surfaces.h"
#include "server/options.h"
#include "server/scene/scene.h"

namespace gonio {

// Result: the scene. With options.state_file it is the one that was saved there, as far as it can be brought back; what
// the command line says explicitly wins. Throws std::invalid_argument with one sentence where an option is wrong.
Scene first_scene(const Options& options);

// Throws std::invalid_argument likewise.
SurfaceOptions surface_options(const Options& options);

}  // namespace gonio
