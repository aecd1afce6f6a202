// The estimate of a link against links whose rate and delay are known: simulated, in time of the test's own.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>

#include "server/stream/bandwidth.h"
#include "server/stream/video_gate.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;
using Seconds = std::chrono::duration<double>;

// A line of `bits_per_s` with a delay on both ways and noise at both ends; frames of whatever size the content would
// like, or of the budget if that is less; a new one every frame time while the window allows.
struct SimulatedLink {
    double bits_per_s = 3e6;
    Bandwidth::Duration one_way = 20ms, frame_time = 25ms;
    double noise_ms = 1;  // mean of an exponential distribution
    double wanted_bytes = 30'000;

    Bandwidth link;
    VideoGate gate;
    Bandwidth::Time now = Bandwidth::Time{} + 1h;
    std::mt19937 random{7};
    std::vector<double> latencies_ms;  // from handing the frame over to its arrival

    struct Flight {
        std::uint32_t seq;
        Bandwidth::Time acknowledged;
        bool ping;
        Bandwidth::Time sent;
    };

    void run(Bandwidth::Duration time) {
        const Bandwidth::Time end = now + time;
        std::deque<Flight> flights;
        Bandwidth::Time free_at = now, last_frame = now - 1s;
        gate.offer(true);
        latencies_ms.clear();
        std::exponential_distribution<double> noise(1 / std::max(noise_ms, 1e-6));
        const auto random_ms = [&] {
            return std::chrono::duration_cast<Bandwidth::Duration>(
                std::chrono::duration<double, std::milli>(noise(random)));
        };
        for (; now < end; now += 1ms) {
            while (!flights.empty() && flights.front().acknowledged <= now) {
                const Flight flight = flights.front();
                flights.pop_front();
                if (flight.ping) {
                    link.round_trip(flight.acknowledged - flight.sent, now);
                    continue;
                }
                gate.acknowledge(flight.seq);
                link.acknowledged(flight.seq, 0ms, flight.acknowledged);
                gate.set_window(link.window(now));
            }
            if (gate.credit() == 0 || now - last_frame < frame_time) continue;
            last_frame = now;
            const std::uint32_t budget = link.frame_budget_bytes();
            const double bytes = budget ? std::min<double>(budget, wanted_bytes) : wanted_bytes;
            const std::uint32_t seq = gate.take_credit();
            if (link.window(now) > 1 && link.wants_probe(now)) {
                link.probed(now);
                flights.push_back({0, std::max(now, free_at) + 2 * one_way + random_ms(), true, now});
            }
            link.wrote(seq, static_cast<std::size_t>(bytes), now);
            gate.set_window(link.window(now));
            free_at = std::max(now, free_at) +
                      std::chrono::duration_cast<Bandwidth::Duration>(Seconds(bytes * 8 / bits_per_s));
            latencies_ms.push_back(std::chrono::duration<double, std::milli>(free_at + one_way - now).count());
            auto acknowledged = free_at + 2 * one_way + random_ms();
            if (!flights.empty()) acknowledged = std::max(acknowledged, flights.back().acknowledged);
            flights.push_back({seq, acknowledged, false, now});
        }
        for (const Flight& flight : flights) {  // the next run begins with an empty line
            if (flight.ping) continue;
            gate.acknowledge(flight.seq);
            link.acknowledged(flight.seq, 0ms, std::max(flight.acknowledged, now));
            now = std::max(now, flight.acknowledged);
        }
    }
    double median_ms(std::size_t from, std::size_t to) const {
        std::vector<double> part(latencies_ms.begin() + static_cast<std::ptrdiff_t>(from),
                                 latencies_ms.begin() + static_cast<std::ptrdiff_t>(to));
        std::nth_element(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2), part.end());
        return part[part.size() / 2];
    }
};

TEST(Bandwidth, FindsTheRateOfANarrowLink) {
    for (const double rate : {1e6, 3e6, 10e6, 30e6}) {
        SimulatedLink line;
        line.bits_per_s = rate;
        line.wanted_bytes = 200'000;
        line.run(5s);
        EXPECT_GT(line.link.bits_per_s(), 0.75 * rate) << rate;
        EXPECT_LT(line.link.bits_per_s(), 1.4 * rate) << rate;
        EXPECT_NEAR(std::chrono::duration<double>(*line.link.min_rtt()).count(), 0.040, 0.012) << rate;
    }
}

