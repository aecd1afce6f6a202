#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "server/base/clock.h"
#include "server/base/queue.h"
#include "server/stream/encoder.h"
#include "server/stream/h264_stream.h"
#include "server/stream/libav.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/hwcontext.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

namespace gonio {
namespace {

constexpr int kInfiniteGop = 1 << 30;  // X264_KEYINT_MAX_INFINITE: an IDR comes on demand only
// Rate control reckons with this many frames a second whatever their real distance is, so that a budget for a frame is
// a rate: budget × kNominalFps with a buffer of one frame.
constexpr int kNominalFps = 60;
// x264 and NVENC change the limits of a running encoder only if it was opened with some: this one binds nothing.
constexpr std::uint32_t kNoLimitBytes = 4 << 20;

// How a kind of encoder is opened. Options are libavcodec's (ffmpeg -h encoder=NAME).
struct Kind {
    const char* name;
    bool surfaces;  // takes VAAPI surfaces instead of pictures in memory
    bool reopens;   // another budget needs another encoder: its rate is fixed once it is open
    std::array<std::pair<const char*, const char*>, 8> options;
};
// Beside the preset, x264's own names (docs/streaming.md has why, docs/notebook/performance.md what was tried). Plain
// blocks get bits from textured ones, chroma from luma; a weak loop filter; more bits for what moves. Beyond quantiser
// 40 a picture is blocks: a frame is rather larger then. Below 8 nobody sees a difference.
constexpr const char* kX264Params =
    "aq-mode=2:aq-strength=1:chroma-qp-offset=-8:deblock=-2:partitions=i4x4:qcomp=0.8:qpmin=8:qpmax=40";
constexpr Kind kKinds[] = {
    {"h264_nvenc",
     false,
     false,
     {{{"preset", "p2"},
       {"tune", "ull"},
       {"profile", "baseline"},
       {"rc", "vbr"},
       {"zerolatency", "1"},
       {"delay", "0"},
       {"forced-idr", "1"},
       {"no-scenecut", "1"}}}},
    {"h264_vaapi", true, true, {{{"profile", "constrained_baseline"}, {"async_depth", "1"}, {"sei", "0"}}}},
    {"libx264",
     false,
     false,
     {{{"preset", "ultrafast"},
       {"tune", "zerolatency"},
       {"profile", "baseline"},
       {"forced-idr", "1"},
       {"sc_threshold", "0"},
       {"x264-params", kX264Params}}}},
};
constexpr const char* kKindNames[] = {kKinds[0].name, kKinds[1].name, kKinds[2].name};

class LibavEncoder final : public H264Encoder {
public:
    // Errors: "encoder_unavailable".
    Result<bool> start(const Kind& kind, int width_px, int height_px) {
        kind_ = &kind;
        width_px_ = width_px;
        height_px_ = height_px;
        if (width_px < 16 || height_px < 16 || width_px > 4096 || height_px > 4096 || width_px % 2 || height_px % 2)
            return unavailable("the size must be even and 16..4096");
        av_log_set_level(AV_LOG_FATAL);  // what it says is in the errors
        if (auto opened = open_context({}); !opened) return opened;
        Picture grey;
        grey.width_px = width_px;
        grey.height_px = height_px;
        grey.nv12 = std::make_shared<const std::vector<std::uint8_t>>(
            static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3 / 2, std::uint8_t{128});
        const Result<EncodedFrame> trial = encode(grey, FrameRequest{true, 0, kCrf});
        if (!trial) return unavailable(trial.error().message);
        const auto info = read_stream_info(trial->data);
        if (!info) return unavailable("its first frame has no SPS");
        codec_string_ = info->codec;
        first_ = true;
        return true;
    }

    Result<EncodedFrame> encode(const Picture& picture, const FrameRequest& request) override {
        const auto width = static_cast<std::size_t>(width_px_), height = static_cast<std::size_t>(height_px_);
        if (picture.width_px != width_px_ || picture.height_px != height_px_ || !picture.nv12 ||
            picture.nv12->size() != width * height * 3 / 2)
            return failed("it has not the encoder's size",
                          std::to_string(picture.width_px) + "x" + std::to_string(picture.height_px));
        const std::int64_t began_ns = monotonic_ns();
        if (auto limited = limit(request); !limited) return limited.error();
        if (const int got = av_frame_make_writable(frame_.get()); got < 0) return failed(av_text(got));
        copy_plane(0, picture.nv12->data(), width, height);
        copy_plane(1, picture.nv12->data() + width * height, width, height / 2);
        AVFrame* input = frame_.get();
        if (surfaces_) {
            av_frame_unref(surface_.get());
            if (const int got = av_hwframe_get_buffer(surfaces_.get(), surface_.get(), 0); got < 0)
                return failed(av_text(got));
            if (const int got = av_hwframe_transfer_data(surface_.get(), frame_.get(), 0); got < 0)
                return failed(av_text(got));
            input = surface_.get();
        }
        input->pts = next_pts_++;
        input->pict_type = request.key || first_ ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;

        if (const int got = avcodec_send_frame(context_.get(), input); got < 0) return failed(av_text(got));
        if (const int got = avcodec_receive_packet(context_.get(), packet_.get()); got < 0)
            return failed("no packet for it: " + av_text(got));
        EncodedFrame frame;
        frame.data.resize(static_cast<std::size_t>(packet_->size));
        std::memcpy(frame.data.data(), packet_->data, frame.data.size());
        frame.key = (packet_->flags & AV_PKT_FLAG_KEY) != 0;
        av_packet_unref(packet_.get());
        first_ = false;
        frame.scene_rev = picture.scene_rev;
        frame.drained_ns = picture.drained_ns;
        frame.rendered_ns = picture.rendered_ns;
        frame.began_ns = began_ns;
        frame.encoded_ns = monotonic_ns();
        return frame;
    }

