#include "protocol/schema/frame_header.h"

namespace gonio {
namespace {

constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kFlagKey = 1;
constexpr std::uint8_t kFlagFinal = 2;

template <typename T>
void put(std::span<std::byte> bytes, std::size_t offset, T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[offset + i] = static_cast<std::byte>((value >> (8 * i)) & 0xff);
}

template <typename T>
T get(std::span<const std::byte> bytes, std::size_t offset) {
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) value |= static_cast<T>(static_cast<T>(bytes[offset + i]) << (8 * i));
    return value;
}

Error refusal(std::size_t offset, std::string value, std::string message) {
    return {"bad_frame_header", "byte " + std::to_string(offset), std::move(value), std::move(message)};
}

}  // namespace

std::array<std::byte, kFrameHeaderBytes> encode_frame_header(const FrameHeader& header) {
    std::array<std::byte, kFrameHeaderBytes> bytes{};
    put<std::uint8_t>(bytes, 0, kBinaryVideo);
    put<std::uint8_t>(bytes, 1, kVersion);
    put<std::uint8_t>(bytes, 2,
                      static_cast<std::uint8_t>((header.key ? kFlagKey : 0) | (header.final ? kFlagFinal : 0)));
    put<std::uint8_t>(bytes, 3, header.lane);
    put<std::uint32_t>(bytes, 4, header.seq);
    put<std::uint32_t>(bytes, 8, header.scene_rev);
    put<std::uint64_t>(bytes, 16, header.rendered_ns);
    put<std::uint32_t>(bytes, 24, header.render_us);
    put<std::uint32_t>(bytes, 28, header.encode_us);
    return bytes;
}

Result<FrameHeader> decode_frame_header(std::span<const std::byte> bytes) {
    if (bytes.size() < kFrameHeaderBytes)
        return refusal(bytes.size(), std::to_string(bytes.size()), "The message ends before the frame header does.");
    if (const auto kind = get<std::uint8_t>(bytes, 0); kind != kBinaryVideo)
        return refusal(0, std::to_string(kind), "The message is not a video frame.");
    if (const auto version = get<std::uint8_t>(bytes, 1); version != kVersion)
        return refusal(1, std::to_string(version), "The frame header has an unknown version.");
    FrameHeader header;
    const auto flags = get<std::uint8_t>(bytes, 2);
    header.key = (flags & kFlagKey) != 0;
    header.final = (flags & kFlagFinal) != 0;
    header.lane = get<std::uint8_t>(bytes, 3);
    header.seq = get<std::uint32_t>(bytes, 4);
    header.scene_rev = get<std::uint32_t>(bytes, 8);
    header.rendered_ns = get<std::uint64_t>(bytes, 16);
    header.render_us = get<std::uint32_t>(bytes, 24);
    header.encode_us = get<std::uint32_t>(bytes, 28);
    return header;
}

}  // namespace gonio
