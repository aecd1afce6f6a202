// The same hundred viewers and two thousand idle sockets on a whole goniod whose light moves; its limits are raised by
// options. What it costs the process is printed: docs/operations.md has the figures.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <thread>

#include "protocol/schema/command.pb.h"
#include "tests/conformance/played_daemon.h"
#include "tests/e2e/daemon_process.h"
#include "tests/load/swarm.h"
#include "tests/soak/operator.h"

namespace gonio::load {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(LoadGoniod, AHundredViewersAmongTwoThousandIdleSockets) {
    const std::size_t most = conformance::raise_descriptor_limit();
    if (most < kViewers + kIdle + 100) GTEST_SKIP() << "only " << most << " descriptors";
    test::DaemonProcess daemon({"--renderer", "gl", "--size", "320x320", "--surfaces", "off", "--max-clients", "2200",
                                "--max-connections", "2300"});
    const std::uint16_t port = test::port_of(daemon.url());
    Swarm swarm(port);
    soak::Operator lamp(port);
    const double before_mib = test::resident_mib(daemon.pid());
    for (int i = 0; i < kIdle; ++i) ASSERT_GT(swarm.join(Kind::idle), 0) << "idle socket " << i;
    const double idle_kib = (test::resident_mib(daemon.pid()) - before_mib) * 1024 / kIdle;
    for (int i = 0; i < kViewers; ++i) ASSERT_GT(swarm.join(Kind::viewer), 0) << "viewer " << i;

    const auto move = [&](std::chrono::milliseconds time) {
        auto next = Clock::now();
        for (const auto until = next + time; Clock::now() < until; next += 33ms) {
            std::this_thread::sleep_until(next);
            v1::Command command;
            command.mutable_set_light()->set_name("luminaire");
            command.mutable_set_light()->set_level_ratio(
                0.5 + 0.5 * std::sin(static_cast<double>(next.time_since_epoch().count()) * 1e-9));
            lamp.send(command);
            lamp.listen();
        }
        return lamp.settle(10s);
    };
    ASSERT_TRUE(move(2s));
    swarm.reset_tallies();
    const double cpu = test::cpu_seconds(daemon.pid());
    const auto began = Clock::now();
    ASSERT_TRUE(move(4s));
    const double wall_s = std::chrono::duration<double>(Clock::now() - began).count();
    const double share = (test::cpu_seconds(daemon.pid()) - cpu) / wall_s;
    for (const auto until = Clock::now() + 15s;; std::this_thread::sleep_for(20ms)) {
        int behind = 0;
        for (const Tally& viewer : swarm.tallies(Kind::viewer)) behind += viewer.newest_rev != lamp.newest_rev();
        if (behind == 0) break;
        ASSERT_LT(Clock::now(), until) << behind << " viewers do not see revision " << lamp.newest_rev();
    }
    std::uint64_t fewest = UINT64_MAX, most_frames = 0;
    std::vector<std::uint32_t> latencies;
    for (const Tally& viewer : swarm.tallies(Kind::viewer)) {
        fewest = std::min(fewest, viewer.frames);
        most_frames = std::max(most_frames, viewer.frames);
        EXPECT_EQ(viewer.older, 0u);
        EXPECT_FALSE(viewer.gone);
        latencies.insert(latencies.end(), viewer.latency_us.begin(), viewer.latency_us.end());
    }
    EXPECT_GT(fewest, 0u);
    for (const Tally& idle : swarm.tallies(Kind::idle)) EXPECT_FALSE(idle.gone);
    EXPECT_TRUE(lamp.refusals().empty());
    EXPECT_LT(idle_kib, 64);
    std::printf(
        "load: goniod with %d viewers and %d idle sockets: %llu to %llu frames each in %.1f s, NV12 to client p50 %.1f "
        "ms, "
        "p99 %.1f ms; %.1f KiB an idle socket; %.0f %% of a core\n",
        kViewers, kIdle, static_cast<unsigned long long>(fewest), static_cast<unsigned long long>(most_frames), wall_s,
        percentile_ms(latencies, 0.5), percentile_ms(latencies, 0.99), idle_kib, 100 * share);
    EXPECT_EQ(daemon.stop(), 0);
}

}  // namespace
}  // namespace gonio::load
