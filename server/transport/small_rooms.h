// Rooms that are small beside the distance between surfels: a cupboard in a hall. Surfels lie closer together in them,
// because light changes over distances that are a part of the room around.
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

// Places in the air where surfaces are near. One thread. Coordinates are local, m.
class SmallRooms {
public:
    // most_m: what is longer than this is no small room.
    explicit SmallRooms(float most_m) : most_m_(most_m) {}
    // Keeps the middle of a way that light takes between two surfaces, if it is short and the first of its length
    // there. 8,192 at most.
    void offer(const glm::vec3& from, const glm::vec3& to);
    // Offers short ways from points that are drawn over all surfaces, whether light comes there or not. Few walks from
    // a luminaire pass the slit of a cupboard. With those of offer() 16,384 at most. pool, stopped: as of found().
    void look(const trace::Geometry& geometry, const Areas& areas, Pool& pool, const std::function<bool()>& stopped);
    // Result: places whose surroundings are a room no larger than most_m, a few in each room and 512 at most. Each
    // reaches as far as nine in ten of the surfaces around it. A place from which more than a tenth of all directions
    // lead further is in no room: so the edges and corners of a large one are none. Light must come there: by offer(),
    // or because one of 16 walks comes from there to what is `reached`, within 16 steps. stopped: asked now and then.
    // When it is true, some are left out.
    std::vector<NearSources::Source> found(const trace::Geometry& geometry, const Reached& reached, float most_m,
                                           Pool& pool, const std::function<bool()>& stopped) const;

private:
    struct Place {
        glm::vec3 at;
        bool doubtful;  // whether light comes there
    };
    void keep(const glm::vec3& from, const glm::vec3& to, bool doubtful);

    float most_m_;
    std::unordered_set<std::uint64_t> known_;  // cells of space, as wide as the way is long, by their hash
    std::vector<Place> places_;
};

}  // namespace gonio::transport
