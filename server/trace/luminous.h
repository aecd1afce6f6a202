// Luminaires with a luminous opening, as an eye sees them: of the luminance I / projected area from all sides.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "server/trace/sources.h"

namespace gonio::trace {

// What stands before an opening is nearer by so much at least, of the distance and in metres.
inline constexpr double kShiningSlack = 1e-4, kShiningSlack_m = 0.002;

struct Shining {
    double distance_m = 0.0;
    double nit = 0.0;  // before the luminaire's weight, cd/m²; 0 from where it sends no light
};
// Result: where a ray meets the opening's outline first, and its luminance there. Nothing where it does not, of a
// point, a line and a sun, and from within. along: unit. Local coordinates; any thread. The area is a hundredth of the
// greatest side at least: a flat opening seen on edge has no luminance without bound.
std::optional<Shining> shining_at(const Luminaire& luminaire, const glm::dvec3& from, const glm::dvec3& along);

}  // namespace gonio::trace
