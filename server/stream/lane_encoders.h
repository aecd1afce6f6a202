// The encoders of the lanes and the few threads that run them. A lane has at most one picture waiting and one in work,
// so nothing queues: a newer picture replaces one that no thread has begun. An encoder that fails is replaced by the
// next kind, one that hangs together with its thread; viewers go on with an IDR. Where no kind works any more H.264 is
// given up, and MJPEG and stills remain.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/base/queue.h"
#include "server/stream/encoder.h"
#include "server/stream/lanes.h"

namespace gonio {

// One picture for one lane.
struct LaneJob {
    Picture picture;
    FrameRequest request;
    bool settled = false;  // nothing newer is due
    bool last = false;     // of the refining repeats of this picture
    bool fine = false;     // at the quality of stills: if the frame is tiny, nothing is left to say
};

struct VideoStream {
    std::string codec, encoder;
    int width_px = 0, height_px = 0;
};

class LaneEncoders {
public:
    // Called on the encoders' threads.
    struct Outputs {
        std::function<void(LaneId, const VideoStream&)> stream;  // before the first frame of an encoder
        // final: nothing newer is due and nothing is left to say about this picture.
        std::function<void(EncodedFrame, bool final)> h264;
        std::function<void(EncodedFrame)> jpeg;
        std::function<void()> idle;                       // a job is done
        std::function<void()> given_up;                   // once: no encoder of H.264 works
        std::function<void(const std::string&)> trouble;  // a line for the log
    };
    struct Setup {
        std::vector<std::string> kinds;  // that work, best first; empty: no H.264
        EncoderFactory open;
        unsigned threads = 2;
        std::chrono::milliseconds stuck{2'000};  // an encoder that takes longer for one picture hangs
        unsigned most_stuck = 3;                 // threads lost to such encoders; then H.264 is given up
    };
    LaneEncoders(Setup setup, Outputs outputs);
    // Joins its threads; those that hang are left behind.
    ~LaneEncoders();
    LaneEncoders(const LaneEncoders&) = delete;
    LaneEncoders& operator=(const LaneEncoders&) = delete;

    // All below: one thread, the owner's.
    // Whether a picture put now would be begun before another of the lane is done.
    bool takes(LaneId lane) const;
    void put(LaneId lane, LaneJob job);
    bool takes_jpeg() const;
    void put_jpeg(Picture picture);
    // Replaces encoders that hang. Result: the lanes whose picture was lost with them.
    std::vector<LaneId> check();
    // Closes the encoder of a lane that nobody watches.
    void close(LaneId lane);
    // Encodes one picture in this lane, or as JPEG where there is no H.264, and waits for it: the trial that READY
    // promises.
    void encode_first(LaneId lane, const Picture& picture);

    struct Counts {
        std::uint32_t frames = 0, keys = 0;  // published
        bool sharp = false;                  // the last frame left nothing to say about its picture
        bool final = false;                  // the last frame was flagged so
        const char* encoder = "";            // that made it
    };
    Counts counts(LaneId lane) const;
    bool idle(LaneId lane) const;  // nothing waits and nothing is in work
    // Result: the kind that new lanes get; "mjpeg" where there is no H.264.
    std::string encoder() const;
    bool works() const;                    // there is H.264
    std::uint32_t frames_encoded() const;  // of all kinds
    std::uint32_t jpeg_frames() const;
    // How often a lane was given to the threads, and how often one was done with it or left behind. Any thread.
    struct Turns {
        std::uint64_t given = 0, done = 0;
    };
    Turns turns() const;

private:
    struct LaneState;
    struct Shared;
    const LaneState* find(LaneId lane) const;
    bool begins_soon(LaneId lane) const;
    void start_thread(std::size_t index);

    std::shared_ptr<Shared> shared_;
    std::map<LaneId, std::shared_ptr<LaneState>> states_;
    std::vector<std::thread> threads_;
    unsigned stuck_ = 0;
};

}  // namespace gonio
