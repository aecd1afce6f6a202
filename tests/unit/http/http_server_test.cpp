// The front's WebSocket over real sockets: handshake, requests, video, slow clients.
#include <thread>

#include "protocol/schema/gonio.pb.h"
#include "tests/unit/http/http_fixture.h"

namespace gonio {
namespace {

using namespace test;
using namespace std::chrono_literals;

// ---------------------------------------------------------------------------------------------------- WebSocket

TEST_F(FrontTest, UnknownSubprotocolIs400) {
    start();
    EXPECT_EQ(Client(front->port()).upgrade("gonio.v2.proto"), 400);
    EXPECT_EQ(Client(front->port()).upgrade(""), 400);
    Client second_choice(front->port());
    EXPECT_EQ(second_choice.upgrade("gonio.v9.x, gonio.v1.json"), 101);
    EXPECT_NE(second_choice.head.find("Sec-WebSocket-Protocol: gonio.v1.json\r\n"), std::string::npos);
    EXPECT_EQ(Client(front->port()).get("/v1/ws"), 426);
}

TEST_F(FrontTest, HelloThenReadyInBothEncodings) {
    start();
    for (const std::string_view subprotocol : {kSubprotocolProto, kSubprotocolJson}) {
        Client client(front->port());
        ASSERT_EQ(client.upgrade(subprotocol), 101);
        auto hello = client.read_message();
        ASSERT_TRUE(hello && hello->has_hello());
        EXPECT_EQ(hello->hello().server(), "goniod test");
        client.identify(false, true);
        auto ready = client.read_message();
        ASSERT_TRUE(ready && ready->has_ready());
        EXPECT_EQ(ready->ready().state().scene(), "cornell");
        EXPECT_EQ(ready->ready().video_config().codec(), "avc1.42C020");
        EXPECT_EQ(client.last.opcode, subprotocol == kSubprotocolProto ? 2 : 1);
        v1::StateChanged change;
        change.set_scene_rev(2);
        front->broadcast(change);
        auto changed_message = client.read_message();
        ASSERT_TRUE(changed_message && changed_message->has_state_changed());
        EXPECT_EQ(changed_message->state_changed().scene_rev(), 2u);
    }
}

TEST_F(FrontTest, ReadyWaitsForTheFirstState) {
    start(false);
    Client client(front->port());
    ASSERT_EQ(client.upgrade(kSubprotocolJson), 101);
    ASSERT_TRUE(client.read_message());
    client.identify(false, false);
    EXPECT_FALSE(client.read_message(100));
    front->publish_state(state(1));
    auto ready = client.read_message();
    ASSERT_TRUE(ready && ready->has_ready());
}

TEST_F(FrontTest, IdentifyMustComeFirstAndInTime) {
    options.limits.identify = 300ms;
    start();
    Client silent(front->port());
    ASSERT_EQ(silent.upgrade(kSubprotocolJson), 101);
    ASSERT_TRUE(silent.read_message());
    EXPECT_FALSE(silent.read_message());
    EXPECT_EQ(silent.last.close_code(), 4002);
    for (const char* first : {"{\"stats\":{}}", "nonsense"}) {
        Client hasty(front->port());
        ASSERT_EQ(hasty.upgrade(kSubprotocolJson), 101);
        ASSERT_TRUE(hasty.read_message());
        hasty.send_frame(1, first);
        EXPECT_FALSE(hasty.read_message());
        EXPECT_EQ(hasty.last.close_code(), 4002);
    }
    std::lock_guard lock(mutex);
    EXPECT_TRUE(requests.empty());
}

TEST_F(FrontTest, TheTokenIsAskedFor) {
    options.tokens.all = "correct horse";
    start();
    for (const char* wrong : {"", "correct hors", "correct horsf", "correct horse "}) {
        Client client(front->port());
        ASSERT_EQ(client.upgrade(kSubprotocolProto), 101);
        ASSERT_TRUE(client.read_message());
        client.identify(false, false, wrong);
        EXPECT_FALSE(client.read_message());
        EXPECT_EQ(client.last.close_code(), 4003) << wrong;
    }
    Client client(front->port());
    ASSERT_EQ(client.upgrade(kSubprotocolProto), 101);
    ASSERT_TRUE(client.read_message());
    client.identify(false, false, "correct horse");
    EXPECT_TRUE(client.read_message());
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
    EXPECT_EQ(Client(front->port()).get("/v1/mjpeg"), 401);
    EXPECT_EQ(Client(front->port()).get("/v1/mjpeg", "Authorization: Bearer wrong\r\n"), 401);
    options.limits.still = 100ms;
    EXPECT_NE(Client(front->port()).get("/v1/nothing", "Authorization: Bearer correct horse\r\n"), 401);
}

TEST_F(FrontTest, MalformedMessagesAreAnsweredAndTheConnectionStays) {
    start();
    Client json(front->port());
    json.join(kSubprotocolJson, false, false);
    json.send_frame(1,
                    "{\"request_id\": 7, \"command\": {\"set_light\": {\"name\": \"a\", \"level_ratio\": \"much\"}}}");
    auto answer = json.read_message();
    ASSERT_TRUE(answer && answer->has_result());
    EXPECT_EQ(answer->request_id(), 7u);
    EXPECT_EQ(answer->result().code(), "bad_message");
    EXPECT_EQ(answer->result().field(), "command.set_light.level_ratio");
    EXPECT_EQ(answer->result().value(), "\"much\"");
    for (const auto& [opcode, text] : {std::pair{1, std::string("{{{")},
                                       {1, "{\"request_id\":3}"},
                                       {2, "\x01zz"},
                                       {1, "[" + std::string(5000, '[')}}) {
        json.send_frame(opcode, text);
        answer = json.read_message();
        ASSERT_TRUE(answer && answer->has_result()) << text;
        EXPECT_NE(answer->result().code(), "ok");
    }
    Client proto(front->port());
    proto.join(kSubprotocolProto, false, false);
    for (const auto& [opcode, bytes] :
         {std::pair{2, std::string("\x01\xff\xff\xff")}, {2, ""}, {2, "\x05"}, {1, "{}"}, {2, "\x01"}}) {
        proto.send_frame(opcode, bytes);
        answer = proto.read_message();
        ASSERT_TRUE(answer && answer->has_result());
        EXPECT_NE(answer->result().code(), "ok");
    }
    v1::ClientMessage stats;
    stats.set_request_id(1);
    stats.mutable_stats();
    proto.say(stats);
    EXPECT_TRUE(wait_for([&] { return requests.size() == 1; }));
    json.identify(false, false);  // a second time
    answer = json.read_message();
    ASSERT_TRUE(answer && answer->has_result());
    EXPECT_EQ(answer->result().code(), "unexpected");
}

TEST_F(FrontTest, OversizeClosesWith1009) {
    start();
    Client unknown(front->port());
    ASSERT_EQ(unknown.upgrade(kSubprotocolJson), 101);
    ASSERT_TRUE(unknown.read_message());
    unknown.send_frame(1, std::string(5000, ' '));
    EXPECT_FALSE(unknown.read_message());
    EXPECT_EQ(unknown.last.close_code(), 1009);
    Client known(front->port());
    known.join(kSubprotocolJson, false, false);
    known.send_frame(1, std::string(kMaxMessageBytes + 2, ' '));
    EXPECT_FALSE(known.read_message());
    EXPECT_EQ(known.last.close_code(), 1009);
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

TEST_F(FrontTest, RequestsReachTheDaemonAndAnswersTheAsker) {
    start();
    Client a(front->port()), b(front->port());
    a.join(kSubprotocolJson, false, false);
    b.join(kSubprotocolProto, false, false);
    v1::ClientMessage question;
    question.set_request_id(42);
    question.mutable_meter()->add_point_m(1.5);
    b.say(question);
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; }));
    EXPECT_DOUBLE_EQ(requests[0].second.meter().point_m(0), 1.5);
    v1::ServerMessage answer;
    answer.set_request_id(42);
    answer.mutable_meter()->set_total_lx(250);
    front->reply(requests[0].first, answer);
    front->reply(12345, answer);  // nobody
    auto reading = b.read_message();
    ASSERT_TRUE(reading && reading->has_meter());
    EXPECT_EQ(reading->request_id(), 42u);
    EXPECT_DOUBLE_EQ(reading->meter().total_lx(), 250);
    EXPECT_FALSE(a.read_message(100));
    accept_requests = false;
    a.say(question);
    auto busy = a.read_message();
    ASSERT_TRUE(busy && busy->has_result());
    EXPECT_EQ(busy->result().code(), "busy");
    EXPECT_EQ(busy->request_id(), 42u);
}

