// A Draco bitstream of triangles -> indices and attributes, within bounds that hold before anything is allocated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

// One attribute that is wanted: its unique id in the bitstream, and how its values are to be stored.
struct DracoAttribute {
    std::uint32_t id = 0;
    int component_type = 0;  // of glTF: 5120 to 5126
    std::size_t components = 0;
};

// The most that may come out, and that the decoder may hold meanwhile.
struct DracoBounds {
    std::size_t faces = 0, points = 0, bytes = 0;
};

struct DracoMesh {
    std::size_t points = 0;
    std::vector<std::uint32_t> indices;              // 3 per face, each below points
    std::vector<std::vector<std::byte>> attributes;  // as wanted: tightly packed, little-endian
};

// where: place for errors. Pure; any thread. Errors: "bad_gltf" (not a Draco mesh, damaged, an attribute is missing or
// of another type), "too_large" (beyond the bounds).
Result<DracoMesh> decode_draco(std::span<const std::byte> bytes, std::span<const DracoAttribute> wanted,
                               const DracoBounds& bounds, const std::string& where);

}  // namespace gonio
