// Sixteen points that rays leave.
#pragma once

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
    // The same, a step off its surface along its normal.
    void set_off(int i, const std::vector<float>* arrays, std::size_t at, const trace::Geometry& geometry) {
        set(i, arrays, at);
        const float off = 4.0f * geometry.step_off({array[0][i], array[1][i], array[2][i]});
        for (int k = 0; k < 3; ++k) array[k][i] += off * array[k + 3][i];
    }
    Points points() const { return {array[0], array[1], array[2], array[3], array[4], array[5]}; }
};

}  // namespace gonio::shade
