// What a show survives: the end of the program in every way, a lost GL context, a full disk, no descriptors; and who
// may change it.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <thread>

#include "tests/e2e/daemon_process.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::string text_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

// Result: the show on disk; null where there is none.
Json show_in(const std::string& path) {
    Json show = Json::parse(text_of(path), nullptr, false);
    return show.is_object() ? show : Json(nullptr);
}

bool until(const std::function<bool()>& done, std::chrono::milliseconds time = 10s) {
    for (const auto end = Clock::now() + time; Clock::now() < end;) {
        if (done()) return true;
        std::this_thread::sleep_for(20ms);
    }
    return false;
}

// The state without what counts up.
Json show_of(const DaemonProcess& daemon) {
    Json state = daemon.json({"get"});
    state.erase("scene_rev");
    for (const char* of_this_run : {"control", "boot", "restored_rev"}) state.erase(of_this_run);
    return state;
}

// A connection that says something and then neither reads nor writes.
class SilentClient {
public:
    SilentClient(const std::string& url, const std::string& says)
        : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        const int small = 4096;
        setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_port = htons(port_of(url));
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
        EXPECT_EQ(write(fd_, says.data(), says.size()), static_cast<ssize_t>(says.size()));
    }
    ~SilentClient() { close(fd_); }
    SilentClient(const SilentClient&) = delete;

private:
    int fd_;
};

const std::string kMjpeg = "GET /v1/mjpeg HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";

TEST(SavedShow, ComesBackAfterAKill) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    const std::string ies = folder.file("mine.ies", isotropic_ies(1234));
    Json before;
    unsigned rev = 0;
    {
        DaemonProcess daemon({"--size", "160x120", "--state", file});
        const std::string light = daemon.json({"get", "lights[0].name"});
        daemon.rev({"set", "light", light, "--level", "0.4", "--profile", ies, "--pan", "20", "--tilt", "35"});
        daemon.rev({"preset", "save", "look 1"});
        daemon.rev({"add", "light", "spot", "--profile", "narrow_spot", "--position", "1,3,0", "--aim", "0,-1,-0.5"});
        daemon.rev({"set", "light", "spot", "--color", "1,0.5,0.25", "--level", "0.8"});
        daemon.rev({"group", "both", light, "spot"});
        daemon.rev({"preset", "save", "look 2"});
        daemon.rev({"preset", "recall", "look 1"});
        daemon.rev({"set", "camera", "--eye", "0,2,4", "--fov", "50"});
        daemon.rev({"set", "view", "indirect", "--gain", "3", "--light", "spot"});
        daemon.rev({"set", "exposure", "4.5"});
        daemon.rev({"set", "technique", "default", "--samples", "1000"});
        daemon.rev({"patch", folder.file("patch.toml",
                                         "[[patch]]\nsacn = 2\naddress = 7\ntarget = \"spot\"\n"
                                         "channels = [\"level\"]\n")});
        rev = daemon.rev({"set", "master", "0.7"});
        before = show_of(daemon);
        before["patch"] = daemon.json({"patch"});
        ASSERT_TRUE(until([&] { return show_in(file)["scene_rev"] == rev; }));
        EXPECT_EQ(daemon.json({"stats"})["state_error"], "");
        kill(daemon.pid(), SIGKILL);
    }
    DaemonProcess daemon({"--state", file});
    Json after = show_of(daemon);
    after["patch"] = daemon.json({"patch"});
    // Angles come back, orientations that were given otherwise to the last few bits.
    for (Json* state : {&before, &after})
        for (Json& light : (*state)["lights"])
            for (const char* vector : {"aim", "c0"})
                for (Json& x : light[vector]) x = std::round(x.get<double>() * 1e12);
    EXPECT_EQ(after, before) << Json::diff(before, after);
    EXPECT_GT(daemon.json({"get", "scene_rev"}).get<unsigned>(), rev) << "revisions go on";
    EXPECT_EQ(daemon.json({"preset", "recall", "look 2"})["code"], "ok");
    const unsigned last = daemon.rev({"set", "master", "0.6"});
    EXPECT_EQ(daemon.stop(), 0);
    EXPECT_EQ(show_in(file)["scene_rev"], last) << "what was changed right before the end is there";
    EXPECT_EQ(show_in(file)["complete"], true);
    DaemonProcess again({"--state", file});
    EXPECT_EQ(again.json({"get", "master_ratio"}), 0.6);
}

