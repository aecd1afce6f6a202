// The checks that a glTF document's JSON passes before anything is built from it: member types, every index, every
// buffer view and accessor range, the node tree. After them the importer may follow any index without asking again.
// It does not look into buffers: vertex indices and values are checked where they are read.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string_view>

#include "ies/core/result.h"

namespace gonio {

inline constexpr int kMaxJsonDepth = 128;                            // beyond: "bad_gltf"
inline constexpr std::size_t kMaxJsonValues = std::size_t{1} << 23;  // beyond: "too_large"

// Bounds nesting and size of a JSON text before it is parsed. Result: an error, or nothing.
std::optional<Error> check_json_size(std::string_view text);

// document: any JSON value. has_binary_chunk: a .glb with a BIN chunk, which buffer 0 may then use without a uri.
// Result: the first error with its JSON pointer and value ("unsupported", "bad_gltf", "out_of_bounds", "too_large").
std::optional<Error> check_gltf(const nlohmann::json& document, bool has_binary_chunk);

// Components of an accessor's type, 1 for SCALAR to 16 for MAT4; 0 where there is no such type.
std::size_t component_count(std::string_view type);

// ByteView of one component, 0 if the glTF component type does not exist.
std::size_t component_bytes(std::uint64_t component_type);

}  // namespace gonio
