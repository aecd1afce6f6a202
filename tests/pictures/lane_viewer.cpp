#include "tests/pictures/lane_viewer.h"

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "server/stream/lane_feed.h"
#include "tests/pictures/decoder.h"

namespace gonio::test {
namespace {

struct Out {
    EncodedFrame frame;
    bool final;
};

LaneEncoders::Setup setup() {
    LaneEncoders::Setup result;
    result.kinds = {"libx264"};
    result.open = [](const std::string& kind, int width, int height) { return H264Encoder::open(width, height, kind); };
    return result;
}

LaneEncoders::Outputs into(Queue<Out>& frames) {
    LaneEncoders::Outputs out;
    out.stream = [](LaneId, const VideoStream&) {};
    out.h264 = [&frames](EncodedFrame frame, bool final) { frames.push({std::move(frame), final}); };
    out.jpeg = [](EncodedFrame) {};
    out.idle = out.given_up = [] {};
    out.trouble = [](const std::string&) {};
    return out;
}

}  // namespace

struct LaneViewer::Parts {
    Queue<Out> frames{8};
    LaneEncoders encoders{setup(), into(frames)};
    LaneFeed feed{encoders};
    Decoder decoder;
};

LaneViewer::LaneViewer() : parts_(std::make_unique<Parts>()) {}
LaneViewer::~LaneViewer() = default;

void LaneViewer::show(gonio::Picture picture, std::int64_t now_ns) {
    parts_->feed.show(std::move(picture), now_ns);
}

const gonio::Picture& LaneViewer::newest() const {
    return parts_->feed.newest();
}

std::optional<LaneViewer::Received> LaneViewer::serve(std::int64_t now_ns, bool settled) {
    const LaneEncoders::Counts counts = parts_->encoders.counts(kFirstPrivateLane);
    LaneRequest request;
    request.lane = kFirstPrivateLane;
    request.viewers = 1;
    request.credit = VideoGate::kWindow;
    request.key = counts.keys == 0;
    request.frames = counts.frames;
    request.keys = counts.keys;
    parts_->feed.want({request}, false, 0);
    parts_->feed.serve(now_ns, false, settled);
    while (!parts_->encoders.idle(kFirstPrivateLane)) std::this_thread::sleep_for(std::chrono::microseconds(200));
    const auto out = parts_->frames.try_pop();
    if (!out) return std::nullopt;
    auto decoded = parts_->decoder.decode(out->frame);
    if (!decoded) throw std::runtime_error("a frame of the stream cannot be decoded");
    return Received{std::move(decoded->nv12), out->frame.data.size(),
                    static_cast<double>(out->frame.encoded_ns - out->frame.began_ns) * 1e-6, out->frame.key,
                    out->final};
}

}  // namespace gonio::test
