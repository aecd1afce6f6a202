// Where surfels lie closer together: near luminaires, because illuminance changes there over distances that are as
// short as the way to them. In a lampshade or a housing nothing else is exact enough.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <utility>
#include <vector>

#include "server/base/pool.h"
#include "server/trace/geometry.h"

namespace gonio::transport {

// Sources by place. Where more than 16 are near one place none counts: surfels close to all of them would be too many.
// Immutable; any thread.
class NearSources {
public:
    // reach_m: what is further away from a source counts as not near it.
    NearSources(const trace::Geometry& geometry, std::span<const glm::vec3> sources, float reach_m);

    struct Near {
        float distance_m;          // to the nearest source in sight, reach_m at most
        double rays_per_m2 = 0.0;  // of `rays` that come there: how densely they sample an opaque surface
    };
    Near at(const trace::SurfacePoint& point) const;

    // One end of a ray from a source, on the side that the ray meets.
    struct End {
        int instance, triangle;
        float u, v;
        bool front;
    };
    // Result: the ends of rays that go evenly in all directions, no further than reach_m. Each source has as many.
    // stopped: asked now and then. When it is true, some are left out.
    std::vector<End> rays(Pool& pool, const std::function<bool()>& stopped) const;

private:
    const trace::Geometry& geometry_;
    std::span<const glm::vec3> sources_;
    float reach_m_;
    unsigned rays_;  // of each source; a multiple of trace::kPacket
    // By the hash of a cell of space, twice the reach wide: those that reach into it. Ascending.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_cell_;
};

}  // namespace gonio::transport
