#include "server/scene/calculation_grid.h"

#include <algorithm>
#include <cmath>

#include "protocol/schema/grid.pb.h"
#include "server/scene/vector_field.h"

namespace gonio {

double grid_spacing_m(double d_m) {
    constexpr double kMostSpacing_m = 10.0;
    return std::min(kMostSpacing_m, 0.2 * std::pow(5.0, std::log10(d_m)));
}

// Of a rectangle: its longer side counts, or the shorter one where they differ by a factor of 2 or more.
static double grid_spacing_m(double u_m, double v_m) {
    const auto [shorter, longer] = std::minmax(u_m, v_m);
    return grid_spacing_m(longer >= 2.0 * shorter ? shorter : longer);
}

GridCounts grid_counts(double u_m, double v_m, GridRounding rounding) {
    const double spacing_m = grid_spacing_m(u_m, v_m);
    const auto count = [&](double side_m) {
        constexpr double kRounding = 1e-9;  // 1 m / 0.2 m is a little above 5
        const double cells = side_m / spacing_m;
        return std::max(1.0, rounding == GridRounding::up ? std::ceil(cells - kRounding) : std::round(cells));
    };
    return {count(u_m), count(v_m)};
}

GridLayout grid_layout(const v1::Grid& grid) {
    const glm::dvec3 u = vector_of(grid.u_m()), v = vector_of(grid.v_m());
    const double u_m = glm::length(u), v_m = glm::length(v), margin_m = grid.margin_m();
    GridLayout layout;
    layout.corner = vector_of(grid.corner_m()) + margin_m / u_m * u + margin_m / v_m * v;
    layout.u = u * (1.0 - 2.0 * margin_m / u_m);
    layout.v = v * (1.0 - 2.0 * margin_m / v_m);
    if (grid.count_size() == 2) {
        layout.counts = {static_cast<double>(grid.count(0)), static_cast<double>(grid.count(1))};
        return layout;
    }
    const double across_m = u_m - 2.0 * margin_m, along_m = v_m - 2.0 * margin_m;
    layout.spacing_m = grid_spacing_m(across_m, along_m);
    layout.counts = grid_counts(across_m, along_m, grid.spacing() == "up" ? GridRounding::up : GridRounding::nearest);
    return layout;
}

}  // namespace gonio
