#include "tests/bench/pareto.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numeric>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <thread>
#include <tuple>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/web_buffer.h"
#include "shaders/lib/as_cpp.h"
#include "tests/bench/cases.h"
#include "tests/bench/frame_loop.h"
#include "tests/bench/reference.h"
#include "tests/bench/seed_rate.h"
#include "tests/scenes/show.h"

namespace gonio::bench {
namespace {

// What is measured. most_lights: a frame of the seed technique takes its time per luminaire; beyond, minutes.
// Of the default technique the samples are of no account.
struct Setting {
    Technique technique;
    unsigned samples;
    std::size_t most_lights = kMaxLights;
    bool quick = false;  // part of the quick run
};
constexpr Setting kSettings[] = {{Technique::standard, kDefaultVpls, kMaxLights, true},
                                 {Technique::seed, 25, 4, true},
                                 {Technique::seed, 50, 4},
                                 {Technique::seed, 100, 4, true},
                                 {Technique::seed, 200, 4},
                                 {Technique::seed, 400, 4},
                                 {Technique::seed, 800, 4}};

// A seed row counts only if its loop runs at the rate that the machine's own micro-benchmark predicts.
constexpr double kRateTolerance = 0.3;

// The seed technique's frames are hundreds of times as long and differ by less: a row of
// theirs is measured for so long, or for the least number of frames.
constexpr double kSeedSeconds = 10.0;

constexpr Pace kQuickPace = {0.5, 3, 5};
constexpr ReferenceSettings kQuickReference = {64, 128, 0.05, 60.0};

// Errors of the last of some frames in which the first luminaire moves, where the scene has it.
void measure_errors(Renderer& renderer, Scene scene, const Reference& reference, ParetoRow& row) {
    const std::vector<glm::dvec3> home = positions_of(scene);
    const bool seed = scene.technique != Technique::standard;  // nothing stays from frame to frame
    if (!seed) test::show(renderer, scene);
    for (int n = seed ? 0 : 5; n >= 0; --n) {
        sway(scene, home, n);
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
    }
    const std::vector<double> shown =
        shown_lx(renderer.live_illuminance(scene, true), scene.width_px, reference.receivers);
    row.rsm = errors_of(shown, reference.rsm_lx, {});
    row.truth = errors_of(shown, reference.truth_lx, reference.truth_variance);
    row.all = errors_of(shown, reference.all_lx, reference.all_variance);
}

// What a step of a millimetre of the first luminaire changes at the receivers, rms, over what is due, a twentieth of
// what 20 mm change: the median and the greatest of 20 steps.
std::pair<double, double> motion_over_due(Renderer& renderer, Scene scene, const Reference& reference) {
    constexpr int kSteps = 20, kBefore = 3;  // it moves already when the first step is taken
    const glm::dvec3 home = scene.lights.at(0).position;
    std::vector<double> first, last, steps;
    const auto change = [](const std::vector<double>& from, const std::vector<double>& to) {
        double squares = 0.0;
        for (std::size_t i = 0; i < from.size(); ++i) squares += (to[i] - from[i]) * (to[i] - from[i]);
        return std::sqrt(squares);
    };
    for (int n = -kBefore; n <= kSteps; ++n) {
        Light& light = scene.lights[0];
        light.position = home + glm::dvec3(0.001 * n, 0.0, 0.0);
        light.position_rev = ++scene.scene_rev;
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
        if (n < 0) continue;
        std::vector<double> shown =
            shown_lx(renderer.live_illuminance(scene, true), scene.width_px, reference.receivers);
        if (n == 0)
            first = shown;
        else
            steps.push_back(change(last, shown));
        last = std::move(shown);
    }
    const double due = std::max(change(first, last) / kSteps, 1e-30);
    return {median(steps) / due, *std::max_element(steps.begin(), steps.end()) / due};
}

ParetoRow measure(const gl::Context& context, LaneEncoders& encoder, Scene scene, const Setting& setting,
                  const Reference& reference, Pace pace) {
    scene.technique = setting.technique;
    scene.samples = setting.samples;
    ParetoRow row;
    row.technique = technique_name(setting.technique);
    row.lights = scene.lights.size();
    row.triangles = scene.asset->triangles();
    row.samples = setting.samples;
    row.points = reference.receivers.size();
    row.empty_pixels = reference.empty_pixels;
    row.seam_pixels = reference.seam_pixels;
    row.cached = reference.cached;
    row.mean_lx = std::accumulate(reference.truth_lx.begin(), reference.truth_lx.end(), 0.0) /
                  static_cast<double>(std::max<std::size_t>(row.points, 1));
    Renderer renderer(context);  // a fresh one: maps that only another technique needs are not made
    renderer.set_links(transport::kMostLinks);
    measure_errors(renderer, scene, reference, row);

    const bool seed = setting.technique != Technique::standard;
    if (!seed) {
        std::tie(row.motion_over_due, row.motion_most) = motion_over_due(renderer, scene, reference);
        const FrameTimes moves = time_frames(renderer, encoder, scene, pace, sway);
        row.move_ms = moves.median_ms();
        row.move_indirect_ms = moves.indirect_ms;
    }
    if (seed) pace.seconds = std::min(pace.seconds, kSeedSeconds);
    // Predictions are taken between the frames, since other work on the machine comes and goes.
    constexpr std::size_t kPredictions = 9;
    std::optional<SeedRate> rate;
    std::vector<double> predicted_ns;
    if (seed) rate.emplace(kRsmSize, mask_face_size(scene.lights.at(0).profile->photometry.web));
    const FrameTimes times = time_frames(renderer, encoder, scene, pace, wander, [&] {
        if (!seed || predicted_ns.size() == kPredictions) return;
        predicted_ns.push_back(rate->ns_per_sample(scene.width_px, scene.height_px, std::min(setting.samples, 50u)));
    });
    row.frame_ms = times.median_ms();
    row.frame_p95_ms = times.p95_ms();
    row.indirect_ms = times.indirect_ms;
    row.frames = times.frame_ms.size();
    if (seed) {
        const auto shown = static_cast<double>(row.points + row.seam_pixels);
        const double covered = shown / (shown + static_cast<double>(row.empty_pixels));
        const double samples =
            covered * scene.width_px * scene.height_px * setting.samples * static_cast<double>(scene.lights.size());
        row.seed_rate_ratio = median(predicted_ns) * 1e-6 * samples / times.gather_ms;
        row.is_void = !(std::abs(row.seed_rate_ratio - 1.0) <= kRateTolerance);
    }
    return row;
}

// rows: of one case.
void mark_front(std::span<ParetoRow> rows) {
    std::vector<glm::dvec2> points;
    for (const ParetoRow& row : rows)
        points.push_back(row.is_void ? glm::dvec2(NAN) : glm::dvec2(row.frame_ms, row.all.rmse));
    for (std::size_t i : pareto_front(points)) rows[i].front = true;
}

std::string cpu_name() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        if (line.starts_with("model name")) return line.substr(std::min(line.find(": ") + 2, line.size()));
    }
    return "unknown";
}

