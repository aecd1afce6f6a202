// Fader boxes and presets as their users meet them: a recorded box on the real goniod, driven and asked through gonio.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <sstream>
#include <thread>

#include "tests/e2e/daemon_process.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

void pause_ms(int ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

// A line of a recording: a pitch bend of 14 bits.
std::string bend(double at_ms, unsigned channel, unsigned value) {
    char line[64];
    std::snprintf(line, sizeof line, "%.1f E%X %02X %02X\n", at_ms, channel - 1, value & 127, value >> 7);
    return line;
}

template <typename Condition>
bool within(int ms, const Condition& condition) {
    for (int waited = 0; waited < ms; waited += 20) {
        if (condition()) return true;
        pause_ms(20);
    }
    return condition();
}

double level_of(const DaemonProcess& daemon, std::size_t light) {
    return daemon.json({"get"})["lights"][light]["level_ratio"];
}

TEST(Surfaces, ABoxDrivesFromTheFirstMomentInAll14Bits) {
    TemporaryFolder folder;
    const std::string file =
        folder.file("box.txt", "midi 1397:00bc Motor Box\n" + bend(500, 1, 8193) + bend(600, 9, 4096));
    DaemonProcess daemon({"--size", "64x64", "--surface-replay", file});
    EXPECT_TRUE(within(5000, [&] { return std::abs(level_of(daemon, 0) - 8193 / 16383.0) < 1e-12; }))
        << level_of(daemon, 0);
    EXPECT_TRUE(within(
        1000, [&] { return std::abs(daemon.json({"get"})["master_ratio"].get<double>() - 4096 / 16383.0) < 1e-12; }));
    EXPECT_TRUE(within(2000, [&] { return daemon.json({"surfaces"})["devices"][0]["events"] == 2; }));
    const Json surfaces = daemon.json({"surfaces"});
    EXPECT_EQ(surfaces["devices"][0]["profile"], "Mackie Control");
    EXPECT_EQ(surfaces["devices"][0]["controls"][0]["steps"], 16383);
}

TEST(Surfaces, LearningMapsTheControlThatMoves) {
    TemporaryFolder folder;
    std::string text = "midi 1234:5678 Unknown\n";
    for (int i = 0; i < 400; ++i) {  // controller 7 of channel 5, up and down
        char line[64];
        std::snprintf(line, sizeof line, "%d B4 07 %02X\n", i * 50, i % 40 < 20 ? i % 40 * 6 : (40 - i % 40) * 6);
        text += line;
    }
    DaemonProcess daemon({"--size", "64x64", "--surface-replay", folder.file("box.txt", text)});
    const std::string light = daemon.json({"get"})["lights"][0]["name"];
    const Json learned = daemon.json({"learn", "--timeout", "10"});
    EXPECT_EQ(learned["control"], "cc 5/7");
    EXPECT_EQ(learned["device"], "1234:5678@replay");
    EXPECT_EQ(level_of(daemon, 0), 1.0) << "it drives nothing yet";
    const Finished mapped =
        daemon.gonio({"learn", light, "level", "--range", "0.25,0.5", "--takeover", "jump", "--smooth", "0"});
    EXPECT_EQ(mapped.exit_code, 0) << mapped.err;
    EXPECT_TRUE(within(3000, [&] {
        const double level = level_of(daemon, 0);
        return level >= 0.25 && level <= 0.5;
    }));
    const Json rows = daemon.json({"surfaces"})["rows"];
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0]["target"], light);
    EXPECT_EQ(daemon.gonio({"forget", "cc 5/7", "--box", "1234:5678@replay"}).exit_code, 0);
    EXPECT_EQ(daemon.json({"surfaces"})["rows"].size(), 0u);
    EXPECT_EQ(daemon.gonio({"forget", "cc 5/7"}).exit_code, 1) << "there is no such row any more";
}

TEST(Surfaces, AMapIsReadAndRefusedWithItsPlace) {
    TemporaryFolder folder;
    DaemonProcess daemon({"--size", "64x64", "--surfaces", "off"});
    const std::string good = folder.file("map.toml", "[[control]]\ncontrol = \"x\"\nproperty = \"orbit\"\n");
    EXPECT_EQ(daemon.gonio({"surfaces", good}).exit_code, 0);
    EXPECT_EQ(daemon.json({"surfaces"})["rows"][0]["property"], "orbit");
    const Finished bad =
        daemon.gonio({"surfaces", folder.file("bad.toml", "[[control]]\ncontrol = \"x\"\nproperty = \"glow\"\n")});
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_NE(bad.err.find("glow"), std::string::npos) << bad.err;
    EXPECT_EQ(daemon.json({"surfaces"})["rows"].size(), 1u) << "the old one stays";
    EXPECT_EQ(daemon.gonio({"learn", "--timeout", "0.2"}).exit_code, 1) << "nothing moved";
}