// Without the last bits of orientations.
Json rounded(Json state) {
    for (Json& light : state["lights"])
        for (const char* vector : {"aim", "c0"})
            for (Json& x : light[vector]) x = std::round(x.get<double>() * 1e12);
    state.erase("show");  // whether it is saved
    return state;
}

TEST(SavedShow, UndoGoesOnAfterAKillAndAfterAnEnd) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    const std::string scene = folder.file("floor.gltf", floor_gltf(0.5));
    const std::string ies = folder.file("mine.ies", isotropic_ies(1234));
    std::vector<Json> states;
    {
        DaemonProcess daemon({"--size", "64x64", "--state", file});
        const auto change = [&](const std::vector<std::string>& words) {
            states.push_back(rounded(show_of(daemon)));
            daemon.rev(words);
        };
        const std::string light = daemon.json({"get", "lights[0].name"});
        change({"set", "light", light, "--level", "0.4", "--profile", ies});
        change({"remove", "light", light});
        change({"load", "scene", scene, "--upload"});
        change({"add", "light", "spot", "--profile", ies, "--position", "0,3,0", "--aim", "0,-1,0"});
        change({"set", "light", "spot", "--level", "0.8"});
        change({"set", "master", "0.7"});
        ASSERT_TRUE(until([&] { return daemon.json({"stats"}).value("state_unsaved_s", 0.0) == 0.0; }));
        kill(daemon.pid(), SIGKILL);
    }
    const auto undo = [](DaemonProcess& daemon) {
        return until([&] { return daemon.gonio({"undo"}).exit_code == 0; });  // a scene before may still be read
    };
    for (const std::size_t most : {std::size_t{2}, states.size()}) {
        DaemonProcess daemon({"--state", file});
        for (std::size_t step = 0; step < most && !states.empty(); ++step) {
            ASSERT_TRUE(undo(daemon)) << states.size() << daemon.log();
            const Json now = rounded(show_of(daemon));
            EXPECT_EQ(now, states.back()) << Json::diff(states.back(), now);
            states.pop_back();
        }
        EXPECT_EQ(daemon.stop(), 0);
    }
    EXPECT_TRUE(states.empty());
    // Nothing of another state.
    std::ofstream(file + ".undo", std::ios::binary | std::ios::app) << "x";
    DaemonProcess daemon({"--state", file});
    EXPECT_EQ(daemon.gonio({"undo"}).exit_code, 1);
    EXPECT_NE(daemon.log().find("It is damaged."), std::string::npos) << daemon.log();
}

TEST(SavedShow, TheFileIsWholeWheneverTheProgramIsKilled) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    std::mt19937 random(7);
    double master = 1, at_start = 1;
    for (int round = 0; round < 4; ++round) {
        DaemonProcess daemon({"--size", "64x64", "--state", file});
        // What came back was true once: between what the last run began with and what it ended with.
        const double restored = daemon.json({"get", "master_ratio"});
        EXPECT_GE(restored, master * 0.999 - 1e-6);  // the last one may have been cut off before its answer
        EXPECT_LE(restored, at_start + 1e-6);
        master = at_start = restored;
        std::atomic<bool> ends{false};
        std::thread hand([&] {
            while (!ends) {
                const Finished set = daemon.gonio({"set", "master", std::to_string(master * 0.999)});
                if (set.exit_code == 0) master *= 0.999;
            }
        });
        std::this_thread::sleep_for(std::chrono::milliseconds(500 + random() % 1500));
        kill(daemon.pid(), SIGKILL);
        ends = true;
        hand.join();
        const Json show = show_in(file);
        ASSERT_TRUE(show.is_object()) << text_of(file).substr(0, 200);
        EXPECT_EQ(show["version"], 1);
        EXPECT_FALSE(std::filesystem::exists(file + ".bad"));
    }
}

