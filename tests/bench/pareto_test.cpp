// The bench itself: its statistics against numbers worked out by hand, its references against the renderer's own sum,
// and a quick run's rows against what must hold for any machine. No timing is asserted.
#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/bench/cases.h"
#include "tests/bench/pareto.h"
#include "tests/bench/plot.h"
#include "tests/bench/reference.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::bench {
namespace {

struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("gonio-bench-test-" + std::to_string(getpid()));
    ~Folder() { std::filesystem::remove_all(path); }
};

TEST(Errors, OnePixelPerCell) {
    const auto pixels = stratified_pixels(200, 130, 64);
    ASSERT_EQ(pixels.size(), 64u * 64u);
    for (int cell = 0; cell < 64 * 64; ++cell) {
        const glm::ivec2 p = pixels[static_cast<std::size_t>(cell)];
        EXPECT_GE(p.x, 200 * (cell % 64) / 64);
        EXPECT_LT(p.x, 200 * (cell % 64 + 1) / 64);
        EXPECT_GE(p.y, 130 * (cell / 64) / 64);
        EXPECT_LT(p.y, 130 * (cell / 64 + 1) / 64);
    }
    EXPECT_EQ(stratified_pixels(3, 2, 64).size(), 6u);
}

TEST(Errors, WorkedByHand) {
    // 100 values of 2, one of them shown as 12, the others as 2.1.
    std::vector<double> shown(100, 2.1), reference(100, 2.0), variance(100, 0.0075);
    shown[17] = 12.0;
    const Errors exact = errors_of(shown, reference, {});
    EXPECT_NEAR(exact.rmse, std::sqrt((99 * 0.01 + 100.0) / 100) / 2, 1e-12);
    EXPECT_NEAR(exact.rmse99, 0.05, 1e-12);
    EXPECT_NEAR(exact.p95, 0.05, 1e-12);
    EXPECT_NEAR(exact.p99, 0.05, 1e-12);
    EXPECT_NEAR(exact.bias, (99 * 0.1 + 10.0) / 100 / 2, 1e-12);
    EXPECT_EQ(exact.noise, 0.0);
    const Errors noisy = errors_of(shown, reference, variance);
    EXPECT_NEAR(noisy.rmse, std::sqrt((99 * 0.01 + 100.0) / 100 - 0.0075) / 2, 1e-12);
    EXPECT_NEAR(noisy.rmse99, std::sqrt(0.01 - 0.0075) / 2, 1e-12);
    EXPECT_NEAR(noisy.noise, std::sqrt(0.0075) / 2, 1e-12);
    // Below a twentieth of the mean the denominator is that.
    EXPECT_NEAR(errors_of(std::vector{1.0, 2.0}, std::vector{0.0, 2.0}, {}).p99, 1.0 / 0.05, 1e-9);
}

TEST(Errors, FrontOfFourPoints) {
    const std::vector<glm::dvec2> points = {{3, 1}, {1, 4}, {2, 5}, {2, 2}, {NAN, 0}, {4, 1}};
    EXPECT_EQ(pareto_front(points), (std::vector<std::size_t>{1, 3, 0}));
}

TEST(Plot, DrawsEveryPointOnce) {
    Plot plot{"t", "s", "n", "x", "y", "front", {}};
    plot.panels.push_back(
        {"one <&>", {{"a", {{{10, 0.5}, "1"}, {{200, 0.1}, "2"}, {{0, 1}, "left out"}}}}, {{10, 0.5}}});
    plot.panels.push_back({"two", {{"b", {{{20, 0.02}, ""}}}}, {}});
    const std::string svg = plot_svg(plot);
    const auto count = [&](const std::string& what) {
        std::size_t n = 0;
        for (std::size_t at = svg.find(what); at != std::string::npos; at = svg.find(what, at + 1)) ++n;
        return n;
    };
    EXPECT_EQ(count("<circle"), 2u + 1u);       // a's points and its legend
    EXPECT_EQ(count("class=\"s1\""), 1u + 1u);  // b's
    EXPECT_EQ(count("one &lt;&amp;>"), 1u);
    EXPECT_EQ(count("left out"), 0u);
    EXPECT_EQ(count("nan"), 0u);
    EXPECT_EQ(count("inf"), 0u);
    EXPECT_EQ(count(">0.02<"), 1u);  // both axes end on whole ticks around the points, labelled once per column or row
    EXPECT_EQ(count(">500<"), 0u);
    EXPECT_EQ(count(">200<"), 2u);
}

