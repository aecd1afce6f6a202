// The 32-byte little-endian header in front of every H.264 access unit on the WebSocket (binary message, first byte 2).
// Offset 0: u8 kind = 2. Offset 1: u8 version = 1. Offset 2: u8 flags (1 key, 2 final: nothing newer is due).
// Offset 3: u8 lane. Offset 4: u32 seq. Offset 8: u32 scene_rev. Offset 12: u32 reserved = 0.
// Offset 16: u64 rendered_ns (server's monotonic clock: NV12 in memory).
// Offset 24: u32 render_us (queue drained to NV12). Offset 28: u32 encode_us.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ies/core/result.h"

namespace gonio {

inline constexpr std::uint8_t kBinaryControl = 1;  // first byte of a binary message: protobuf follows
inline constexpr std::uint8_t kBinaryVideo = 2;    // first byte: frame header and access unit follow

struct FrameHeader {
    bool key = false;
    bool final = false;
    std::uint8_t lane = 0;
    std::uint32_t seq = 0;
    std::uint32_t scene_rev = 0;
    std::uint64_t rendered_ns = 0;
    std::uint32_t render_us = 0;
    std::uint32_t encode_us = 0;
};

inline constexpr std::size_t kFrameHeaderBytes = 32;

std::array<std::byte, kFrameHeaderBytes> encode_frame_header(const FrameHeader& header);
// Errors: "bad_frame_header" with the byte offset.
Result<FrameHeader> decode_frame_header(std::span<const std::byte> bytes);

}  // namespace gonio
