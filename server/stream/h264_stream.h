// What an H.264 byte stream says about itself. Pure.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace gonio {

// Of a sequence parameter set (ITU-T H.264 7.3.2.1.1).
struct StreamInfo {
    std::string codec;                // for WebCodecs (RFC 6381): profile, constraint flags and level, "avc1.42C020"
    int width_px = 0, height_px = 0;  // after cropping; 0: the set has scaling matrices and was not read further
};

// Result: of the first SPS in an Annex B access unit; nothing where there is none or it ends early.
std::optional<StreamInfo> read_stream_info(std::span<const std::byte> access_unit);

// Result: the lowest level_idc (ITU-T H.264 Table A-1) for this size at this many frames a second, e.g. 32 for 3.2.
int level_idc(int width_px, int height_px, int fps);

}  // namespace gonio
