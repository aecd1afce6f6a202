#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "server/stream/encoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

namespace gonio {
namespace {

struct ContextDeleter {
    void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
};
struct FrameDeleter {
    void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
struct PacketDeleter {
    void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};

constexpr int kInfiniteGop = 1 << 30;  // X264_KEYINT_MAX_INFINITE: an IDR comes on demand only
constexpr int kNominalFps = 60;        // only x264's choice of the level depends on it
constexpr const char* kCrf = "23";

std::int64_t monotonic_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

std::string av_text(int code) {
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(code, text, sizeof text);
    return text;
}

// Result: the WebCodecs string of the SPS in an Annex B access unit: profile, constraint flags and level are the three
// bytes after its NAL header (ITU-T H.264 7.3.2.1.1). Empty if there is no SPS.
std::string codec_string_of(const std::uint8_t* data, std::size_t size) {
    constexpr int kSps = 7;
    for (std::size_t i = 0; i + 7 <= size; ++i) {
        if (data[i] != 0 || data[i + 1] != 0 || data[i + 2] != 1 || (data[i + 3] & 0x1f) != kSps) continue;
        char text[16];
        std::snprintf(text, sizeof text, "avc1.%02X%02X%02X", data[i + 4], data[i + 5], data[i + 6]);
        return text;
    }
    return {};
}

class LibavEncoder final : public H264Encoder {
public:
    // Errors: "encoder_unavailable". Encodes one grey picture, so that what cannot encode is refused here.
    Result<bool> start(int width_px, int height_px) {
        const auto refusal = [&](const std::string& what) {
            return Error{"encoder_unavailable", "libx264", std::to_string(width_px) + "x" + std::to_string(height_px),
                         "The H.264 encoder cannot be opened: " + what + "."};
        };
        if (width_px < 16 || height_px < 16 || width_px > 4096 || height_px > 4096 || width_px % 2 || height_px % 2)
            return refusal("the size must be even and 16..4096");
        av_log_set_level(AV_LOG_ERROR);
        const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
        if (!codec) return refusal("libavcodec has no libx264");
        context_.reset(avcodec_alloc_context3(codec));
        frame_.reset(av_frame_alloc());
        packet_.reset(av_packet_alloc());
        if (!context_ || !frame_ || !packet_) return refusal("out of memory");

        context_->width = width_px;
        context_->height = height_px;
        context_->pix_fmt = AV_PIX_FMT_NV12;
        context_->time_base = {1, kNominalFps};
        context_->framerate = {kNominalFps, 1};
        context_->gop_size = kInfiniteGop;
        context_->max_b_frames = 0;
        context_->thread_count = 1;  // a second thread means slices and gains nothing at these sizes
        context_->color_range = AVCOL_RANGE_MPEG;
        context_->colorspace = AVCOL_SPC_BT709;
        context_->color_primaries = AVCOL_PRI_BT709;
        context_->color_trc = AVCOL_TRC_BT709;
        context_->chroma_sample_location = AVCHROMA_LOC_CENTER;  // the shader averages 2×2
        // Without AV_CODEC_FLAG_GLOBAL_HEADER libx264 repeats SPS and PPS before every IDR. Baseline without B frames
        // makes it write bitstream_restriction with max_num_reorder_frames = 0: decoders hold nothing back.
        const std::pair<const char*, const char*> options[] = {
            {"preset", "ultrafast"}, {"tune", "zerolatency"}, {"profile", "baseline"},
            {"crf", kCrf},           {"forced-idr", "1"},     {"sc_threshold", "0"},
        };
        AVDictionary* dictionary = nullptr;
        for (const auto& [key, value] : options) av_dict_set(&dictionary, key, value, 0);
        const int opened = avcodec_open2(context_.get(), codec, &dictionary);
        const AVDictionaryEntry* unused = av_dict_get(dictionary, "", nullptr, AV_DICT_IGNORE_SUFFIX);
        const std::string unused_option = unused ? unused->key : "";
        av_dict_free(&dictionary);
        if (opened < 0) return refusal(av_text(opened));
        if (!unused_option.empty()) return refusal("it does not know the option " + unused_option);

        frame_->format = AV_PIX_FMT_NV12;
        frame_->width = width_px;
        frame_->height = height_px;
        if (const int got = av_frame_get_buffer(frame_.get(), 0); got < 0) return refusal(av_text(got));

        Picture grey;
        grey.width_px = width_px;
        grey.height_px = height_px;
        grey.nv12 = std::make_shared<const std::vector<std::uint8_t>>(
            static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3 / 2, std::uint8_t{128});
        const Result<EncodedFrame> trial = encode(grey, true);
        if (!trial) return refusal(trial.error().message);
        codec_string_ = codec_string_of(reinterpret_cast<const std::uint8_t*>(trial->data.data()), trial->data.size());
        if (codec_string_.empty()) return refusal("its first frame has no SPS");
        first_ = true;
        return true;
    }

