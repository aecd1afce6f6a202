// Compressed parts of a checked document -> plain buffers, before anything else reads it. What follows never sees that
// they were compressed.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

inline constexpr std::size_t kMaxExpandedBytes = std::size_t{1} << 30;  // of a file, decoded: "too_large"

struct GltfExpansion {
    nlohmann::json& document;
    std::vector<std::vector<std::byte>>& buffers;
    std::size_t& room;  // as of take_memory
    std::vector<std::string>& warnings;
    std::size_t expanded = 0;  // bytes so far
};

// EXT_meshopt_compression: the view's bytes become what it holds; it is a plain view of a buffer of its own then.
// KHR_draco_mesh_compression: accessors without bytes get views of what the primitive's mesh holds for them; accessors
// that have bytes keep these. Result: nothing, or the error of load_scene.
std::optional<Error> expand_meshopt(GltfExpansion& expansion);
std::optional<Error> expand_draco(GltfExpansion& expansion);

// The bytes of a compressed view. mode, filter, count, byteStride: as the extension has them. Pure; any thread.
// Errors: "bad_gltf" at `where` or a member of it.
Result<std::vector<std::byte>> decode_meshopt(std::span<const std::byte> bytes, const std::string& mode,
                                              const std::string& filter, std::size_t count, std::size_t stride,
                                              const std::string& where);
// A buffer view that is compressed; a buffer that stands for views before they are decoded, and is never read.
bool is_meshopt_view(const nlohmann::json& view);
bool is_meshopt_fallback(const nlohmann::json& buffer);

// Takes so many bytes off the room and off kMaxExpandedBytes. Result: nothing, or "too_large".
std::optional<Error> take_expanded(GltfExpansion& expansion, std::size_t bytes, const std::string& where);

}  // namespace gonio
