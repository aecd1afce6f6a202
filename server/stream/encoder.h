// Pictures -> compressed frames. Knows neither the scene nor sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ies/result.h"

namespace gonio {

// One rendered picture on its way out.
struct Picture {
    std::uint32_t scene_rev = 0;
    int width_px = 0, height_px = 0;  // even
    // NV12, BT.709 limited range, tightly packed: height rows of Y, then height/2 rows of interleaved Cb Cr.
    std::shared_ptr<const std::vector<std::uint8_t>> nv12;
    std::int64_t drained_ns = 0, rendered_ns = 0;  // monotonic clock: queue drained; NV12 in memory
};

struct EncodedFrame {
    std::vector<std::byte> data;  // H.264 Annex B access unit, or a JPEG file
    bool key = false;
    std::uint32_t scene_rev = 0;
    std::int64_t drained_ns = 0, rendered_ns = 0, encoded_ns = 0;
};

// H.264 by libavcodec (libx264 ultrafast, zero latency, infinite GOP, no B frames, one thread, BT.709 limited VUI).
// Not thread-safe: one thread owns it.
class H264Encoder {
public:
    // Errors: "encoder_unavailable".
    static Result<std::unique_ptr<H264Encoder>> open(int width_px, int height_px);
    virtual ~H264Encoder() = default;
    // picture must have the encoder's size. want_key: the result is an IDR with SPS and PPS in-band.
    virtual Result<EncodedFrame> encode(const Picture& picture, bool want_key) = 0;
    virtual std::string codec_string() const = 0;  // for WebCodecs, e.g. "avc1.42C020"
};

// Result: a JPEG file of the picture (MJPEG fallback). quality 1..100.
Result<EncodedFrame> encode_jpeg_frame(const Picture& picture, int quality_percent);

}  // namespace gonio
