// The thread that encodes: always the newest picture, never a queue of them.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "server/queue.h"
#include "server/stream/encoder.h"

namespace gonio {

// One picture and who wants it.
struct EncodeJob {
    Picture picture;
    bool h264 = false;
    bool key = false;  // as an IDR
    bool jpeg = false;
    bool final = false;  // nothing newer is due
};

class EncodeThread {
public:
    // Called on the encode thread.
    struct Outputs {
        std::function<void(EncodedFrame, bool final)> h264;
        std::function<void(EncodedFrame)> jpeg;
        std::function<void(const std::string& codec, int width_px, int height_px)>
            config;                  // before the first frame of an encoder
        std::function<void()> idle;  // a job is done
    };
    explicit EncodeThread(Outputs outputs);
    ~EncodeThread();

    // Encodes one picture and waits for it: the trial that READY promises. Result: whether there is an encoder.
    bool encode_now(const Picture& picture);
    // Replaces a job that has not been started; its wish for a key frame passes on.
    void put(EncodeJob job);
    // Whether a new job would start within one encode.
    bool idle() const { return waiting_.load() == 0; }
    std::uint32_t frames_encoded() const { return frames_encoded_.load(); }

private:
    void work();
    void encode(const EncodeJob& job);

    Outputs out_;
    Latest<EncodeJob> jobs_;
    std::atomic<int> waiting_{0};      // 1: a job is in the slot
    std::atomic<bool> failed_{false};  // the last H.264 picture could not be encoded
    std::atomic<bool> key_{false};     // the next H.264 frame must be an IDR
    std::atomic<std::uint32_t> frames_encoded_{0};
    std::unique_ptr<H264Encoder> encoder_;  // encode thread, or before it has a job
    int width_px_ = 0, height_px_ = 0;
    std::thread thread_;
};

}  // namespace gonio
