// Luminaires whose light gets nowhere: above the ceiling that they are let into, or inside a closed housing. Pure
// functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "server/scene/light.h"
#include "server/trace/geometry.h"

namespace gonio::trace {

inline constexpr double kNear_m = 0.3;       // what is farther from a luminaire is no housing of it
inline constexpr double kRecess_m = 0.5;     // how far it is moved at most
inline constexpr double kInFront_m = 0.001;  // of the surface that it is let into

struct Obstacle {
    double distance_m = 0.0;  // along the middle of its light
    int instance = 0;         // of the asset
};
// Result: what stops the light, where less than half a percent of its flux lands on anything and at least a quarter is
// stopped at once. A ray lands farther off than kNear_m, on no plane that runs within 0.1 m of the luminaire. Others
// end at once, or leave the scene. Nothing for suns and what shines freely, as from an open housing. Costs 16 rays, 256
// where none of those lands.
std::optional<Obstacle> obstacle_of(const Geometry& geometry, const Light& light);

// Result: where the light shines freely, world, m: kInFront_m before a surface along the middle of its light, the first
// one that lets it. A light that shines freely goes before the surface behind it. Nothing where there is no such
// surface within kRecess_m, and for suns.
std::optional<glm::dvec3> recessed_position(const Geometry& geometry, const Light& light);

}  // namespace gonio::trace
