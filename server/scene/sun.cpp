#include "server/scene/sun.h"

#include <algorithm>

#include "server/scene/orientation.h"

namespace gonio {

LightSource source_of(const Light& light, const Bounds& scene) {
    if (!light.sun) return {light.position};
    const bool empty = !(scene.min.x <= scene.max.x);
    const glm::dvec3 middle = empty ? glm::dvec3(0.0) : 0.5 * (scene.min + scene.max);
    const double diagonal_m = empty ? 1.0 : std::max(glm::length(scene.max - scene.min), 1e-6),
                 distance_m = kSunDistance * diagonal_m;
    return {middle - aim_of(light.world_from_light) * distance_m, distance_m * distance_m};
}

}  // namespace gonio
