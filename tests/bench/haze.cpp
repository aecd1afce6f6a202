#include "tests/bench/haze.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/bench/cases.h"
#include "tests/bench/errors.h"
#include "tests/scenes/bench_scenes.h"
#include "tests/scenes/show.h"

namespace gonio::bench {
namespace {

constexpr int kBlock = 4;  // pixels a side, whose mean is compared
constexpr int kBlocks = 64, kSide_px = kBlock * kBlocks;
constexpr int kOctaves = 6;  // of periods: 2 to 4 pixels, 4 to 8, …
constexpr double kMove_m = 1e-3;
constexpr int kMoves = 20;

// Errors of blocks where the reference is above a tenth of its mean, less what is the reference's own.
struct Compared : Errors {
    double relative = 0.0;  // rms of error / the block's own value
    // rmse without the blocks that hold a luminaire or touch such a one: light grows as 1 / h, of which the mean square
    // over a block has no bound, and so neither has the reference's variance.
    double rmse_beside = 0.0;
};

struct HazeRow {
    std::string scene;
    std::size_t lights = 0;
    Compared moving, resting;
    std::array<double, kOctaves> bands{};         // rms of the error along the middle row, over its mean, by octave
    double flicker_rms = 0.0, flicker_p99 = 0.0;  // from one millimetre to the next, over the value, or the mean
};

// Of live pixels, whose rows go from the bottom; from the top here.
std::vector<double> luminances(const std::vector<glm::vec3>& rgb) {
    std::vector<double> values(rgb.size());
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const std::size_t row = kSide_px - 1 - i / kSide_px;
        values[row * kSide_px + i % kSide_px] = trace::luminance(glm::dvec3(rgb[i]));
    }
    return values;
}

// Means of blocks.
std::vector<double> blocks_of(const std::vector<double>& pixels) {
    std::vector<double> blocks(kBlocks * kBlocks, 0.0);
    for (int y = 0; y < kSide_px; ++y)
        for (int x = 0; x < kSide_px; ++x)
            blocks[static_cast<std::size_t>(y / kBlock * kBlocks + x / kBlock)] +=
                pixels[static_cast<std::size_t>(y * kSide_px + x)] / (kBlock * kBlock);
    return blocks;
}

// One half of the reference's samples: what haze scatters once of luminaires, blocks, rows from the top.
std::vector<double> traced(const Scene& scene, std::uint32_t seed, double seconds) {
    trace::PictureRequest request;
    request.camera = scene.camera;
    request.width_px = request.height_px = kSide_px;
    request.antialias = true;  // at a luminaire no one ray is like its pixel
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 1e-4;
    settings.max_seconds = seconds;
    settings.seed = seed;
    trace::Picture picture(trace::make_world(scene), request, settings);
    while (!picture.refine(seconds).complete) {
    }
    const std::vector<float> haze = picture.haze();
    std::vector<double> values;
    for (std::size_t i = 0; i + 2 < haze.size(); i += 3)
        values.push_back(trace::luminance(glm::dvec3(haze[i], haze[i + 1], haze[i + 2])));
    return blocks_of(values);
}

// By block, whether a luminaire is in it or in one that touches it.
std::vector<bool> blocks_at_luminaires(const Scene& scene) {
    std::vector<bool> at(kBlocks * kBlocks, false);
    const Eye eye = eye_of(scene.camera, kSide_px, kSide_px);
    for (const Light& light : scene.lights) {
        const glm::dvec3 to = light.position - eye.position;
        const double away = glm::dot(to, eye.forward);
        if (!(away > 0.0)) continue;
        const double x = glm::dot(to, eye.right) / (away * eye.tan_half_x),
                     y = glm::dot(to, eye.up) / (away * eye.tan_half_y);
        if (!(std::abs(x) < 2.0 && std::abs(y) < 2.0)) continue;
        const int column = static_cast<int>(std::floor((0.5 + 0.5 * x) * kBlocks)),
                  row = static_cast<int>(std::floor((0.5 - 0.5 * y) * kBlocks));
        for (int j = std::max(row - 1, 0); j <= std::min(row + 1, kBlocks - 1); ++j)
            for (int i = std::max(column - 1, 0); i <= std::min(column + 1, kBlocks - 1); ++i)
                at[static_cast<std::size_t>(j * kBlocks + i)] = true;
    }
    return at;
}

Compared compare(const std::vector<double>& shown, const std::array<std::vector<double>, 2>& halves,
                 const std::vector<bool>& at_luminaires) {
    double mean = 0.0;
    for (std::size_t i = 0; i < shown.size(); ++i)
        mean += 0.5 * (halves[0][i] + halves[1][i]) / static_cast<double>(shown.size());
    std::vector<double> a, b, variance, beside_a, beside_b, beside_variance;
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const double truth = 0.5 * (halves[0][i] + halves[1][i]), unsure = 0.5 * (halves[0][i] - halves[1][i]);
        if (truth < 0.1 * mean) continue;
        a.push_back(shown[i]), b.push_back(truth), variance.push_back(unsure * unsure);
        if (at_luminaires[i]) continue;
        beside_a.push_back(shown[i]), beside_b.push_back(truth), beside_variance.push_back(unsure * unsure);
    }
    Compared compared{errors_of(a, b, variance)};
    compared.rmse_beside = errors_of(beside_a, beside_b, beside_variance).rmse;
    double squares = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) squares += ((a[i] - b[i]) * (a[i] - b[i]) - variance[i]) / (b[i] * b[i]);
    compared.relative = a.empty() ? 0.0 : std::sqrt(std::max(squares, 0.0) / static_cast<double>(a.size()));
    return compared;
}

