// Sixteen points that rays leave.
#pragma once

#include <algorithm>

#include "server/shade/grid.h"
#include "server/shade/kernels.h"
#include "server/trace/geometry.h"

namespace gonio::shade {

inline constexpr int kArrays = 6;  // x y z nx ny nz

struct PointPacket {
    alignas(64) float array[kArrays][trace::kPacket];

    // The point `at` of arrays, on its surface.
    void set(int i, const std::vector<float>* arrays, std::size_t at) {
        for (int k = 0; k < kArrays; ++k) array[k][i] = arrays[k][at];
    }
    // The same points, each a step off its surface along its normal.
    PointPacket off(const trace::Geometry& geometry) const {
        PointPacket result = *this;
        for (int i = 0; i < trace::kPacket; ++i) {
            const float off = 4.0f * geometry.step_off({array[0][i], array[1][i], array[2][i]});
            for (int k = 0; k < 3; ++k) result.array[k][i] += off * array[k + 3][i];
        }
        return result;
    }
    Points points() const { return {array[0], array[1], array[2], array[3], array[4], array[5]}; }
};

// 4 × 4 neighbouring points of a grid, rows of four; beyond its edge its last ones again, which are not active.
struct Patch {
    static constexpr int kSide = 4;
    static_assert(kSide * kSide == trace::kPacket);
    PointPacket points;
    std::size_t at[trace::kPacket];  // in the grid's arrays
    unsigned active = 0;             // bits of those that show a surface
};
inline Patch patch_at(const Grid& grid, int first_x, int first_y) {
    Patch patch;
    for (int i = 0; i < trace::kPacket; ++i) {
        const int x = first_x + i % Patch::kSide, y = first_y + i / Patch::kSide;
        patch.at[i] = static_cast<std::size_t>(grid.at(std::min(x, grid.width - 1), std::min(y, grid.height - 1)));
        patch.points.set(i, grid.values, patch.at[i]);
        if (x < grid.width && y < grid.height && grid.values[6][patch.at[i]] > 0.0f) patch.active |= 1u << i;
    }
    return patch;
}

}  // namespace gonio::shade
