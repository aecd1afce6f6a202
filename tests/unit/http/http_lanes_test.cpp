// Lanes over real sockets: who gets whose frames, what a viewer is told when its lane or its encoder changes.
#include <condition_variable>
#include <memory>
#include <mutex>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/http/http_server.h"
#include "tests/unit/http_client.h"

namespace gonio {
namespace {

using test::Client;
using namespace std::chrono_literals;

struct FrontLanesTest : testing::Test {
    std::unique_ptr<HttpServer> front;
    std::mutex mutex;
    std::condition_variable changed;
    Demand demand;

    void start(unsigned private_lanes) {
        HttpOptions options;
        options.port = 0;
        options.encoder = "libx264";
        options.private_lanes = private_lanes;
        HttpServer::Callbacks callbacks;
        callbacks.demand = [this](Demand now) {
            std::lock_guard lock(mutex);
            demand = std::move(now);
            changed.notify_all();
        };
        auto started = HttpServer::start(options, std::move(callbacks));
        ASSERT_TRUE(started) << started.error().text();
        front = std::move(*started);
        v1::State state;
        state.set_scene_rev(1);
        front->publish_state(state);
        stream(kFirstPrivateLane, "libx264");
    }
    ~FrontLanesTest() override { front.reset(); }
    void stream(LaneId lane, const char* encoder) {
        v1::VideoConfig config;
        config.set_codec("avc1.42C020");
        config.set_encoder(encoder);
        config.set_width_px(800);
        config.set_height_px(800);
        front->publish_video_config(config, lane);
    }
    void publish(LaneId lane, std::uint32_t rev, bool key) {
        EncodedFrame frame;
        frame.lane = lane;
        frame.key = key;
        frame.scene_rev = rev;
        frame.data.assign(100, std::byte{0x65});
        front->publish_h264(std::move(frame), false);
    }
    template <typename Condition>
    bool wait_for(const Condition& condition) {
        std::unique_lock lock(mutex);
        return changed.wait_for(lock, 3s, [&] { return condition(demand); });
    }
    static const LaneRequest* request(const Demand& demand, LaneId lane) {
        for (const LaneRequest& one : demand.lanes)
            if (one.lane == lane) return &one;
        return nullptr;
    }
};

TEST_F(FrontLanesTest, ViewersGetTheFramesOfTheirLaneAlone) {
    start(1);
    Client own(front->port()), shared(front->port());
    const v1::Ready first = own.join(kSubprotocolProto, true, false);
    EXPECT_EQ(first.video_config().lane(), "private");
    EXPECT_EQ(first.video_config().encoder(), "libx264");
    const v1::Ready second = shared.join(kSubprotocolJson, true, false);
    EXPECT_EQ(second.video_config().lane(), "shared");
    EXPECT_EQ(second.video_config().codec(), "avc1.42C020") << "what others make, until its lane has an encoder";
    ASSERT_TRUE(wait_for([](const Demand& d) { return request(d, kFirstPrivateLane) && request(d, kSharedLane); }));
    publish(kFirstPrivateLane, 5, true);
    publish(kSharedLane, 6, true);
    const auto a = own.read_frame(), b = shared.read_frame();
    EXPECT_EQ(a.header().scene_rev, 5u);
    EXPECT_EQ(a.header().lane, kFirstPrivateLane);
    EXPECT_EQ(b.header().scene_rev, 6u);
    EXPECT_EQ(b.header().lane, kSharedLane);
    EXPECT_EQ(own.read_frame(50).opcode, -1);
}

TEST_F(FrontLanesTest, MetricsTellOfEncoderAndLanes) {
    start(1);
    Client own(front->port()), shared(front->port()), scraper(front->port());
    own.join(kSubprotocolProto, true, false);
    shared.join(kSubprotocolProto, true, false);
    publish(kFirstPrivateLane, 5, true);
    EXPECT_EQ(own.read_frame().header().scene_rev, 5u);
    publish(kFirstPrivateLane, 6, false);
    EXPECT_EQ(own.read_frame().header().scene_rev, 6u);
    ASSERT_EQ(scraper.get("/metrics"), 200);
    for (const char* line :
         {"gonio_encoder_info{encoder=\"libx264\"} 1\n", "gonio_encoder_info{encoder=\"h264_nvenc\"} 0\n",
          "gonio_lane_viewers{lane=\"private\"} 1\n", "gonio_lane_viewers{lane=\"shared\"} 1\n",
          "gonio_lane_viewers{lane=\"low\"} 0\n", "gonio_idr_total{lane=\"private\"} 1\n",
          "gonio_frames_encoded_total{codec=\"h264\",lane=\"private\"} 2\n", "gonio_client_gated_total 0\n",
          "# TYPE gonio_send_seconds histogram\n", "gonio_send_seconds_count 2\n"})
        EXPECT_NE(scraper.body.find(line), std::string::npos) << line << scraper.body;
    // Two frames are on their way until they are acknowledged.
    const std::string in_flight = "gonio_inflight_bytes " + std::to_string(2 * (100 + kFrameHeaderBytes)) + "\n";
    EXPECT_NE(scraper.body.find(in_flight), std::string::npos) << in_flight << scraper.body;
    own.acknowledge(2);
    for (int i = 0; i < 100 && scraper.body.find("gonio_inflight_bytes 0\n") == std::string::npos; ++i)
        ASSERT_EQ(scraper.get("/metrics"), 200);
    EXPECT_NE(scraper.body.find("gonio_inflight_bytes 0\n"), std::string::npos) << scraper.body;
}

TEST_F(FrontLanesTest, PartsOfMjpegAreCountedAsSent) {
    start(1);
    Client viewer(front->port()), scraper(front->port());
    viewer.send("GET /v1/mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(viewer.receive_until("image/jpeg\r\n\r\n"));
    EncodedFrame picture;
    picture.data.assign(4, std::byte{'e'});
    picture.rendered_ns = picture.began_ns = picture.encoded_ns = 5'000'000;
    front->publish_jpeg(picture);
    ASSERT_TRUE(viewer.receive_until("eeee\r\n--gonio-frame"));
    for (int i = 0; i < 100 && scraper.body.find("gonio_send_seconds_count 1\n") == std::string::npos; ++i)
        ASSERT_EQ(scraper.get("/metrics"), 200);
    EXPECT_NE(scraper.body.find("gonio_send_seconds_count 1\n"), std::string::npos) << scraper.body;
}

TEST_F(FrontLanesTest, APromotedViewerIsToldAndBeginsWithAKeyFrame) {
    start(1);
    auto own = std::make_unique<Client>(front->port());
    Client shared(front->port());
    own->join(kSubprotocolProto, true, false);
    shared.join(kSubprotocolProto, true, false);
    publish(kSharedLane, 1, true);
    EXPECT_EQ(shared.read_frame().seq(), 1u);
    own.reset();
    const auto told = shared.read_message();
    ASSERT_TRUE(told && told->has_video_config());
    EXPECT_EQ(told->video_config().lane(), "private");
    ASSERT_TRUE(
        wait_for([](const Demand& d) { return request(d, kFirstPrivateLane) && request(d, kFirstPrivateLane)->key; }));
    publish(kSharedLane, 2, false);        // of the lane that it left
    publish(kFirstPrivateLane, 3, false);  // nothing to begin with
    publish(kFirstPrivateLane, 4, true);
    const auto frame = shared.read_frame();
    EXPECT_EQ(frame.header().scene_rev, 4u);
    EXPECT_EQ(frame.seq(), 2u) << "its frames are counted on";
}

TEST_F(FrontLanesTest, AnotherEncoderIsTold) {
    start(1);
    Client viewer(front->port());
    viewer.join(kSubprotocolProto, true, false);
    stream(kFirstPrivateLane, "libx264");  // what it knows already
    publish(kFirstPrivateLane, 1, true);
    EXPECT_EQ(viewer.read_frame().header().scene_rev, 1u);
    stream(kFirstPrivateLane, "h264_nvenc");
    const auto told = viewer.read_message();
    ASSERT_TRUE(told && told->has_video_config());
    EXPECT_EQ(told->video_config().encoder(), "h264_nvenc");
    publish(kFirstPrivateLane, 2, false);
    publish(kFirstPrivateLane, 3, true);
    EXPECT_EQ(viewer.read_frame().header().scene_rev, 3u);
}

TEST_F(FrontLanesTest, WithoutH264ViewersAreSentToMjpeg) {
    start(1);
    Client viewer(front->port());
    viewer.join(kSubprotocolProto, true, false);
    front->stop_h264();
    const auto told = viewer.read_message();
    ASSERT_TRUE(told && told->has_video_config());
    EXPECT_EQ(told->video_config().encoder(), "mjpeg");
    EXPECT_EQ(told->video_config().codec(), "");
    EXPECT_TRUE(wait_for([](const Demand& d) { return d.lanes.empty() && d.clients == 1; }));
    Client late(front->port());
    ASSERT_EQ(late.upgrade(kSubprotocolJson), 101);
    const auto hello = late.read_message();
    ASSERT_TRUE(hello && hello->has_hello());
    EXPECT_EQ(hello->hello().encoder(), "mjpeg");
    for (const std::string& feature : hello->hello().features()) EXPECT_NE(feature, "h264");
}

// A client that acknowledges late but says that its decoder was slow is on a wide link all the same.
TEST_F(FrontLanesTest, TheBudgetFollowsTheAcknowledgements) {
    start(1);
    Client viewer(front->port());
    viewer.join(kSubprotocolProto, true, false);
    const auto run = [&](std::uint32_t decode_us) {
        for (std::uint32_t rev = 0; rev < 16; ++rev) {
            EncodedFrame frame;
            frame.lane = kFirstPrivateLane;
            frame.key = rev == 0;
            frame.data.assign(20'000, std::byte{0x65});
            front->publish_h264(std::move(frame), false);
            const auto received = viewer.read_frame();
            ASSERT_EQ(received.opcode, 2);
            std::this_thread::sleep_for(25ms);
            v1::ClientMessage message;
            message.mutable_frame_ack()->set_seq(received.seq());
            message.mutable_frame_ack()->set_decode_us(decode_us);
            viewer.say(message);
        }
    };
    viewer.keeps_pings = false;
    run(25'000);
    EXPECT_TRUE(wait_for([](const Demand& d) {
        return request(d, kFirstPrivateLane) && request(d, kFirstPrivateLane)->credit == 2 &&
               request(d, kFirstPrivateLane)->frames == 16;
    }));
    std::lock_guard lock(mutex);
    const std::uint32_t budget = request(demand, kFirstPrivateLane)->budget_bytes;
    EXPECT_TRUE(budget == 0 || budget > 40'000) << budget;
}

}  // namespace
}  // namespace gonio
