// The real goniod over lines that are narrow and long, and beside viewers that hardly read or not at all.
// GONIO_PACING_SECONDS makes the measurements longer than the few seconds of the test run (docs/streaming.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <thread>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/measured.h"
#include "tests/e2e/mover.h"
#include "tests/throttle/throttle_proxy.h"
#include "tests/unit/http_client.h"

namespace gonio::test {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;
using Json = nlohmann::json;

std::chrono::seconds measuring_time() {
    const char* given = std::getenv("GONIO_PACING_SECONDS");
    return std::chrono::seconds(given ? std::max(2, std::atoi(given)) : 2);
}

double milliseconds_since(std::uint64_t monotonic_ns) {
    return static_cast<double>(Clock::now().time_since_epoch().count() - static_cast<std::int64_t>(monotonic_ns)) *
           1e-6;
}

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return NAN;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

// As fast as frames come: every picture is another, all over.
void swing_camera(v1::Command& command, int step) {
    for (const double x : {0.8 * std::sin(0.12 * step), 2.0, 6.5}) command.mutable_set_camera()->add_eye_m(x);
}

struct Watched {
    std::vector<double> ages_ms;  // of each picture when it was whole: from its place in the server's memory
    std::size_t bytes = 0;
    unsigned keys = 0;
    double fps(std::chrono::seconds time) const {
        return static_cast<double>(ages_ms.size()) / static_cast<double>(time.count());
    }
};

Watched watch(Client& viewer, std::chrono::seconds time) {
    Watched watched;
    const auto end = Clock::now() + time;
    while (Clock::now() < end) {
        const auto picture = viewer.read_picture(1000);
        if (!picture) continue;
        watched.ages_ms.push_back(milliseconds_since(picture->header().rendered_ns));
        watched.bytes += picture->payload.size();
        watched.keys += picture->header().key;
    }
    return watched;
}

// A line of this rate, 20 ms each way, that shows a moving picture for a while. Result: what did not hold.
std::string shows_fresh_frames(const DaemonProcess& daemon, double bits_per_s, double most_p50_ms) {
    ThrottleProxy line(port_of(daemon.url()), {bits_per_s, 20ms, 16 << 10});
    Client viewer(line.port());
    viewer.join(kSubprotocolProto, true, false);
    viewer.keeps_pings = true;
    const Mover mover(port_of(daemon.url()), swing_camera);
    watch(viewer, 2s);  // until the line is known
    const auto time = measuring_time();
    const Watched watched = watch(viewer, time);
    const auto half = static_cast<std::ptrdiff_t>(watched.ages_ms.size() / 2);
    const double p50 = quantile(watched.ages_ms, 0.5), p99 = quantile(watched.ages_ms, 0.99);
    const double early = quantile({watched.ages_ms.begin(), watched.ages_ms.begin() + half}, 0.5);
    const double late = quantile({watched.ages_ms.begin() + half, watched.ages_ms.end()}, 0.5);
    const Json lane = daemon.json({"stats"})["lanes"][0];
    std::printf(
        "%.1f Mb/s, 20+20 ms, %lld s: age when shown p50 %.0f ms, p99 %.0f ms, first half %.0f, second half %.0f; "
        "%.1f frames/s, %.2f Mb/s, lane %s at %.2f Mb/s\n",
        bits_per_s * 1e-6, static_cast<long long>(time.count()), p50, p99, early, late, watched.fps(time),
        static_cast<double>(watched.bytes) * 8e-6 / static_cast<double>(time.count()),
        lane["kind"].get<std::string>().c_str(), lane["bitrate_bps"].get<double>() * 1e-6);
    EXPECT_EQ(lane["kind"], "private");
    EXPECT_EQ(watched.keys, 0u) << "a viewer with a lane of its own never needs another key frame";
    return unless(watched.ages_ms.size() > static_cast<std::size_t>(4 * time.count()), "too few frames") +
           unless(p50 < most_p50_ms, "frames are too old") + unless(late < 1.5 * early + 10.0, "the lag grows");
}

TEST(Pacing, ANarrowLineShowsFreshFramesForAsLongAsItLasts) {
    const DaemonProcess daemon({"--renderer", "gl", "--size", "640x640"});
    holds_in_one_of_three([&] { return shows_fresh_frames(daemon, 3e6, 120); });
    // Less than the picture would take: the line is full. Of frames of Bandwidth::kLeastBudgetBytes, 55 ms each there,
    // two are on their way.
    holds_in_one_of_three([&] { return shows_fresh_frames(daemon, 0.6e6, 20 + 3 * 55); });
}

// One that never reads, one that reads at a tenth of what comes: whoever reads does not feel them. Result: what did not
// hold.
std::string slow_readers_trouble_nobody() {
    DaemonProcess daemon({"--renderer", "gl", "--size", "320x320", "--max-private-lanes", "1"});
    if (!daemon.transport_ready()) return "no transport";
    const std::uint16_t port = port_of(daemon.url());
    Client first(port), fast(port);
    first.join(kSubprotocolProto, true, false);
    fast.join(kSubprotocolProto, true, false);  // in the shared lane, as those below
    const Mover mover(port, swing_camera);
    std::atomic<bool> stop{false};
    std::thread own([&] {
        while (!stop) watch(first, 1s);
    });
    watch(fast, 1s);
    const auto time = measuring_time() / 2;
    const Watched alone = watch(fast, time);
    const double memory_mib = resident_mib(daemon.pid());
    Client never(port, 4096), tenth(port, 4096);
    never.join(kSubprotocolProto, true, false);
    tenth.join(kSubprotocolProto, true, false);
    std::atomic<unsigned> tenth_frames{0};
    std::thread slow([&] {
        while (!stop) {
            if (!tenth.read_picture(500)) continue;
            ++tenth_frames;
            std::this_thread::sleep_for(300ms);
        }
    });
    watch(fast, 1s);
    const Watched beside = watch(fast, time);
    const Json stats = daemon.json({"stats"});
    const double grown_mib = resident_mib(daemon.pid()) - memory_mib;
    stop = true;
    slow.join();
    own.join();
    std::printf(
        "age when shown, alone p50 %.1f p99 %.1f ms, %.1f frames/s; beside slow readers p50 %.1f p99 %.1f ms, "
        "%.1f frames/s, %u key frames; the slow one got %u; memory grew by %.1f MiB\n",
        quantile(alone.ages_ms, 0.5), quantile(alone.ages_ms, 0.99), alone.fps(time), quantile(beside.ages_ms, 0.5),
        quantile(beside.ages_ms, 0.99), beside.fps(time), beside.keys, tenth_frames.load(), grown_mib);
    EXPECT_GT(tenth_frames.load(), 0u);
    // Key frames that laggards ask for: at most one a second, in the shared and the low lane.
    EXPECT_LE(beside.keys, static_cast<unsigned>(time.count()) + 2);
    EXPECT_LT(grown_mib, 48.0);
    EXPECT_GE(stats["lanes"].size(), 2u);
    return unless(beside.fps(time) > 0.6 * alone.fps(time), "fewer frames than alone") +
           unless(quantile(beside.ages_ms, 0.5) < 1.5 * quantile(alone.ages_ms, 0.5) + 5, "older ones than alone");
}

TEST(Pacing, SlowReadersAreNobodyElsesTrouble) {
    holds_in_one_of_three(slow_readers_trouble_nobody);
}

// What a viewer over a wide link feels: from sending a command to having the frame that contains it.
TEST(Pacing, ACommandIsSeenInTheNextFrame) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "320x320"});
    const std::uint16_t port = port_of(daemon.url());
    Client viewer(port);
    viewer.join(kSubprotocolProto, true, false);
    viewer.keeps_pings = true;
    std::vector<double> times_ms, frame_ms;
    for (std::uint32_t i = 0; i < 40; ++i) {
        v1::ClientMessage message;
        message.set_request_id(i + 1);
        message.mutable_command()->mutable_set_exposure()->set_ev100(5.0 + 0.02 * i);
        const auto sent = Clock::now();
        viewer.say(message);
        std::uint32_t rev = 0;
        for (bool seen = false; !seen;) {
            const Client::Frame frame = viewer.read_frame(5000);
            ASSERT_NE(frame.opcode, -1);
            if (frame.opcode == 9) viewer.send_frame(10, frame.payload);
            if (frame.opcode != 2 || frame.payload.empty()) continue;
            if (frame.payload[0] == 1) {
                const auto answer = decode_server_message(Encoding::proto, std::string_view(frame.payload).substr(1));
                if (answer && answer->has_result()) rev = answer->result().scene_rev();
                continue;
            }
            viewer.acknowledge(frame.seq());
            if (rev == 0 || frame.header().scene_rev < rev) continue;
            times_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - sent).count());
            frame_ms.push_back((frame.header().render_us + frame.header().encode_us) * 1e-3);
            seen = true;
        }
        std::this_thread::sleep_for(30ms);
    }
    std::printf("command to its frame at the viewer: p50 %.1f ms, p90 %.1f ms; its render and encode p50 %.1f ms\n",
                quantile(times_ms, 0.5), quantile(times_ms, 0.9), quantile(frame_ms, 0.5));
    EXPECT_LT(quantile(times_ms, 0.5), 250.0);
}