// rms by octave of periods of a row of values.
std::array<double, kOctaves> octaves_of(const std::vector<double>& row) {
    std::array<double, kOctaves> power{};
    const auto n = static_cast<int>(row.size());
    for (int k = 1; k <= n / 2; ++k) {
        std::complex<double> sum = 0.0;
        for (int x = 0; x < n; ++x)
            sum += row[static_cast<std::size_t>(x)] * std::polar(1.0, -2.0 * std::numbers::pi * k * x / n);
        const auto octave = static_cast<std::size_t>(std::log2(static_cast<double>(n) / k)) - 1;
        power[std::min<std::size_t>(octave, kOctaves - 1)] += (2 * k == n ? 1.0 : 2.0) * std::norm(sum) / n / n;
    }
    for (double& value : power) value = std::sqrt(value);
    return power;
}

Scene scene_named(const std::string& name) {
    Scene scene = scene_of(bench_asset(name));
    for (Light& light : scene.lights) light.opening = ies::Opening();  // beams start at a point
    return scene;
}

HazeRow measure(const gl::Context& context, const std::string& name, const HazeBenchOptions& options,
                std::ostream& progress) {
    HazeRow row;
    row.scene = name;
    Scene scene = scene_named(name);
    scene.width_px = scene.height_px = kSide_px;
    scene.haze = {.extinction_per_m = options.extinction_per_m};
    row.lights = scene.lights.size();
    progress << name << ": reference\n";
    const std::array<std::vector<double>, 2> halves = {traced(scene, 1, options.reference_seconds),
                                                       traced(scene, 2, options.reference_seconds)};
    progress << name << ": live\n";
    Renderer renderer(context);
    test::show(renderer, scene);
    std::vector<double> before = luminances(renderer.live_beams(scene));
    const std::vector<bool> at_luminaires = blocks_at_luminaires(scene);
    row.resting = compare(blocks_of(before), halves, at_luminaires);

    // Bands: along the middle row, beside a still's own rays.
    const auto still = renderer.capture(scene, View::luminance, kSide_px, kSide_px, true, 0);
    std::vector<double> error;
    double mean = 0.0;
    for (int x = 0; x < kSide_px; ++x) {
        const std::size_t at = static_cast<std::size_t>(kSide_px / 2) * kSide_px + static_cast<std::size_t>(x);
        const double exact =
            trace::luminance(glm::dvec3(still->haze[3 * at], still->haze[3 * at + 1], still->haze[3 * at + 2]));
        error.push_back(before[at] - exact);
        mean += exact / kSide_px;
    }
    for (double& value : error) value /= std::max(mean, 1e-30);
    row.bands = octaves_of(error);

    // Flicker: a luminaire goes a millimetre a frame.
    Light& light = scene.lights[scene.lights.size() / 2];
    const glm::dvec3 home = light.position;
    double all = 0.0;
    for (const double value : before) all += value / static_cast<double>(before.size());
    std::vector<double> changes;
    for (int n = 1; n <= kMoves; ++n) {
        light.position.x += kMove_m;
        light.position_rev = light.aim_rev = ++scene.scene_rev;
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
        const std::vector<double> now = luminances(renderer.live_beams(scene));
        for (std::size_t i = 0; n > 1 && i < now.size(); ++i)
            if (before[i] > 0.1 * all) changes.push_back(std::abs(now[i] - before[i]) / std::max(before[i], all));
        before = now;
    }
    double squares = 0.0;
    for (const double change : changes) squares += change * change / static_cast<double>(changes.size());
    row.flicker_rms = std::sqrt(squares);
    std::sort(changes.begin(), changes.end());
    if (!changes.empty()) row.flicker_p99 = changes[changes.size() * 99 / 100];
    light.position = home;  // as it moves: one more frame where the reference has it
    light.position_rev = light.aim_rev = ++scene.scene_rev;
    renderer.begin_frame(scene, monotonic_ns());
    renderer.finish_frame(true);
    row.moving = compare(blocks_of(luminances(renderer.live_beams(scene))), halves, at_luminaires);
    return row;
}

}  // namespace

