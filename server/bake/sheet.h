// A chart on a grid of texels, and which part of which triangle each texel's square shows: exact, by clipping. Any
// thread. No files.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "server/bake/charts.h"

namespace gonio::bake {

using Polygon = std::vector<glm::dvec2>;  // convex

// A part of a side that a sheet shows: all of it, or what is left of it where the sheet was cut.
struct Piece {
    int side = 0;  // index into Sheet::sides
    Polygon outline;
};

struct Sheet {
    int chart = 0;  // that it is of; a chart that was cut has several
    std::vector<Side> sides;
    std::vector<std::array<glm::dvec2, 3>> flat;  // of each side the corners, texels from the sheet's corner
    std::vector<double> m2_per_texel;             // of each side: its area over that in the sheet
    std::vector<Piece> pieces;
    glm::ivec2 size{1};  // texels
};

// A texel whose square a sheet's surface touches.
struct Covered {
    glm::ivec2 at{0};
    int side = 0;              // index into Sheet::sides: what its sample point lies on
    float u = 0.0f, v = 0.0f;  // barycentric, of the mesh's corners 1 and 2
    glm::dvec2 point{0.0};     // the sample point in the sheet, texels: inside its triangle
    double area_m2 = 0.0;      // of all surface in the square
};

// Result: the sheet of a chart at this density. Its corners lie on the grid's: it is stretched by less than a texel.
Sheet sheet_of(const trace::Geometry& geometry, const std::vector<Chart>& charts, int chart, double texels_per_m);

// Result: its texels, row by row. The areas add up to the pieces'. The sample point is the centroid of what the square
// covers, or, where that lies beside the surface, of the largest piece in it.
std::vector<Covered> cover(const Sheet& sheet);

// Result: what of a convex polygon lies within the rectangle; empty: nothing.
Polygon clipped(const Polygon& polygon, const glm::dvec2& low, const glm::dvec2& high);
// Signed area, positive counter-clockwise.
double area_of(const Polygon& polygon);

// Result: whether a point lies in a convex polygon, or no further than `slack` beside it.
bool contains(const Polygon& polygon, const glm::dvec2& point, double slack = 0.0);

// Result: barycentric coordinates of corners 1 and 2, within the triangle.
glm::dvec2 barycentric(const std::array<glm::dvec2, 3>& triangle, const glm::dvec2& point);

}  // namespace gonio::bake
