// Tables of light by surfel, as half floats that fit into a core's cache, and the sums over them. Any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/transport/surfels.h"

namespace gonio::transport {

// One entry of 4 half floats for each surfel, and a black one after the last, for links that meet nothing. A value is
// its entry × `unit`.
struct Table {
    std::vector<std::uint16_t> halves;
    float unit = 0.0f;  // 0: every entry is black
};
// values: one for each surfel. They are scaled so that the greatest magnitude is 1000: half floats then resolve 2^-24
// of it, and round every larger value by at most 2^-11 of itself.
void make_table(std::span<const glm::vec4> values, Table& table, Pool& pool);

// The links of `size` consecutive surfels: surfel i has `count` of them, a multiple of 4, from ids[i × stride] on.
struct LinkRun {
    const std::uint16_t* ids;
    unsigned stride, count;
    std::size_t size;
};
// sums[i] += share × the sum of the table's entries, without its unit, over the links of the run's surfel i.
void gather(const Table& table, const LinkRun& run, float share, glm::vec4* sums);

// Surfels farther away than this many radii have no weight.
inline constexpr float kBlendRadii = 2.2f;
// weights: of the kNeighbours surfels `ids` at a point, with sum 1. A surfel's weight falls with its distance, with how
// far the point and the surfel lie off each other's plane, and with the angle between their normals. If every weight
// would be 0, the first surfel has them all.
void weigh(const Surfels& surfels, const std::uint16_t* ids, const glm::vec3& p, const glm::vec3& n, float* weights);
// out[i] = the table's values, weighted and summed over the kNeighbours surfels ids[i]; null: 0.
void blend(const Table& table, const std::uint16_t* const* ids, const float* weights, std::size_t size, glm::vec4* out);

}  // namespace gonio::transport
