#include "server/stream/video_file.h"

#include <algorithm>
#include <cmath>

#include "server/stream/libav.h"

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/cpu.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

namespace gonio {
namespace {

struct FreeFormat {
    void operator()(AVFormatContext* context) const {
        if (context->pb != nullptr) avio_closep(&context->pb);
        avformat_free_context(context);
    }
};
using FormatPointer = std::unique_ptr<AVFormatContext, FreeFormat>;

Error failed(const std::string& what) {
    return {"encoder_failed", "", "", "The video could not be encoded: " + what + "."};
}

// BT.709, limited range: Y' of 219 steps, Cb and Cr of 224. Chroma is that of each 2 × 2 pixels' mean.
void to_planes(const std::vector<std::uint8_t>& rgb, AVFrame& frame) {
    const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
    constexpr float kR = 0.2126f, kB = 0.0722f, kG = 1.0f - kR - kB;
    const auto luma = [](const float* p) { return kR * p[0] + kG * p[1] + kB * p[2]; };
    const auto byte = [](float value) { return static_cast<std::uint8_t>(std::lround(value)); };
    for (std::size_t y = 0; y < height; y += 2) {
        for (std::size_t x = 0; x < width; x += 2) {
            float mean[3] = {};
            for (std::size_t k = 0; k < 4; ++k) {
                const std::size_t row = y + k / 2, column = x + k % 2;
                const std::uint8_t* from = &rgb[3 * (row * width + column)];
                const float pixel[3] = {static_cast<float>(from[0]) / 255.0f, static_cast<float>(from[1]) / 255.0f,
                                        static_cast<float>(from[2]) / 255.0f};
                for (int c = 0; c < 3; ++c) mean[c] += 0.25f * pixel[c];
                frame.data[0][row * static_cast<std::size_t>(frame.linesize[0]) + column] =
                    byte(16.0f + 219.0f * luma(pixel));
            }
            const float of_mean = luma(mean);
            frame.data[1][y / 2 * static_cast<std::size_t>(frame.linesize[1]) + x / 2] =
                byte(128.0f + 112.0f * (mean[2] - of_mean) / (1.0f - kB));
            frame.data[2][y / 2 * static_cast<std::size_t>(frame.linesize[2]) + x / 2] =
                byte(128.0f + 112.0f * (mean[0] - of_mean) / (1.0f - kR));
        }
    }
}

class VideoFile {
public:
    Result<bool> open(const std::string& path, const VideoSettings& settings) {
        av_log_set_level(AV_LOG_FATAL);  // what it says is in the errors
        const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
        if (codec == nullptr)
            return Error{"encoder_unavailable", "libx264", "", "libavcodec has no H.264 encoder of its own."};
        AVFormatContext* made = nullptr;
        const std::string url = "file:" + path;  // that MP4 reads again to bring its index first
        if (const int got =
                avformat_alloc_output_context2(&made, nullptr, settings.matroska ? "matroska" : "mp4", url.c_str());
            got < 0)
            return Error{"encoder_unavailable", "libavformat", "", "No video file can be made: " + av_text(got) + "."};
        format_.reset(made);
        format_->flags |= AVFMT_FLAG_BITEXACT;  // no version, no random number
        encoder_.reset(avcodec_alloc_context3(codec));
        frame_.reset(av_frame_alloc());
        packet_.reset(av_packet_alloc());
        if (!encoder_ || !frame_ || !packet_) return failed("out of memory");
        encoder_->width = settings.width_px;
        encoder_->height = settings.height_px;
        encoder_->pix_fmt = AV_PIX_FMT_YUV420P;
        encoder_->time_base = {static_cast<int>(settings.rate_denominator), static_cast<int>(settings.rate_numerator)};
        encoder_->framerate = {encoder_->time_base.den, encoder_->time_base.num};
        encoder_->thread_count = 1;
        encoder_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
        encoder_->color_range = AVCOL_RANGE_MPEG;
        encoder_->colorspace = AVCOL_SPC_BT709;
        encoder_->color_primaries = AVCOL_PRI_BT709;
        encoder_->color_trc = AVCOL_TRC_IEC61966_2_1;
        encoder_->chroma_sample_location = AVCHROMA_LOC_CENTER;
        AVDictionary* options = nullptr;
        av_dict_set(&options, "preset", "medium", 0);
        av_dict_set(&options, "crf", std::to_string(settings.crf).c_str(), 0);
        // At sizes such as 64x36 and 320x180 x264's AVX-512 code of its macroblock tree (mbtree, with B-frames) reads
        // memory that nobody wrote, and bytes differ from run to run. Its AVX2 code makes the bytes of a clean memory.
        if ((av_get_cpu_flags() & AV_CPU_FLAG_AVX512) != 0) av_dict_set(&options, "x264-params", "asm=AVX2", 0);
        const int opened = avcodec_open2(encoder_.get(), codec, &options);
        av_dict_free(&options);
        if (opened < 0) return failed(av_text(opened));
        stream_ = avformat_new_stream(format_.get(), nullptr);
        if (stream_ == nullptr) return failed("out of memory");
        stream_->time_base = encoder_->time_base;
        stream_->avg_frame_rate = encoder_->framerate;
        if (const int got = avcodec_parameters_from_context(stream_->codecpar, encoder_.get()); got < 0)
            return failed(av_text(got));
        frame_->format = AV_PIX_FMT_YUV420P;
        frame_->width = settings.width_px;
        frame_->height = settings.height_px;
        if (const int got = av_frame_get_buffer(frame_.get(), 0); got < 0) return failed(av_text(got));
        path_ = path;
        if (const int got = avio_open(&format_->pb, url.c_str(), AVIO_FLAG_WRITE); got < 0) return unwritable(got);
        AVDictionary* layout = nullptr;
        if (!settings.matroska) av_dict_set(&layout, "movflags", "+faststart", 0);
        const int begun = avformat_write_header(format_.get(), &layout);
        av_dict_free(&layout);
        if (begun < 0) return unwritable(begun);
        return true;
    }

