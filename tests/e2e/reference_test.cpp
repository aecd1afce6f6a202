// Reference quality, grids and errors of readings, as users meet them.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <thread>

#include "server/assets/assets.h"
#include "tests/e2e/daemon_process.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

// Waits until the counter of the server's stats has the value; false after 30 s.
bool until(const DaemonProcess& daemon, const char* counter, int value) {
    for (int i = 0; i < 300; ++i) {
        if (daemon.json({"stats"})[counter] == value) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
}

// What an isotropic source of 1000 cd 2 m above the floor gives at (x, z): I cos / d².
double floor_lx(double x, double z) {
    return 1000.0 * 2.0 / std::pow(4.0 + x * x + z * z, 1.5);
}

TEST(Reference, AllQualitiesReadTheInverseSquareLaw) {
    TemporaryFolder folder;
    DaemonProcess daemon(
        {"--renderer", "gl", "--scene", folder.file("floor.gltf", floor_gltf(0.5)), "--size", "64x64"});
    for (const char* quality : {"interactive", "rsm", "reference"}) {
        const Json meter = daemon.json({"meter", "--point", "0,0,0", "--normal", "0,1,0", "--quality", quality});
        EXPECT_NEAR(meter["direct_lx"].get<double>(), 250.0, 0.5) << quality;
        EXPECT_NEAR(meter["indirect_lx"].get<double>(), 0.0, 1e-6) << quality;
        EXPECT_NEAR(meter["total_lx"].get<double>(), 250.0, 0.5) << quality;
        EXPECT_EQ(meter["direct_error_lx"], 0.0) << quality << ": evaluated exactly";
        EXPECT_TRUE(meter["indirect_error_lx"].is_number());
        EXPECT_TRUE(meter["samples"].is_number_unsigned());
        for (const char* bounces : {"0", "1", "7", "all"}) {
            const Finished done = daemon.gonio(
                {"meter", "--point", "0,0,0", "--normal", "0,1,0", "--quality", quality, "--bounces", bounces});
            const bool has = std::string(quality) == "reference" || std::string(bounces) == "1" ||
                             (std::string(quality) == "interactive" && std::string(bounces) != "7");
            EXPECT_EQ(done.exit_code, has ? 0 : 1) << quality << " " << bounces << done.err;
        }
    }
}

TEST(Reference, GridsOfAllQualities) {
    TemporaryFolder folder;
    DaemonProcess daemon(
        {"--renderer", "gl", "--scene", folder.file("floor.gltf", floor_gltf(0.5)), "--size", "64x64"});
    for (const char* quality : {"interactive", "rsm", "reference"}) {
        const Json grid = daemon.json({"meter", "--point", "-2,0,-1", "--normal", "0,1,0", "--u", "4,0,0", "--v",
                                       "0,0,3", "--count", "4x3", "--quality", quality});
        ASSERT_EQ(grid["points"].size(), 12u) << quality;
        double sum = 0.0, least = 1e9, greatest = 0.0;
        for (int k = 0; k < 12; ++k) {
            const double x = -2.0 + k % 4 + 0.5, z = -1.0 + k / 4 + 0.5, lx = floor_lx(x, z);
            const Json& point = grid["points"][static_cast<std::size_t>(k)];
            EXPECT_NEAR(point["point_m"][0].get<double>(), x, 1e-12);
            EXPECT_NEAR(point["point_m"][2].get<double>(), z, 1e-12);
            EXPECT_NEAR(point["total_lx"].get<double>(), lx, 0.003 * lx) << quality << " " << x << "," << z;
            EXPECT_TRUE(point.contains("indirect_error_lx"));
            sum += lx;
            least = std::min(least, lx);
            greatest = std::max(greatest, lx);
        }
        EXPECT_NEAR(grid["mean_lx"].get<double>(), sum / 12, 0.003 * sum / 12);
        EXPECT_NEAR(grid["min_lx"].get<double>(), least, 0.003 * least);
        EXPECT_NEAR(grid["max_lx"].get<double>(), greatest, 0.003 * greatest);
        EXPECT_NEAR(grid["uniformity_ratio"].get<double>(), least / (sum / 12), 0.005);
    }
    const Finished many = daemon.gonio(
        {"meter", "--point", "-2,0,-1", "--normal", "0,1,0", "--u", "4,0,0", "--v", "0,0,3", "--count", "4097x1"});
    EXPECT_EQ(many.exit_code, 1);
    EXPECT_NE(many.err.find("too_large meter.count 4097,1"), std::string::npos) << many.err;
}

// An interactive grid leaves the picture to the viewers: a level change in between costs one composite.
TEST(Reference, AGreatGridLetsFramesThroughAndLeavesPassesClean) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "96x96"});
    EXPECT_TRUE(daemon.transport_ready());
    daemon.json({"report"});
    const KilledClient grid(daemon.url(), {"meter", "--point", "-1.9,0,-1.9", "--normal", "0,1,0", "--u", "3.8,0,0",
                                           "--v", "0,0,3.8", "--count", "64x64", "--quality", "rsm"});
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    for (int i = 0; i < 3; ++i) {
        const unsigned rev = daemon.rev({"set", "exposure", std::to_string(4 + i)});
        const Json report = daemon.json({"report", "--rev", std::to_string(rev)});
        for (const Json& pass : report["passes"]) {
            const bool picture = pass["name"] == "composite" || pass["name"] == "nv12";
            EXPECT_EQ(pass["state"] == "ran", picture) << pass["name"] << " " << pass["state"];
        }
        EXPECT_LT(report["frame_ms"].get<double>(), 1000.0);
    }
    EXPECT_FALSE(grid.ended()) << "all of that happened beside it";
}