TEST(SavedShow, AnotherSceneOnTheCommandLineAndABadFileKeepWhatWasThere) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    const std::string scene = folder.file("floor.gltf", floor_gltf(0.5));
    unsigned rev = 0;
    {
        DaemonProcess daemon({"--size", "64x64", "--state", file});
        rev = daemon.rev({"set", "master", "0.5"});
    }
    const std::string cornell = text_of(file);
    {
        DaemonProcess daemon({"--size", "64x64", "--state", file, "--scene", scene});
        EXPECT_EQ(daemon.json({"get", "master_ratio"}), 1.0);
        EXPECT_GT(daemon.json({"get", "scene_rev"}).get<unsigned>(), rev);
        EXPECT_EQ(text_of(file + ".aside"), cornell);
        daemon.rev({"set", "master", "0.25"});
    }
    {
        DaemonProcess daemon({"--state", file, "--size", "96x64"});
        EXPECT_EQ(std::filesystem::path(daemon.json({"get", "scene"}).get<std::string>()).filename(), "floor.gltf");
        EXPECT_EQ(daemon.json({"get", "master_ratio"}), 0.25);
        EXPECT_EQ(daemon.json({"get", "size_px"}), Json({96, 64})) << "said on the command line";
    }
    std::filesystem::remove(scene);
    {
        DaemonProcess daemon({"--state", file});
        EXPECT_EQ(daemon.json({"get", "scene"}), "cornell") << "the saved one is gone";
        EXPECT_EQ(daemon.json({"get", "master_ratio"}), 0.25);
        EXPECT_EQ(Json::parse(text_of(file + ".aside-2"))["master_ratio"], 0.25);
    }
    std::ofstream(file) << cornell.substr(0, cornell.size() / 2);
    DaemonProcess daemon({"--state", file, "--size", "64x64"});
    EXPECT_EQ(daemon.json({"get", "master_ratio"}), 1.0);
    EXPECT_EQ(text_of(file + ".bad"), cornell.substr(0, cornell.size() / 2));
}

TEST(SavedShow, WhatCannotBeRestoredIsKeptAside) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    {
        DaemonProcess daemon({"--size", "64x64", "--state", file});
        daemon.rev({"add", "light", "spot", "--profile", "narrow_spot", "--position", "1,3,0"});
        daemon.rev({"preset", "save", "look"});
        EXPECT_EQ(daemon.stop(), 0);
    }
    Json show = show_in(file);
    show["profiles"][0]["photometry"] = "SUVTTkE6TE0tNjMtMjAwMgpicm9rZW4=";  // a header and nothing else
    const std::string broken = show.dump();
    std::ofstream(file) << broken;
    DaemonProcess daemon({"--state", file});
    ASSERT_TRUE(until([&] { return text_of(file) != broken && show_in(file).is_object(); }));
    EXPECT_EQ(show_in(file)["lights"].size(), show["lights"].size()) << "the light is there, dark";
    EXPECT_NE(daemon.log().find("light 'spot' is dark: its profile is missing"), std::string::npos);
    EXPECT_EQ(text_of(file + ".aside"), broken) << "and what was saved of its profile is not gone";
    EXPECT_NE(daemon.log().find("is kept as " + file + ".aside"), std::string::npos);
}

TEST(SavedShow, AFullDiskEndsNothing) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    DaemonProcess daemon({"--size", "64x64", "--state", file});
    ASSERT_TRUE(until([&] { return show_in(file).is_object(); }));
    rlimit free{};
    ASSERT_EQ(prlimit(daemon.pid(), RLIMIT_FSIZE, nullptr, &free), 0);
    const rlimit full{50, free.rlim_max};
    ASSERT_EQ(prlimit(daemon.pid(), RLIMIT_FSIZE, &full, nullptr), 0);
    daemon.rev({"set", "master", "0.5"});
    EXPECT_TRUE(until([&] { return daemon.json({"stats"})["state_error"] != ""; }));
    EXPECT_TRUE(show_in(file).is_object()) << "the old one";
    EXPECT_EQ(daemon.json({"get", "master_ratio"}), 0.5);
    prlimit(daemon.pid(), RLIMIT_FSIZE, &free, nullptr);
    daemon.rev({"set", "master", "0.25"});
    EXPECT_TRUE(until([&] { return show_in(file)["master_ratio"] == 0.25; }));
    EXPECT_TRUE(until([&] { return daemon.json({"stats"})["state_error"] == ""; }));
}

TEST(SavedShow, IsOneServersAloneAndStaysBehindItsLink) {
    const TemporaryFolder folder;
    const std::string file = folder.path("real.json"), link = folder.path("link.json");
    std::filesystem::create_symlink("real.json", link);
    const std::vector<std::string> options{"--size", "64x64", "--state"};
    const auto with = [&](const std::string& path) {
        std::vector<std::string> all = options;
        all.push_back(path);
        return all;
    };
    DaemonProcess daemon(with(link));
    daemon.rev({"set", "master", "0.5"});
    EXPECT_TRUE(until([&] { return show_in(file)["master_ratio"] == 0.5; }));
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    const Finished other = run_program("goniod", with(file));
    EXPECT_EQ(other.exit_code, 69);
    EXPECT_NE(other.err.find("Another server"), std::string::npos) << other.err;
    EXPECT_NE(other.err.find(file), std::string::npos) << other.err;
}