    Result<bool> add(const std::vector<std::uint8_t>& rgb, std::int64_t number) {
        if (rgb.size() !=
            std::size_t{3} * static_cast<std::size_t>(frame_->width) * static_cast<std::size_t>(frame_->height))
            return Error{"encoder_failed", "", std::to_string(number), "This frame has not the video's size."};
        if (const int got = av_frame_make_writable(frame_.get()); got < 0) return failed(av_text(got));
        to_planes(rgb, *frame_);
        frame_->pts = number;
        return send(frame_.get());
    }

    Result<bool> end() {
        if (auto sent = send(nullptr); !sent) return sent;
        if (const int got = av_write_trailer(format_.get()); got < 0) return unwritable(got);
        if (const int got = avio_closep(&format_->pb); got < 0) return unwritable(got);
        return true;
    }

private:
    Error unwritable(int code) const { return {"file_unwritable", "", path_, av_text(code)}; }

    // frame: null at the end.
    Result<bool> send(const AVFrame* frame) {
        if (const int got = avcodec_send_frame(encoder_.get(), frame); got < 0) return failed(av_text(got));
        for (;;) {
            const int got = avcodec_receive_packet(encoder_.get(), packet_.get());
            if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) return true;
            if (got < 0) return failed(av_text(got));
            packet_->duration = 1;
            av_packet_rescale_ts(packet_.get(), encoder_->time_base, stream_->time_base);
            packet_->stream_index = stream_->index;
            if (const int wrote = av_interleaved_write_frame(format_.get(), packet_.get()); wrote < 0)
                return unwritable(wrote);
        }
    }

    std::string path_;
    FormatPointer format_;
    ContextPointer encoder_;
    FramePointer frame_;
    PacketPointer packet_;
    AVStream* stream_ = nullptr;
};

}  // namespace

Result<bool> write_video(const std::string& path, const VideoSettings& settings, const FrameSource& source,
                         const std::stop_token& stop) {
    if (settings.width_px < 16 || settings.height_px < 16 || settings.width_px > 4096 || settings.height_px > 4096 ||
        settings.width_px % 2 != 0 || settings.height_px % 2 != 0)
        return Error{"encoder_unavailable", "libx264",
                     std::to_string(settings.width_px) + "x" + std::to_string(settings.height_px),
                     "A video's size must be even and 16..4096."};
    VideoFile file;
    if (auto opened = file.open(path, settings); !opened) return opened;
    for (std::int64_t i = 0; i < settings.frames; ++i) {
        if (stop.stop_requested()) return Error{"cancelled", "", "", "The video was given up."};
        const auto rgb = source(i);
        if (!rgb) return rgb.error();
        if (auto added = file.add(*rgb, i); !added) return added;
    }
    return file.end();
}

}  // namespace gonio
