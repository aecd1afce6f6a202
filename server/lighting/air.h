// Haze (server/scene/haze.h) as kernels take it, in local coordinates.
#pragma once

#include "server/scene/haze.h"

namespace gonio::lighting {

struct Air {
    float extinction_per_m = 0.0f;  // at the floor; 0: there is no haze
    float albedo = 1.0f, g = 0.0f;
    float per_height = 0.0f;  // 1 / the layer's height, 1/m; 0: the same everywhere
    float floor_m = 0.0f;
    explicit operator bool() const { return extinction_per_m > 0.0f; }
};
// haze: in local coordinates.
inline Air air_of(const Haze& haze) {
    return {static_cast<float>(haze.extinction_per_m), static_cast<float>(haze.albedo), static_cast<float>(haze.g),
            haze.layer_height_m > 0.0 ? static_cast<float>(1.0 / haze.layer_height_m) : 0.0f,
            static_cast<float>(haze.floor_m)};
}

// Result: what passes from a to b, local (server/scene/haze.h).
inline float transmittance(const Air& air, const glm::vec3& a, const glm::vec3& b) {
    const HazeValues values{static_cast<double>(air.extinction_per_m), 1.0, 0.0,
                            air.per_height > 0.0f ? 1.0 / static_cast<double>(air.per_height) : 0.0};
    return static_cast<float>(
        gonio::transmittance({values, static_cast<double>(air.floor_m)}, glm::dvec3(a), glm::dvec3(b)));
}

}  // namespace gonio::lighting
