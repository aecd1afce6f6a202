// Meshes in the compressed forms that scene files have, as their encoders write them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/scene/asset.h"

namespace gonio::test {

struct EncodedDraco {
    std::string bytes;
    std::size_t points = 0, faces = 0;  // as a decoder finds them
};

// Positions are attribute 0, normals 1, texture coordinates 2. position_bits: of quantisation over the largest side of
// the bounds; 0: none. sequential: in place of Edgebreaker.
EncodedDraco encode_draco(const Mesh& mesh, int position_bits, bool sequential = false);

// EXT_meshopt_compression: count elements of stride bytes; indices as triangles, or as a sequence.
std::string encode_meshopt_vertices(const std::string& bytes, std::size_t count, std::size_t stride);
std::string encode_meshopt_triangles(const std::vector<std::uint32_t>& indices, std::size_t vertices);
std::string encode_meshopt_sequence(const std::vector<std::uint32_t>& indices, std::size_t vertices);
// The filters' encoders: unit vectors (OCTAHEDRAL, 4 bytes each) and values of 3 floats (EXPONENTIAL, 12 bytes each).
std::string filter_octahedral(const std::vector<glm::vec3>& units);
std::string filter_exponential(const std::vector<glm::vec3>& values, int bits);

}  // namespace gonio::test
