// Big-endian and little-endian integers in packets. The caller has checked that the bytes are there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace gonio {

using Bytes = std::span<const std::uint8_t>;

inline std::uint16_t be16(Bytes bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}
inline std::uint32_t be32(Bytes bytes, std::size_t at) {
    return static_cast<std::uint32_t>(be16(bytes, at)) << 16 | be16(bytes, at + 2);
}
inline std::uint64_t be64(Bytes bytes, std::size_t at) {
    return static_cast<std::uint64_t>(be32(bytes, at)) << 32 | be32(bytes, at + 4);
}
inline std::uint16_t le16(Bytes bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at + 1] << 8 | bytes[at]);
}

}  // namespace gonio
