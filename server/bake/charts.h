// Surfaces cut into nearly flat charts: grown over shared edges while the normal stays near the chart's, and projected
// at right angles. Local coordinates (server/trace/geometry.h). Any thread. No files.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "server/trace/geometry.h"

namespace gonio::bake {

// Result: the area that two edges span, with its sign.
inline double cross(const glm::dvec2& a, const glm::dvec2& b) {
    return a.x * b.y - a.y * b.x;
}

// One side of a triangle that a map shows. The backs of one-sided surfaces have none.
struct Side {
    int instance = 0, triangle = 0;
    bool back = false;
    bool operator==(const Side&) const = default;
};

// Sides that a plane shows without two of them over each other. Each side is in one chart.
struct Chart {
    std::vector<Side> sides;
    glm::dvec3 origin{0.0}, across{1.0, 0.0, 0.0}, up{0.0, 1.0, 0.0};  // local, m; unit, at right angles
    glm::dvec2 size_m{0.0};                                            // all lies in 0 … size_m

    // Result: the point in the chart's plane, m.
    glm::dvec2 flat(const glm::dvec3& local) const {
        return {glm::dot(local - origin, across), glm::dot(local - origin, up)};
    }
};

inline constexpr double kChartAngle_rad = 8.0 * 3.14159265358979323846 / 180.0;
// Charts that a few texels hold bend more: gutters around each facet of a small thing would fill the atlas.
inline constexpr double kSmallChartAngle_rad = 5.0 * kChartAngle_rad;

// Corners of an instance's mesh that lie at the same place have the same number: meshes repeat vertices where normals
// or texture coordinates differ. Result: a number for each vertex.
std::vector<int> welded(const trace::Geometry& geometry, int instance);

// Result: charts of all sides, in the order of instances. Triangles without area are in none. A projection is longer
// than its surface is nowhere, and shorter by 1 − cos(angle) at most. What is in a chart of less than small_m2 is grown
// once more, with kSmallChartAngle_rad.
std::vector<Chart> grow_charts(const trace::Geometry& geometry, double angle_rad = kChartAngle_rad,
                               double small_m2 = 0.0);

// Result: the corners of a side, local, m, counter-clockwise as seen from it.
std::array<glm::dvec3, 3> corners_of(const trace::Geometry& geometry, const Side& side);

}  // namespace gonio::bake