TEST_F(FrontTest, OneClientTooManyIs503) {
    options.limits.clients = 2;
    start();
    Client a(front->port()), b(front->port());
    a.join(kSubprotocolJson, false, false);
    b.join(kSubprotocolJson, false, false);
    EXPECT_EQ(Client(front->port()).upgrade(kSubprotocolJson), 503);
    EXPECT_EQ(Client(front->port()).get("/v1/mjpeg"), 503);
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

TEST_F(FrontTest, StoppingSaysGoodbye) {
    start();
    Client client(front->port());
    client.join(kSubprotocolJson, true, true);
    const auto begin = std::chrono::steady_clock::now();
    std::thread stopper([this] { front.reset(); });
    auto goodbye = client.read_message();
    EXPECT_TRUE(goodbye && goodbye->has_goodbye());
    EXPECT_FALSE(client.read_message());
    EXPECT_EQ(client.last.close_code(), 1001);
    stopper.join();
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
}

// ---------------------------------------------------------------------------------------------------- video

TEST_F(FrontTest, TwoViewersSeeTheSamePicture) {
    start();
    Client a(front->port()), b(front->port());
    a.join(kSubprotocolJson, true, false);
    b.join(kSubprotocolProto, true, false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.h264() && d.key() && d.clients == 2; }));
    front->publish_h264(frame(7, true), true);
    for (Client* client : {&a, &b}) {
        const auto packet = client->read_frame();
        ASSERT_EQ(packet.opcode, 2);
        ASSERT_EQ(packet.payload.size(), 32u + 1000u);
        const FrameHeader header = packet.header();
        EXPECT_TRUE(header.key);
        EXPECT_TRUE(header.final);
        EXPECT_EQ(header.seq, 1u);
        EXPECT_EQ(header.scene_rev, 7u);
        EXPECT_EQ(header.rendered_ns, 3'000'000u);
        EXPECT_EQ(header.render_us, 2000u);
        EXPECT_EQ(header.encode_us, 1500u);
        EXPECT_EQ(packet.payload[32], '\x65');
    }
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.h264() && !d.key(); }));
    EXPECT_EQ(front->packets_sent(), 2u);
}

