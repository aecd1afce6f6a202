// Rays from a point to the small surfels near luminaires. They are bright, and few of a point's links meet them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "server/transport/transport.h"

namespace gonio::transport {

// Where a meter stands, local, and the unit normal of the plane that it measures.
struct Stand {
    glm::vec3 p, n, start;  // start: of its rays
    Stand(const trace::Geometry& geometry, const glm::vec3& point, const glm::vec3& normal)
        : p(point), n(normal), start(p + n * (4.0f * geometry.step_off(p))) {}
};

inline constexpr float kFarSpacings = 8.0f;  // from there on a surfel is as good as a point
struct ToCrowded {
    std::uint16_t surfel;
    float form_factor;  // share of the point's cosine-weighted hemisphere that the surfel's visible part covers
    float length_m;
};
// Result: rays to the crowded surfels in front that are at least `far` of their spacings away, so that they are as good
// as points. Those that are hidden have the form factor 0. Links find all other surfels. geometry: of the frame, with
// bodies where they are now.
std::vector<ToCrowded> rays_to_crowded(const Transport& transport, const trace::Geometry& geometry, const Stand& from,
                                       float far = kFarSpacings);

}  // namespace gonio::transport