TEST(Limits, WithoutDescriptorsTheServerGoesOn) {
    const TemporaryFolder folder;
    const std::string file = folder.path("show.json");
    DaemonProcess daemon({"--size", "64x64", "--state", file});
    const std::string scene = folder.file("floor.gltf", floor_gltf(0.5));
    ASSERT_TRUE(until([&] { return show_in(file).is_object(); }));
    std::size_t open = 0;
    for ([[maybe_unused]] const auto& fd :
         std::filesystem::directory_iterator("/proc/" + std::to_string(daemon.pid()) + "/fd"))
        ++open;
    rlimit free{};
    ASSERT_EQ(prlimit(daemon.pid(), RLIMIT_NOFILE, nullptr, &free), 0);
    const rlimit few{open + 3, free.rlim_max};
    ASSERT_EQ(prlimit(daemon.pid(), RLIMIT_NOFILE, &few, nullptr), 0);
    {
        std::vector<std::unique_ptr<SilentClient>> crowd;
        for (int i = 0; i < 40; ++i)
            crowd.push_back(std::make_unique<SilentClient>(daemon.url(), "GET / HTTP/1.1\r\n"));
        std::this_thread::sleep_for(500ms);
        EXPECT_TRUE(daemon.alive());
    }
    EXPECT_TRUE(until([&] { return daemon.gonio({"set", "master", "0.5"}).exit_code == 0; })) << "they are gone again";
    daemon.gonio({"load", "scene", scene});  // may fail for want of a descriptor; the server stays
    EXPECT_TRUE(daemon.alive());
    prlimit(daemon.pid(), RLIMIT_NOFILE, &free, nullptr);
    EXPECT_TRUE(until([&] { return show_in(file)["master_ratio"] == 0.5; }));
    EXPECT_EQ(daemon.stop(), 0);
}

TEST(ContextLoss, AViewerSeesAGapAndNotAnEnd) {
    DaemonProcess daemon(
        {"--renderer", "gl", "--size", "160x160", "--inject", "gl-loss-after=8", "--inject", "gl-rebuild-fails=1"});
    const std::string light = daemon.json({"get", "lights[0].name"});
    const Json meter = daemon.json({"meter", "--point", "0,0,1", "--normal", "0,1,0"});
    std::atomic<bool> ends{false};
    std::thread hand([&] {
        for (int i = 0; !ends; ++i) daemon.gonio({"set", "light", light, "--level", i % 2 == 0 ? "0.3" : "0.9"});
    });
    const Finished watched = run_program("gonio", {"--server", daemon.url(), "watch", "--frames", "20"});
    EXPECT_EQ(watched.exit_code, 0) << watched.err;
    ends = true;
    hand.join();
    EXPECT_EQ(daemon.json({"stats"})["gpu_resets"], 1);
    // It is the same scene: what is measured and captured after the loss is what it was before.
    const unsigned rev = daemon.rev({"set", "light", light, "--level", "1"});
    const Json again = daemon.json({"meter", "--point", "0,0,1", "--normal", "0,1,0"});
    EXPECT_NEAR(again["total_lx"].get<double>() / meter["total_lx"].get<double>(), 1.0, 1e-4);
    daemon.json({"report", "--rev", std::to_string(rev)});
    EXPECT_TRUE(until([&] { return daemon.json({"stats"})["settled"].get<bool>(); })) << "and then silence";
}

