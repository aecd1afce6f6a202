// The sun, whose light is parallel. Lighting takes it as a point far beyond the scene, with the intensity that brings
// its lux there: all that is done with luminaires is then done with it. Its position in the file has no effect.
#pragma once

#include <glm/glm.hpp>
#include <numbers>

#include "server/scene/asset.h"
#include "server/scene/light.h"

namespace gonio {

// The angular diameter of the sun's disc, as seen from Earth in the mean.
inline constexpr double kSunDiameter_rad = 0.53 * std::numbers::pi / 180.0;
// How far that point is from the middle of the scene, in diagonals of it. At the scene's edge its direction is 0.014°
// off, and its lux 0.05 %.
inline constexpr double kSunDistance = 2000.0;

// What a light is to a scene.
struct LightSource {
    glm::dvec3 position;  // world, m
    double gain = 1.0;    // cd for each cd of its web: of a sun cd for each lux of its multiplier
};
// Result: of a sun the point that stands for it; of other lights themselves. scene: its bounds.
LightSource source_of(const Light& light, const Bounds& scene);

}  // namespace gonio
