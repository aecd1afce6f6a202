// The whole program as its users meet it: goniod started, driven by gonio, asked what it did.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/assets/assets.h"
#include "server/render/quality_level.h"
#include "server/transport/links.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/mover.h"
#include "tests/e2e/onlooker.h"
#include "tests/shared_data.h"
#include "tests/unit/http_client.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

// Names of the passes that ran, "name" or "name:light".
std::set<std::string> ran(const Json& report) {
    std::set<std::string> names;
    for (const Json& pass : report["passes"]) {
        EXPECT_TRUE(pass.contains("light"));
        if (pass["state"] == "ran")
            names.insert(pass["name"].get<std::string>() +
                         (pass["light"].is_null() ? "" : ":" + pass["light"].get<std::string>()));
    }
    return names;
}

// Whether anything ran that belongs to a luminaire alone, whoever looks.
bool any_light_pass(const std::set<std::string>& names) {
    for (const std::string& name : names) {
        for (const char* part : {"shadow", "rsm", "mask", "vpl"}) {
            if (name.find(part) != std::string::npos) return true;
        }
    }
    return false;
}

std::string number(double value) {
    std::ostringstream out;
    out << value;
    return out.str();
}

std::string triple(double x, double y, double z) {
    return number(x) + "," + number(y) + "," + number(z);
}

TEST(Cornell, ReadyStateAndCostTable) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "320x320"});
    ASSERT_TRUE(daemon.transport_ready());
    for (int i = 0; i < 20 && !daemon.json({"report"})["settled"].get<bool>(); ++i) {
    }
    const Json state = daemon.json({"get"});
    ASSERT_TRUE(state["scene_rev"].is_number_unsigned());
    EXPECT_EQ(state["scene"], "cornell");
    ASSERT_GE(state["lights"].size(), 1u);
    const std::string light = state["lights"][0]["name"];
    EXPECT_EQ(state["lights"][0]["aim"].size(), 3u);
    EXPECT_EQ(state["lights"][0]["c0"].size(), 3u);

    // Level, colour, exposure: the composite only.
    const std::vector<std::vector<std::string>> cheap = {{"set", "light", light, "--level", "0.5"},
                                                         {"set", "light", light, "--color", "1,0.5,0.25"},
                                                         {"set", "exposure", "4"},
                                                         {"set", "master", "0.8"}};
    for (const auto& words : cheap) {
        const unsigned rev = daemon.rev(words);
        const Json report = daemon.json({"report", "--rev", std::to_string(rev)});
        EXPECT_GE(report["scene_rev"].get<unsigned>(), rev);
        std::set<std::string> passes = ran(report);
        passes.erase("nv12");  // of its own where shaders make the picture
        EXPECT_EQ(passes, std::set<std::string>{"composite"}) << words[2];
        EXPECT_GT(report["frame_ms"].get<double>(), 0.0);
        EXPECT_TRUE(report["settled"].get<bool>());
    }

    // Camera: no light map.
    const unsigned moved = daemon.rev({"set", "camera", "--eye", "0.2,2,7"});
    const auto camera = ran(daemon.json({"report", "--rev", std::to_string(moved)}));
    EXPECT_TRUE(camera.contains("gbuffer"));
    EXPECT_TRUE(camera.contains("gather:" + light));
    EXPECT_FALSE(any_light_pass(camera));

    // Profile: the light's own passes, neither G-buffer nor clean faces.
    TemporaryFolder folder;
    const unsigned swapped =
        daemon.rev({"set", "light", light, "--profile", folder.file("iso.ies", isotropic_ies(300))});
    const auto profile = ran(daemon.json({"report", "--rev", std::to_string(swapped)}));
    for (const char* name : {"surfels:", "solve:", "direct:", "gather:"})
        EXPECT_TRUE(profile.contains(name + light)) << name;
    EXPECT_FALSE(profile.contains("gbuffer"));
    const Json after = daemon.json({"get", "lights[0]"});
    EXPECT_NEAR(after["max_cd"].get<double>(), 300.0, 1e-3);
    EXPECT_NEAR(after["flux_lm"].get<double>(), 300.0 * 4 * M_PI, 0.01);

    // Aim: no face that is clean at this position is made again, nothing of the camera.
    const unsigned turned = daemon.rev({"set", "light", light, "--tilt", "20"});
    const auto aim = ran(daemon.json({"report", "--rev", std::to_string(turned)}));
    EXPECT_TRUE(aim.contains("surfels:" + light));
    EXPECT_FALSE(aim.contains("shadow:" + light)) << "an isotropic source had reached all faces";
    EXPECT_FALSE(aim.contains("gbuffer"));
}

