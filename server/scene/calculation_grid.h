// Where the points of a calculation grid lie. Pure, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "protocol/schema/messages.h"

namespace gonio {

inline constexpr std::uint32_t kMaxGridPoints = 4096;  // of a grid and of a meter query; more are refused: "too_large"

// How many cells a length holds is rounded: to the nearest whole number, or up.
enum class GridRounding : std::uint8_t { nearest, up };

// Result: the distance p between points, m, at most 10: p = 0.2 · 5^(log10 d) (EN 12464-1:2021, 5.4). d_m: above 0.
double grid_spacing_m(double d_m);

struct GridCounts {
    double u = 1.0, v = 1.0;  // whole, at least 1; of absurd lengths they are large
};
// Result: points along the sides of a rectangle. d is its longer side; the shorter one where they differ by a factor
// of 2 or more. u_m, v_m: above 0.
GridCounts grid_counts(double u_m, double v_m, GridRounding rounding);

struct GridLayout {
    glm::dvec3 corner{0.0}, u{0.0}, v{0.0};  // of what the margin leaves, m
    GridCounts counts;
    double spacing_m = 0.0;  // that the rule gives; 0: the counts are given
    // Result: the centre of a cell, world, m.
    glm::dvec3 centre(double i, double j) const { return corner + (i + 0.5) / counts.u * u + (j + 0.5) / counts.v * v; }
};
// grid: checked (apply_grid.h), but for how many points it has.
GridLayout grid_layout(const v1::Grid& grid);

}  // namespace gonio
