// The blocks of 4 × 4 grid points within which the light differs most, at contacts and folds: windows mix there what
// differs. Each of their points is estimated for itself, with more rays.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "server/shade/screen.h"

namespace gonio::shade {

// Result: the first points of at most `share` of the grid's blocks, those of the greatest contrast in `light` (3 planes
// in the grid's shape), in no order; none where it is slight.
std::vector<glm::ivec2> choose_close_blocks(const Grid& grid, const Planes& light, float share);

// Overwrites `out` at the points of these blocks: irradiance as of gather_grid, from the whole list, from rays to VPLs
// that are chosen for each block by what they bring, and from short rays of each point's own.
void light_close_blocks(const std::vector<glm::ivec2>& blocks, const ScreenGrid& screen, const LightView& light,
                        Planes& out, Pool& pool);

}  // namespace gonio::shade
