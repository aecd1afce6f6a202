// Pictures -> compressed frames. Knows neither the scene nor sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

// One rendered picture on its way out.
struct Picture {
    std::uint32_t scene_rev = 0;
    int width_px = 0, height_px = 0;  // even
    // NV12, BT.709 limited range, tightly packed: height rows of Y, then height/2 rows of interleaved Cb Cr.
    std::shared_ptr<const std::vector<std::uint8_t>> nv12;
    std::int64_t drained_ns = 0, rendered_ns = 0;  // monotonic clock: queue drained; NV12 in memory
    std::int64_t readback_ns = 0;                  // how long the render thread waited for it and copied it
};

struct EncodedFrame {
    std::vector<std::byte> data;  // H.264 Annex B access unit, or a JPEG file
    bool key = false;
    std::uint8_t lane = 0;  // server/stream/lanes.h
    std::uint32_t scene_rev = 0;
    std::int64_t drained_ns = 0, rendered_ns = 0;  // of the picture
    std::int64_t began_ns = 0, encoded_ns = 0;     // of its encoding; a repeat of a picture begins long after it
};

// x264's constant rate factors: 6 more halve the bits. While something moves, and at rest, where the picture comes out
// visually lossless (docs/streaming.md).
inline constexpr double kCrf = 22.0, kStillCrf = 10.0;

// How one frame is to be encoded.
struct FrameRequest {
    bool key = false;  // as an IDR with SPS and PPS in-band
    // It shall not be larger, however coarse it gets, down to x264's quantiser 40; 0: no limit.
    std::uint32_t budget_bytes = 0;
    double crf = kCrf;  // where the budget allows it, 0..51
};

// H.264 by libavcodec: infinite GOP, no B frames, nothing held back, a VUI of what colours the pixels have. Not
// thread-safe: one thread owns it.
class H264Encoder {
public:
    // kind: a name of encoder_kinds(). Encodes one grey picture, so that what cannot encode is refused here.
    // Errors: "encoder_unavailable".
    static Result<std::unique_ptr<H264Encoder>> open(int width_px, int height_px, const std::string& kind = "libx264");
    virtual ~H264Encoder() = default;
    // picture must have the encoder's size. Errors: "encoder_failed".
    virtual Result<EncodedFrame> encode(const Picture& picture, const FrameRequest& request) = 0;
    Result<EncodedFrame> encode(const Picture& picture, bool key) {
        return encode(picture, FrameRequest{key, 0, kCrf});
    }
    virtual std::string codec_string() const = 0;  // for WebCodecs, e.g. "avc1.42C020"
};

using EncoderFactory =
    std::function<Result<std::unique_ptr<H264Encoder>>(const std::string& kind, int width_px, int height_px)>;

// All kinds in the order in which they are tried: "h264_nvenc", "h264_vaapi", "libx264".
std::span<const char* const> encoder_kinds();

// Tries `wanted` ("auto": all kinds; "nvenc", "vaapi", "libx264"; "mjpeg": none) with one frame of this size each.
// Result: the kinds that work, best first. One that does not answer within 5 s counts as broken. `note` is told why one
// does not work.
std::vector<std::string> working_encoders(const std::string& wanted, int width_px, int height_px,
                                          const EncoderFactory& open,
                                          const std::function<void(const std::string&)>& note);

// Result: a JPEG file of the picture (MJPEG fallback). quality_percent: of JPEG, 1..100.
Result<EncodedFrame> encode_jpeg_frame(const Picture& picture, int quality_percent);

}  // namespace gonio