TEST_F(FrontTest, WithoutAcknowledgementTwoFramesThenAKeyFrameWithTheNewest) {
    start();
    Client lazy(front->port()), quick(front->port());
    lazy.join(kSubprotocolJson, true, false);
    quick.join(kSubprotocolJson, true, false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.key() && d.clients == 2; }));
    std::uint32_t quick_frames = 0;
    for (std::uint32_t rev = 1; rev <= 10; ++rev) {
        front->publish_h264(frame(rev, rev == 1), rev == 10);
        const auto packet = quick.read_frame();
        ASSERT_EQ(packet.header().scene_rev, rev);
        quick.acknowledge(packet.seq());
        ++quick_frames;
        ASSERT_TRUE(wait_demand([](const Demand& d) { return d.h264(); }));
    }
    EXPECT_EQ(quick_frames, 10u);  // not slowed down
    EXPECT_EQ(lazy.read_frame().header().scene_rev, 1u);
    const auto second = lazy.read_frame();
    EXPECT_EQ(second.header().scene_rev, 2u);
    EXPECT_EQ(lazy.read_frame(150).opcode, -1);  // no third
    lazy.acknowledge(second.seq());
    EXPECT_EQ(lazy.read_frame(150).opcode, -1);  // a delta would not decode
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.key(); }));
    front->publish_h264(frame(10, true), true);
    const auto newest = lazy.read_frame();
    EXPECT_TRUE(newest.header().key);
    EXPECT_EQ(newest.header().scene_rev, 10u);
    EXPECT_EQ(newest.seq(), 3u);
}