// Nobody looks, nobody asks: no surfel and no link is made.
TEST(Cornell, NothingIsPreparedForNobody) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "256x256", "--max-transport-mib", "256"});
    EXPECT_TRUE(comes_to_rest(daemon.pid(), 0.1));
    Json stats = daemon.json({"stats"});  // which asks for it
    EXPECT_FALSE(stats["transport_ready"].get<bool>());
    for (int i = 0; i < 600 && !stats["transport_ready"].get<bool>(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        stats = daemon.json({"stats"});
    }
    EXPECT_TRUE(stats["transport_ready"].get<bool>());
    EXPECT_GT(stats["transport"]["surfels"].get<int>(), 10'000);
}

TEST(Cornell, NothingHappensWhileNothingChanges) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "256x256"});
    // A viewer watches for the whole test.
    TemporaryFolder folder;
    std::thread viewer([&] {
        run_program("gonio", {"--server", daemon.url(), "watch", "--out", folder.path("stream.h264")});
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(800));
    daemon.rev({"set", "light", daemon.json({"get", "lights[0].name"}), "--level", "0.7"});
    // The picture gets better for a while, then nothing more comes.
    Json before = daemon.json({"stats"});
    EXPECT_FALSE(before["settled"].get<bool>()) << "somebody looks";
    for (int i = 0; i < 600 && !before["settled"].get<bool>(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        before = daemon.json({"stats"});
    }
    EXPECT_TRUE(before["settled"].get<bool>());
    EXPECT_GE(before["frames_encoded"].get<int>(), 2 + 4) << "refined ones among them";
    EXPECT_TRUE(comes_to_rest(daemon.pid(), 0.01));
    const Json after = daemon.json({"stats"});
    for (const char* counter : {"frames_rendered", "frames_encoded", "packets_sent"})
        EXPECT_EQ(before[counter], after[counter]) << counter;
    daemon.stop();  // which ends the viewer
    viewer.join();
    std::ifstream stream(folder.path("stream.h264"), std::ios::binary);
    char head[4] = {};
    stream.read(head, 4);
    EXPECT_EQ(std::string(head, 4), std::string("\0\0\0\1", 4)) << "Annex B";
}

// Reports of frames that light anew.
std::vector<Json> reports_while_moving(const DaemonProcess& daemon, std::size_t count) {
    const Mover mover(port_of(daemon.url()), [](v1::Command& command, int step) {
        v1::SetLight& light = *command.mutable_set_light();
        light.set_name("luminaire");
        for (const double x : {0.1 * (step % 7), 3.8, 0.1}) light.add_position_m(x);
    });
    std::vector<Json> reports;
    for (int asked = 0; asked < 2000 && reports.size() < count; ++asked) {
        Json report = daemon.json({"report"});
        if (ran(report).contains("gather:luminaire")) reports.push_back(std::move(report));
    }
    return reports;
}

// Frames of a moving luminaire at a rate that no machine reaches: after a few of them each has less work, which reports
// name. When the luminaire rests the picture is whole again and gets better. Which effort follows which frame times is
// tested apart (Budget).
TEST(Cornell, FramesThatComeLateHaveLessWork) {
    constexpr int kSide = 640;
    constexpr std::size_t kFrames = 24;
    DaemonProcess daemon(
        {"--renderer", "gl", "--size", std::to_string(kSide) + "x" + std::to_string(kSide), "--target-fps", "1000"});
    ASSERT_TRUE(daemon.transport_ready());
    const Onlooker viewer(daemon);
    const std::vector<Json> moving = reports_while_moving(daemon, kFrames);
    ASSERT_EQ(moving.size(), kFrames);
    std::map<int, std::size_t> efforts;
    for (const Json& report : moving) {
        const int effort = report["effort"];
        ++efforts[effort];
        ASSERT_LT(effort, static_cast<int>(kQualityLevels.size()));
        const QualityLevel& chosen = kQualityLevels.at(static_cast<std::size_t>(effort));
        EXPECT_NEAR(report["width_px"].get<int>(), kSide * chosen.scale, 2.0);
        EXPECT_EQ(report["height_px"], report["width_px"]);
        EXPECT_EQ(report["refined_rounds"].get<int>(), 0);
    }
    EXPECT_LT(2 * efforts[0], moving.size()) << "most frames are whole";
    EXPECT_EQ(efforts.rbegin()->first, static_cast<int>(kQualityLevels.size()) - 1) << "as little as there is";
    Json still;
    // Not too often: a message interrupts what makes the picture better.
    for (int i = 0; i < 30; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1200));
        still = daemon.json({"report"});
        if (still["refined_rounds"].get<int>() > 0) break;
    }
    EXPECT_EQ(still["effort"].get<int>(), 0);
    EXPECT_EQ(still["width_px"].get<int>(), kSide);
    EXPECT_EQ(still["height_px"].get<int>(), kSide);
    EXPECT_EQ(still["links"].get<unsigned>(), transport::kMostForwardLinks);
    EXPECT_GT(still["refined_rounds"].get<int>(), 0);
}

