// Where surfaces curve within a few grid points, a window of 4 × 4 of them mixes light that differs. Blocks on the most
// curved surfaces of a picture are looked at closely: all VPLs at each point, more rays, nearer nodes. Which blocks
// depends on the surfaces alone, so that the light of all luminaires has the same shape.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "server/shade/grid.h"
#include "server/shade/kernels.h"
#include "server/shade/pool.h"
#include "server/shade/vpl_rays.h"

namespace gonio::shade {

inline constexpr int kCloseSide = 4;  // grid points

struct CloseBlocks {
    std::vector<glm::ivec2> blocks;      // their first grid points
    std::vector<std::uint8_t> is_close;  // by block, rows of `columns`
    int columns = 0;
    std::vector<float> normals[3];  // of the grid's points in these blocks, 0 elsewhere; in the grid's shape
    Grid nodes;                     // that trace occlusion: every second point of these blocks, no others
    std::vector<float> points[6];   // all sixteen of each block in turn: x y z nx ny nz; 0 outside the grid

    bool any() const { return !blocks.empty(); }
    bool holds(int x, int y) const {
        return any() && is_close[static_cast<std::size_t>(y / kCloseSide * columns + x / kCloseSide)] != 0;
    }
};
inline constexpr int kCloseNodeStride = 2;  // grid points

// Chooses at most `share` of the grid's blocks. depth_per_point: distance of neighbouring grid points per metre of
// depth.
void choose_close_blocks(const Grid& grid, float depth_per_point, float share, CloseBlocks& close, Pool& pool);

// Sums the whole list of VPLs at each point of the blocks; weight: of one VPL. Calls put(x, y, rgb) for each, from any
// of the pool's threads.
void gather_close(const CloseBlocks& close, const Grid& grid, const VplCast& cast, const glm::vec3& origin, float kappa,
                  float weight, const std::function<void(int, int, const glm::vec3&)>& put, Pool& pool);

// Overwrites the blocks' values in `out` with those of `in`, filtered over 3 × 3 points of such blocks, plus `own`. All
// are of the grid's shape.
void filter_close(const CloseBlocks& close, const Grid& grid, float near_per_depth, const Planes& in, const Planes& own,
                  Planes& out, Pool& pool);

}  // namespace gonio::shade