TEST_F(FrontTest, ALoneViewerWithoutCreditStopsTheDemand) {
    start();
    Client viewer(front->port());
    viewer.join(kSubprotocolJson, true, false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.key(); }));
    front->publish_h264(frame(1, true), false);
    front->publish_h264(frame(2, false), false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return !d.h264() && d.clients == 1; }));
    front->publish_h264(frame(3, false), true);  // was in the encoder when the credit ran out: the last of a movement
    EXPECT_EQ(viewer.read_frame().header().scene_rev, 1u);
    EXPECT_EQ(viewer.read_frame().header().scene_rev, 2u);
    EXPECT_EQ(viewer.read_frame(100).opcode, -1);
    viewer.acknowledge(1);
    const auto last = viewer.read_frame();
    EXPECT_EQ(last.header().scene_rev, 3u);  // arrives, and needs no key frame
    EXPECT_FALSE(last.header().key);
    viewer.acknowledge(3);
    EXPECT_TRUE(wait_demand([](const Demand& d) { return d.h264() && !d.key(); }));
}

TEST_F(FrontTest, KeyFramesOnRequestAtMostOncePerInterval) {
    options.limits.key_interval = 400ms;
    start();
    Client viewer(front->port());
    viewer.join(kSubprotocolJson, true, false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.key(); }));
    front->publish_h264(frame(1, true), false);
    viewer.acknowledge(viewer.read_frame().seq());
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.h264() && !d.key(); }));
    const auto begin = std::chrono::steady_clock::now();
    v1::ClientMessage request;
    request.mutable_request_keyframe();
    viewer.say(request);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.key(); }));
    EXPECT_GT(std::chrono::steady_clock::now() - begin, 200ms);
}

TEST_F(FrontTest, ANewSizeStartsWithAKeyFrame) {
    start();
    Client viewer(front->port());
    viewer.join(kSubprotocolJson, true, false);
    front->publish_h264(frame(1, true), false);
    viewer.acknowledge(viewer.read_frame().seq());
    v1::VideoConfig config;
    config.set_width_px(640);
    front->publish_video_config(config);
    front->publish_h264(frame(2, false), false);  // of nobody's stream
    front->publish_h264(frame(3, true), false);
    auto message = viewer.read_message();
    ASSERT_TRUE(message && message->has_video_config());
    EXPECT_EQ(viewer.videos, 0);  // the config comes first
    EXPECT_EQ(viewer.read_frame().header().scene_rev, 3u);
}

TEST_F(FrontTest, AViewerThatLeavesIsForgotten) {
    start();
    {
        Client viewer(front->port());
        viewer.join(kSubprotocolJson, true, true);
        ASSERT_TRUE(wait_demand([](const Demand& d) { return d.h264() && d.clients == 1; }));
    }
    EXPECT_TRUE(wait_demand([](const Demand& d) { return !d.h264() && d.clients == 0; }));
    front->publish_h264(frame(1, true), true);
    front->broadcast({});
    EXPECT_EQ(Client(front->port()).get("/healthz"), 200);
}

// ---------------------------------------------------------------------------------------------------- slow clients

struct StateQueue {
    const char* name;
    std::size_t messages, bytes;
};
struct FrontStateQueues : FrontTest, testing::WithParamInterface<StateQueue> {};

TEST_P(FrontStateQueues, AReaderThatStopsGetsOneWholeStateInsteadOfManyChanges) {
    options.limits.queued_messages = GetParam().messages;
    options.limits.queued_bytes = GetParam().bytes;
    options.limits.write_stall = 20s;
    start();
    Client slow(front->port(), 4096);
    slow.join(kSubprotocolProto, false, true);
    v1::StateChanged change;
    change.mutable_state()->set_scene(std::string(60000, 'x'));
    constexpr std::uint32_t kChanges = 200;  // 12 MB: more than the kernel takes
    for (std::uint32_t rev = 2; rev <= kChanges; ++rev) {
        v1::State now = state(rev);
        front->publish_state(now);
        change.set_scene_rev(rev);
        front->broadcast(change);
    }
    std::uint32_t messages = 0, newest = 0;
    bool whole = false;
    while (newest < kChanges) {
        auto message = slow.read_message();
        ASSERT_TRUE(message);
        ++messages;
        if (message->has_ready()) {
            whole = true;
            newest = message->ready().state().scene_rev();
        } else {
            EXPECT_GT(message->state_changed().scene_rev(), newest);
            newest = message->state_changed().scene_rev();
        }
    }
    EXPECT_TRUE(whole);
    EXPECT_LT(messages, kChanges);
    EXPECT_EQ(newest, kChanges);
}