double load_average() {
    double load = 0.0;
    return getloadavg(&load, 1) == 1 ? load : -1.0;
}

}  // namespace

ParetoResult run_pareto(const gl::Context& context, const ParetoOptions& options, std::ostream& progress) {
    ReferenceSettings reference_settings = options.quick ? kQuickReference : ReferenceSettings{};
    if (!options.quick) reference_settings.seconds = options.reference_seconds;
    const Pace pace = options.quick ? kQuickPace : Pace{options.seconds};
    const int side = options.quick ? 192 : 800;
    ParetoResult result;
    result.renderer = context.renderer();
    result.cpu = cpu_name();
    result.threads = std::thread::hardware_concurrency();
    result.width_px = (options.width_px > 0 ? options.width_px : side) & ~1;
    result.height_px = (options.height_px > 0 ? options.height_px : side) & ~1;
    result.noise_wanted = reference_settings.noise;
    result.rsm_size = reference_settings.rsm_size;
    result.quick = options.quick;
    result.load_before = load_average();
    const auto encoder = make_idle_encoder();
    std::vector<Case> cases = bench_cases(options.scene);
    if (options.profile == "panel" || options.profile == "haze")
        cases = {{options.scene.empty() ? "cornell" : options.scene, options.profile, 0}};
    for (const Case& which : cases) {
        if (!options.profile.empty() && which.profile != options.profile) continue;
        Scene scene = scene_of_case(which);
        if (options.lights > 0 && scene.lights.size() != options.lights) continue;
        scene.width_px = result.width_px;
        scene.height_px = result.height_px;
        progress << which.scene << ", " << scene.lights.size() << " luminaires, " << which.profile << "\n"
                 << std::flush;
        const Reference reference = reference_of(scene, reference_settings, options.cache, progress);
        const std::size_t first = result.rows.size();
        for (const Setting& setting : kSettings) {
            if (!options.technique.empty() && technique_name(setting.technique) != options.technique) continue;
            if (scene.lights.size() > setting.most_lights || (options.quick && !setting.quick)) continue;
            ParetoRow row = measure(context, *encoder, scene, setting, reference, pace);
            row.scene = which.scene;
            row.profile = which.profile;
            progress << "  " << row.technique << " " << row.samples << ": " << row.frame_ms << " ms, error "
                     << row.all.rmse << (row.is_void ? ", void" : "") << "\n"
                     << std::flush;
            result.rows.push_back(std::move(row));
        }
        mark_front(std::span(result.rows).subspan(first));
        if (options.quick) break;
    }
    if (result.rows.empty()) throw std::runtime_error("no case is left: see gonio-bench pareto --help");
    result.load_after = load_average();
    return result;
}

}  // namespace gonio::bench
