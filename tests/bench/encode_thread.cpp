#include "tests/bench/encode_thread.h"

#include <chrono>

namespace gonio {

EncodeThread::EncodeThread(Outputs outputs) : out_(std::move(outputs)), thread_([this] { work(); }) {}

EncodeThread::~EncodeThread() {
    jobs_.close();
    thread_.join();
}

bool EncodeThread::encode_now(const Picture& picture) {
    put({picture, true, true, false, true});
    while (frames_encoded_.load() == 0) {
        if (waiting_.load() == 0 && frames_encoded_.load() == 0 && failed_.load()) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
}

void EncodeThread::put(EncodeJob job) {
    if (job.key) key_ = true;
    waiting_ = 1;
    jobs_.put(std::move(job));
}

void EncodeThread::work() {
    while (auto job = jobs_.take()) {
        waiting_ = 0;
        encode(*job);
        out_.idle();
    }
}

void EncodeThread::encode(const EncodeJob& job) {
    const Picture& picture = job.picture;
    if (job.h264) {
        if (!encoder_ || picture.width_px != width_px_ || picture.height_px != height_px_) {
            encoder_.reset();
            auto opened = H264Encoder::open(picture.width_px, picture.height_px);
            if (opened) {
                encoder_ = std::move(*opened);
                width_px_ = picture.width_px;
                height_px_ = picture.height_px;
                out_.config(encoder_->codec_string(), width_px_, height_px_);
            }
            failed_ = !encoder_;
        }
        if (encoder_) {
            auto frame = encoder_->encode(picture, key_.exchange(false));
            if (frame) {
                ++frames_encoded_;
                out_.h264(std::move(*frame), job.final);
            } else {
                encoder_.reset();  // opened anew, with an IDR, for the next picture
                failed_ = true;
            }
        }
    }
    if (job.jpeg) {
        auto frame = encode_jpeg_frame(picture, 85);
        if (frame) {
            ++frames_encoded_;
            out_.jpeg(std::move(*frame));
        }
    }
}

}  // namespace gonio
