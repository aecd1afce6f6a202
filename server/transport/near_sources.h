// Places around which surfels lie closer together. Near a luminaire they do, because illuminance changes over distances
// that are as short as the way to it. In a lampshade or a housing nothing else is exact enough. In a small room
// (server/transport/small_rooms.h) they do, because light changes over parts of the room.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "server/base/pool.h"
#include "server/trace/geometry.h"

namespace gonio::transport {

// Sources by place. Immutable; any thread.
class NearSources {
public:
    struct Source {
        glm::vec3 position;  // local, m
        float reach_m;       // what is further away is not near it
    };
    struct Bounds {
        unsigned rays;           // of each source; of all together 131,072
        std::ptrdiff_t at_once;  // where more are near one place none counts: surfels close to all would be too many
    };
    NearSources(const trace::Geometry& geometry, std::vector<Source> sources, const Bounds& bounds);

    struct Near {
        float distance_m;          // to the nearest source in sight; infinite: none is near
        float reach_m;             // the shortest of those in sight; infinite: none is near
        double rays_per_m2 = 0.0;  // of `rays` that come there: how densely they sample an opaque surface
    };
    Near at(const trace::SurfacePoint& point) const;

    // One end of a ray from a source, on the side that the ray meets.
    struct End {
        int instance, triangle;
        float u, v;
        bool front;
    };
    // Result: the ends of rays that go evenly in all directions, as far as their source reaches. Each has as many.
    // stopped: asked now and then. When it is true, some are left out.
    std::vector<End> rays(Pool& pool, const std::function<bool()>& stopped) const;

private:
    const trace::Geometry& geometry_;
    std::vector<Source> sources_;
    std::ptrdiff_t at_once_;
    float side_m_ = 0.0f;  // of cells of space: twice the longest reach
    unsigned rays_;        // of each source; a multiple of trace::kPacket
    // By the hash of a cell: those that reach into it. Ascending.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_cell_;
};

}  // namespace gonio::transport