TEST(Cornell, TheLastFrameOfAMovementArrives) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "256x256"});
    const std::string light = daemon.json({"get", "lights[0].name"});
    Finished watched;
    // The viewer prints a line per frame header; it is ended by the daemon's stop.
    std::thread watcher([&] { watched = run_program("gonio", {"--server", daemon.url(), "watch"}); });
    std::this_thread::sleep_for(std::chrono::milliseconds(800));
    unsigned last = 0;
    for (int i = 0; i < 12; ++i) last = daemon.rev({"set", "light", light, "--level", number(0.3 + 0.05 * i)});
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    daemon.stop();
    watcher.join();
    unsigned newest = 0, frames = 0;
    std::istringstream lines(watched.out);
    for (std::string line; std::getline(lines, line);) {
        const Json json = Json::parse(line, nullptr, false);
        if (!json.is_discarded() && json.contains("frame")) {
            const unsigned rev = json["frame"]["scene_rev"];
            EXPECT_GE(rev, newest) << "never an older picture after a newer one";
            newest = rev;
            ++frames;
        }
    }
    EXPECT_EQ(newest, last);
    EXPECT_GE(frames, 2u);
}

TEST(Floor, MeterAndPictureReadTheInverseSquareLaw) {
    TemporaryFolder folder;
    DaemonProcess daemon(
        {"--renderer", "gl", "--scene", folder.file("floor.gltf", floor_gltf(0.5)), "--size", "200x200"});
    const Json meter = daemon.json({"meter", "--point", "0,0,0", "--normal", "0,1,0"});
    EXPECT_NEAR(meter["direct_lx"].get<double>(), 250.0, 0.5);
    EXPECT_NEAR(meter["indirect_lx"].get<double>(), 0.0, 1e-9);
    EXPECT_NEAR(meter["total_lx"].get<double>(), 250.0, 0.5);
    ASSERT_EQ(meter["direct_rgb_lx"].size(), 3u);

    const Finished capture =
        daemon.gonio({"capture", folder.path("lux.exr"), "--view", "illuminance", "--size", "201x201"});
    ASSERT_EQ(capture.exit_code, 0) << capture.err;
    const auto lux = read_picture(folder.path("lux.exr"));
    ASSERT_TRUE(lux);
    // The camera stands 6 m above the floor and looks straight down, 0.8 rad high.
    for (int x : {100, 60, 150, 20}) {
        const double at = ((x + 0.5) / 201 * 2 - 1) * std::tan(0.4) * 6.0;
        const double expected = 1000.0 * 2.0 / std::pow(4.0 + at * at, 1.5);
        EXPECT_NEAR(static_cast<double>(lux->values[static_cast<std::size_t>((100 * 201 + x) * lux->channels)]),
                    expected, 0.01 * expected)
            << x;
    }
    ASSERT_EQ(daemon.gonio({"capture", folder.path("nits.exr"), "--view", "luminance", "--size", "201x201"}).exit_code,
              0);
    const auto nits = read_picture(folder.path("nits.exr"));
    ASSERT_TRUE(nits);
    EXPECT_NEAR(static_cast<double>(nits->values[static_cast<std::size_t>((100 * 201 + 100) * nits->channels)]),
                0.5 * 250.0 / M_PI, 0.5);
}

