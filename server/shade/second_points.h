// Where surfaces are finer than the grid: cells of 4 × 4 pixels in which some show what no grid point around them does
// get a second point, outside the grid's rows. They follow from the camera alone: none comes or goes with the light.
#pragma once

#include "server/shade/screen.h"

namespace gonio::shade {

// Places for second points that a grid keeps, whether it has any or not: layers keep their shape as efforts change.
constexpr std::size_t most_second_points(int grid_width, int grid_height) {
    return static_cast<std::size_t>(grid_width) * static_cast<std::size_t>(grid_height) / 16;
}

// Fills in the second points, at most `share` of the cells: those with the most poor pixels. screen: its grid and
// weights are made.
void find_second_points(const Surfaces& surfaces, float share, ScreenGrid& screen, Pool& pool);

}  // namespace gonio::shade
