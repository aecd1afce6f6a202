// glTF 2.0, 4.4 "Binary glTF Layout": the types of a .glb's chunks.
#pragma once

#include <cstdint>

namespace gonio {

inline constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

}  // namespace gonio