// Values read off the table by hand: at V = 45 the planes C0, C90, C180 and C270 have 880, 930, 980 and 1030 cd.
TEST(Floor, AnAsymmetricFileFacesTheRightWay) {
    TemporaryFolder folder;
    DaemonProcess daemon(
        {"--renderer", "gl", "--scene", folder.file("floor.gltf", floor_gltf(0.5)), "--size", "64x64"});
    const std::string file =
        folder.file("planes.ies",
                    "IESNA:LM-63-2002\n[TEST] e2e\n[TESTLAB] e2e\n[ISSUEDATE] today\n[MANUFAC] none\nTILT=NONE\n1 -1 1 "
                    "3 5 1 2 0 0 0\n1 1 10\n"
                    "0 45 90\n0 90 180 270 360\n900 880 10\n900 930 10\n900 980 10\n900 1030 10\n900 880 10\n");
    daemon.rev({"set", "light", "lamp", "--profile", file, "--pan", "0", "--tilt", "0", "--roll", "0"});
    // Pan and tilt 0: C0 = +X, C90 = -Z. Two metres aside at two metres' height: cos 45 / 8.
    const auto lux = [&](double x, double z) {
        return daemon.json({"meter", "--point", triple(x, 0, z), "--normal", "0,1,0"})["direct_lx"].get<double>();
    };
    const double share = std::sqrt(0.5) / 8.0;
    EXPECT_NEAR(lux(2, 0), 880 * share, 0.1);
    EXPECT_NEAR(lux(0, -2), 930 * share, 0.1);
    EXPECT_NEAR(lux(-2, 0), 980 * share, 0.1);
    EXPECT_NEAR(lux(0, 2), 1030 * share, 0.1);
    EXPECT_NEAR(lux(0, 0), 900 / 4.0, 0.2);
}

