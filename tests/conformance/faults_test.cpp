// What goes wrong with connections: headers that never end, peers that vanish at any point, storms of reconnects. After
// each the front serves others, and nothing of the broken ones is left: no descriptor, no session, no memory that
// grows.
#include <gtest/gtest.h>
#include <malloc.h>

#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/conformance/played_daemon.h"
#include "tests/conformance/raw_peer.h"

namespace gonio::conformance {
namespace {

using namespace std::chrono_literals;

constexpr auto kSoon = 3s;

HttpLimits limits_of_tests() {
    HttpLimits limits;
    limits.clients = 2000;
    limits.connections = 2000;
    limits.header = 1000ms;
    limits.identify = 1000ms;
    limits.ping = 500ms;
    limits.dead = 1500ms;
    limits.write_stall = 1000ms;
    return limits;
}

std::string get(std::uint16_t port, const std::string& target) {
    return "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
}

// Result: how long /healthz takes on a connection of its own; nothing where it is not answered within 3 s.
std::optional<std::chrono::microseconds> health(std::uint16_t port) {
    const auto began = Clock::now();
    RawPeer peer(port);
    peer.send(get(port, "/healthz"));
    if (!peer.read_head(began + kSoon).starts_with("HTTP/1.1 200 ")) return std::nullopt;
    return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - began);
}

std::string identify(bool video) {
    return frame(kText, std::string(R"({"identify":{"client":"fault","state":true,"video":)") +
                            (video ? "true" : "false") + "}}");
}

// A client that has got as far as Ready.
bool join(RawPeer& peer, std::uint16_t port, bool video) {
    peer.send(handshake(port, "gonio.v1.json"));
    if (!peer.read_head(Clock::now() + kSoon).starts_with("HTTP/1.1 101 ")) return false;
    peer.send(identify(video));
    return peer.read_frame(Clock::now() + kSoon).opcode == kText &&  // Hello
           peer.read_frame(Clock::now() + kSoon).opcode == kText;    // Ready
}

struct Faults : testing::Test {
    PlayedDaemon daemon{limits_of_tests()};
    const std::uint16_t port = daemon.port();
    std::size_t descriptors = 0;