INSTANTIATE_TEST_SUITE_P(Bounds, FrontStateQueues,
                         testing::Values(StateQueue{"Messages", 16, 64 << 20}, StateQueue{"Bytes", 256, 1 << 20}),
                         [](const auto& test) { return std::string(test.param.name); });

// A change of more bytes than may wait is told as the whole state, at once, also where nothing else is being sent.
TEST_F(FrontTest, AChangeBeyondTheBoundDoesNotWaitForTheNext) {
    options.limits.queued_bytes = 1 << 16;
    start();
    Client viewer(front->port());
    viewer.join(kSubprotocolProto, false, true);
    v1::StateChanged change;
    change.set_scene_rev(7);
    change.mutable_state()->set_scene(std::string(1 << 17, 'x'));
    front->publish_state(state(7));
    front->broadcast(change);
    const auto message = viewer.read_message();
    ASSERT_TRUE(message && message->has_ready());
    EXPECT_EQ(message->ready().state().scene_rev(), 7u);
}

TEST_F(FrontTest, AReaderThatStopsIsDropped) {
    options.limits.write_stall = 300ms;
    start();
    Client slow(front->port(), 4096);
    slow.join(kSubprotocolProto, true, false);
    ASSERT_TRUE(wait_demand([](const Demand& d) { return d.clients == 1; }));
    front->publish_h264(frame(1, true, 8 << 20), false);
    EXPECT_TRUE(wait_demand([](const Demand& d) { return d.clients == 0; }));
}

TEST_F(FrontTest, ASilentClientIsPingedThenDropped) {
    options.limits.ping = 100ms;
    options.limits.dead = 400ms;
    start();
    Client silent(front->port());
    silent.join(kSubprotocolJson, false, false);
    silent.keeps_pings = true;
    EXPECT_EQ(silent.read_frame(1000).opcode, 9);  // never answered
    EXPECT_TRUE(wait_demand([](const Demand& d) { return d.clients == 0; }));
}

TEST_F(FrontTest, WhoSendsOrTakesALongMessageSlowlyIsNotSilent) {
    options.limits.ping = 100ms;
    options.limits.dead = 400ms;
    start();
    Client sender(front->port());
    sender.join(kSubprotocolJson, false, false);
    const std::string bytes = Client::frame(1, R"({"request_id":1,"stats":{}})" + std::string(20'000, ' '));
    for (std::size_t at = 0; at < bytes.size(); at += 1000) {  // over a second
        sender.send(bytes.substr(at, 1000));
        std::this_thread::sleep_for(50ms);
    }
    ASSERT_TRUE(wait_for([&] { return requests.size() == 1; })) << "it was dropped in the middle of its message";
    Client taker(front->port(), 4096);
    taker.join(kSubprotocolProto, false, false);
    v1::ClientMessage query;
    query.set_request_id(1);
    query.mutable_capture();
    taker.say(query);
    ASSERT_TRUE(wait_for([&] { return requests.size() == 2; }));
    v1::ServerMessage answer;
    answer.set_request_id(1);
    answer.mutable_capture()->set_image(std::string(8 << 20, 'x'));
    front->reply(requests[1].first, answer);
    const auto began = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - began < 1s) {
        ASSERT_TRUE(taker.receive()) << "it was dropped in the middle of its answer";
        std::this_thread::sleep_for(20ms);
    }
    const auto whole = taker.read_message();
    EXPECT_TRUE(whole && whole->has_capture());
}

TEST_F(FrontTest, PublishingFromManyThreadsIsSafe) {
    start();
    Client viewer(front->port());
    viewer.join(kSubprotocolJson, false, true);
    std::vector<std::thread> threads;
    for (int thread = 0; thread < 4; ++thread)
        threads.emplace_back([this] {
            v1::StateChanged change;
            change.set_scene_rev(2);
            for (std::uint32_t i = 0; i < 50; ++i) {
                front->publish_state(state(1));
                front->broadcast(change);
                front->publish_h264(frame(i, true), false);
                front->publish_jpeg(frame(i, true));
            }
        });
    for (auto& thread : threads) thread.join();
    for (int i = 0; i < 200; ++i) ASSERT_TRUE(viewer.read_message());
}

}  // namespace
}  // namespace gonio