TEST(Scene, AGreatCaptureLetsOthersThrough) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "128x128"});
    TemporaryFolder folder;
    Finished big;
    std::thread capture([&] {
        big = daemon.gonio({"capture", folder.path("big.exr"), "--view", "indirect", "--size", "640x640"});
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    // Each tile is a bounded piece of work; between two of them commands are applied and queries answered.
    for (int i = 0; i < 3; ++i) {
        const auto start = std::chrono::steady_clock::now();
        daemon.rev({"set", "exposure", std::to_string(4 + i)});
        daemon.json({"stats"});
        EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
    }
    capture.join();
    EXPECT_EQ(big.exit_code, 0) << big.err;
    const auto lux = read_picture(folder.path("big.exr"));
    ASSERT_TRUE(lux);
    EXPECT_EQ(lux->width_px, 640);
    EXPECT_GT(std::filesystem::file_size(folder.path("big.exr")), 2u << 20)
        << "larger than any message a client may send";
}

TEST(Floor, ARealFileReadsItsOwnCandela) {
    const auto path = test::shared_data("photometry/ies/photompy__LLIA001477-002.ies");
    if (!path) GTEST_SKIP() << "no shared photometry on this machine";
    std::ifstream file(*path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    const auto profile = make_profile("real", bytes);
    ASSERT_TRUE(profile) << profile.error().text();
    TemporaryFolder folder;
    DaemonProcess daemon(
        {"--renderer", "gl", "--scene", folder.file("floor.gltf", floor_gltf(0.5)), "--size", "128x128"});
    daemon.rev({"set", "light", "lamp", "--profile", path->string(), "--pan", "0", "--tilt", "0", "--roll", "0",
                "--opening", "point"});
    // Pan/tilt zero: aim -Y, C0 = +X, C90 = -Z.
    for (const auto& [x, z] : {std::pair{0.01, 0.0}, {1.0, 0.3}, {-0.7, 1.5}, {0.4, -2.0}, {2.5, 1.0}}) {
        const double d2 = x * x + z * z + 4.0;
        const double candela = ies::intensity((*profile)->photometry.web, {x, -z, -2.0}).in(cd);
        const double expected = candela * 2.0 / std::pow(d2, 1.5);
        const Json meter = daemon.json({"meter", "--point", triple(x, 0, z), "--normal", "0,1,0"});
        EXPECT_NEAR(meter["direct_lx"].get<double>(), expected, 0.005 * expected + 1e-3) << x << "," << z;
    }
}

TEST(Scene, LoadsTheOtherSceneAndBack) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "160x160"});
    const unsigned atrium = daemon.rev({"load", "scene", "atrium"});
    const Json report = daemon.json({"report", "--rev", std::to_string(atrium)});
    EXPECT_TRUE(ran(report).contains("gbuffer"));
    EXPECT_EQ(daemon.json({"get", "scene"}), "atrium");
    EXPECT_GT(daemon.rev({"load", "scene", "cornell"}), atrium);
}

TEST(Scene, LightsGroupsViewsAndTechniques) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "128x128"});
    const std::string first = daemon.json({"get", "lights[0].name"});
    daemon.rev({"add", "light", "spot", "--profile", "narrow_spot", "--position", "0.5,3,0.5", "--aim", "0.1,-1,0.2"});
    daemon.rev({"group", "both", first, "spot"});
    daemon.rev({"set", "light", "both", "--level", "0.25"});
    const Json state = daemon.json({"get"});
    for (const Json& light : state["lights"]) EXPECT_DOUBLE_EQ(light["level_ratio"].get<double>(), 0.25);
    for (const char* view : {"direct", "indirect", "illuminance", "luminance", "mask", "rsm-depth", "rsm-normal",
                             "rsm-flux", "solid", "beauty"}) {
        const unsigned rev = daemon.rev({"set", "view", view});
        EXPECT_TRUE(ran(daemon.json({"report", "--rev", std::to_string(rev)})).contains("composite")) << view;
    }
    const unsigned seed = daemon.rev({"set", "technique", "seed", "--samples", "20"});
    EXPECT_TRUE(ran(daemon.json({"report", "--rev", std::to_string(seed)})).contains("gather:" + first));
    daemon.rev({"set", "technique", "default"});
    daemon.rev({"remove", "light", "spot"});
    EXPECT_EQ(daemon.json({"get", "lights"}).size(), 1u);
    TemporaryFolder folder;
    for (const char* name : {"a.png", "a.jpg", "a.exr"}) {
        ASSERT_EQ(daemon.gonio({"capture", folder.path(name)}).exit_code, 0) << name;
        const auto picture = read_picture(folder.path(name));
        ASSERT_TRUE(picture) << name;
        EXPECT_EQ(picture->width_px, 128);
    }
}