    std::string codec_string() const override { return codec_string_; }

private:
    Error unavailable(const std::string& what) const {
        return {"encoder_unavailable", kind_->name, std::to_string(width_px_) + "x" + std::to_string(height_px_),
                "The H.264 encoder cannot be opened: " + what + "."};
    }
    Error failed(const std::string& what, const std::string& value = {}) const {
        return {"encoder_failed", kind_->name, value, "The picture could not be encoded: " + what + "."};
    }

    Result<bool> open_context(const FrameRequest& request) {
        const AVCodec* codec = avcodec_find_encoder_by_name(kind_->name);
        if (!codec) return unavailable("libavcodec has no " + std::string(kind_->name));
        context_.reset(avcodec_alloc_context3(codec));
        frame_.reset(av_frame_alloc());
        packet_.reset(av_packet_alloc());
        if (!context_ || !frame_ || !packet_) return unavailable("out of memory");
        context_->width = width_px_;
        context_->height = height_px_;
        context_->pix_fmt = kind_->surfaces ? AV_PIX_FMT_VAAPI : AV_PIX_FMT_NV12;
        context_->time_base = {1, kNominalFps};
        context_->framerate = {kNominalFps, 1};
        context_->gop_size = kInfiniteGop;
        context_->max_b_frames = 0;
        context_->thread_count = 1;  // a second thread means slices and gains nothing at these sizes
        context_->color_range = AVCOL_RANGE_MPEG;
        context_->colorspace = AVCOL_SPC_BT709;
        context_->color_primaries = AVCOL_PRI_BT709;
        context_->color_trc = AVCOL_TRC_IEC61966_2_1;            // of srgb_encode() in shaders/lib/display.glsl
        context_->chroma_sample_location = AVCHROMA_LOC_CENTER;  // the shader averages 2×2
        if (kind_->surfaces) {
            if (auto made = make_surfaces(); !made) return made;
        }
        // Without AV_CODEC_FLAG_GLOBAL_HEADER SPS and PPS are repeated before every IDR. Baseline without B frames
        // makes libx264 write bitstream_restriction with max_num_reorder_frames = 0: decoders hold nothing back.
        AVDictionary* dictionary = nullptr;
        for (const auto& [key, value] : kind_->options)
            if (key) av_dict_set(&dictionary, key, value, 0);
        add_rate(dictionary, request);
        std::string unknown;
        const AVClass* options = codec->priv_class;
        for (const AVDictionaryEntry* entry = nullptr;
             (entry = av_dict_get(dictionary, "", entry, AV_DICT_IGNORE_SUFFIX)) != nullptr;)
            if (!av_opt_find(&options, entry->key, nullptr, 0, AV_OPT_SEARCH_FAKE_OBJ)) unknown = entry->key;
        const int opened =
            unknown.empty() ? avcodec_open2(context_.get(), codec, &dictionary) : AVERROR_OPTION_NOT_FOUND;
        av_dict_free(&dictionary);
        if (!unknown.empty()) return unavailable("it does not know the option " + unknown);
        if (opened < 0) return unavailable(av_text(opened));

        frame_->format = AV_PIX_FMT_NV12;
        frame_->width = width_px_;
        frame_->height = height_px_;
        if (const int got = av_frame_get_buffer(frame_.get(), 0); got < 0) return unavailable(av_text(got));
        first_ = true;
        return true;
    }

