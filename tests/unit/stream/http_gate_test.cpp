// Which frames a viewer gets.
#include <gtest/gtest.h>

#include "server/stream/video_gate.h"

namespace gonio {
namespace {

using Verdict = VideoGate::Verdict;

struct VideoGateTest : testing::Test {
    VideoGate gate;
    std::uint32_t send(bool key) {
        EXPECT_EQ(gate.offer(key), Verdict::send);
        return gate.take_credit();
    }
};

TEST_F(VideoGateTest, StartsWithAKeyFrame) {
    EXPECT_TRUE(gate.waits_for_key());
    EXPECT_EQ(gate.spare(), 2u);
    EXPECT_EQ(gate.offer(false), Verdict::skip);
    EXPECT_EQ(send(true), 1u);
    EXPECT_FALSE(gate.waits_for_key());
    EXPECT_EQ(send(false), 2u);
}

TEST_F(VideoGateTest, TwoInFlightThenOneHeldThenSkipped) {
    send(true);
    send(false);
    EXPECT_EQ(gate.spare(), 0u);
    EXPECT_EQ(gate.offer(false), Verdict::hold);  // was on its way when the credit ran out
    EXPECT_TRUE(gate.acknowledge(1));
    EXPECT_TRUE(gate.sends_held());
    EXPECT_EQ(gate.spare(), 0u) << "the held one takes the credit";
    EXPECT_EQ(gate.take_credit(), 3u);
    EXPECT_EQ(gate.offer(false), Verdict::hold);
    EXPECT_EQ(gate.offer(false), Verdict::skip);  // newer than the held one: both go, a key frame must come
    EXPECT_FALSE(gate.sends_held());
    EXPECT_TRUE(gate.waits_for_key());
    EXPECT_EQ(gate.offer(false), Verdict::skip);
    gate.acknowledge(3);
    EXPECT_EQ(gate.offer(false), Verdict::skip);
    EXPECT_EQ(gate.offer(true), Verdict::send);
}

TEST_F(VideoGateTest, AKeyFrameReplacesTheHeldOne) {
    send(true);
    send(false);
    EXPECT_EQ(gate.offer(false), Verdict::hold);
    EXPECT_EQ(gate.offer(true), Verdict::hold);
    EXPECT_FALSE(gate.waits_for_key());
    gate.acknowledge(2);
    EXPECT_TRUE(gate.sends_held());
}

TEST_F(VideoGateTest, WrongAcknowledgementsChangeNothing) {
    send(true);
    send(false);
    EXPECT_FALSE(gate.acknowledge(99));
    EXPECT_FALSE(gate.acknowledge(0));
    EXPECT_EQ(gate.credit(), 0u);
    EXPECT_TRUE(gate.acknowledge(2));
    EXPECT_FALSE(gate.acknowledge(1));
    EXPECT_EQ(gate.credit(), 2u);
    EXPECT_EQ(send(false), 3u);
    EXPECT_EQ(gate.credit(), 1u);  // 2 was acknowledged, one is in flight
}

TEST_F(VideoGateTest, ALongLinkGetsAWiderWindowAndMayNarrowAgain) {
    gate.set_window(3);
    send(true), send(false), send(false);
    EXPECT_EQ(gate.credit(), 0u);
    gate.set_window(1);
    gate.acknowledge(2);
    EXPECT_EQ(gate.credit(), 0u);
    gate.acknowledge(3);
    EXPECT_EQ(gate.credit(), 1u);
}

}  // namespace
}  // namespace gonio