    void SetUp() override {
        raise_descriptor_limit();
        descriptors = open_descriptors();
        ASSERT_TRUE(health(port));
        ASSERT_TRUE(wait_for_descriptors(descriptors)) << "the server's end of that";
    }
    void TearDown() override {
        EXPECT_TRUE(daemon.wait_until_alone(5s)) << "somebody who has left is still known";
        EXPECT_TRUE(wait_for_descriptors(descriptors)) << open_descriptors() << " descriptors, before " << descriptors;
        EXPECT_TRUE(health(port));
    }
    static bool wait_for_descriptors(std::size_t most) {
        for (const auto until = Clock::now() + 5s; open_descriptors() > most;) {
            if (Clock::now() > until) return false;
            std::this_thread::sleep_for(5ms);
        }
        return true;
    }
};

TEST_F(Faults, SlowHeadersAreClosedInTimeAndHinderNobody) {
    std::vector<std::unique_ptr<RawPeer>> slow;
    const auto began = Clock::now();
    for (int i = 0; i < 800; ++i) {
        slow.push_back(std::make_unique<RawPeer>(port));
        ASSERT_TRUE(slow.back()->connected());
        slow.back()->send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n");
    }
    // They go on with a header line now and then: it is the whole header that must come in time.
    std::chrono::microseconds longest{0};
    for (int round = 0; round < 4; ++round) {
        for (const auto& peer : slow) peer->send("X-" + std::to_string(round) + ": y\r\n");
        const auto took = health(port);
        ASSERT_TRUE(took) << "not available in round " << round;
        longest = std::max(longest, *took);
        std::this_thread::sleep_for(100ms);
    }
    for (const auto& peer : slow) ASSERT_TRUE(peer->read_end(began + 5s));
    EXPECT_LT(longest, 1s);
    RecordProperty("longest_health_us", static_cast<int>(longest.count()));
}

TEST_F(Faults, HalfOpenPeersAreDropped) {
    std::vector<std::unique_ptr<RawPeer>> silent;
    for (int i = 0; i < 50; ++i) {
        silent.push_back(std::make_unique<RawPeer>(port));
        ASSERT_TRUE(join(*silent.back(), port, i % 2 == 0));
    }
    // They neither read nor write any more: their pings go unanswered.
    const auto began = Clock::now();
    EXPECT_TRUE(daemon.wait_until_alone(5s));
    EXPECT_GT(Clock::now() - began, 1s) << "dropped before the time of silence was over";
}

TEST_F(Faults, APeerThatNeverReadsIsDroppedWhileOthersGetEveryFrame) {
    RawPeer deaf(port, 4096), reader(port);
    ASSERT_TRUE(join(deaf, port, true));
    ASSERT_TRUE(join(reader, port, true));
    for (std::uint32_t rev = 2; rev < 42; ++rev) {
        daemon.publish(rev, true, 400'000);  // more than the kernel keeps for the deaf one
        HeardFrame heard;
        do heard = reader.read_frame(Clock::now() + kSoon);
        while (heard.opcode == kText || heard.opcode == kPing);
        ASSERT_EQ(heard.opcode, kBinary) << "no frame of revision " << rev;
        reader.send(frame(kText, R"({"frame_ack":{"seq":)" + std::to_string(rev - 1) + "}}"));
    }
    for (const auto until = Clock::now() + 5s; daemon.clients() > 1 && Clock::now() < until;)
        std::this_thread::sleep_for(10ms);
    EXPECT_EQ(daemon.clients(), 1u) << "the one that does not read is still there";
}

TEST_F(Faults, ADisconnectAtEveryStageLeavesNothing) {
    const std::string request = handshake(port, "gonio.v1.json");
    for (const bool reset : {false, true}) {
        const auto leave = [&](RawPeer& peer) {
            if (reset) peer.reset();
        };
        for (std::size_t sent :
             {std::size_t{0}, std::size_t{1}, request.size() / 2, request.size() - 1, request.size()}) {
            RawPeer peer(port);  // in the middle of the header and of the upgrade
            peer.send(request.substr(0, sent));
            leave(peer);
        }
        const std::string message = frame(kText, R"({"request_id":7,"profile":{"light":"xxxxxxxxxxxxxxxxx"}})");
        for (std::size_t sent : {std::size_t{0}, std::size_t{1}, std::size_t{5}, message.size() / 2, message.size()}) {
            RawPeer peer(port);  // in the middle of a frame, and with its answer on the way
            ASSERT_TRUE(join(peer, port, true));
            peer.send(message.substr(0, sent));
            leave(peer);
        }
        {
            RawPeer peer(port);  // in the middle of a video frame that is being written
            ASSERT_TRUE(join(peer, port, true));
            daemon.publish(2, true, 4'000'000);
            ASSERT_FALSE(peer.read_bytes(1000, Clock::now() + kSoon).empty());
            leave(peer);
        }
        const unsigned asked = daemon.captures_asked();
        {
            RawPeer peer(port);  // while its still is being rendered
            peer.send(get(port, "/v1/frame.png"));
            ASSERT_TRUE(daemon.wait_for_captures(asked + 1, kSoon));
            leave(peer);
        }
        {
            RawPeer peer(port);  // in the MJPEG stream
            peer.send(get(port, "/v1/mjpeg"));
            ASSERT_TRUE(peer.read_head(Clock::now() + kSoon).starts_with("HTTP/1.1 200 "));
            leave(peer);
        }
    }
}

TEST_F(Faults, PipelinedRequestsAreAnsweredInOrder) {
    RawPeer peer(port);
    std::string requests;
    for (int i = 0; i < 50; ++i) requests += get(port, i % 2 == 0 ? "/healthz" : "/nothing");
    peer.send(requests);
    for (int i = 0; i < 50; ++i) {
        const std::string head = peer.read_head(Clock::now() + kSoon);
        ASSERT_TRUE(head.starts_with(i % 2 == 0 ? "HTTP/1.1 200 " : "HTTP/1.1 404 ")) << i << ": " << head;
        const std::size_t length = head.find("Content-Length: ");
        ASSERT_NE(length, std::string::npos);
        const std::size_t bytes = std::stoul(head.substr(length + 16));
        ASSERT_EQ(peer.read_bytes(bytes, Clock::now() + kSoon).size(), bytes);
    }
}

TEST_F(Faults, AStormOfReconnectsLeavesNoMemory) {
    std::mt19937 random(6455);
    const std::string request = handshake(port, "gonio.v1.json");
    const auto storm = [&](int connects) {
        std::vector<std::unique_ptr<RawPeer>> open;
        for (int i = 0; i < connects; ++i) {
            auto peer = std::make_unique<RawPeer>(port);
            ASSERT_TRUE(peer->connected());
            switch (random() % 5) {
                case 0:
                    break;
                case 1:
                    peer->send(request.substr(0, random() % request.size()));
                    break;
                case 2:
                    peer->send(request);
                    break;
                case 3:
                    peer->send(request);
                    peer->read_head(Clock::now() + kSoon);
                    peer->send(identify(true).substr(0, random() % 40));
                    break;
                default:
                    EXPECT_TRUE(join(*peer, port, random() % 2 == 0));
            }
            if (random() % 3 == 0) peer->reset();
            open.push_back(std::move(peer));
            if (open.size() > 64) open.erase(open.begin() + static_cast<std::ptrdiff_t>(random() % open.size()));
        }
    };
    const auto in_use = [] { return static_cast<std::int64_t>(mallinfo2().uordblks); };
    storm(500);  // the first storm fills caches
    ASSERT_TRUE(daemon.wait_until_alone(5s));
    ASSERT_TRUE(wait_for_descriptors(descriptors));
    const std::int64_t before = in_use();
    for (int i = 0; i < 3; ++i) storm(500);
    ASSERT_TRUE(daemon.wait_until_alone(5s));
    ASSERT_TRUE(wait_for_descriptors(descriptors));
    const std::int64_t grown = in_use() - before;
    EXPECT_LT(grown, 256 << 10) << "bytes grown in 1,500 connections";
    RecordProperty("grown_bytes", static_cast<int>(grown));
}

}  // namespace
}  // namespace gonio::conformance