// Inside a diffuse sphere nothing is hidden and one bounce is rho · flux / (4 pi R²) everywhere: both references agree
// with that, and the stated noise of the path traced one covers its spread.
TEST(Reference, BothAreTheClosedFormInASphere) {
    const Folder folder;
    const auto profile = test::cosine_power(1000.0, 2.0);
    Scene scene = test::scene_with({{test::inward_sphere(2.0, 256), glm::vec3(0.5f)}}, profile, {0.5, 0.3, 0.4},
                                   orientation_of({0.3, 0.8, 0.0}));
    scene.camera = {{0.0, 0.0, 0.5}, {0.3, -0.2, -2.0}, 1.2};
    scene.width_px = scene.height_px = 64;
    std::ostringstream progress;
    const Reference reference = reference_of(scene, {16, 128, 0.01, 60.0}, folder.path, progress);
    ASSERT_EQ(reference.receivers.size(), 16u * 16u);
    const double expected = 0.5 * profile->flux_lm / (16 * std::numbers::pi);
    const std::vector<double> exact(reference.receivers.size(), expected);
    const Errors rsm = errors_of(reference.rsm_lx, exact, {}), truth = errors_of(reference.truth_lx, exact, {}),
                 noise = errors_of(exact, reference.truth_lx, reference.truth_variance);
    EXPECT_LT(rsm.rmse, 0.005);
    EXPECT_NEAR(truth.bias, 0.0, 0.002);
    EXPECT_LT(truth.rmse, 0.012);
    EXPECT_LE(noise.noise, 0.01);
    EXPECT_LT(truth.rmse, 1.3 * noise.noise + 0.002);
}

// The bench's own sum over all texels is the renderer's (meter --quality rsm) at the map size the renderer uses.
TEST(Reference, DenseSumIsTheMeters) {
    Scene scene = scene_of_case({"corridor", "wide", 0});
    scene.width_px = scene.height_px = 64;
    const auto receivers = receivers_of(scene, stratified_pixels(64, 64, 5));
    ASSERT_GT(receivers.size(), 5u);
    const auto dense = dense_rsm_lx(scene, receivers, kRsmSize);
    Renderer renderer(test::context());
    for (std::size_t i = 0; i < receivers.size(); ++i) {
        const auto reading =
            renderer.meter(scene, receivers[i].position, receivers[i].normal, Renderer::MeterQuality::rsm);
        EXPECT_NEAR(dense[i], reading.indirect_lx(), 1e-6 * reading.indirect_lx() + 1e-9) << i;
    }
}

// What the live picture at rest is read back as is what its captures and meters say, up to its coarser gather.
TEST(Reference, LiveDirectLightIsTheMeters) {
    Scene scene = scene_of_case({"stage", "downlight", 2});
    scene.width_px = scene.height_px = 64;
    const auto receivers = receivers_of(scene, stratified_pixels(64, 64, 6));
    Renderer renderer(test::context());
    renderer.set_refinement(true);
    test::show(renderer, scene);
    while (!renderer.refined(scene)) {
        if (!renderer.refine(scene, [] { return false; })) continue;
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
    }
    const auto direct = renderer.live_illuminance(scene, false), indirect = renderer.live_illuminance(scene, true);
    double live_sum = 0.0, meter_sum = 0.0;
    std::size_t agree = 0;
    for (const Receiver& r : receivers) {
        const std::size_t at = static_cast<std::size_t>(r.pixel.y * 64 + r.pixel.x);
        const auto reading = renderer.meter(scene, r.position, r.normal, Renderer::MeterQuality::interactive);
        live_sum += static_cast<double>(indirect[at].g);
        meter_sum += reading.indirect_rgb_lx(1);
        // 16-bit layers, 2^-11 each.
        const double off = std::abs(static_cast<double>(direct[at].g) - reading.direct_lx());
        agree += off <= 0.01 * reading.direct_lx() + 0.01 ? 1 : 0;
    }
    // A pixel that a shadow's edge crosses has the mean over it, not its centre's.
    EXPECT_GE(10 * agree, 8 * receivers.size());
    EXPECT_NEAR(live_sum, meter_sum, 0.1 * meter_sum);
}