// What more viewers cost: everybody goes on getting pictures. The figures are printed; docs/streaming.md has those of
// an idle machine.
TEST(Pacing, ManyViewersShareWhatThereIs) {
    std::vector<std::size_t> counts{1, 12};
    if (std::getenv("GONIO_PACING_SECONDS")) counts = {1, 4, 8, 60};
    for (const std::size_t count : counts) {
        DaemonProcess daemon({"--renderer", "gl", "--size", "640x640"});
        const std::uint16_t port = port_of(daemon.url());
        std::vector<std::unique_ptr<Client>> viewers;
        for (std::size_t i = 0; i < count; ++i) {
            viewers.push_back(std::make_unique<Client>(port));
            viewers.back()->join(kSubprotocolProto, true, false);
        }
        const Mover mover(port, swing_camera);
        const auto time = std::getenv("GONIO_PACING_SECONDS") ? 8s : 2s;
        std::vector<double> ages_ms;
        std::vector<std::size_t> frames(count);
        const double cpu_s = cpu_seconds(daemon.pid());
        const auto end = Clock::now() + time;
        while (Clock::now() < end) {
            bool any = false;
            for (std::size_t i = 0; i < count; ++i) {
                const Client::Frame frame = viewers[i]->read_frame(0);
                any = any || frame.opcode != -1;
                if (frame.opcode != 2 || frame.payload.empty() || frame.payload[0] != 2) continue;
                ages_ms.push_back(milliseconds_since(frame.header().rendered_ns));
                ++frames[i];
                viewers[i]->acknowledge(frame.seq());
            }
            if (!any) std::this_thread::sleep_for(500us);
        }
        const double seconds = static_cast<double>(time.count()), used_s = cpu_seconds(daemon.pid()) - cpu_s;
        const auto [least, most] = std::minmax_element(frames.begin(), frames.end());
        std::printf(
            "%zu viewers: age when shown p50 %.1f, p99 %.1f ms; %.1f to %.1f frames/s each; goniod uses %.2f cores\n",
            count, quantile(ages_ms, 0.5), quantile(ages_ms, 0.99), static_cast<double>(*least) / seconds,
            static_cast<double>(*most) / seconds, used_s / seconds);
        EXPECT_GT(*least, 2u) << count;
    }
}

