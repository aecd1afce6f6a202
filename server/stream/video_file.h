// Pictures -> a video file, H.264 in MP4 or Matroska. Knows neither the scene nor sockets.
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

struct VideoSettings {
    int width_px = 0, height_px = 0;  // even, 16..4096
    std::int64_t frames = 0;
    std::int64_t rate_numerator = 24, rate_denominator = 1;  // frames in so many seconds
    double crf = 18.0;      // x264's constant rate factor, 0..51: 6 more halve the bits
    bool matroska = false;  // else MP4, whose index comes first, so that it plays while it loads
};

// Result: R'G'B' of a frame, sRGB-encoded, 3 bytes a pixel, rows from the top.
using FrameSource = std::function<Result<std::vector<std::uint8_t>>(std::int64_t frame)>;

// Writes the file at `path`, which is not there whole before the result is. BT.709, limited range, 4:2:0, the transfer
// of sRGB; one thread, no date, no random number: the same pictures make the same bytes by the same libraries.
// Errors: those of the source, "encoder_unavailable", "encoder_failed", "file_unwritable", "cancelled" after a stop.
Result<bool> write_video(const std::string& path, const VideoSettings& settings, const FrameSource& source,
                         const std::stop_token& stop);

}  // namespace gonio
