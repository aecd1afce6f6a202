// The OSC server on real sockets of the loopback interface: what clients that leave, stay or flood cost the others.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/resource.h>

#include <chrono>
#include <ctime>
#include <functional>

#include "protocol/schema/console.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/inputs/osc_server.h"
#include "tests/console/udp.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::int64_t monotonic() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

// The NTP time tag of a moment from now.
std::uint64_t tag_in(std::chrono::milliseconds time) {
    const auto due = std::chrono::system_clock::now().time_since_epoch() + time;
    const auto ns = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(due).count());
    return (ns / 1'000'000'000 + 2'208'988'800) << 32 | ((ns % 1'000'000'000) << 32) / 1'000'000'000;
}

test::Packet bundle_at(std::uint64_t tag, const std::vector<OscMessage>& messages) {
    test::Packet packet = encode_osc_bundle(messages);
    for (std::size_t i = 0; i < 8; ++i) packet[8 + i] = static_cast<std::uint8_t>(tag >> (56 - 8 * i));
    return packet;
}

test::Packet packet_of(const std::string& address, std::vector<OscArgument> arguments = {}) {
    return encode_osc({kOscImmediately, address, std::move(arguments)});
}

// A TCP client with OSC 1.0 framing.
class Tcp {
public:
    explicit Tcp(std::uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_port = htons(port);
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        if (connect(fd_.fd(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
            throw std::runtime_error("connect");
        fcntl(fd_.fd(), F_SETFL, O_NONBLOCK);
    }
    void send(const test::Packet& packet) {
        test::Packet framed(4);
        test::put16(framed, 2, static_cast<unsigned>(packet.size()));
        framed.insert(framed.end(), packet.begin(), packet.end());
        ASSERT_EQ(write(fd_.fd(), framed.data(), framed.size()), static_cast<ssize_t>(framed.size()));
    }
    // Result: bytes that waited; 0: the server closed; nothing: neither.
    std::optional<std::size_t> receive() {
        std::array<char, 65536> buffer;
        const ssize_t size = read(fd_.fd(), buffer.data(), buffer.size());
        if (size < 0) return errno == EAGAIN ? std::nullopt : std::optional<std::size_t>(0);
        return static_cast<std::size_t>(size);
    }

private:
    Descriptor fd_;
};

class OscServers : public testing::Test {
protected:
    void SetUp() override {
        auto opened = OscServer::open({INADDR_LOOPBACK, 0}, watch,
                                      [this](const OscClient&, const std::string& address, OscSet values) {
                                          heard.emplace_back(address, std::move(values));
                                          return true;
                                      });
        ASSERT_TRUE(opened) << opened.error().text();
        server = std::move(*opened);
        port = server->address().port;
        v1::State state;
        for (int i = 0; i < 64; ++i) {
            v1::Light& light = *state.add_lights();
            light.set_name("light " + std::to_string(i));
            for (int k = 0; k < 3; ++k) light.add_color_rgb(1), light.add_position(0), light.add_aim(0);
        }
        server->publish_state(std::move(state));
    }
    // Serves until it is done, 2 s at most. Result: whether it was.
    bool serve(const std::function<bool()>& done) {
        for (const auto end = Clock::now() + 2s; Clock::now() < end;) {
            watch.wait(5);
            server->tick(monotonic());
            if (done()) return true;
        }
        return false;
    }
    void serve_for(std::chrono::milliseconds time) {
        for (const auto end = Clock::now() + time; Clock::now() < end;) {
            watch.wait(5);
            server->tick(monotonic());
        }
    }
    v1::InputEndpoint endpoint() {
        v1::Sources table;
        server->describe(table, monotonic());
        return table.endpoints(0);
    }
    unsigned packets() { return endpoint().packets(); }
    void send(const test::Udp& from, const test::Packet& packet) { from.send("127.0.0.1", port, packet); }

    Watch watch;
    std::unique_ptr<OscServer> server;
    std::uint16_t port = 0;
    std::vector<std::pair<std::string, OscSet>> heard;
};

TEST_F(OscServers, AClientThatHasGoneTakesNoPlaceAmongTheSubscribers) {
    const std::uint64_t due = tag_in(400ms);
    for (unsigned i = 0; i < kMaxOscSubscribers + 4; ++i) {
        Tcp client(port);
        client.send(
            bundle_at(due, {{kOscImmediately, "/gonio/subscribe", {}}, {kOscImmediately, "/light/a/level", {0.5F}}}));
        ASSERT_TRUE(serve([&] { return packets() == i + 1; }));
    }
    ASSERT_TRUE(serve([&] { return heard.size() == kMaxOscSubscribers + 4; })) << "what they set is set in time";
    const test::Udp watcher;
    send(watcher, packet_of("/gonio/subscribe"));
    serve_for(50ms);
    EXPECT_EQ(endpoint().refused_sources(), 0u) << endpoint().last_error();
    EXPECT_TRUE(watcher.receive(100ms)) << "the one who is there is told";
}

TEST_F(OscServers, WithoutDescriptorsItPausesInsteadOfTurningRound) {
    Tcp client(port);
    rlimit before{};
    getrlimit(RLIMIT_NOFILE, &before);
    rlimit none = before;
    const int free = dup(0);
    close(free);
    none.rlim_cur = static_cast<rlim_t>(free);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
    watch.wait(1000);  // accept fails
    const auto begin = Clock::now();
    watch.wait(150);
    const auto waited = Clock::now() - begin;
    setrlimit(RLIMIT_NOFILE, &before);
    EXPECT_GE(waited, 140ms) << "the caller that cannot be accepted keeps nobody busy";
    EXPECT_NE(endpoint().last_error().find("accept"), std::string::npos) << endpoint().last_error();
    client.send(packet_of("/gonio/ping"));
    server->tick(monotonic() + 2 * kOscPause_ns);
    std::optional<std::size_t> answer;
    EXPECT_TRUE(serve([&] { return (answer = client.receive()).has_value(); }));
    EXPECT_GT(answer.value_or(0), 0u) << "then it is served";
}

TEST_F(OscServers, AnIdleTcpClientIsClosedASubscriberStays) {
    Tcp idle(port), half(port), subscriber(port);
    subscriber.send(packet_of("/gonio/subscribe"));
    ASSERT_TRUE(serve([&] { return packets() == 1; }));
    serve_for(50ms);
    while (subscriber.receive()) {
    }
    server->tick(monotonic() + kOscIdle_ns - 1'000'000'000);
    serve_for(30ms);
    EXPECT_FALSE(idle.receive()) << "not yet";
    server->tick(monotonic() + kOscIdle_ns + 1'000'000'000);
    EXPECT_TRUE(serve([&] { return idle.receive() == 0u; }));
    EXPECT_TRUE(serve([&] { return half.receive() == 0u; }));
    EXPECT_FALSE(subscriber.receive());
}

// Whoever has not subscribed may be somebody else whose address was forged: no answer is over four times the question.
TEST_F(OscServers, WhoHasNotSubscribedGetsLittleMoreThanTheyAsked) {
    const test::Udp asking;
    for (const char* question :
         {"/*", "/light/*/level", "/light/*/*", "/light/light%203/level", "/light/light%203/*"}) {
        const auto packet = packet_of(question);
        const unsigned before = packets();
        send(asking, packet);
        ASSERT_TRUE(serve([&] { return packets() == before + 1; }));
        std::size_t answered = 0;
        while (const auto answer = asking.receive(20ms)) answered += answer->size();
        EXPECT_LE(answered, kOscAmplification * packet.size()) << question;
        EXPECT_EQ(answered > 0, std::string(question) == "/light/light%203/level") << question;
    }
}

// 24 bytes that ask for all of every light, of one address: half a megabyte a second and no more.
TEST_F(OscServers, AnswersOverUdpAreBounded) {
    const test::Udp asking;
    send(asking, packet_of("/gonio/subscribe"));
    serve_for(100ms);
    while (asking.receive(0ms)) {
    }
    send(asking, packet_of("/light/*/*"));
    serve_for(1100ms);
    double answer = 0;  // bytes
    while (const auto packet = asking.receive(0ms)) answer += static_cast<double>(packet->size());
    ASSERT_GT(answer, 30e3);
    const unsigned subscribed = packets();
    const auto begin = Clock::now();
    for (unsigned i = 0; i < 200; ++i) {
        send(asking, packet_of("/light/*/*"));
        if (i % 20 == 19) {
            ASSERT_TRUE(serve([&] { return packets() == subscribed + i + 1; }));
        }
    }
    const double time_s = std::chrono::duration<double>(Clock::now() - begin).count();
    const unsigned answered = 200 - endpoint().refused_sources();
    EXPECT_GE(answered * answer, kOscAddressBytes / 2) << "what people ask for is answered";
    EXPECT_LE(answered * answer, (1.0 + time_s) * kOscAddressBytes);
}

TEST_F(OscServers, WhoSubscribesAgainAndAgainIsToldEverythingOnce) {
    const test::Udp watcher;
    for (int i = 0; i < 10; ++i) {
        send(watcher, packet_of("/gonio/subscribe"));
        serve_for(30ms);
    }
    int told = 0;
    while (const auto packet = watcher.receive(0ms)) {
        const auto messages = decode_osc(*packet);
        ASSERT_TRUE(messages);
        for (const OscMessage& message : *messages) told += message.address == "/master" ? 1 : 0;
    }
    EXPECT_EQ(told, 1);
}

TEST_F(OscServers, PatternsOfOnePacketCostMilliseconds) {
    std::vector<OscMessage> messages;
    for (int i = 0; i < 30; ++i) {
        std::string evil = "/light/";
        for (int k = 0; k < 240; ++k) evil += "*l";
        messages.push_back({kOscImmediately, evil + "/*", {}});
    }
    const test::Udp asking;
    send(asking, encode_osc_bundle(messages));
    send(asking, packet_of("/gonio/ping"));
    const auto begin = Clock::now();
    ASSERT_TRUE(serve([&] { return packets() == 2; }));
    const auto time = Clock::now() - begin;
    EXPECT_LT(time, 100ms);
    EXPECT_GT(endpoint().refused_sources(), 20u) << "beyond the budget they are refused";
    EXPECT_TRUE(asking.receive(200ms)) << "who comes behind is answered";
}

TEST_F(OscServers, WhatWaitsForItsTimeIsSmall) {
    const test::Udp panel;
    send(panel, bundle_at(tag_in(100ms), {{kOscImmediately, "/light/a/profile", {std::string(3000, 'x')}},
                                          {kOscImmediately, "/light/a/level", {1.0F}}}));
    ASSERT_TRUE(serve([&] { return heard.size() == 1; }));
    EXPECT_EQ(heard[0].first, "/light/a/level");
    EXPECT_EQ(endpoint().refused_sources(), 1u);
}

// Phones whose clock is off (42-osc-clock-skew): in the past at once, a little ahead later, an hour ahead refused.
TEST_F(OscServers, ATimeTagFarAheadIsRefusedWithTheReason) {
    const test::Udp panel;
    send(panel, bundle_at(tag_in(-3600s), {{kOscImmediately, "/light/past/level", {1.0F}}}));
    send(panel, bundle_at(kOscImmediately, {{kOscImmediately, "/light/now/level", {1.0F}}}));
    send(panel, bundle_at(tag_in(30s), {{kOscImmediately, "/light/soon/level", {1.0F}}}));
    send(panel, bundle_at(tag_in(3600s), {{kOscImmediately, "/light/late/level", {1.0F}}}));
    ASSERT_TRUE(serve([&] { return packets() == 4; }));
    ASSERT_EQ(heard.size(), 2u);
    EXPECT_EQ(heard[0].first, "/light/past/level");
    EXPECT_EQ(heard[1].first, "/light/now/level");
    EXPECT_EQ(endpoint().refused_sources(), 1u);
    EXPECT_NE(endpoint().last_error().find("/light/late/level"), std::string::npos);
    EXPECT_NE(endpoint().last_error().find("3600 s ahead"), std::string::npos) << endpoint().last_error();
}

}  // namespace
}  // namespace gonio
