#include "tests/pictures/decoder.h"

#include <cstring>
#include <stdexcept>

extern "C" {
#include <libavcodec/avcodec.h>
}

namespace gonio::test {

struct Decoder::Libav {
    AVCodecContext* context = avcodec_alloc_context3(avcodec_find_decoder(AV_CODEC_ID_H264));
    AVPacket* packet = av_packet_alloc();
    AVFrame* frame = av_frame_alloc();
    std::int64_t next = 0;

    Libav() {
        context->flags |= AV_CODEC_FLAG_LOW_DELAY;
        context->thread_count = 1;
        if (avcodec_open2(context, nullptr, nullptr) != 0) throw std::runtime_error("no decoder of H.264");
    }
    ~Libav() {
        av_frame_free(&frame);
        av_packet_free(&packet);
        avcodec_free_context(&context);
    }
    Libav(const Libav&) = delete;
    Libav& operator=(const Libav&) = delete;
};

Decoder::Decoder() : libav_(std::make_unique<Libav>()) {}
Decoder::~Decoder() = default;

std::optional<Decoded> Decoder::decode(const EncodedFrame& encoded) {
    std::vector<std::uint8_t> padded(encoded.data.size() + AV_INPUT_BUFFER_PADDING_SIZE);
    std::memcpy(padded.data(), encoded.data.data(), encoded.data.size());
    libav_->packet->data = padded.data();
    libav_->packet->size = static_cast<int>(encoded.data.size());
    libav_->packet->pts = libav_->next++;
    if (avcodec_send_packet(libav_->context, libav_->packet) != 0) return std::nullopt;
    if (avcodec_receive_frame(libav_->context, libav_->frame) != 0) return std::nullopt;
    const AVFrame& frame = *libav_->frame;
    Decoded result{frame.width, frame.height, {}, frame.pts, libav_->context->has_b_frames};
    result.primaries = frame.color_primaries;
    result.transfer = frame.color_trc;
    result.matrix = frame.colorspace;
    result.full_range = frame.color_range == AVCOL_RANGE_JPEG;
    result.chroma_location = static_cast<int>(frame.chroma_location) - 1;
    const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
    result.nv12.resize(width * height * 3 / 2);
    const auto row = [&](int plane, std::size_t y) {
        return frame.data[plane] + static_cast<std::ptrdiff_t>(y) * frame.linesize[plane];
    };
    for (std::size_t y = 0; y < height; ++y) std::memcpy(&result.nv12[y * width], row(0, y), width);
    for (std::size_t y = 0; y < height / 2; ++y) {
        std::uint8_t* to = &result.nv12[(height + y) * width];
        for (std::size_t x = 0; x < width / 2; ++x) {
            to[2 * x] = row(1, y)[x];
            to[2 * x + 1] = row(2, y)[x];
        }
    }
    return result;
}

}  // namespace gonio::test