    Result<EncodedFrame> encode(const Picture& picture, bool want_key) override {
        const auto refusal = [&](const std::string& what, const std::string& value = {}) {
            return Error{"encoder_failed", "libx264", value, "The picture could not be encoded: " + what + "."};
        };
        const auto width = static_cast<std::size_t>(context_->width);
        const auto height = static_cast<std::size_t>(context_->height);
        if (picture.width_px != context_->width || picture.height_px != context_->height || !picture.nv12 ||
            picture.nv12->size() != width * height * 3 / 2)
            return refusal("it has not the encoder's size",
                           std::to_string(picture.width_px) + "x" + std::to_string(picture.height_px));
        if (const int got = av_frame_make_writable(frame_.get()); got < 0) return refusal(av_text(got));
        copy_plane(0, picture.nv12->data(), width, height);
        copy_plane(1, picture.nv12->data() + width * height, width, height / 2);
        frame_->pts = next_pts_++;
        frame_->pict_type = want_key || first_ ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;

        if (const int got = avcodec_send_frame(context_.get(), frame_.get()); got < 0) return refusal(av_text(got));
        if (const int got = avcodec_receive_packet(context_.get(), packet_.get()); got < 0)
            return refusal("no packet for it: " + av_text(got));
        EncodedFrame frame;
        frame.data.resize(static_cast<std::size_t>(packet_->size));
        std::memcpy(frame.data.data(), packet_->data, frame.data.size());
        frame.key = (packet_->flags & AV_PKT_FLAG_KEY) != 0;
        av_packet_unref(packet_.get());
        first_ = false;
        frame.scene_rev = picture.scene_rev;
        frame.drained_ns = picture.drained_ns;
        frame.rendered_ns = picture.rendered_ns;
        frame.encoded_ns = monotonic_ns();
        return frame;
    }

    std::string codec_string() const override { return codec_string_; }

private:
    void copy_plane(int plane, const std::uint8_t* from, std::size_t row_bytes, std::size_t rows) {
        const std::ptrdiff_t stride = frame_->linesize[plane];
        for (std::size_t row = 0; row < rows; ++row)
            std::memcpy(frame_->data[plane] + static_cast<std::ptrdiff_t>(row) * stride, from + row * row_bytes,
                        row_bytes);
    }

    std::unique_ptr<AVCodecContext, ContextDeleter> context_;
    std::unique_ptr<AVFrame, FrameDeleter> frame_;
    std::unique_ptr<AVPacket, PacketDeleter> packet_;
    std::string codec_string_;
    std::int64_t next_pts_ = 0;
    bool first_ = true;  // the next picture is the first that anybody sees
};

}  // namespace

Result<std::unique_ptr<H264Encoder>> H264Encoder::open(int width_px, int height_px) {
    auto encoder = std::make_unique<LibavEncoder>();
    if (auto started = encoder->start(width_px, height_px); !started) return started.error();
    return std::unique_ptr<H264Encoder>(std::move(encoder));
}

}  // namespace gonio
