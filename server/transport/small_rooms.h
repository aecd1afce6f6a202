// Finds rooms that are small compared with the spacing of surfels, such as a cupboard in a hall. Surfels lie closer
// together in them, because light changes over distances that are a fraction of the room.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <unordered_set>
#include <vector>

#include "server/base/pool.h"
#include "server/trace/geometry.h"
#include "server/transport/candidates.h"
#include "server/transport/near_sources.h"
#include "server/transport/reached.h"

namespace gonio::transport {

// Collects places in the air that have surfaces nearby, and tells which of them are in small rooms. One thread.
// Coordinates are local, m.
class SmallRooms {
public:
    // most_m: steps longer than this are ignored.
    explicit SmallRooms(float most_m) : most_m_(most_m) {}
    // Keeps the middle of a step that light takes between two surfaces, if the step is short and the first of its
    // length there. Keeps 8,192 at most.
    void offer(const glm::vec3& from, const glm::vec3& to);
    // Keeps the middles of short rays from points drawn over all surfaces, whether light reaches them or not: few walks
    // from a luminaire find the slit of a cupboard. With those of offer() 16,384 are kept at most. pool, stopped: see
    // found().
    void look(const trace::Geometry& geometry, const Areas& areas, Pool& pool, const std::function<bool()>& stopped);
    // Result: places in rooms no larger than most_m, a few in each room and 512 at most. A place's reach is the
    // distance within which nine in ten of the rays from it end. If more than one in ten go further than most_m, the
    // place is in no small room. So the edges and corners of a large room do not count. Light reaches the places of
    // offer(). From any other place one of 16 walks must come to a surface of `reached` within 16 steps. stopped: asked
    // now and then. When it is true, some places are left out.
    std::vector<NearSources::Source> found(const trace::Geometry& geometry, const Reached& reached, float most_m,
                                           Pool& pool, const std::function<bool()>& stopped) const;

private:
    struct Place {
        glm::vec3 at;
        bool doubtful;  // whether it is unknown that light reaches it
    };
    void keep(const glm::vec3& from, const glm::vec3& to, bool doubtful);

    float most_m_;
    std::unordered_set<std::uint64_t> known_;  // hashes of cells about as wide as the steps in them are long
    std::vector<Place> places_;
};

}  // namespace gonio::transport
