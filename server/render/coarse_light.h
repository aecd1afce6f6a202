// How far the live indirect light is from the truth where it is metered. A second transport of the scene has a quarter
// of the surfels. Where its light differs from the picture's, the spacing of surfels and the number of links matter.
// Two grids tell the error of the finer one (Richardson 1911). Render thread.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/render/frame_inputs.h"

namespace gonio {

// Light of one transport, of all luminaires at their weights and of emissive surfaces.
struct PlainLight {
    std::shared_ptr<const transport::Transport> transport;  // null: none yet
    transport::Irradiance light;                            // lux
    std::vector<glm::vec4> sent;                            // rho (share × E0 + E), lux
    std::vector<glm::vec4> late;  // rho × what the solve has left out of E, lux; of `fine` alone
    double mean_lx = 0.0;         // E of all surfels on the mean
};

// Kept from one meter to the next, because it costs as much as a frame.
struct CoarseLight {
    std::shared_ptr<const transport::Transport::Surface> beside;  // the finer surfels that `builder` stands beside
    std::unique_ptr<transport::Builder> builder;
    std::shared_ptr<const transport::Transport> made;  // by it, the newest that was lit
    Revision scene_rev = 0;                            // that both are of
    std::vector<glm::vec3> per_unit;  // by luminaire: lux for one in LightGpu's unit; scenes of one revision may differ
    PlainLight fine, coarse;
};

// What the two lights differ by at a point.
struct Discrepancy {
    bool known = false;          // false while the coarse transport is being made
    double difference_lx = 0.0;  // of the illuminances
    double patches_lx = 0.0;     // of what each coarse surfel sends to the point, added up as if independent
    double scene_lx = 0.0;       // mean indirect illuminance of all surfels
    double late_lx = 0.0;        // what comes to the point of that which the solve has left out
    double late_share = 0.0;     // Solved::error of the same solve: what late_lx comes from
    double absorbed_lx = 0.0;    // what the point's own links lose to the air less than surfels' links on the mean
    // Known at once:
    double missing = 0.0;  // share of the links that meet a surface without a surfel, by albedo
    double dimmed = 0.0;   // share of the links' light that haze takes on its way
    double legs = 1.0;     // surfaces that light meets, on the mean, before it is absorbed
};
// inputs: of a meter whose passes have run. fine: the transport that they read, not null. seeds, settings: those that
// it was made with. waits: for the coarse one.
Discrepancy discrepancy_of(const FrameInputs& inputs, const std::shared_ptr<const transport::Transport>& fine,
                           std::span<const glm::vec3> seeds, const transport::SurfelSettings& settings, bool waits,
                           CoarseLight& kept);

}  // namespace gonio
