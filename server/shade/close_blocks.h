// Points that are lit each for itself, with more rays: those of the blocks of 4 × 4 grid points within which the light
// differs most, at contacts and folds, where windows mix what differs; and second points (second_points.h).
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "server/shade/screen.h"

namespace gonio::shade {

struct CloseBlock {
    glm::ivec2 first;  // grid point
    float share;       // of its own estimate in what is shown, 0..1
};
// Result: at most close.share of the grid's blocks, those of the greatest contrast in `light` (3 planes in the grid's
// shape), in no order; none where it is slight. With a fade the next ones in line would have a share of 0, so that a
// luminaire which glides makes no block jump from one estimate to the other.
std::vector<CloseBlock> choose_close_blocks(const Grid& grid, const Planes& light, const Close& close);

// Mixes into `out` at the points of these blocks: irradiance as of gather_grid, from VPLs without occlusion, from rays
// to VPLs that are chosen for each block by what they bring, and from short rays of each point's own.
void light_close_blocks(const std::vector<CloseBlock>& blocks, const ScreenGrid& screen, const LightView& light,
                        Planes& out, Pool& pool);

// Sets `out` likewise at the second points, with half as many rays to VPLs; where none of those asked could light a
// point, nothing is taken to be hidden from it.
void light_second_points(const ScreenGrid& screen, const LightView& light, Planes& out, Pool& pool);

}  // namespace gonio::shade
