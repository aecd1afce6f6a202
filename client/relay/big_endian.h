// Numbers in network byte order. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gonio {

inline void put_u16(std::vector<std::byte>& to, std::uint16_t value) {
    to.push_back(static_cast<std::byte>(value >> 8));
    to.push_back(static_cast<std::byte>(value & 255));
}

inline void put_u32(std::vector<std::byte>& to, std::uint32_t value) {
    put_u16(to, static_cast<std::uint16_t>(value >> 16));
    put_u16(to, static_cast<std::uint16_t>(value & 65535));
}

// bytes: at least two, at least four from `at` on.
inline std::uint32_t get_u16(std::span<const std::byte> bytes, std::size_t at) {
    return std::to_integer<std::uint32_t>(bytes[at]) << 8 | std::to_integer<std::uint32_t>(bytes[at + 1]);
}

inline std::uint32_t get_u32(std::span<const std::byte> bytes, std::size_t at) {
    return get_u16(bytes, at) << 16 | get_u16(bytes, at + 2);
}

}  // namespace gonio
