// The inputs' thread on the loopback interface: what waits for the render thread is the newest state, never a queue.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "protocol/osc/osc.h"
#include "protocol/schema/console.pb.h"
#include "server/inputs/udp_inputs.h"
#include "tests/console/udp.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

class UdpInputsTest : public testing::Test {
protected:
    void SetUp() override {
        InputOptions options;
        options.sacn = options.artnet = options.osc = UdpPeer{INADDR_LOOPBACK, 0};
        auto started = Inputs::start(options, [this] { ++wakes; });
        ASSERT_TRUE(started) << started.error().text();
        inputs = std::move(*started);
        inputs->listen_to({{DmxProtocol::sacn, 1}, {DmxProtocol::artnet, 0}});
        const v1::Sources first = table();
        for (const v1::InputEndpoint& one : first.endpoints()) {
            const std::string& address = one.address();
            ports[one.protocol()] = static_cast<std::uint16_t>(std::stoi(address.substr(address.find(':') + 1)));
        }
    }
    // Waits for the next table.
    v1::Sources table() {
        for (const auto end = Clock::now() + 3s; Clock::now() < end; std::this_thread::sleep_for(5ms))
            if (auto next = inputs->table().try_take()) return *next;
        ADD_FAILURE() << "no table came";
        return {};
    }
    // Waits until an endpoint of a table says so, 3 s at most.
    template <typename Done>
    bool until(const std::string& protocol, const Done& done) {
        for (const auto end = Clock::now() + 3s; Clock::now() < end;) {
            const v1::Sources now = table();
            for (const v1::InputEndpoint& one : now.endpoints())
                if (one.protocol() == protocol && done(one)) return true;
        }
        return false;
    }
    std::atomic<int> wakes{0};
    std::unique_ptr<Inputs> inputs;
    std::map<std::string, std::uint16_t> ports;
    test::Udp desk;
};

TEST_F(UdpInputsTest, WhatNobodyTakesIsReplacedAndWakesOnce) {
    // The patch's universes came first, as they are: silent.
    for (int i = 0; i < 200 && wakes < 1; ++i) std::this_thread::sleep_for(5ms);
    ASSERT_EQ(inputs->updates().try_take()->universes.size(), 2u);
    wakes = 0;
    for (unsigned i = 0; i < 500; ++i) {
        desk.send("127.0.0.1", ports["artnet"],
                  test::art_dmx(0, 0, {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8)}));
        desk.send("127.0.0.1", ports["osc"],
                  encode_osc({kOscImmediately, "/light/a/level", {static_cast<float>(i) / 500.0F}}));
        if (i % 50 == 49) std::this_thread::sleep_for(5ms);
    }
    ASSERT_TRUE(until("artnet", [](const auto& one) { return one.packets() == 500; }));
    ASSERT_TRUE(until("osc", [](const auto& one) { return one.packets() == 500; }));
    EXPECT_EQ(wakes, 1) << "whoever does not look is woken once, not a thousand times";
    const auto updates = inputs->updates().try_take();
    ASSERT_TRUE(updates);
    ASSERT_EQ(updates->universes.size(), 1u);
    const DmxUniverse& universe = *updates->universes.begin()->second;
    ASSERT_EQ(universe.sources.size(), 1u);
    EXPECT_EQ(universe.sources[0].levels[0] | universe.sources[0].levels[1] << 8, 499) << "the newest, both bytes";
    ASSERT_EQ(updates->osc.size(), 1u);
    EXPECT_NEAR(updates->osc.begin()->second.values.at(0).value[0], 499.0 / 500.0, 1e-6);
    // The next change wakes again.
    desk.send("127.0.0.1", ports["artnet"], test::art_dmx(0, 0, {7, 7}));
    for (int i = 0; i < 200 && wakes < 2; ++i) std::this_thread::sleep_for(5ms);
    EXPECT_EQ(wakes, 2);
}

TEST_F(UdpInputsTest, PatternsThatWaitAreBounded) {
    for (unsigned i = 0; i < 200; ++i) {
        desk.send("127.0.0.1", ports["osc"],
                  encode_osc({kOscImmediately, "/light/*" + std::to_string(i) + "/level", {0.5F}}));
        if (i % 50 == 49) std::this_thread::sleep_for(5ms);
    }
    EXPECT_TRUE(until("osc", [](const auto& one) { return one.packets() == 200; }));
    const auto updates = inputs->updates().try_take();
    ASSERT_TRUE(updates);
    EXPECT_EQ(updates->osc.size(), kMaxOscPatternUpdates);
    EXPECT_TRUE(until("osc", [](const auto& one) { return one.refused_sources() == 200 - kMaxOscPatternUpdates; }));
    // Taken: there is room again.
    desk.send("127.0.0.1", ports["osc"], encode_osc({kOscImmediately, "/light/*/level", {0.5F}}));
    EXPECT_TRUE(until("osc", [&](const auto&) { return inputs->updates().waiting(); }));
}

TEST_F(UdpInputsTest, RefusalsAreCountedAlsoWhereTheyCannotBeTold) {
    for (int i = 0; i < 20000; ++i)
        inputs->tell_refusal(OscClient{}, "/light/a/level", {"invalid_argument", "", "", "no"});
    EXPECT_TRUE(until("osc", [](const auto& one) { return one.refused_sources() == 20000; }));
    inputs->tell_refusal(DmxProtocol::artnet, {"invalid_argument", "set_light.aim", "0,0,0", "no"});
    EXPECT_TRUE(
        until("artnet", [](const auto& one) { return one.last_error().find("set_light.aim") != std::string::npos; }));
}

}  // namespace
}  // namespace gonio