// What it says of its error covers how far the interactive meter is from the traced light of every bounce.
TEST(Reference, InteractiveErrorsCoverWhatTheyLeaveOut) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "64x64"});
    double squares = 0.0, spread = 0.0;
    for (const char* point : {"0,0,1.5", "-1.2,0,0.4", "1.5,0,-1.5", "0.7,0,1.9", "-1.8,0,1.8", "1.1,0,0.9"}) {
        const Json list = daemon.json({"meter", "--point", point, "--normal", "0,1,0"});
        const Json all =
            daemon.json({"meter", "--point", point, "--normal", "0,1,0", "--quality", "reference", "--noise", "0.003"});
        const double off = list["indirect_lx"].get<double>() - all["indirect_lx"].get<double>();
        const double error = list["indirect_error_lx"].get<double>();
        EXPECT_EQ(list["bounces"], "all");
        EXPECT_LE(std::abs(off), 4 * std::hypot(error, all["indirect_error_lx"].get<double>())) << point;
        squares += off * off;
        spread += error * error;
    }
    EXPECT_LT(squares, 2.0 * spread);
    EXPECT_GT(squares, 0.02 * spread) << "an error estimate, not a bound for everything";
}

// The left wall of cornell seen straight on from a metre away: pixels are patches of it.
TEST(Reference, CaptureAndMeterAgree) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "64x64"});
    const double tan_half = 0.2, distance = 1.0;
    daemon.rev({"set", "camera", "--eye", "-1,3,1", "--target", "-2,3,1", "--fov",
                std::to_string(2 * std::atan(tan_half) * 180 / M_PI)});
    TemporaryFolder folder;
    const Json capture = daemon.json({"capture", folder.path("wall.exr"), "--view", "illuminance", "--size", "12x12",
                                      "--quality", "reference", "--noise", "0.02"});
    EXPECT_GE(capture["samples"].get<int>(), 8);
    EXPECT_LE(capture["noise_ratio"].get<double>(), 0.02);
    EXPECT_GT(capture["noise_ratio"].get<double>(), 0.0);
    EXPECT_FALSE(capture.contains("report"));
    const auto lux = read_picture(folder.path("wall.exr"));
    ASSERT_TRUE(lux);
    ASSERT_EQ(lux->width_px, 12);
    double seen = 0.0;
    for (int i = 0; i < 144; ++i) seen += static_cast<double>(lux->values[static_cast<std::size_t>(i * lux->channels)]);
    const double side = 2 * tan_half * distance;
    const Json grid = daemon.json(
        {"meter", "--point", "-2," + std::to_string(3 - side / 2) + "," + std::to_string(1 - side / 2), "--normal",
         "1,0,0", "--u", "0,0," + std::to_string(side), "--v", "0," + std::to_string(side) + ",0", "--count", "12x12",
         "--quality", "reference", "--noise", "0.02"});
    // 144 pixels of 2 % and 144 points of at most 2 %: the means differ by 0.24 % (one sigma).
    EXPECT_NEAR(seen / 144, grid["mean_lx"].get<double>(), 0.01 * seen / 144);
    double indirect = 0.0;
    for (const Json& point : grid["points"]) indirect += point["indirect_lx"].get<double>() / 144;
    EXPECT_GT(indirect, 0.05 * seen / 144) << "there is something to agree on";

    // Direct light alone has no noise: the same as the interactive picture, through the same exposure and dither.
    for (const char* quality : {"interactive", "reference"}) {
        ASSERT_EQ(daemon
                      .gonio({"capture", folder.path(std::string(quality) + ".png"), "--view", "direct", "--size",
                              "32x32", "--quality", quality})
                      .exit_code,
                  0);
    }
    const auto ours = read_picture(folder.path("reference.png")), live = read_picture(folder.path("interactive.png"));
    ASSERT_TRUE(ours && live);
    ASSERT_EQ(ours->values.size(), live->values.size());
    double difference = 0.0;
    for (std::size_t i = 0; i < ours->values.size(); ++i)
        difference +=
            static_cast<double>(std::abs(ours->values[i] - live->values[i])) / static_cast<double>(ours->values.size());
    EXPECT_LT(difference, 0.5 / 255);

    const Finished solid =
        daemon.gonio({"capture", folder.path("no.png"), "--view", "solid", "--quality", "reference"});
    EXPECT_EQ(solid.exit_code, 1);
    EXPECT_NE(solid.err.find("unsupported capture.view solid"), std::string::npos) << solid.err;
}

