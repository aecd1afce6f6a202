// Which surfaces light comes to: those that random walks from where it starts have met.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "server/trace/geometry.h"
#include "server/transport/space_hash.h"

namespace gonio::transport {

// Whether a short ray between two points on surfaces is free, or a path that is above_m above both. On a rounded
// surface rays between its points pass below it. n, m: their normals.
bool in_sight(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& n, const glm::vec3& q,
              const glm::vec3& m, float above_m);

// Points that walks met, some in each coarse cell of space, by the axis that their surface faces. One thread adds; any
// asks.
class Reached {
public:
    Reached(float side_m, std::size_t cells) : side_m_(side_m), buckets_(power_of_two(64 * cells), 0) {}
    // Returns whether the point is kept: there were few before; or there is room and none of them sees it, because a
    // housing's own points must not be all that a cell has. Of points in the plane of a kept one, one in eight is
    // asked.
    bool add(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& normal);
    // Whether one of them is in sight: else it is on the other side of a wall.
    bool sees(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& normal) const;

private:
    static constexpr int kFew = 6, kMost = 10;
    struct Some {
        int count = 0, met = 0;
        std::pair<glm::vec3, glm::vec3> points[kMost];
    };
    std::size_t bucket_of(const glm::vec3& p, const glm::vec3& n) const;
    float side_m_;
    std::vector<std::uint32_t> buckets_;
    std::vector<Some> some_;
};

}  // namespace gonio::transport