    // A constant rate factor under a limit that each kind spells in its own way.
    void add_rate(AVDictionary*& dictionary, const FrameRequest& request) {
        crf_ = request.crf;
        budget_bytes_ = request.budget_bytes;
        const std::string crf = std::to_string(request.crf);
        if (!kind_->reopens) {
            set_limit(request.budget_bytes);
            const bool x264 = std::strcmp(kind_->name, "libx264") == 0;
            av_dict_set(&dictionary, x264 ? "crf" : "cq", crf.c_str(), 0);
            // By the size alone: the limit that binds nothing would count otherwise.
            if (x264) context_->level = level_idc(width_px_, height_px_, kNominalFps);
        } else if (request.budget_bytes == 0) {
            av_dict_set(&dictionary, "rc_mode", "CQP", 0);
            av_dict_set_int(&dictionary, "qp", static_cast<std::int64_t>(request.crf), 0);
        } else {
            av_dict_set(&dictionary, "rc_mode", "VBR", 0);
            set_limit(request.budget_bytes);
            context_->bit_rate = context_->rc_max_rate * 9 / 10;
        }
    }
    void set_limit(std::uint32_t budget_bytes) {
        const std::int64_t bits = std::int64_t{8} * (budget_bytes ? budget_bytes : kNoLimitBytes);
        context_->rc_buffer_size = static_cast<int>(bits);
        context_->rc_max_rate = bits * kNominalFps;
    }
    // Running encoders of libx264 and NVENC look at these fields before each frame and take new values without an IDR.
    Result<bool> limit(const FrameRequest& request) {
        if (request.crf == crf_ && request.budget_bytes == budget_bytes_) return true;
        if (kind_->reopens) {
            // Not for a change that nobody would notice, nor to sharpen a still: the IDR that it costs would be seen.
            const double before = budget_bytes_, now = request.budget_bytes;
            const bool same = before == now || (before > 0 && now > 0 && now / before > 0.67 && now / before < 1.5);
            return request.crf <= crf_ && same ? Result<bool>(true) : open_context(request);
        }
        crf_ = request.crf;
        budget_bytes_ = request.budget_bytes;
        set_limit(request.budget_bytes);
        av_opt_set_double(context_->priv_data, std::strcmp(kind_->name, "libx264") == 0 ? "crf" : "cq", request.crf, 0);
        return true;
    }

    Result<bool> make_surfaces() {
        AVBufferRef* device = nullptr;
        if (const int got = av_hwdevice_ctx_create(&device, AV_HWDEVICE_TYPE_VAAPI, nullptr, nullptr, 0); got < 0)
            return unavailable("no VAAPI device: " + av_text(got));
        const BufferPointer owned(device);
        surfaces_.reset(av_hwframe_ctx_alloc(device));
        surface_.reset(av_frame_alloc());
        if (!surfaces_ || !surface_) return unavailable("out of memory");
        auto* frames = reinterpret_cast<AVHWFramesContext*>(surfaces_->data);
        frames->format = AV_PIX_FMT_VAAPI;
        frames->sw_format = AV_PIX_FMT_NV12;
        frames->width = width_px_;
        frames->height = height_px_;
        frames->initial_pool_size = 4;
        if (const int got = av_hwframe_ctx_init(surfaces_.get()); got < 0) return unavailable(av_text(got));
        context_->hw_frames_ctx = av_buffer_ref(surfaces_.get());
        return true;
    }

    void copy_plane(int plane, const std::uint8_t* from, std::size_t row_bytes, std::size_t rows) {
        const std::ptrdiff_t stride = frame_->linesize[plane];
        for (std::size_t row = 0; row < rows; ++row)
            std::memcpy(frame_->data[plane] + static_cast<std::ptrdiff_t>(row) * stride, from + row * row_bytes,
                        row_bytes);
    }

    const Kind* kind_ = nullptr;
    int width_px_ = 0, height_px_ = 0;
    ContextPointer context_;
    FramePointer frame_, surface_;
    PacketPointer packet_;
    BufferPointer surfaces_;
    std::string codec_string_;
    std::int64_t next_pts_ = 0;
    double crf_ = kCrf;
    std::uint32_t budget_bytes_ = 0;
    bool first_ = true;  // the next picture is the first that anybody sees
};

// The option's word for a kind.
std::vector<std::string> kinds_of(const std::string& wanted) {
    std::vector<std::string> kinds;
    for (const std::string_view name : kKindNames)
        if (wanted == "auto" || name.ends_with(wanted)) kinds.emplace_back(name);
    return kinds;
}

}  // namespace

Result<std::unique_ptr<H264Encoder>> H264Encoder::open(int width_px, int height_px, const std::string& kind) {
    const Kind* const found = std::ranges::find(kKinds, kind, &Kind::name);
    if (found == std::end(kKinds)) return Error{"encoder_unavailable", kind, "", "There is no such encoder."};
    auto encoder = std::make_unique<LibavEncoder>();
    if (auto started = encoder->start(*found, width_px, height_px); !started) return started.error();
    return std::unique_ptr<H264Encoder>(std::move(encoder));
}

std::span<const char* const> encoder_kinds() {
    return kKindNames;
}

std::vector<std::string> working_encoders(const std::string& wanted, int width_px, int height_px,
                                          const EncoderFactory& open,
                                          const std::function<void(const std::string&)>& note) {
    constexpr auto kPatience = std::chrono::seconds(5);
    std::vector<std::string> working;
    for (const std::string& kind : kinds_of(wanted)) {
        // A driver may hang: then this thread is left to itself.
        const auto answers = std::make_shared<Queue<std::string>>(1);
        std::thread([=] {
            auto opened = open(kind, width_px, height_px);
            answers->push(opened ? "" : opened.error().message);
        }).detach();
        const auto answer = answers->pop_for(kPatience);
        if (answer && answer->empty())
            working.push_back(kind);
        else
            note(kind + ": " + answer.value_or("It does not answer."));
    }
    return working;
}

}  // namespace gonio
