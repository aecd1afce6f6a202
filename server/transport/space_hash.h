// Cells of space by hash, for grids whose extent nobody knows. Any thread.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <glm/glm.hpp>

#include "server/trace/sampler.h"

namespace gonio::transport {

// The cell, side_m wide, that a point lies in.
inline glm::ivec3 cell_at(const glm::vec3& p, float side_m) {
    return glm::ivec3(glm::floor(p / side_m));
}
inline std::uint32_t hash_of(const glm::ivec3& cell) {
    return trace::mix_bits(trace::mix_bits(static_cast<std::uint32_t>(cell.x), static_cast<std::uint32_t>(cell.y)),
                           static_cast<std::uint32_t>(cell.z));
}
// Result: a number of buckets, a power of two, for so many entries; 1024 at least.
inline std::uint32_t power_of_two(std::size_t least) {
    return std::max(1024u, std::bit_ceil(static_cast<std::uint32_t>(least)));
}

}  // namespace gonio::transport
