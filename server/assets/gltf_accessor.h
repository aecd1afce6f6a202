// Accessors of a checked glTF document -> numbers.
#pragma once

#include <cstdint>
#include <vector>

#include "server/assets/gltf_document.h"

namespace gonio {

// Elements of an accessor.
std::size_t accessor_count(const GltfDocument& document, int accessor);
// Components of one element: 1 for SCALAR … 16 for MAT4.
std::size_t accessor_components(const GltfDocument& document, int accessor);

// accessor: index, checked. Result: count * components values, converted from any component type; normalised integers
// become -1..1 or 0..1 (glTF 2.0, 3.11); sparse substitutions applied.
// Errors: "out_of_bounds" (a sparse index), "bad_gltf" (NaN or infinite, with the place of the element).
Result<std::vector<float>> read_floats(const GltfDocument& document, int accessor);

// Result: the values of a SCALAR accessor of unsigned bytes, shorts or ints. Errors: "bad_gltf", "out_of_bounds".
Result<std::vector<std::uint32_t>> read_indices(const GltfDocument& document, int accessor);

}  // namespace gonio
