// The largest files and commands that are accepted, while somebody watches a picture that moves: none of them holds up
// the others.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <thread>

#include "protocol/schema/command.pb.h"
#include "server/scene/scene.h"
#include "server/session/command_files.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/largest_files.h"
#include "tests/e2e/measured.h"
#include "tests/e2e/mover.h"

namespace gonio::test {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

// Whoever watches, and when each picture came.
class Watcher {
public:
    explicit Watcher(std::uint16_t port) : viewer_(port) {
        viewer_.join(kSubprotocolProto, true, false);
        thread_ = std::thread([this] {
            while (!stop_) {
                if (!viewer_.read_picture(200)) continue;
                const std::lock_guard lock(mutex_);
                came_.push_back(Clock::now());
            }
        });
    }
    ~Watcher() {
        stop_ = true;
        thread_.join();
    }
    Watcher(const Watcher&) = delete;
    // Median and longest of the gaps between pictures since the last call, ms.
    std::pair<double, double> gaps_ms() {
        const std::lock_guard lock(mutex_);
        std::vector<double> gaps;
        for (std::size_t i = 1; i < came_.size(); ++i)
            gaps.push_back(std::chrono::duration<double, std::milli>(came_[i] - came_[i - 1]).count());
        came_.erase(came_.begin(), came_.end() - (came_.empty() ? 0 : 1));
        if (gaps.empty()) return {0.0, 1e9};
        std::sort(gaps.begin(), gaps.end());
        return {gaps[gaps.size() / 2], gaps.back()};
    }

private:
    Client viewer_;
    std::mutex mutex_;
    std::vector<Clock::time_point> came_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

// Runs it while the picture moves, with a second before and after. Result: what did not hold.
std::string holds_up_nobody(Watcher& watcher, const char* what, const std::function<void()>& run) {
    watcher.gaps_ms();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    const auto begin = Clock::now();
    run();
    const double took_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    const auto [median, longest] = watcher.gaps_ms();
    std::printf("%s: answered in %.0f ms; pictures every %.1f ms, at most %.1f\n", what, took_ms, median, longest);
    return unless(longest <= 3 * median, std::string(what) + " holds up pictures");
}

TEST(Largest, NothingThatIsAcceptedHoldsUpThePicture) {
    TemporaryFolder folder;
    const std::string ies = folder.file("fine.ies", fine_ies(kMaxProfileBytes / 11));
    const std::string scene = folder.file("hills.glb", hills_glb(800));
    std::string patch;
    for (int i = 0; i < 4096; ++i)
        patch += "[[patch]]\nsacn = " + std::to_string(1 + i / 512) + "\naddress = " + std::to_string(1 + i % 512) +
                 "\ntarget = \"luminaire\"\nchannels = [\"level\"]\n";
    const std::string rows = folder.file("patch.toml", patch);
    holds_in_one_of_three([&] {
        DaemonProcess daemon({"--renderer", "gl", "--size", "160x160", "--scene-root", folder.path("")});
        if (!daemon.transport_ready()) return std::string("no transport");
        const Mover mover(port_of(daemon.url()), [](v1::Command& command, int step) {
            command.mutable_set_exposure()->set_ev100(6 + 0.5 * std::sin(0.1 * step));
        });
        Watcher watcher(port_of(daemon.url()));
        std::string missed = holds_up_nobody(watcher, "nothing", [] {});
        missed += holds_up_nobody(watcher, "photometry", [&] {
            for (int i = 0; i < 7; ++i)
                daemon.rev({"add", "light", "fine" + std::to_string(i), "--profile", ies, "--position", "0,3,0"});
        });
        missed += holds_up_nobody(watcher, "patch", [&] { EXPECT_EQ(daemon.gonio({"patch", rows}).exit_code, 0); });
        missed += holds_up_nobody(watcher, "preset", [&] {
            daemon.rev({"preset", "save", "all"});
            daemon.rev({"preset", "recall", "all"});
        });
        missed += holds_up_nobody(watcher, "scene", [&] { daemon.rev({"load", "scene", scene}); });
        return missed;
    });
}

// Seven of the largest photometric files in a saved show: a service must be ready in 30 s (packaging/goniod.service).
TEST(Largest, AShowOfTheLargestFilesIsReadyInTime) {
    TemporaryFolder folder;
    const std::string state = folder.path("show.json");
    std::vector<std::string> names = {"luminaire"};
    {
        DaemonProcess daemon({"--renderer", "gl", "--size", "160x160", "--state", state});
        for (int i = 0; i < 7; ++i) {
            const std::string number = std::to_string(i);
            std::string text = fine_ies(kMaxProfileBytes / 11);
            text.replace(text.find("[TEST] x"), 8, "[TEST] " + number);  // each a file of its own
            names.push_back("fine" + number);
            daemon.rev(
                {"add", "light", names.back(), "--profile", folder.file(number + ".ies", text), "--position", "0,3,0"});
        }
        EXPECT_EQ(daemon.stop(), 0);
    }
    const auto begin = Clock::now();
    DaemonProcess daemon({"--renderer", "gl", "--size", "160x160", "--state", state});
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(30));
    std::vector<std::string> restored;
    const Json scene = daemon.json({"get"});
    for (const Json& light : scene["lights"]) restored.push_back(light["name"]);
    EXPECT_EQ(restored, names);
}

// 2 million triangles take some 400 MiB while they are read: where these are not left the scene is refused before it
// takes any, by whichever bound, and all else goes on. What is loaded is given back with the next scene.
TEST(Largest, ASceneThatDoesNotFitIsRefusedAndOneThatGoesIsGivenBack) {
    TemporaryFolder folder;
    const std::string scene = folder.file("hills.glb", hills_glb(1000));
    const auto refused = [&](const DaemonProcess& daemon) {
        const Finished loaded = daemon.gonio({"load", "scene", scene, "--json"});
        EXPECT_EQ(loaded.exit_code, 1);
        EXPECT_NE(loaded.out.find("too_large"), std::string::npos) << loaded.out << loaded.err;
        EXPECT_TRUE(daemon.alive());
        daemon.rev({"load", "scene", "cornell"});
    };
    {
        const DaemonProcess daemon({"--renderer", "gl", "--size", "160x160", "--max-memory-mib", "600"});
        refused(daemon);
    }
    DaemonProcess daemon({"--renderer", "gl", "--size", "160x160"});
    const auto fill_undo = [&] {  // it keeps four scenes
        for (int i = 0; i < 5; ++i) daemon.rev({"load", "scene", "cornell"});
        EXPECT_TRUE(daemon.transport_ready());
    };
    fill_undo();
    const double before_mib = resident_mib(daemon.pid());
    rlimit unlimited{}, tight{};
    ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_AS, nullptr, &unlimited), 0);
    std::size_t pages = 0;
    std::ifstream("/proc/" + std::to_string(daemon.pid()) + "/statm") >> pages;
    tight.rlim_cur = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + (300u << 20);
    tight.rlim_max = unlimited.rlim_max;
    ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_AS, &tight, nullptr), 0);
    refused(daemon);
    ASSERT_EQ(::prlimit(daemon.pid(), RLIMIT_AS, &unlimited, nullptr), 0);
    daemon.rev({"load", "scene", scene});
    EXPECT_TRUE(daemon.transport_ready());
    const double loaded_mib = resident_mib(daemon.pid());
    EXPECT_GT(loaded_mib, before_mib + 200);
    fill_undo();
    EXPECT_LT(resident_mib(daemon.pid()), before_mib + 0.25 * (loaded_mib - before_mib));
}

}  // namespace
}  // namespace gonio::test
