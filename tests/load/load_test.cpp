// A hundred streaming viewers and two thousand idle sockets on the real front, frames played by the test; then one
// reader that never reads and one that reads at a tenth beside them. Figures are printed: they are
// docs/operations.md's.
#include <gtest/gtest.h>
#include <malloc.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "tests/conformance/played_daemon.h"
#include "tests/load/swarm.h"

namespace gonio::load {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kFrameBytes = 5'000;  // 30 a second: 1.2 Mb/s, a moving light at 800 × 800
constexpr auto kFrameTime = 33ms;

double cpu_s() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

struct Load : testing::Test {
    static HttpLimits limits() {
        HttpLimits limits;
        limits.clients = kViewers + kIdle + 10;
        limits.connections = kViewers + kIdle + 20;
        return limits;
    }
    conformance::PlayedDaemon daemon{limits()};
    Swarm swarm{daemon.port()};
    std::uint32_t rev = 1;

    void SetUp() override {
        const std::size_t most = conformance::raise_descriptor_limit();
        if (most < 2 * (kViewers + kIdle) + 100) GTEST_SKIP() << "only " << most << " descriptors";
    }
    // Frames as a renderer makes them: one after the other, in each lane that viewers watch.
    void stream(std::chrono::milliseconds time) {
        auto next = Clock::now();
        for (const auto until = next + time; Clock::now() < until; next += kFrameTime) {
            std::this_thread::sleep_until(next);
            daemon.publish(++rev, false, kFrameBytes);
        }
    }
    // Whether every viewer has the newest frame, within this time.
    bool all_have_the_newest(std::chrono::milliseconds time) {
        for (const auto until = Clock::now() + time;; std::this_thread::sleep_for(5ms)) {
            bool all = true;
            for (const Tally& viewer : swarm.tallies(Kind::viewer)) all = all && viewer.newest_rev == rev;
            if (all || Clock::now() > until) return all;
            if (daemon.key_wanted()) daemon.publish(rev, false, kFrameBytes);  // as goniod serves whoever fell behind
        }
    }
    double p99_ms() const {
        std::vector<std::uint32_t> all;
        for (const Tally& viewer : swarm.tallies(Kind::viewer))
            all.insert(all.end(), viewer.latency_us.begin(), viewer.latency_us.end());
        return percentile_ms(std::move(all), 0.99);
    }
    // Streams for a second. Result: the latency of that time alone; `fewest` grows by what the least viewer got.
    double p99_ms_of_a_second(std::uint64_t& fewest) {
        swarm.reset_tallies();
        stream(1s);
        EXPECT_TRUE(all_have_the_newest(5s));
        std::uint64_t least = UINT64_MAX;
        for (const Tally& viewer : swarm.tallies(Kind::viewer)) least = std::min(least, viewer.frames);
        fewest += least;
        return p99_ms();
    }
};

TEST_F(Load, AHundredViewersAmongTwoThousandIdleSockets) {
    const auto before = mallinfo2().uordblks;
    for (int i = 0; i < kIdle; ++i) ASSERT_GT(swarm.join(Kind::idle), 0) << "idle socket " << i;
    const double idle_kib = static_cast<double>(mallinfo2().uordblks - before) / kIdle / 1024;
    for (int i = 0; i < kViewers; ++i) ASSERT_GT(swarm.join(Kind::viewer), 0) << "viewer " << i;

    stream(500ms);  // everybody's first key frame
    swarm.reset_tallies();
    const double cpu = cpu_s(), swarm_cpu = swarm.cpu_s();
    const auto began = Clock::now();
    const std::uint32_t first = rev;
    stream(3s);
    const double wall_s = std::chrono::duration<double>(Clock::now() - began).count();
    EXPECT_TRUE(all_have_the_newest(5s)) << "a viewer did not get the newest frame";
    const double front_cpu = (cpu_s() - cpu - (swarm.cpu_s() - swarm_cpu)) / wall_s;

    std::uint64_t fewest = UINT64_MAX, most = 0;
    std::vector<std::uint32_t> latencies;
    for (const Tally& viewer : swarm.tallies(Kind::viewer)) {
        fewest = std::min(fewest, viewer.frames);
        most = std::max(most, viewer.frames);
        EXPECT_EQ(viewer.older, 0u) << "a frame older than one that had come";
        EXPECT_FALSE(viewer.gone);
        latencies.insert(latencies.end(), viewer.latency_us.begin(), viewer.latency_us.end());
    }
    for (const Tally& idle : swarm.tallies(Kind::idle)) EXPECT_FALSE(idle.gone);
    // Frames are skipped where a viewer has two unacknowledged, on a busy machine most of them; but for all alike.
    EXPECT_GT(4 * fewest, most) << "one viewer is served much less than others";
    EXPECT_LT(idle_kib, 64) << "memory of an idle socket, both ends";
    std::printf(
        "load: %d viewers, %d idle sockets: %u frames in %.1f s, the least viewer got %llu; "
        "publish to received p50 %.1f ms, p99 %.1f ms; %.1f KiB an idle socket (both ends); front %.0f %% of a core\n",
        kViewers, kIdle, rev - first, wall_s, static_cast<unsigned long long>(fewest), percentile_ms(latencies, 0.5),
        percentile_ms(latencies, 0.99), idle_kib, 100 * front_cpu);
}

TEST_F(Load, AReaderThatNeverReadsAndOneAtATenthHinderNobody) {
    for (int i = 0; i < 20; ++i) ASSERT_GT(swarm.join(Kind::viewer), 0);
    stream(500ms);
    // Alternating, so that a machine that gets slower meanwhile is no finding.
    std::vector<double> alone, beside;
    std::uint64_t frames_alone = 0, frames_beside = 0;
    const double tenth = kFrameBytes * 30 / 10.0;
    const auto before = mallinfo2().uordblks;
    for (int round = 0; round < 3; ++round) {
        alone.push_back(p99_ms_of_a_second(frames_alone));
        const int deaf = swarm.join(Kind::deaf), slow = swarm.join(Kind::slow, tenth);
        ASSERT_GT(deaf, 0);
        ASSERT_GT(slow, 0);
        stream(200ms);
        beside.push_back(p99_ms_of_a_second(frames_beside));
        EXPECT_GT(swarm.tally(slow).frames, 0u) << "a slow reader gets frames too";
        EXPECT_EQ(swarm.tally(slow).older, 0u);
        swarm.leave(deaf, true);
        swarm.leave(slow, true);
    }
    const auto median = [](std::vector<double> values) {
        std::sort(values.begin(), values.end());
        return values[values.size() / 2];
    };
    const double ratio = median(beside) / median(alone);
    std::printf(
        "load: 20 viewers p99 %.2f ms alone, %.2f ms beside a deaf and a tenth-speed reader (ratio %.2f), the least "
        "got %llu and %llu frames, %.0f KiB held\n",
        median(alone), median(beside), ratio, static_cast<unsigned long long>(frames_alone),
        static_cast<unsigned long long>(frames_beside), static_cast<double>(mallinfo2().uordblks - before) / 1024);
    EXPECT_GT(2 * frames_beside, frames_alone) << "viewers are served much less beside slow readers";
    // Latencies are the machine's as much as the front's, whose fault shows in each of the three.
    EXPECT_LT(*std::min_element(beside.begin(), beside.end()), 2 * median(alone) + 5);
}

}  // namespace
}  // namespace gonio::load
