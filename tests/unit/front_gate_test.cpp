// Which frames a viewer gets, with a clock of the test's own.
#include <gtest/gtest.h>

#include "server/net/video_gate.h"

namespace gonio {
namespace {

using Verdict = VideoGate::Verdict;
using namespace std::chrono_literals;

struct VideoGateTest : testing::Test {
    VideoGate gate{1000ms};
    VideoGate::Time now{};
    std::uint32_t send(bool key) {
        EXPECT_EQ(gate.offer(key), Verdict::send);
        return gate.take_credit(key, now);
    }
};

TEST_F(VideoGateTest, StartsWithAKeyFrame) {
    EXPECT_TRUE(gate.wants_frame(now));
    EXPECT_TRUE(gate.wants_key(now));
    EXPECT_EQ(gate.offer(false), Verdict::skip);
    EXPECT_EQ(send(true), 1u);
    EXPECT_FALSE(gate.wants_key(now));
    EXPECT_EQ(send(false), 2u);
}

TEST_F(VideoGateTest, TwoInFlightThenOneHeldThenSkipped) {
    send(true);
    send(false);
    EXPECT_FALSE(gate.credit());
    EXPECT_FALSE(gate.wants_frame(now));
    EXPECT_EQ(gate.offer(false), Verdict::hold);  // was on its way when the credit ran out
    gate.acknowledge(1);
    EXPECT_TRUE(gate.sends_held());
    EXPECT_FALSE(gate.wants_frame(now));
    EXPECT_EQ(gate.take_credit(false, now), 3u);
    EXPECT_EQ(gate.offer(false), Verdict::hold);
    EXPECT_EQ(gate.offer(false), Verdict::skip);  // newer than the held one: both go, a key frame must come
    EXPECT_FALSE(gate.sends_held());
    EXPECT_EQ(gate.offer(false), Verdict::skip);
    gate.acknowledge(3);
    now += 2s;
    EXPECT_TRUE(gate.wants_key(now));
    EXPECT_EQ(gate.offer(false), Verdict::skip);
    EXPECT_EQ(gate.offer(true), Verdict::send);
}

TEST_F(VideoGateTest, AKeyFrameReplacesTheHeldOne) {
    send(true);
    send(false);
    EXPECT_EQ(gate.offer(false), Verdict::hold);
    EXPECT_EQ(gate.offer(true), Verdict::hold);
    EXPECT_TRUE(gate.held_key());
    gate.acknowledge(2);
    EXPECT_TRUE(gate.sends_held());
}

TEST_F(VideoGateTest, KeyFramesAreAskedForOnceASecond) {
    send(true);
    gate.acknowledge(1);
    gate.need_key();
    EXPECT_FALSE(gate.wants_key(now));
    EXPECT_FALSE(gate.wants_frame(now));  // a delta would be of no use
    ASSERT_TRUE(gate.key_due_at(now));
    EXPECT_EQ(*gate.key_due_at(now), now + 1000ms);
    now += 1s;
    EXPECT_TRUE(gate.wants_key(now));
    EXPECT_FALSE(gate.key_due_at(now));
    gate.restart();
    EXPECT_TRUE(gate.wants_key(now));
}

TEST_F(VideoGateTest, WrongAcknowledgementsChangeNothing) {
    send(true);
    send(false);
    gate.acknowledge(99);
    gate.acknowledge(0);
    EXPECT_FALSE(gate.credit());
    gate.acknowledge(2);
    gate.acknowledge(1);
    EXPECT_TRUE(gate.credit());
    EXPECT_EQ(send(false), 3u);
    EXPECT_TRUE(gate.credit());  // 2 was acknowledged, one is in flight
}

}  // namespace
}  // namespace gonio