TEST(ContextLoss, ThreeFailedRebuildsEndTheProgram) {
    DaemonProcess daemon(
        {"--renderer", "gl", "--size", "64x64", "--inject", "gl-loss-after=1", "--inject", "gl-rebuild-fails=3"});
    siginfo_t info{};
    ASSERT_TRUE(until([&] {
        return waitid(P_PID, static_cast<id_t>(daemon.pid()), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               info.si_pid == daemon.pid();
    }));
    EXPECT_EQ(info.si_code, CLD_EXITED);
    EXPECT_EQ(info.si_status, 69);
}

// SIGTERM ends the program with exit code 0 within two seconds, whatever it is at.
class Ending : public testing::Test {
protected:
    void start(std::vector<std::string> more = {}) {
        more.insert(more.begin(), {"--size", "160x160"});
        daemon = std::make_unique<DaemonProcess>(more);
    }
    // The first signal, which is heard when this returns.
    void end_once() {
        kill(daemon->pid(), SIGTERM);
        ASSERT_TRUE(until([&] { return daemon->log().find("stopping") != std::string::npos; }));
    }
    // The tests hang something for ever, so a goniod that waits for it exceeds any bound. A busy machine takes seconds.
    static constexpr double kLong_s = 10.0;
    void expect_prompt_end() {
        const auto began = Clock::now();
        EXPECT_EQ(daemon->stop(), 0);
        EXPECT_LT(std::chrono::duration<double>(Clock::now() - began).count(), kLong_s);
    }
    std::unique_ptr<DaemonProcess> daemon;
};

TEST_F(Ending, WhenIdle) {
    start({"--renderer", "gl"});
    start();
    expect_prompt_end();
}

TEST_F(Ending, DuringAReferenceCapture) {
    start({"--renderer", "gl"});
    start();
    const KilledClient client(daemon->url(),
                              {"capture", "/dev/null/x.png", "--quality", "reference", "--noise", "0.0005"});
    ASSERT_TRUE(until([&] { return daemon->json({"stats"})["reference_running"] == 1; }));
    expect_prompt_end();
}

TEST_F(Ending, WhileAScenesFileIsRead) {
    start();
    std::vector<std::unique_ptr<KilledClient>> clients;
    for (int i = 0; i < 4; ++i)
        clients.push_back(
            std::make_unique<KilledClient>(daemon->url(), std::vector<std::string>{"load", "scene", "atrium"}));
    std::this_thread::sleep_for(300ms);
    expect_prompt_end();
}

TEST_F(Ending, DuringAMeterGrid) {
    start({"--renderer", "gl"});
    start();
    const KilledClient client(daemon->url(), {"meter", "--point", "-1,0,-1", "--normal", "0,1,0", "--u", "2,0,0", "--v",
                                              "0,0,2", "--count", "64x64"});
    std::this_thread::sleep_for(300ms);
    expect_prompt_end();
}

TEST_F(Ending, WithClientsThatDoNotRead) {
    start();
    const SilentClient stream(daemon->url(), kMjpeg), half(daemon->url(), "GET / HT");
    const SilentClient socket(daemon->url(),
                              "GET /v1/ws HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: "
                              "websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
                              "dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: gonio.v1.json\r\n\r\n");
    const KilledClient viewer(daemon->url(), {"watch"});
    std::this_thread::sleep_for(500ms);
    expect_prompt_end();
}

TEST_F(Ending, AViewerIsTold) {
    start();
    std::thread end([&] {
        std::this_thread::sleep_for(500ms);
        EXPECT_EQ(daemon->stop(), 0);
    });
    const Finished watched = run_program("gonio", {"--server", daemon->url(), "--json", "watch"});
    end.join();
    EXPECT_EQ(watched.exit_code, 3);
    EXPECT_NE(watched.err.find("The server stops."), std::string::npos) << watched.err;
}

TEST_F(Ending, TheSecondSignalEndsAtOnce) {
    start();
    const KilledClient client(daemon->url(), {"load", "scene", "atrium"});
    std::this_thread::sleep_for(200ms);
    const auto began = Clock::now();
    kill(daemon->pid(), SIGTERM);
    std::this_thread::sleep_for(60ms);
    const int code = daemon->stop();
    EXPECT_TRUE(code == 128 + SIGTERM || code == 0) << code;  // 0: it was quicker than the second one
    EXPECT_LT(std::chrono::duration<double>(Clock::now() - began).count(), kLong_s);
}

// The folders of uploads below a folder.
std::size_t upload_folders(const std::string& below) {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(below))
        count += entry.path().filename().string().starts_with(".goniod-uploads-");
    return count;
}