void run_haze(const HazeBenchOptions& options, std::ostream& out, std::ostream& progress) {
    const auto context = gl::Context::create({options.device, false});
    std::vector<std::string> scenes{"cornell", "atrium", "stage"};
    if (!options.scene.empty()) scenes = {options.scene};
    nlohmann::json document{{"renderer", context->renderer()}, {"extinction_per_m", options.extinction_per_m}};
    if (!options.json)
        out << "beams in haze beside the path tracer, where above a tenth of their mean: rms of the relative error; "
               "over the mean; beside: without the blocks at luminaires; bands: rms along the middle row by period; "
               "flicker: from one millimetre to the next\n"
               "scene    lights  relative  rmse  beside  rmse99    bias   moving   bias   noise | bands 2-4  4-8  8-16 "
               " 16-32  32-64  64- px | flicker rms  p99\n";
    for (const std::string& name : scenes) {
        const HazeRow row = measure(*context, name, options, progress);
        document["rows"].push_back({{"scene", row.scene},
                                    {"lights", row.lights},
                                    {"relative", row.resting.relative},
                                    {"rmse", row.resting.rmse},
                                    {"rmse_beside", row.resting.rmse_beside},
                                    {"rmse99", row.resting.rmse99},
                                    {"bias", row.resting.bias},
                                    {"moving_relative", row.moving.relative},
                                    {"moving_rmse", row.moving.rmse},
                                    {"moving_bias", row.moving.bias},
                                    {"noise", row.resting.noise},
                                    {"bands", row.bands},
                                    {"flicker_rms", row.flicker_rms},
                                    {"flicker_p99", row.flicker_p99}});
        if (options.json) continue;
        char line[320];
        std::snprintf(line, sizeof line,
                      "%-8s %6zu %7.4f %7.4f %7.4f %7.4f %+7.4f %8.4f %+6.4f %7.4f | %8.4f %.4f %.4f %.4f %.4f %.4f | "
                      "%.5f %.5f\n",
                      name.c_str(), row.lights, row.resting.relative, row.resting.rmse, row.resting.rmse_beside,
                      row.resting.rmse99, row.resting.bias, row.moving.rmse, row.moving.bias, row.resting.noise,
                      row.bands[0], row.bands[1], row.bands[2], row.bands[3], row.bands[4], row.bands[5],
                      row.flicker_rms, row.flicker_p99);
        out << line << std::flush;
    }
    if (options.json) out << document.dump(2) << "\n";
}

}  // namespace gonio::bench
