// Captures that take long tell how far they are.
#include "server/session/capture_queue.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

// Six tiles, each as long as that.
class SlowTiles : public NullRenderer {
public:
    explicit SlowTiles(std::chrono::milliseconds tile) : tile_(tile) {}
    bool continue_capture(CaptureJob& job) override {
        std::this_thread::sleep_for(tile_);
        job.tile_px = 10;
        if (++job.next_tile < 6) return false;
        return NullRenderer::continue_capture(job);
    }

private:
    std::chrono::milliseconds tile_;
};

struct Heard {
    std::uint32_t session;
    v1::ServerMessage message;
};

// Two captures of 30×20, of sessions 1 and 2. Result: all that was answered, in its order.
std::vector<Heard> capture_two(std::chrono::milliseconds tile) {
    Queue<Heard> heard{100};
    const Scene scene = scene_of(make_cornell());
    Replies replies([](std::uint32_t, v1::ServerMessage) {}, scene);
    GuardedRenderer renderer(std::make_unique<SlowTiles>(tile), [] { return false; });
    {
        Loader loader;
        CaptureQueue captures(loader, [&](std::uint32_t session, v1::ServerMessage message) {
            heard.push({session, std::move(message)});
        });
        for (const std::uint32_t session : {1u, 2u}) {
            Work work;
            work.session = session;
            work.message.set_request_id(10 + session);
            CaptureRequest request;
            request.format = "png";
            request.width_px = 30;
            request.height_px = 20;
            captures.add(work, scene, request, renderer, replies);
        }
        while (!captures.empty()) captures.advance(renderer, replies);
        std::promise<void> written;
        loader.submit([&] { written.set_value(); });
        written.get_future().wait();
    }
    std::vector<Heard> all;
    while (auto one = heard.try_pop()) all.push_back(std::move(*one));
    return all;
}

TEST(CaptureQueue, WhatTakesLongTellsHowFarItIs) {
    const auto heard = capture_two(110ms);
    std::vector<v1::Progress> first, second;
    for (const Heard& one : heard)
        if (one.message.has_progress()) (one.session == 1 ? first : second).push_back(one.message.progress());
    ASSERT_EQ(first.size(), 1u) << "after half a second of 0.66";
    EXPECT_EQ(first[0].request(), 11u);
    EXPECT_EQ(first[0].jobs_before(), 0u);
    EXPECT_GE(first[0].seconds(), 0.5);
    EXPECT_GE(first[0].samples(), 1u);
    EXPECT_LE(first[0].samples(), 5u);
    EXPECT_EQ(first[0].total(), 6u);
    EXPECT_EQ(first[0].unit(), "tiles");
    const double tiles = first[0].samples();
    EXPECT_NEAR(first[0].seconds_left(), first[0].seconds() * (6 - tiles) / tiles, 1e-9);
    ASSERT_FALSE(second.empty());
    EXPECT_EQ(second[0].request(), 12u);
    EXPECT_EQ(second[0].jobs_before(), 1u);
    EXPECT_EQ(heard.back().session, 2u);
    EXPECT_TRUE(heard.back().message.has_capture());
}

TEST(CaptureQueue, ACaptureIsCancelledByItsOwnClient) {
    const Scene scene = scene_of(make_cornell());
    Replies replies([](std::uint32_t, v1::ServerMessage) {}, scene);
    GuardedRenderer renderer(std::make_unique<SlowTiles>(0ms), [] { return false; });
    Loader loader;
    CaptureQueue captures(loader, [](std::uint32_t, v1::ServerMessage) {});
    Work work{.session = 3};
    CaptureRequest request;
    request.width_px = request.height_px = 16;
    work.message.set_request_id(1);
    captures.add(work, scene, request, renderer, replies);
    work.message.set_request_id(2);
    work.message.mutable_capture()->set_after_rev(1000);
    captures.add_late(work, replies);
    captures.advance(renderer, replies);
    EXPECT_FALSE(captures.cancel(4, 1));
    EXPECT_TRUE(captures.cancel(3, 1));
    EXPECT_TRUE(captures.empty());
    EXPECT_TRUE(captures.cancel(3, 2));
    EXPECT_FALSE(captures.take_due(2000)) << "nor does it wait any more";
    EXPECT_FALSE(captures.cancel(3, 2));
}

TEST(CaptureQueue, WhatIsQuickTellsNothing) {
    for (const Heard& one : capture_two(1ms)) EXPECT_TRUE(one.message.has_capture());
}

}  // namespace
}  // namespace gonio