TEST(Pareto, QuickRunHoldsItsInvariants) {
    const Folder folder;
    ParetoOptions options;
    options.quick = true;
    options.cache = folder.path;
    std::ostringstream progress;
    const ParetoResult result = run_pareto(test::context(), options, progress);
    std::ostringstream text;
    write_json(result, text);
    const auto json = nlohmann::json::parse(text.str());
    ASSERT_EQ(json["rows"].size(), 3u) << progress.str();
    std::set<std::string> techniques;
    for (const auto& row : json["rows"]) {
        techniques.insert(row["technique"]);
        for (const char* field : {"lights",   "samples",          "frame_ms",        "frame_p95_ms", "indirect_ms",
                                  "move_ms",  "move_indirect_ms", "motion_over_due", "motion_most",  "rmse_rsm",
                                  "bias_rsm", "rmse_truth",       "rmse99_truth",    "p95_truth",    "p99_truth",
                                  "bias",     "reference_noise",  "rmse_all",        "rmse99_all",   "p95_all",
                                  "p99_all",  "bias_all",         "noise_all",       "frames",       "points"}) {
            ASSERT_TRUE(row.contains(field) && row[field].is_number()) << field;
            EXPECT_TRUE(std::isfinite(row[field].get<double>())) << field;
        }
        EXPECT_GE(row["frames"], 3);
        EXPECT_GT(row["frame_ms"], row["indirect_ms"]);
        EXPECT_GE(row["frame_p95_ms"], row["frame_ms"]);
        EXPECT_GE(row["rmse_all"], row["rmse99_all"]);
        EXPECT_GE(row["p99_all"], row["p95_all"]);
        EXPECT_EQ(row["points"].get<int>() + row["empty_pixels"].get<int>() + row["seam_pixels"].get<int>(), 64 * 64);
        EXPECT_LE(row["reference_noise"], json["reference"]["noise_wanted"]);
        EXPECT_LE(row["noise_all"], json["reference"]["noise_wanted"]);
        EXPECT_EQ(row["seed_rate_ratio"].is_number(), row["technique"] == "seed");
    }
    EXPECT_EQ(techniques, (std::set<std::string>{"default", "seed"}));
    // The default technique's picture is the nearest; every fourfold brings the seed's nearer to the dense sum.
    const auto& rows = result.rows;
    EXPECT_LT(rows[0].all.rmse, std::min(rows[1].all.rmse, rows[2].all.rmse));
    EXPECT_GT(rows[0].move_ms, rows[0].move_indirect_ms);
    EXPECT_LT(rows[0].motion_over_due, 1.5);
    EXPECT_LT(rows[2].rsm.rmse, rows[1].rsm.rmse);
    std::vector<const ParetoRow*> front;
    for (const ParetoRow& row : rows) {
        if (!row.front) continue;
        EXPECT_FALSE(row.is_void);
        front.push_back(&row);
    }
    ASSERT_FALSE(front.empty());
    std::sort(front.begin(), front.end(), [](auto* a, auto* b) { return a->frame_ms < b->frame_ms; });
    for (std::size_t i = 1; i < front.size(); ++i) EXPECT_LT(front[i]->all.rmse, front[i - 1]->all.rmse);
    EXPECT_FALSE(rows[0].cached);

    // The second time the reference comes from disk and says the same.
    options.technique = "default";
    const ParetoResult again = run_pareto(test::context(), options, progress);
    ASSERT_EQ(again.rows.size(), 1u);
    EXPECT_TRUE(again.rows[0].cached);
    EXPECT_EQ(again.rows[0].all.rmse, rows[0].all.rmse);
    EXPECT_EQ(again.rows[0].rsm.rmse, rows[0].rsm.rmse);
}

// A file that was cut short is not believed; another light is another reference.
TEST(Pareto, CacheIsByContent) {
    const Folder folder;
    Scene scene = scene_of_case({"corridor", "wide", 0});
    scene.width_px = scene.height_px = 32;
    const ReferenceSettings coarse{8, 16, 0.5, 5.0};
    std::ostringstream progress;
    const auto files = [&] {
        std::vector<std::filesystem::path> found;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path)) found.push_back(entry.path());
        return found;
    };
    const Reference first = reference_of(scene, coarse, folder.path, progress);
    EXPECT_FALSE(first.cached);
    ASSERT_EQ(files().size(), 1u);
    const Reference second = reference_of(scene, coarse, folder.path, progress);
    EXPECT_TRUE(second.cached);
    EXPECT_EQ(second.truth_lx, first.truth_lx);
    EXPECT_EQ(second.all_lx, first.all_lx);
    EXPECT_EQ(second.rsm_lx, first.rsm_lx);
    std::filesystem::resize_file(files()[0], std::filesystem::file_size(files()[0]) - 8);
    EXPECT_FALSE(reference_of(scene, coarse, folder.path, progress).cached);
    scene.lights[0].position.x += 0.5;
    EXPECT_FALSE(reference_of(scene, coarse, folder.path, progress).cached);
    EXPECT_EQ(files().size(), 2u);
}

}  // namespace
}  // namespace gonio::bench
