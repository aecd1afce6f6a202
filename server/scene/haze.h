// The air: how it takes light away and scatters it.
#pragma once

#include <glm/glm.hpp>

namespace gonio {

struct Scene;

// What can be set of it.
struct HazeValues {
    double extinction_per_m = 0.0;  // absorbed and scattered, at the floor; 0: there is no haze
    double albedo = 1.0;            // of that what is scattered
    double g = 0.7;                 // mean cosine of the phase function; above 0: forwards
    double layer_height_m = 0.0;    // above the floor, where it is e times thinner; 0: the same everywhere
    bool operator==(const HazeValues&) const = default;
};

// Haze in any coordinates whose y points up. Below its floor it is as at the floor.
struct Haze : HazeValues {
    double floor_m = 0.0;
    explicit operator bool() const { return extinction_per_m > 0.0; }
};

inline constexpr double kMostExtinction_per_m = 10.0, kMostHazeG = 0.95, kLeastLayer_m = 0.01, kMostLayer_m = 1e5;

// Result: the scene's, in coordinates relative to origin (world, m). Its floor is the lowest point of any surface.
Haze haze_of(const Scene& scene, const glm::dvec3& origin);

// Result: the optical depth of the straight path from a to b, the integral of the extinction. >= 0. Any thread.
double optical_depth(const Haze& haze, const glm::dvec3& a, const glm::dvec3& b);
// Result: of light what passes from a to b, exp(-optical_depth): Beer and Lambert.
double transmittance(const Haze& haze, const glm::dvec3& a, const glm::dvec3& b);
// Result: haze that absorbs as much and scatters nothing.
Haze absorption_of(const Haze& haze);
// Result: what is scattered per metre at p, 1/m.
double scattering_per_m(const Haze& haze, const glm::dvec3& p);
// Result: Henyey and Greenstein's phase function, 1/sr; its integral over the sphere is 1. The cosine is between the
// light's travel before and after (Henyey and Greenstein 1941, equation 2). |g| < 1.
double henyey_greenstein(double g, double cosine);

}  // namespace gonio
