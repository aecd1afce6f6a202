// Who watches through which encoder, with a clock of the test's own.
#include <gtest/gtest.h>

#include <algorithm>

#include "server/stream/lanes.h"

namespace gonio {
namespace {

using Verdict = VideoGate::Verdict;
using namespace std::chrono_literals;

struct LanesTest : testing::Test {
    Lanes::Time now = Lanes::Time{} + 1h;

    static Lanes::Rules rules(unsigned private_lanes) {
        Lanes::Rules result;
        result.private_lanes = private_lanes;
        return result;
    }
    static LaneRequest request(const Lanes& lanes, LaneId lane, Lanes::Time at) {
        for (const LaneRequest& one : lanes.requests(at))
            if (one.lane == lane) return one;
        return {.viewers = 0};
    }
    // Publishes a frame; whoever gets it and is in `readers` acknowledges at once.
    std::map<Lanes::ViewerId, Verdict> publish(Lanes& lanes, LaneId lane, bool key,
                                               const std::vector<Lanes::ViewerId>& readers) {
        std::map<Lanes::ViewerId, Verdict> verdicts;
        for (const auto& [viewer, verdict] : lanes.published(lane, key, now)) {
            verdicts[viewer] = verdict;
            if (verdict != Verdict::send) continue;
            const std::uint32_t seq = lanes.take_credit(viewer);
            lanes.wrote(viewer, seq, 1000, now);
            if (std::find(readers.begin(), readers.end(), viewer) != readers.end())
                lanes.acknowledged(viewer, seq, 0ms, now);
        }
        return verdicts;
    }
};

TEST_F(LanesTest, TheFirstHaveTheirOwnAndALaneThatGetsFreeGoesToTheOldest) {
    Lanes lanes(rules(2));
    EXPECT_EQ(lanes.join(10, now), kFirstPrivateLane);
    EXPECT_EQ(lanes.join(11, now), kFirstPrivateLane + 1);
    EXPECT_EQ(lanes.join(12, now), kSharedLane);
    EXPECT_EQ(lanes.join(13, now), kSharedLane);
    EXPECT_EQ(request(lanes, kSharedLane, now).viewers, 2u);
    EXPECT_TRUE(lanes.take_moved().empty());
    lanes.leave(10, now);
    EXPECT_EQ(lanes.take_moved(), std::vector<Lanes::ViewerId>{12});
    EXPECT_EQ(lanes.lane_of(12), kFirstPrivateLane);
    EXPECT_TRUE(request(lanes, kFirstPrivateLane, now).key) << "it was promoted into another stream";
    EXPECT_EQ(lanes.lane_of(13), kSharedLane);
    lanes.leave(13, now);
    EXPECT_TRUE(lanes.take_moved().empty());
    EXPECT_EQ(lanes.join(14, now), kSharedLane);
    lanes.leave(14, now);
    EXPECT_EQ(lanes.requests(now).size(), 2u);
}

TEST_F(LanesTest, WithoutPrivateLanesAllShareOne) {
    Lanes lanes(rules(0));
    for (Lanes::ViewerId viewer = 1; viewer <= 100; ++viewer) EXPECT_EQ(lanes.join(viewer, now), kSharedLane);
    EXPECT_EQ(lanes.requests(now).size(), 1u);
    lanes.leave(1, now);
    EXPECT_TRUE(lanes.take_moved().empty());
}

TEST_F(LanesTest, AViewerWithoutCreditIsNotEncodedForAndDoesNotSlowTheOthers) {
    Lanes lanes(rules(2));
    lanes.join(1, now), lanes.join(2, now);
    const LaneId own = lanes.lane_of(1), others = lanes.lane_of(2);
    publish(lanes, own, true, {});
    publish(lanes, own, false, {});
    EXPECT_EQ(request(lanes, own, now).credit, 0u);
    EXPECT_EQ(request(lanes, own, now).frames, 2u);
    EXPECT_EQ(request(lanes, others, now).credit, 2u);
    lanes.acknowledged(1, 1, 0ms, now);
    EXPECT_EQ(request(lanes, own, now).credit, 1u);
    EXPECT_FALSE(request(lanes, own, now).key);
    EXPECT_EQ(request(lanes, own, now).gated, 0u);
}

TEST_F(LanesTest, TheSharedLaneFollowsItsFastestAndIdrsComeOnceASecond) {
    Lanes lanes(rules(0));
    for (const Lanes::ViewerId viewer : {1u, 2u, 3u}) lanes.join(viewer, now);
    publish(lanes, kSharedLane, true, {1});
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(request(lanes, kSharedLane, now).credit, 2u) << "viewer 1 can";
        publish(lanes, kSharedLane, false, {1});
    }
    EXPECT_EQ(request(lanes, kSharedLane, now).gated, 2u) << "2 and 3 took two, held one, then fell out";
    lanes.acknowledged(2, 2, 0ms, now);
    lanes.acknowledged(3, 2, 0ms, now);
    EXPECT_FALSE(request(lanes, kSharedLane, now).key) << "the last IDR was just now";
    ASSERT_TRUE(lanes.due(now));
    EXPECT_EQ(*lanes.due(now), now + 1s);
    now += 1s;
    EXPECT_FALSE(lanes.due(now));
    EXPECT_TRUE(request(lanes, kSharedLane, now).key);
    const auto verdicts = publish(lanes, kSharedLane, true, {1, 2, 3});
    for (const auto& [viewer, verdict] : verdicts) EXPECT_EQ(verdict, Verdict::send) << viewer;
    lanes.need_key(1);
    EXPECT_FALSE(request(lanes, kSharedLane, now + 900ms).key);
    EXPECT_TRUE(request(lanes, kSharedLane, now + 1s).key);
}

// A whole minute of a laggard in the shared lane: however it behaves, at most one IDR a second, and the fast one gets
// every frame.
TEST_F(LanesTest, LaggardsMoveToTheLowLaneAndBackWhenTheyKeepUp) {
    Lanes lanes(rules(0));
    lanes.join(1, now), lanes.join(2, now);
    unsigned keys = 0, sent_to_fast = 0, frames = 0;
    for (int tick = 0; lanes.lane_of(2) == kSharedLane; ++tick) {
        ASSERT_LT(tick, 30 * 20);
        now += 33ms;
        const bool key = request(lanes, kSharedLane, now).key;
        keys += key;
        ++frames;
        const auto verdicts = publish(lanes, kSharedLane, key, {1});
        sent_to_fast += verdicts.at(1) == Verdict::send;
        for (std::uint32_t seq = 1; tick % 30 == 29 && seq < 100; ++seq) lanes.acknowledged(2, seq, 0ms, now);
    }
    EXPECT_EQ(sent_to_fast, frames);
    EXPECT_LE(keys, frames / 30 + 2);
    EXPECT_EQ(lanes.take_moved(), std::vector<Lanes::ViewerId>{2});
    EXPECT_EQ(request(lanes, kSharedLane, now).gated, 3u);

    // It keeps up with the low lane for ten seconds.
    const auto entered = now;
    const auto catch_up = [&] {
        for (std::uint32_t seq = 1; seq < 1000; ++seq) lanes.acknowledged(2, seq, 0ms, now);
    };
    catch_up();
    for (bool key = true; lanes.lane_of(2) == kLowLane; key = false) {
        ASSERT_LT(now - entered, 20s);
        now += 66ms;
        publish(lanes, kLowLane, key, {2});
    }
    EXPECT_GE(now - entered, 10s);
    EXPECT_EQ(lanes.take_moved(), std::vector<Lanes::ViewerId>{2});
    // The second time the proof takes twice as long.
    while (lanes.lane_of(2) == kSharedLane) {
        now += 500ms;
        publish(lanes, kSharedLane, request(lanes, kSharedLane, now).key, {1});
        if (now.time_since_epoch() / 500ms % 4 == 0) catch_up();
    }
    const auto again = now;
    catch_up();
    for (bool key = true; lanes.lane_of(2) == kLowLane; key = false) {
        now += 66ms;
        publish(lanes, kLowLane, key, {2});
    }
    EXPECT_GE(now - again, 20s);
}

TEST_F(LanesTest, AnotherStreamStartsAtOnceWithAKeyFrame) {
    Lanes lanes(rules(1));
    lanes.join(1, now);
    publish(lanes, kFirstPrivateLane, true, {1});
    EXPECT_FALSE(request(lanes, kFirstPrivateLane, now).key);
    lanes.restarted(kFirstPrivateLane);
    EXPECT_TRUE(request(lanes, kFirstPrivateLane, now).key);
    EXPECT_EQ(publish(lanes, kFirstPrivateLane, false, {1}).at(1), Verdict::skip);
    EXPECT_EQ(publish(lanes, kFirstPrivateLane, true, {1}).at(1), Verdict::send);
}

TEST_F(LanesTest, TheBudgetOfASharedLaneIsThatOfItsFastestViewerThatFollows) {
    Lanes lanes(rules(0));
    lanes.join(1, now), lanes.join(2, now);
    // 1 and 2 on links of 2 and 4 Mb/s without delay: 10,000 bytes take 40 and 20 ms.
    for (int i = 0; i < 40; ++i) {
        now += 50ms;
        for (const auto& [viewer, verdict] : lanes.published(kSharedLane, i == 0, now)) {
            ASSERT_EQ(verdict, Verdict::send);
            const std::uint32_t seq = lanes.take_credit(viewer);
            if (lanes.wrote(viewer, seq, 10'000, now)) lanes.round_trip(viewer, 1ms, now);
            lanes.acknowledged(viewer, seq, 0ms, now + (viewer == 1 ? 43ms : 23ms));
        }
    }
    const std::uint32_t budget = request(lanes, kSharedLane, now).budget_bytes;
    EXPECT_GT(budget, 4e6 / 8 * 0.033 * 0.65);  // a step of a fifth below 90 %
    EXPECT_LE(budget, 4e6 / 8 * 0.033);
    lanes.need_key(2);
    EXPECT_LE(request(lanes, kSharedLane, now).budget_bytes, 2e6 / 8 * 0.033);
}

TEST_F(LanesTest, WhatWasNotWrittenCannotBeAcknowledged) {
    Lanes lanes(rules(1));
    lanes.join(1, now);
    lanes.published(kFirstPrivateLane, true, now);
    lanes.published(kFirstPrivateLane, false, now);
    const std::uint32_t first = lanes.take_credit(1), second = lanes.take_credit(1);
    EXPECT_EQ(request(lanes, kFirstPrivateLane, now).credit, 0u);
    lanes.acknowledged(1, second, 0ms, now);
    EXPECT_EQ(request(lanes, kFirstPrivateLane, now).credit, 0u) << "both wait behind a slow socket";
    lanes.wrote(1, first, 1000, now);
    lanes.acknowledged(1, second, 0ms, now);
    EXPECT_EQ(request(lanes, kFirstPrivateLane, now).credit, 0u);
    lanes.acknowledged(1, first, 0ms, now);
    EXPECT_EQ(request(lanes, kFirstPrivateLane, now).credit, 1u);
}

}  // namespace
}  // namespace gonio