// A still picture on a narrow line: it sharpens, one frame says that it is final, then nothing more comes.
TEST(Pacing, AStillPictureSharpensAndThenIsSilent) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "320x320"});
    ThrottleProxy line(port_of(daemon.url()), {1.5e6, 20ms, 16 << 10});
    Client viewer(line.port());
    viewer.join(kSubprotocolProto, true, false);
    viewer.keeps_pings = true;
    {
        const Mover mover(port_of(daemon.url()), swing_camera);
        watch(viewer, 1s);
    }
    bool final = false;
    unsigned after_final = 0;
    const auto end = Clock::now() + 40s;
    while (Clock::now() < end) {
        const Client::Frame frame = viewer.read_frame(final ? 2000 : 15000);
        if (frame.opcode == -1) break;
        if (frame.opcode == 9) viewer.send_frame(10, frame.payload);
        if (frame.opcode != 2 || frame.payload.empty() || frame.payload[0] != 2) continue;
        viewer.acknowledge(frame.seq());
        after_final = final ? after_final + 1 : 0;
        final = final || frame.header().final;
    }
    EXPECT_TRUE(final);
    EXPECT_EQ(after_final, 0u);
}

// The longest that a client waits for the answer to a command, and for a picture of a movement, for so long.
struct Waits {
    double answer_ms = 0, picture_ms = 0;
};
Waits longest_waits(const DaemonProcess& daemon, std::chrono::seconds time) {
    Client viewer(port_of(daemon.url())), asking(port_of(daemon.url()));
    viewer.join(kSubprotocolProto, true, false);
    asking.join(kSubprotocolProto, false, false);
    std::atomic<bool> stop{false};
    Waits waits;
    std::thread asks([&] {
        for (std::uint32_t id = 1; !stop; ++id) {
            v1::ClientMessage message;
            message.set_request_id(id);
            message.mutable_command()->mutable_set_master()->set_ratio(0.5 + 0.4 * std::sin(0.1 * id));
            const auto begin = Clock::now();
            asking.say(message);
            bool answered = false;
            while (!answered && Clock::now() - begin < 10s) {
                const Client::Frame frame = asking.read_frame(1000);
                if (frame.opcode != 2 || frame.payload.empty() || frame.payload[0] != 1) continue;
                const auto heard = decode_server_message(Encoding::proto, std::string_view(frame.payload).substr(1));
                answered = heard && heard->request_id() == id;
            }
            waits.answer_ms =
                std::max(waits.answer_ms, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
            std::this_thread::sleep_for(20ms);
        }
    });
    auto last = Clock::now();
    for (const auto end = last + time; Clock::now() < end;) {
        if (!viewer.read_picture(100)) continue;
        const auto now = Clock::now();
        waits.picture_ms = std::max(waits.picture_ms, std::chrono::duration<double, std::milli>(now - last).count());
        last = now;
    }
    stop = true;
    asks.join();
    return waits;
}

// Beside captures and a camera that swings, in a scene of many lights.
std::string ten_that_never_read_hold_up_nobody() {
    TemporaryFolder folder;
    DaemonProcess daemon({"--renderer", "gl", "--size", "320x320"});
    if (!daemon.transport_ready()) return "no transport";
    for (int i = 0; i < 31; ++i)
        daemon.rev({"add", "light", "light " + std::to_string(i), "--profile", "downlight", "--position",
                    std::to_string(-1.5 + 0.1 * i) + ",3,0"});
    const std::uint16_t port = port_of(daemon.url());
    daemon.gonio({"capture", folder.path("still.exr"), "--size", "320x320"});  // what it compiles is there then
    const Mover mover(port, swing_camera);
    std::atomic<bool> stop{false};
    std::thread captures([&] {
        while (!stop) daemon.gonio({"capture", folder.path("still.exr"), "--size", "320x320"});
    });
    const auto time = measuring_time();
    const Waits alone = longest_waits(daemon, time);
    std::vector<std::unique_ptr<Client>> deaf;
    for (int i = 0; i < 10; ++i) {
        deaf.push_back(std::make_unique<Client>(port, 4096));
        deaf.back()->join(kSubprotocolProto, true, true);
    }
    std::this_thread::sleep_for(1s);
    const Waits beside = longest_waits(daemon, time);
    stop = true;
    captures.join();
    std::printf("longest waits, alone: answer %.0f ms, picture %.0f ms; beside ten that never read: %.0f, %.0f\n",
                alone.answer_ms, alone.picture_ms, beside.answer_ms, beside.picture_ms);
    return unless(beside.answer_ms < 2 * alone.answer_ms + 100, "answers wait") +
           unless(beside.picture_ms < 2 * alone.picture_ms + 100, "pictures wait");
}

TEST(Pacing, TenThatNeverReadHoldUpNobody) {
    holds_in_one_of_three(ten_that_never_read_hold_up_nobody);
}

}  // namespace
}  // namespace gonio::test
