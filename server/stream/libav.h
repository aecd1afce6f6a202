// libavcodec's and libavformat's objects with owners. Only for .cpp files.
#pragma once

#include <memory>
#include <string>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/buffer.h>
#include <libavutil/error.h>
#include <libavutil/frame.h>
}

namespace gonio {

template <auto Free>
struct FreeByAddress {
    template <typename T>
    void operator()(T* object) const {
        Free(&object);
    }
};
using ContextPointer = std::unique_ptr<AVCodecContext, FreeByAddress<avcodec_free_context>>;
using FramePointer = std::unique_ptr<AVFrame, FreeByAddress<av_frame_free>>;
using PacketPointer = std::unique_ptr<AVPacket, FreeByAddress<av_packet_free>>;
using BufferPointer = std::unique_ptr<AVBufferRef, FreeByAddress<av_buffer_unref>>;

// Result: the sentence for an error code of these libraries.
inline std::string av_text(int code) {
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(code, text, sizeof text);
    return text;
}

}  // namespace gonio
