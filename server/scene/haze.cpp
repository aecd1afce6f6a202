#include "server/scene/haze.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/scene/scene.h"

namespace gonio {

Haze haze_of(const Scene& scene, const glm::dvec3& origin) {
    const Bounds& bounds = scene.asset->bounds;
    return {scene.haze, bounds.min.y <= bounds.max.y ? bounds.min.y - origin.y : -origin.y};
}

namespace {

// Result: the mean of exp(-y / height) over heights from a to b above the floor, below which it is 1.
double mean_density(double a, double b, double height) {
    if (a > b) std::swap(a, b);
    const double below = std::clamp(-a, 0.0, b - a), low = std::max(a, 0.0) / height, high = std::max(b, 0.0) / height,
                 x = high - low;
    // (1 - exp(-x)) / x, by its series where the difference would round.
    const double ratio = x < 1e-3 ? 1.0 - x / 2.0 + x * x / 6.0 : -std::expm1(-x) / x;
    const double above = std::exp(-low) * ratio;
    return b - a > 0.0 ? (below + (b - a - below) * above) / (b - a) : std::exp(-low);
}

}  // namespace

double optical_depth(const Haze& haze, const glm::dvec3& a, const glm::dvec3& b) {
    const double uniform = haze.extinction_per_m * glm::distance(a, b);
    if (!(haze.layer_height_m > 0.0)) return uniform;
    return uniform * mean_density(a.y - haze.floor_m, b.y - haze.floor_m, haze.layer_height_m);
}

double transmittance(const Haze& haze, const glm::dvec3& a, const glm::dvec3& b) {
    return std::exp(-optical_depth(haze, a, b));
}

Haze absorption_of(const Haze& haze) {
    Haze absorption = haze;
    absorption.extinction_per_m *= 1.0 - haze.albedo;
    absorption.albedo = 0.0;
    return absorption;
}

double scattering_per_m(const Haze& haze, const glm::dvec3& p) {
    const double most = haze.extinction_per_m * haze.albedo;
    return haze.layer_height_m > 0.0 ? most * std::exp(-std::max(0.0, p.y - haze.floor_m) / haze.layer_height_m) : most;
}

double henyey_greenstein(double g, double cosine) {
    const double d = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * std::numbers::pi * d * std::sqrt(d));
}

}  // namespace gonio