TEST(Reference, FewSamplesAndLittleTime) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "64x64"});
    TemporaryFolder folder;
    const auto capture = [&](const std::string& file, std::vector<std::string> more) {
        std::vector<std::string> words{"capture", folder.path(file), "--quality", "reference"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    };
    const Json denoised = daemon.json(capture("few.exr", {"--denoise"}));
    EXPECT_EQ(denoised["denoised"], true);
    EXPECT_EQ(denoised["noise_reached"], true);
    EXPECT_LE(denoised["noise_ratio"].get<double>(), 0.15);
    EXPECT_LT(denoised["denoised_noise_ratio"].get<double>(), denoised["noise_ratio"].get<double>());
    std::ifstream file(folder.path("few.exr"), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    EXPECT_NE(bytes.find("gonio:denoised"), std::string::npos);
    const Finished lux = daemon.gonio(capture("lux.exr", {"--denoise", "--view", "illuminance"}));
    EXPECT_EQ(lux.exit_code, 1);
    EXPECT_NE(lux.err.find("unsupported capture.denoise illuminance"), std::string::npos) << lux.err;

    // A pass of 512 x 512 takes a second or so, and 64 of them are filtered at least.
    const Finished live = daemon.gonio(capture("live.png", {"--denoise", "--max-seconds", "0.1", "--size", "512x512"}));
    EXPECT_EQ(live.exit_code, 0) << live.err;
    EXPECT_NE(live.err.find("looks worse than the live picture"), std::string::npos) << live.err;
    EXPECT_EQ(live.out.find("samples"), std::string::npos) << live.out;

    const Finished late =
        daemon.gonio(capture("late.png", {"--noise", "0.0005", "--max-seconds", "0.3", "--size", "32x32"}));
    EXPECT_EQ(late.exit_code, 0);
    EXPECT_NE(late.out.find("the noise asked for is not reached"), std::string::npos) << late.out;
    const Json lx = daemon.json({"meter", "--point", "0,0,1.5", "--normal", "0,1,0", "--quality", "reference",
                                 "--noise", "0.0005", "--max-seconds", "0.1"});
    EXPECT_EQ(lx["noise_reached"], false);
    EXPECT_GE(lx["samples"].get<int>(), 1024);
}

TEST(Reference, FramesGoOnBesideACaptureThatEndsWithItsClient) {
    DaemonProcess daemon({"--renderer", "gl", "--size", "128x128"});
    EXPECT_TRUE(daemon.transport_ready());
    daemon.json({"report"});
    TemporaryFolder folder;
    {
        const KilledClient endless(daemon.url(), {"capture", folder.path("never.exr"), "--quality", "reference",
                                                  "--size", "512x512", "--noise", "0.0005"});
        const KilledClient second(daemon.url(), {"capture", folder.path("never2.exr"), "--quality", "reference",
                                                 "--size", "512x512", "--noise", "0.0005"});
        ASSERT_TRUE(until(daemon, "reference_running", 1));
        ASSERT_TRUE(until(daemon, "reference_waiting", 1));
        for (int i = 0; i < 3; ++i) {
            const unsigned rev = daemon.rev({"set", "exposure", std::to_string(4 + i)});
            const Json report = daemon.json({"report", "--rev", std::to_string(rev)});
            for (const Json& pass : report["passes"]) {
                const bool picture = pass["name"] == "composite" || pass["name"] == "nv12";
                EXPECT_EQ(pass["state"] == "ran", picture) << pass["name"] << " " << pass["state"];
            }
        }
        EXPECT_FALSE(endless.ended());
        EXPECT_FALSE(second.ended());
    }
    EXPECT_TRUE(until(daemon, "reference_cancelled", 2));
    EXPECT_TRUE(until(daemon, "reference_running", 0));
    const Json stats = daemon.json({"stats"});
    EXPECT_EQ(stats["reference_waiting"], 0);
    EXPECT_EQ(stats["reference_done"], 0);
    EXPECT_FALSE(std::ifstream(folder.path("never.exr")));
    // The next client is served.
    EXPECT_GT(daemon
                  .json({"meter", "--point", "0,0,1.5", "--normal", "0,1,0", "--quality", "reference", "--noise",
                         "0.05"})["indirect_lx"]
                  .get<double>(),
              0.0);
    EXPECT_EQ(daemon.json({"stats"})["reference_done"], 1);
    // And the server stops at once although a job runs.
    const KilledClient last(daemon.url(), {"capture", folder.path("never3.exr"), "--quality", "reference", "--size",
                                           "512x512", "--noise", "0.0005"});
    ASSERT_TRUE(until(daemon, "reference_running", 1));
    EXPECT_EQ(daemon.stop(), 0);
}

TEST(Reference, OneshotTakesTheSameCaptures) {
    TemporaryFolder folder;
    const std::string scene = folder.file("floor.gltf", floor_gltf(0.5));
    const std::string job = folder.file("job.json", R"({"frames":[{"capture":{"out":"lux.exr","view":"illuminance",
        "size":"21x21","quality":"reference","bounces":2,"noise":0.05,"samples_per_pixel":1,"openings":false}},
        {"capture":{"out":"all.png","size":"8x8","quality":"reference","bounces":"all","noise":0.2}},
        {"capture":{"out":"few.png","size":"8x8","quality":"reference","denoise":true,"max_seconds":9}}]})");
    const Finished done = run_program("goniod", {"--scene", scene, "--oneshot", job, "--out", folder.path("out")});
    ASSERT_EQ(done.exit_code, 0) << done.err;
    const auto lux = read_picture(folder.path("out/lux.exr"));
    ASSERT_TRUE(lux);
    EXPECT_NEAR(static_cast<double>(lux->values[static_cast<std::size_t>((10 * 21 + 10) * lux->channels)]), 250.0, 1.0);
    EXPECT_EQ(read_picture(folder.path("out/all.png"))->width_px, 8);
    struct Case {
        const char* wrong;
        const char* named;
    };
    const Case cases[] = {{R"("quality":"reference","bounces":65)", "65"},
                          {R"("quality":"reference","noise":0.9)", "0.9"},
                          {R"("quality":"reference","noise":"low")", "capture.noise"},
                          {R"("quality":"reference","openings":1)", "capture.openings"},
                          {R"("quality":"reference","view":"mask")", "mask"},
                          {R"("quality":"reference","denoise":true,"view":"luminance")", "denoise"},
                          {R"("quality":"reference","max_seconds":"long")", "capture.max_seconds"},
                          {R"("denoise":true)", "denoise"},
                          {R"("noise":0.1)", "0.1"}};
    for (const Case& expected : cases) {
        const std::string bad =
            folder.file("bad.json", std::string(R"({"frames":[{"capture":{"out":"x.png",)") + expected.wrong + "}}]}");
        const Finished refused =
            run_program("goniod", {"--scene", scene, "--oneshot", bad, "--out", folder.path("out")});
        EXPECT_EQ(refused.exit_code, 1) << expected.wrong;
        EXPECT_NE(refused.err.find("frames[0].capture"), std::string::npos) << refused.err;
        EXPECT_NE(refused.err.find(expected.named), std::string::npos) << refused.err;
    }
}

}  // namespace
}  // namespace gonio::test
