// Bodies of luminaires as the renderer shows them: for the CPU's rasteriser, for GL, and what indirect light they take.
// Render thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/lighting/body_sides.h"
#include "server/lighting/posed_bodies.h"
#include "server/render/gpu_scene.h"
#include "server/scene/body.h"
#include "server/scene/eye.h"

namespace gonio {

class ShownBodies {
public:
    // posed: of the same, nowhere yet. within: whose targets they are drawn into.
    ShownBodies(std::shared_ptr<const Bodies> bodies, const lighting::PosedBodies& posed, const GpuScene& within);

    // Brings them to where the scene's lights are. origin: of local coordinates. What has not moved costs nothing.
    void place(const Scene& scene, const glm::dvec3& origin);
    // Result: a number that tells where those stand that may be in the view; 0: there are none.
    std::uint64_t in_view(const Eye& eye) const;

    const lighting::PosedBodies& posed() const { return posed_; }
    const GpuScene& gpu() const { return gpu_; }
    const lighting::BodySides& sides() const { return sides_; }
    // Follows links of what has moved.
    void find_sides(const std::shared_ptr<const transport::Transport::Surface>& surface, Pool& pool) {
        sides_.update(surface, middles_, pool);
    }

private:
    std::shared_ptr<const Bodies> bodies_;
    lighting::PosedBodies posed_;
    GpuScene gpu_;
    lighting::BodySides sides_;
    BodyPlaces places_;
    std::vector<std::optional<lighting::BodyMiddle>> middles_;  // likewise
    std::vector<lighting::BodyMiddle> at_home_;                 // likewise, of the fixture's axes
};

}  // namespace gonio
