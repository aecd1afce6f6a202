// Which surfaces light comes to: those that random walks from where it starts have met.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "server/trace/geometry.h"
#include "server/transport/space_hash.h"

namespace gonio::transport {

// Whether a short ray between two points on surfaces is free, or a path that is above_m above both. On a rounded
// surface rays between its points pass below it. n, m: their normals.
bool in_sight(const trace::Geometry& geometry, const glm::vec3& p, const glm::vec3& n, const glm::vec3& q,
              const glm::vec3& m, float above_m);

// Sets ray i to the next step of a diffuse walk that has come to a surface. Directions are cosine-distributed about the
// geometric normal. random: a pair in [0, 1). far_m: the ray's length.
void set_diffuse_step(trace::RayPacket& rays, int i, const trace::Geometry& geometry, const trace::SurfacePoint& from,
                      const glm::vec2& random, float far_m = std::numeric_limits<float>::infinity());

// Points that walks met, some in each coarse cell of space, by the axis that their surface faces. One thread adds; any
// asks.
class Reached {
public:
    Reached(float side_m, std::size_t cells) : side_m_(side_m), buckets_(power_of_two(64 * cells), 0) {}
    // Returns whether the point is kept. The first few of a cell are. Later ones are kept while there is room and where
    // no kept one sees them, so that the points inside a housing do not stand for its outside as well. Of the later
    // points that lie in the plane of a kept one, one in eight is tested.
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