TEST(Presets, SavedRecalledAndFadedOverTime) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "64x64"});
    EXPECT_TRUE(daemon.transport_ready());
    daemon.json({"report"});  // takes the transport, which is no cost of a level
    const std::string light = daemon.json({"get"})["lights"][0]["name"];
    daemon.rev({"set", "light", light, "--level", "0.8"});
    daemon.rev({"preset", "save", "bright"});
    daemon.rev({"set", "light", light, "--level", "0.2"});
    daemon.rev({"preset", "save", "dim"});
    EXPECT_EQ(daemon.json({"get"})["presets"]["names"], (Json{"bright", "dim"}));
    const unsigned rev = daemon.rev({"preset", "recall", "bright"});
    EXPECT_DOUBLE_EQ(level_of(daemon, 0), 0.8);
    // Levels that change cost the composite only, as a fader does.
    const Json report = daemon.json({"report", "--rev", std::to_string(rev)});
    for (const Json& pass : report["passes"])
        if (pass["state"] == "ran") {
            EXPECT_TRUE(pass["name"] == "composite" || pass["name"] == "nv12") << pass["name"];
        }
    daemon.rev({"preset", "recall", "dim", "--fade", "1"});
    std::set<double> seen;
    EXPECT_TRUE(within(3000, [&] {
        seen.insert(level_of(daemon, 0));
        return level_of(daemon, 0) == 0.2;
    }));
    EXPECT_GE(seen.size(), 4u) << "on the way";
    EXPECT_EQ(daemon.gonio({"preset", "recall", "none"}).exit_code, 1);
    EXPECT_EQ(daemon.gonio({"preset", "blend", "dim"}).exit_code, 2);
    daemon.rev({"preset", "remove", "dim"});
    EXPECT_EQ(daemon.json({"get"})["presets"]["names"], (Json{"bright"}));
}

// A gonio that watches, so that frames are rendered, until the end of its scope.
class Viewer {
public:
    explicit Viewer(const DaemonProcess& daemon) : pid_(fork()) {
        if (pid_ != 0) return;
        const int nowhere = ::open("/dev/null", O_WRONLY);
        dup2(nowhere, STDOUT_FILENO);
        const char* folder = std::getenv("GONIO_BIN");
        const std::string program =
            folder != nullptr ? std::string(folder) + "/gonio"
                              : (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "gonio").string();
        execl(program.c_str(), "gonio", "--server", daemon.url().c_str(), "watch", nullptr);
        std::_Exit(127);
    }
    ~Viewer() {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
    }
    Viewer(const Viewer&) = delete;

private:
    pid_t pid_;
};

