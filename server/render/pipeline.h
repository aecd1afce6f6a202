// The list of passes of one frame, in order: the one page that says what runs when. Keys are the cost table of
// docs/rendering.md.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "server/render/graph.h"
#include "server/render/passes/passes.h"

namespace gonio {

// One frame's inputs. lights[i] belongs to scene.lights[i].
struct FrameInputs {
    Programs& programs;
    const GpuScene& geometry;
    const Scene& scene;
    const Target& target;
    ScreenLight& screen;  // of the target
    PassCache& pass_cache;
    const Eye& eye;
    std::vector<LightGpu*> lights;
    View view;
    const trace::Geometry& traced;
    const lighting::Clusters& clusters;
    const lighting::MaterialTable& material_table;
    Pool& pool;
    bool direct_by_rays = false;
    const transport::Transport* transport = nullptr;  // null: not made yet
    std::uint64_t generation = 0;                     // counts what `transport` was
    std::vector<int> layers;                          // PassContext::layers
    std::map<std::uint32_t, glm::dvec3> in_sum;       // PassContext::in_sum
    std::size_t layered() const;                      // lights that have one
    int bounces = trace::kAllBounces;                 // or 1, or 0: of captures and meters
    enum class Meter : std::uint8_t { none, interactive, rsm };
    Meter meter = Meter::none;  // else the G-buffer is a single point and nothing is composited; rsm: texels are wanted
    // Whether the live picture's light stays on the CPU; a view that only shaders show asks for it (run_layers).
    bool shades_on_cpu() const;
    // Whether its indirect light is gathered by shaders.
    bool gathers_by_gl() const;
    std::size_t quality_level = 0;      // index into kQualityLevels
    std::uint64_t surface() const;      // tells one set of surfels from another
    std::uint64_t solve_links() const;  // that the solve follows, at most
    bool has_besides() const;           // light without a layer
    // Whether the direct light of a luminaire in the live picture is to have a shadow ray from each pixel; from now on
    // it is, until what it depends on moves.
    bool each_pixel(const Light& light) const;
    void want_each_pixel(const Light& light) const;
    PassContext context() const;
    // Whether the picture can be made of all luminaires at once: several of them, and it shows them.
    bool can_merge() const;
    Revision seen_rev = 0;              // the scene's in the live frame before
    bool merged = false;                // it is; else of the luminaires' own layers
    std::vector<std::uint32_t> refill;  // ids of luminaires whose own layers are made besides
    GLuint raw = 0;                     // composite values into this framebuffer instead of the display
};

// inputs outlive the passes.
std::vector<Pass> build_pipeline(const FrameInputs& inputs);

// The slots a viewer of this view looks at: NV12 for the live picture, the picture for captures, layers for meters.
std::vector<SlotRef> wanted_slots(const FrameInputs& inputs, bool nv12);

}  // namespace gonio
