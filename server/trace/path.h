// The estimators of the reference: illuminance of one point from one sample of each random decision. docs/rendering.md
// derives them. Local coordinates; any thread.
#pragma once

#include <glm/glm.hpp>

#include "server/trace/sampler.h"
#include "server/trace/sources.h"

namespace gonio::trace {

// A path goes on with the probability of its surface's reflectance, at most this: even between perfect mirrors of light
// it ends.
inline constexpr float kMaxSurvival = 0.995f;

// A point that receives light. Distances and cosines are taken at it, rays start a step off its surface.
struct Receiver {
    glm::vec3 position{0.0f};   // local, m
    glm::vec3 from{0.0f};       // where its rays start, local, m
    glm::vec3 normal{0.0f};     // unit: cosines are taken with it
    glm::vec3 geometric{0.0f};  // unit: light from behind it is stopped
};
Receiver receiver_of(const Geometry& geometry, const SurfacePoint& point);

// Result: direct illuminance from all luminaires, lux, rgb: from one point that openings draws on each luminous
// opening; null: of luminaires as points, exact.
glm::vec3 luminaires_direct(const World& world, const Receiver& receiver, Sample* openings);

struct PathLight {
    glm::vec3 direct{0.0f};    // from emissive surfaces, lux
    glm::vec3 indirect{0.0f};  // after 1 to `bounces` diffuse reflections, lux
};
// Result: one unbiased sample of everything but the luminaires' own direct light.
PathLight trace_path(const World& world, Receiver receiver, int bounces, Sample& sample);

}  // namespace gonio::trace