// The state file's disk never answers: the end does not wait for it, and leaves nothing behind that is private.
TEST_F(Ending, WhileTheDiskOfTheStateHangs) {
    TemporaryFolder folder;
    const std::string state = folder.path("show.json"), scene = folder.file("floor.gltf", floor_gltf(0.5));
    for (const bool twice : {false, true}) {
        setenv("XDG_RUNTIME_DIR", folder.path("").c_str(), 1);
        start({"--state", state, "--inject", "state-hangs"});
        unsetenv("XDG_RUNTIME_DIR");
        daemon->rev({"load", "scene", scene, "--upload"});
        ASSERT_EQ(upload_folders(folder.path("")), 1u);
        const auto began = Clock::now();
        if (twice) end_once();
        EXPECT_EQ(daemon->stop(), twice ? 128 + SIGTERM : 0);
        const double took_s = std::chrono::duration<double>(Clock::now() - began).count();
        EXPECT_LT(took_s, kLong_s);
        if (!twice) {
            EXPECT_GT(took_s, 1.5) << "nothing held it up";
        }
        EXPECT_EQ(upload_folders(folder.path("")), 0u);
        EXPECT_FALSE(std::filesystem::exists(state));
    }
}

// What SIGHUP reads again lies on a disk that never answers: the signals after it are heard all the same.
TEST_F(Ending, WhileAReloadHangs) {
    TemporaryFolder folder;
    const auto hang_up = [&] {
        for (int i = 0; i < 2; ++i) {
            kill(daemon->pid(), SIGHUP);
            std::this_thread::sleep_for(100ms);
        }
    };
    start({"--inject", "reload-hangs"});
    hang_up();
    EXPECT_EQ(daemon->log().find("reloaded"), std::string::npos) << "it hangs";
    expect_prompt_end();
    start({"--inject", "reload-hangs", "--inject", "state-hangs", "--state", folder.path("show.json")});
    hang_up();
    const auto began = Clock::now();
    end_once();
    EXPECT_EQ(daemon->stop(), 128 + SIGTERM) << "the second one ends it at once";
    EXPECT_LT(std::chrono::duration<double>(Clock::now() - began).count(), kLong_s);
}

TEST(Roles, ViewersTheLeaseAndConflicts) {
    DaemonProcess daemon({"--size", "64x64"});
    const auto refused = [&](std::vector<std::string> words) -> Json {
        words.insert(words.begin(), "--json");
        const Finished run = daemon.gonio(words);
        EXPECT_EQ(run.exit_code, 1) << run.out << run.err;
        return Json::parse(run.out, nullptr, false);
    };
    EXPECT_EQ(refused({"--role", "viewer", "set", "master", "0.5"})["code"], "permission");
    EXPECT_EQ(refused({"--role", "viewer", "control", "acquire"})["code"], "permission");
    EXPECT_EQ(daemon.json({"--role", "viewer", "get", "master_ratio"}), 1.0);
    EXPECT_NE(daemon.gonio({"--role", "king", "get"}).exit_code, 0);
    {
        const KilledClient holder(daemon.url(), {"--json", "control", "acquire"});
        ASSERT_TRUE(until([&] { return daemon.json({"get", "control"})["holder"] != 0; }));
        EXPECT_EQ(daemon.json({"get", "control.name"}), "gonio");
        const Json held = refused({"set", "camera", "--fov", "60"});
        EXPECT_EQ(held["code"], "held");
        EXPECT_EQ(held["value"], "gonio");
        EXPECT_EQ(refused({"control", "release"})["code"], "held");
        daemon.rev({"set", "master", "0.5"});  // the camera alone is held
    }
    ASSERT_TRUE(until([&] { return daemon.json({"get", "control"})["holder"] == 0; })) << "it ends with the connection";
    daemon.rev({"set", "camera", "--fov", "60"});
    {
        const KilledClient holder(daemon.url(), {"--json", "control", "acquire"});
        ASSERT_TRUE(until([&] { return daemon.json({"get", "control"})["holder"] != 0; }));
        EXPECT_EQ(daemon.gonio({"control", "release", "--take"}).exit_code, 0);
        EXPECT_EQ(daemon.json({"get", "control"})["holder"], 0);
    }
    EXPECT_EQ(daemon.gonio({"control", "acquire", "--hold", "0.1"}).exit_code, 0);

    const unsigned before = daemon.json({"get", "scene_rev"});
    const unsigned changed = daemon.rev({"set", "exposure", "3"});
    const Json conflict = refused({"set", "exposure", "4", "--base-rev", std::to_string(before)});
    EXPECT_EQ(conflict["code"], "conflict");
    EXPECT_EQ(conflict["field"], "exposure_ev100");
    EXPECT_EQ(conflict["value"], std::to_string(changed));
    daemon.rev({"set", "exposure", "4", "--base-rev", std::to_string(changed)});
    daemon.rev({"set", "master", "0.4", "--base-rev=" + std::to_string(changed)});
}

}  // namespace
}  // namespace gonio::test