TEST(Bandwidth, AFrameIsThroughInAFrameTimeAndTheLagDoesNotGrow) {
    SimulatedLink line;
    line.run(60s);
    const std::size_t count = line.latencies_ms.size();
    ASSERT_GT(count, 1000u) << "20 frames a second at least";
    const double early = line.median_ms(count / 10, count / 5), late = line.median_ms(count * 9 / 10, count);
    EXPECT_LT(early, 90);
    EXPECT_LT(late, 90);
    EXPECT_LT(late, 1.25 * early + 5);
}

TEST(Bandwidth, FollowsALinkThatChanges) {
    SimulatedLink line;
    line.run(10s);
    line.bits_per_s = 1e6;
    line.run(10s);
    EXPECT_LT(line.link.bits_per_s(), 1.5e6);
    line.bits_per_s = 10e6;
    line.run(20s);
    EXPECT_GT(line.link.bits_per_s(), 6e6);
}

TEST(Bandwidth, AWideLinkIsNoLimit) {
    SimulatedLink line;
    line.bits_per_s = 1e9;
    line.one_way = 200us;
    line.wanted_bytes = 8'000;
    line.run(5s);
    EXPECT_EQ(line.link.frame_budget_bytes(), 0u);
    // Machines that are busy are not taken for a narrow link: what content takes stays allowed.
    line.noise_ms = 8;
    line.run(5s);
    const std::uint32_t budget = line.link.frame_budget_bytes();
    EXPECT_TRUE(budget == 0 || budget > 16'000) << budget;
}

TEST(Bandwidth, SmallFramesSayNothing) {
    SimulatedLink line;
    line.bits_per_s = 1e9;
    line.noise_ms = 20;
    line.wanted_bytes = 1'000;
    line.run(5s);
    EXPECT_EQ(line.link.frame_budget_bytes(), 0u);
}

TEST(Bandwidth, LongLinksGetThreeFramesAndTheBudgetHasAFloor) {
    SimulatedLink line;
    line.one_way = 20ms;
    line.run(3s);
    EXPECT_EQ(line.link.window(line.now), 2u);
    SimulatedLink far;
    far.one_way = 40ms;
    far.run(3s);
    EXPECT_EQ(far.link.window(far.now), 3u);
    SimulatedLink thin;
    thin.bits_per_s = 100e3;
    thin.run(20s);
    EXPECT_EQ(thin.link.frame_budget_bytes(), Bandwidth::kLeastBudgetBytes);
}

// A route that became longer is measured anew: what was the least once is forgotten after two spans of ten seconds.
TEST(Bandwidth, TheLeastRoundTripGrowsOld) {
    SimulatedLink line;
    line.run(5s);
    EXPECT_NEAR(std::chrono::duration<double>(*line.link.min_rtt()).count(), 0.040, 0.012);
    line.one_way = 60ms;
    line.run(25s);
    EXPECT_NEAR(std::chrono::duration<double>(*line.link.min_rtt()).count(), 0.120, 0.012);
}

// What the viewer's decoder takes is not the link's.
TEST(Bandwidth, DecodingIsNotCounted) {
    Bandwidth slow_decoder;
    auto now = Bandwidth::Time{} + 1h;
    for (std::uint32_t seq = 1; seq <= 20; ++seq) {
        slow_decoder.wrote(seq, 50'000, now);
        slow_decoder.acknowledged(seq, 200ms, now + 201ms);
        now += 250ms;
    }
    EXPECT_EQ(slow_decoder.frame_budget_bytes(), 0u);
    slow_decoder.wrote(21, 50'000, now);
    slow_decoder.acknowledged(21, 10h, now + 1ms);  // a lie: clamped
    ASSERT_TRUE(slow_decoder.min_rtt());
    EXPECT_GE(*slow_decoder.min_rtt(), 0ms);
}

}  // namespace
}  // namespace gonio