// All of 64 lights ridden 100 times a second: each frame costs the composite alone, and the lights have positions of
// one moment. How many frames that makes is printed, not judged: docs/faders.md has the figure of an idle machine.
TEST(Surfaces, SixtyFourLightsRiddenAtOnce) {
    TemporaryFolder folder;
    constexpr int kLights = 64, kFrom_ms = 4000, kUntil_ms = 120'000;  // the test ends before the box does
    const auto value_at = [](int tick, int light) { return (tick * 5 + light) % 128; };
    std::string text = "midi 1234:5678 Wing\n", map;
    for (int at = kFrom_ms; at < kUntil_ms; at += 10) {
        for (int i = 0; i < kLights; ++i) {
            char line[64];
            std::snprintf(line, sizeof line, "%d B0 %02X %02X\n", at, i, value_at(at / 10, i));
            text += line;
        }
    }
    for (int i = 0; i < kLights; ++i)
        map += "[[control]]\ncontrol = \"cc 1/" + std::to_string(i) + "\"\ntarget = \"#" + std::to_string(i + 1) +
               "\"\nproperty = \"level\"\ntakeover = \"jump\"\nsmooth_s = 0\n";
    DaemonProcess daemon({"--renderer", "gl", "--size", "400x400", "--surface-replay", folder.file("box.txt", text),
                          "--surface-map", folder.file("map.toml", map)});
    EXPECT_TRUE(daemon.transport_ready());
    const double one_mib = resident_mib(daemon.pid());
    for (int i = 1; i < kLights; ++i)
        daemon.rev({"add", "light", "l" + std::to_string(i), "--profile", "narrow_spot", "--position",
                    std::to_string(-1.6 + i % 8 * 0.45) + ",3.5," + std::to_string(-1.6 + i / 8 * 0.45)});
    const Viewer viewer(daemon);
    // Their layers are made first, once somebody looks, and narrow beams ask for more links.
    const std::set<std::string> composite{"composite"};
    int in_a_row = 0;
    EXPECT_TRUE(within(60'000, [&] {
        const bool ready = daemon.json({"stats"}).at("transport_ready").get<bool>();
        in_a_row = ready && passes_ran(daemon.json({"report"})) == composite ? in_a_row + 1 : 0;
        return in_a_row == 10;
    }));
    const Json before = daemon.json({"stats"});
    pause_ms(2000);
    const Json report = daemon.json({"report"}), after = daemon.json({"stats"});
    EXPECT_EQ(passes_ran(report), composite);
    EXPECT_LT(resident_mib(daemon.pid()) - one_mib, 16.0 * kLights) << "of layers; nothing here needs a light's maps";
    const int frames = after["frames_rendered"].get<int>() - before["frames_rendered"].get<int>();
    EXPECT_GT(frames, 5);
    std::printf("64 lights ridden at once, 400x400: %.1f frames a second, the last in %.1f ms\n", frames / 2.0,
                report["frame_ms"].get<double>());
    const Json lights = daemon.json({"get"})["lights"];
    const auto value_of = [&](int i) {
        return std::lround(127 * lights[static_cast<std::size_t>(i)]["level_ratio"].get<double>());
    };
    int tick = 0;
    while (value_at(tick, 0) != value_of(0)) ASSERT_LT(++tick, 128);
    for (int i = 1; i < kLights; ++i) EXPECT_EQ(value_of(i), value_at(tick, i)) << "positions of one moment";
}

// A scripted box at 1 kHz, watched: the newest position is in every frame, and the last one stays.
TEST(Surfaces, FaderToFrameAt1kHz) {
    TemporaryFolder folder;
    std::string text = "midi 1397:00bc Motor Box\n";
    constexpr int kEvents = 3000;
    for (int i = 0; i < kEvents; ++i) text += bend(2000 + i, 1, static_cast<unsigned>(i * 37 % 16384));
    DaemonProcess daemon({"--renderer", "gl", "--size", "320x320", "--surface-replay", folder.file("box.txt", text)});
    const Viewer viewer(daemon);
    pause_ms(1200);
    const auto before = daemon.json({"stats"})["frames_rendered"].get<unsigned>();
    pause_ms(kEvents + 1500);
    const Json stats = daemon.json({"stats"});
    const unsigned frames = stats["frames_rendered"].get<unsigned>() - before;
    const double median_ms = daemon.json({"surfaces"})["latency_ms"];
    EXPECT_DOUBLE_EQ(level_of(daemon, 0), (kEvents - 1) * 37 % 16384 / 16383.0)
        << "the last position is the one that stays";
    // A machine that is busy elsewhere makes fewer frames: then of those.
    const double frame_ms = std::max(1000.0 / 60, 1.0 * kEvents / std::max(frames, 1u));
    EXPECT_LE(median_ms, 1.5 * frame_ms) << "from the first event that a frame had not shown";
    EXPECT_GE(frames, kEvents / 50u);
    // The light may become finer in the very frame that shows the last position, so a picture at rest is judged.
    EXPECT_TRUE(within(60'000, [&] { return daemon.json({"stats"})["settled"].get<bool>(); }));
    const unsigned rev = daemon.rev({"set", "light", daemon.json({"get"})["lights"][0]["name"], "--level", "0.5"});
    const Json report = daemon.json({"report", "--rev", std::to_string(rev)});
    for (const Json& pass : report["passes"])
        if (pass["state"] == "ran") {
            EXPECT_TRUE(pass["name"] == "composite" || pass["name"] == "nv12") << pass["name"];
        }
    RecordProperty("median_ms", std::to_string(median_ms));
    std::printf("fader to frame: %.1f ms median, %u frames in %d s\n", median_ms, frames, kEvents / 1000);
}

}  // namespace
}  // namespace gonio::test
