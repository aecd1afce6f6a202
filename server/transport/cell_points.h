// Where direct light is sampled on a small surfel near a luminaire: at one place of each quarter of its cell.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>

namespace gonio::transport {

inline constexpr std::size_t kCellPoints = 4;
// Places on one surface and, of each, the share of the surface that it stands for. The shares sum to 1.
struct CellPoints {
    std::array<glm::vec3, kCellPoints> at;
    std::array<float, kCellPoints> share;
};

// A point of a cell, local, m. It stands for area_m2 of the cell. If the luminaires near by shone evenly, they would
// light it as strongly as `lit` says, in any unit.
struct CellMember {
    glm::vec3 position;
    double area_m2, lit;
};
// Result: for each quarter of the cell by area, the member near its middle that is lit like the quarter on the mean.
// Quarters differ in direction, as a luminaire's light does. The centre of a cell would be lit 3 to 7 % more than its
// mean. Cells reach further away from the luminaire than towards it. members: are reordered. centre: what stands for a
// cell without members. spacing_m: of the surfel. Any thread.
CellPoints cell_points(std::span<CellMember> members, const glm::vec3& centre, float spacing_m);

}  // namespace gonio::transport