TEST(Scene, OneCallOfGonioUndoesWhatAnotherDid) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "64x64"});
    const std::string first = daemon.json({"get", "lights[0].name"});
    const Json before = daemon.json({"get", "lights"});
    const auto sum_lx = [&] {
        TemporaryFolder folder;
        EXPECT_EQ(daemon.gonio({"capture", folder.path("a.exr"), "--view", "illuminance", "--bounces", "0"}).exit_code,
                  0);
        const auto picture = read_picture(folder.path("a.exr"));
        double sum = 0;
        for (const float value : picture->values) sum += double(value);
        return sum;
    };
    const double lit = sum_lx();
    daemon.rev({"set", "light", first, "--level", "25%", "--pan", "20"});
    daemon.rev({"rename", "light", first, "main"});
    const unsigned removed = daemon.rev({"remove", "light", "main"});
    EXPECT_EQ(daemon.json({"get", "lights"}).size(), 0u);
    EXPECT_EQ(sum_lx(), 0);
    EXPECT_GT(daemon.rev({"undo"}), removed);
    EXPECT_EQ(daemon.json({"get", "lights[0].name"}), "main");
    daemon.rev({"undo"});
    daemon.rev({"undo"});
    EXPECT_EQ(daemon.json({"get", "lights"}), before);
    EXPECT_NEAR(sum_lx(), lit, 0.001 * lit) << "it is lit as before";
    const auto nothing = daemon.gonio({"undo"});
    EXPECT_EQ(nothing.exit_code, 1);
    EXPECT_EQ(nothing.err, "gonio: not_found undo: nothing to undo\n");
    daemon.rev({"redo"});
    EXPECT_DOUBLE_EQ(daemon.json({"get", "lights[0].level_ratio"}).get<double>(), 0.25);
    EXPECT_EQ(daemon.gonio({"undo", "--role", "viewer"}).exit_code, 1) << "a viewer changes nothing";
}

TEST(Daemon, StopsCleanlyAndNamesBadOptions) {
    DaemonProcess daemon({"--size", "64x64"});
    EXPECT_EQ(daemon.stop(), 0);
    EXPECT_EQ(run_program("goniod", {"--size", "banana"}).exit_code, 2);
    const Finished missing = run_program("goniod", {"--scene", "/nowhere/at/all.gltf", "--listen", "127.0.0.1:0"});
    EXPECT_EQ(missing.exit_code, 2);
    EXPECT_NE(missing.err.find("/nowhere/at/all.gltf"), std::string::npos) << missing.err;
    const Finished open = run_program("goniod", {"--listen", "0.0.0.0:0"});
    EXPECT_NE(open.exit_code, 0);
    EXPECT_NE(open.err.find("--token-file"), std::string::npos) << open.err;
}

TEST(Oneshot, CapturesAJobAndNamesWhatIsWrongInIt) {
    TemporaryFolder folder;
    const std::string scene = folder.file("floor.gltf", floor_gltf(0.5));
    const std::string job = folder.file("job.json", R"({"frames":[
        {"set":[["set","light","lamp","--level","0.5"]],"capture":{"out":"a/half.exr","view":"illuminance","size":"101x101"}},
        {"set":[["light","lamp","--level","1"],["exposure","5"]],"capture":{"out":"full.png","size":"64x48"}}]})");
    const Finished done = run_program("goniod", {"--scene", scene, "--oneshot", job, "--out", folder.path("out")});
    ASSERT_EQ(done.exit_code, 0) << done.err;
    const auto lux = read_picture(folder.path("out/a/half.exr"));
    ASSERT_TRUE(lux);
    EXPECT_NEAR(static_cast<double>(lux->values[static_cast<std::size_t>((50 * 101 + 50) * lux->channels)]), 125.0,
                0.7);
    EXPECT_EQ(read_picture(folder.path("out/full.png"))->height_px, 48);
    const std::string bad = folder.file("bad.json", R"({"frames":[{},{"set":[["light","nobody","--level","0.5"]]}]})");
    const Finished refused = run_program("goniod", {"--scene", scene, "--oneshot", bad, "--out", folder.path("out")});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("frames[1].set[0]"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("nobody"), std::string::npos) << refused.err;
    const std::string escape = folder.file("escape.json", R"({"frames":[{"capture":{"out":"../x.png"}}]})");
    EXPECT_EQ(run_program("goniod", {"--scene", scene, "--oneshot", escape, "--out", folder.path("out")}).exit_code, 1);
}

}  // namespace
}  // namespace gonio::test
