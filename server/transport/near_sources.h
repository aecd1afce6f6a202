// Places around which surfels lie closer together: luminaires and small rooms (server/transport/small_rooms.h). Near a
// luminaire illuminance changes over distances as short as the way to it, in a room over parts of the room. In a
// lampshade or a housing coarser surfels are not exact enough.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "server/base/pool.h"
#include "server/trace/geometry.h"

namespace gonio::transport {

// Sixteen rays from a place, evenly spread over all directions: number `first` and those after it of a sequence.
// stream: chooses the sequence. The rays start off_m from the place and end far_m further on.
trace::RayPacket rays_around(const glm::vec3& place, float off_m, std::uint32_t stream, unsigned first, float far_m);

// Sources by place. Immutable; any thread.
class NearSources {
public:
    struct Source {
        glm::vec3 position;  // local, m
        float reach_m;       // points further away than this are not near it
    };
    struct Bounds {
        unsigned rays;  // from each source; all sources together send 131,072 at most
        // Where more sources than this are near one place, none of them counts: surfels close to all would be too many.
        std::ptrdiff_t at_once;
    };
    NearSources(const trace::Geometry& geometry, std::vector<Source> sources, const Bounds& bounds);

    struct Near {
        float distance_m;          // to the nearest source in sight; infinite if none is near
        float reach_m;             // the shortest reach of the sources in sight; infinite if none is near
        double rays_per_m2 = 0.0;  // how densely the rays of rays() sample an opaque surface there
    };
    Near at(const trace::SurfacePoint& point) const;

    // One end of a ray from a source, on the side that the ray meets.
    struct End {
        int instance, triangle;
        float u, v;
        bool front;
    };
    // Result: the ends of the rays that each source sends evenly in all directions, as far as it reaches. All sources
    // send equally many. stopped: asked now and then. When it is true, some are left out.
    std::vector<End> rays(Pool& pool, const std::function<bool()>& stopped) const;

private:
    const trace::Geometry& geometry_;
    std::vector<Source> sources_;
    std::ptrdiff_t at_once_;
    float side_m_ = 0.0f;  // of cells of space: twice the longest reach
    unsigned rays_;        // of each source; a multiple of trace::kPacket
    // Pairs of a cell's hash and a source that reaches into the cell; ascending.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_cell_;
};

}  // namespace gonio::transport
