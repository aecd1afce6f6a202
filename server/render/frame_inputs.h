// What a frame is made of, and what follows from it: which light is on the CPU, what is merged, what is besides.
#pragma once

#include <vector>

#include "server/render/passes/passes.h"

namespace gonio {

// One frame's inputs. lights[i] belongs to scene.lights[i].
struct FrameInputs : PassContext {
    ScreenLight& screen;  // of the target
    View view;
    bool direct_by_rays;
    std::uint64_t generation;   // counts what `transport` was
    std::vector<int> layer_of;  // what `layers` refers to
    std::vector<LightGpu*> lights;
    std::size_t layered() const;  // lights that have a layer
    enum class Meter : std::uint8_t { none, interactive, rsm };
    Meter meter = Meter::none;  // else the G-buffer is a single point and nothing is composited; rsm: texels are wanted
    // Whether the live picture's light stays on the CPU; a view that only shaders show asks for it (run_layers).
    bool shades_on_cpu() const;
    // Whether its indirect light is gathered by shaders.
    bool gathers_by_gl() const;
    std::uint64_t surface() const;      // tells one set of surfels from another
    std::uint64_t solve_links() const;  // that the solve follows, at most
    bool has_besides() const;           // light without a layer
    // Whether the direct light of a luminaire in the live picture is to have a shadow ray from each pixel. And: from
    // now on it is, until what it depends on moves.
    bool wants_each_pixel(const Light& light) const;
    void want_each_pixel(const Light& light) const;
    PassContext context() const;  // of a pass
    // Whether the picture can be made of all luminaires at once: several of them, and it shows them.
    bool can_merge() const;
    Revision seen_rev = 0;              // the scene's in the live frame before
    std::vector<std::uint32_t> refill;  // ids of luminaires whose own layers are made besides
    bool shares_sum = false;            // what is summed is solved once for all targets like this one
    GLuint raw = 0;                     // composite values into this framebuffer instead of the display
};

}  // namespace gonio
