#include "server/trace/luminous.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ies/quantities.h"
#include "server/scene/opening_points.h"

namespace gonio::trace {
namespace {

using Shape = ies::OpeningShape;

// Axes on which a shape is round; along the others it ends in planes.
glm::bvec3 round_axes(Shape shape) {
    switch (shape) {
        case Shape::ellipse:
        case Shape::vertical_cylinder:
            return {true, true, false};
        case Shape::ellipsoid:
            return {true, true, true};
        case Shape::horizontal_cylinder_length:
        case Shape::vertical_ellipse:
            return {false, true, true};
        case Shape::horizontal_cylinder_width:
            return {true, false, true};
        default:
            return {false, false, false};
    }
}

// Result: how far along the ray the shape begins. Of what is round Σ ((from + t along) / half)² = 1.
std::optional<double> first_met(const ies::Opening& opening, const glm::dvec3& from, const glm::dvec3& along) {
    const glm::dvec3 half = half_sides(opening);
    const glm::bvec3 round = round_axes(opening.shape);
    double low = 0.0, high = std::numeric_limits<double>::max();
    double a = 0.0, b = 0.0, c = -1.0;
    for (int k = 0; k < 3; ++k) {
        if (round[k]) {
            const double f = from[k] / half[k], d = along[k] / half[k];
            a += d * d, b += f * d, c += f * f;
            continue;
        }
        if (std::abs(along[k]) < 1e-12) {
            if (std::abs(from[k]) > half[k]) return std::nullopt;
            continue;
        }
        const double t0 = (-half[k] - from[k]) / along[k], t1 = (half[k] - from[k]) / along[k];
        low = std::max(low, std::min(t0, t1)), high = std::min(high, std::max(t0, t1));
    }
    if (glm::any(round)) {
        const double root = b * b - a * c;
        if (!(root >= 0.0) || !(a > 0.0)) return std::nullopt;
        low = std::max(low, (-b - std::sqrt(root)) / a), high = std::min(high, (-b + std::sqrt(root)) / a);
    }
    return low > 0.0 && low <= high ? std::optional(low) : std::nullopt;
}

}  // namespace

std::optional<Shining> shining_at(const Luminaire& luminaire, const glm::dvec3& from, const glm::dvec3& along) {
    const ies::Opening& opening = luminaire.opening;
    if (luminaire.is_point() || luminaire.sun_reach_m > 0.0) return std::nullopt;
    const glm::dmat3 light_from_world = glm::transpose(luminaire.world_from_light);
    const glm::dvec3 d = light_from_world * along;
    const auto distance = first_met(opening, light_from_world * (from - luminaire.position - luminaire.lift), d);
    if (!distance) return std::nullopt;
    const auto area_towards = [&](const ies::Direction& direction) {
        return ies::projected_area(opening, direction).in(m * m);
    };
    const double whole = std::max({area_towards({1, 0, 0}), area_towards({0, 1, 0}), area_towards({0, 0, 1})});
    if (!(whole > 0.0)) return std::nullopt;
    const double area = std::max(area_towards({-d.x, -d.y, -d.z}), 0.01 * whole);
    return Shining{*distance, luminaire.intensity_cd(-along) / area};
}

}  // namespace gonio::trace
