#include "tests/bench/scaling.h"

#include <algorithm>
#include <iomanip>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/web_buffer.h"
#include "tests/bench/cases.h"
#include "tests/bench/errors.h"
#include "tests/bench/frame_loop.h"
#include "tests/bench/receivers.h"
#include "tests/bench/seed_rate.h"
#include "tests/scenes/bench_scenes.h"

namespace gonio {
namespace {

struct Case {
    const char* scene;
    int side_px;
    int splits = 0;  // as of split_triangles
};
// One thing at a time, from the default on.
constexpr Case kCases[] = {{"cornell", 800},    {"cornell", 200},   {"cornell", 400}, {"cornell", 1200},
                           {"cornell", 1600},   {"corridor", 800},  {"stage", 800},   {"atrium", 800},
                           {"cornell", 800, 1}, {"cornell", 800, 2}};
constexpr int kRsmSizes[] = {64, 128, 256, 512};
constexpr unsigned kSeedSamples = 100;
constexpr const char* kPasses[] = {"gbuffer", "gather-weights", "surfels", "solve", "direct", "gather", "composite"};

// The stage under one luminaire, as the others are.
std::shared_ptr<const SceneAsset> asset_of(const Case& which) {
    const auto asset = std::string_view(which.scene) == "stage" ? test::make_stage(1) : bench::bench_asset(which.scene);
    return which.splits > 0 ? bench::split_triangles(*asset, which.splits) : asset;
}

struct Timed {
    double frame_ms = 0.0;
    std::map<std::string, double> pass_ms;  // medians
    double pass(const char* name) const {
        const auto found = pass_ms.find(name);
        return found != pass_ms.end() ? found->second : 0.0;
    }
};
// Of a scene that wanders, two frames to warm up.
Timed measure(Renderer& renderer, Scene scene, double seconds, int least_frames) {
    const std::vector<glm::dvec3> home = bench::positions_of(scene);
    std::vector<double> frames;
    bench::PassTimes passes;
    double spent_ms = 0.0;
    for (int n = -2; n < 100 && (n < least_frames || spent_ms < seconds * 1e3); ++n) {
        bench::wander(scene, home, n);
        renderer.begin_frame(scene, monotonic_ns());
        const v1::FrameReport report = renderer.finish_frame(true)->report;
        if (n < 0) continue;
        spent_ms += report.frame_ms();
        frames.push_back(report.frame_ms());
        passes.add(report);
    }
    return {bench::median(frames), passes.medians()};
}

struct ScalingRow {
    Case which;
    std::size_t triangles = 0;
    Timed timed;
};
ScalingRow measure_case(const gl::Context& context, const Case& which, double seconds) {
    const auto asset = asset_of(which);
    Scene scene = scene_of(asset);
    scene.width_px = scene.height_px = which.side_px;
    Renderer renderer(context);
    renderer.set_links(transport::kMostLinks);
    return {which, asset->triangles(), measure(renderer, std::move(scene), seconds, 10)};
}

// Reflective shadow maps of one size, in cornell: what they and the cube of depths take to make on shaders, and the
// frame of the seed technique, the only one whose live picture reads them.
struct RsmRow {
    int size = 0;
    double rsm_ms = 0.0, flux_ms = 0.0, shadow_ms = 0.0;
    double seed_rsm_ms = 0.0, seed_gather_ms = 0.0, seed_frame_ms = 0.0;
    double seed_predicted_ms = 0.0;  // of the gather: SeedRate's
};
RsmRow measure_rsm(const gl::Context& context, int size, double seconds) {
    RsmRow row;
    row.size = size;
    Scene scene = scene_of(bench::bench_asset("cornell"));
    scene.view = View::rsm_flux;
    Renderer looked_at(context, Renderer::DirectLight::gl);
    looked_at.set_rsm_size(size);
    const Timed maps = measure(looked_at, scene, seconds, 10);
    row.rsm_ms = maps.pass("rsm");
    row.flux_ms = maps.pass("rsm-flux");
    scene.view = View::beauty;
    scene.technique = Technique::seed;
    scene.samples = kSeedSamples;
    Renderer seed(context, Renderer::DirectLight::gl);
    seed.set_rsm_size(size);
    const Timed frames = measure(seed, scene, seconds, 5);
    row.shadow_ms = frames.pass("shadow");
    row.seed_rsm_ms = frames.pass("rsm");
    row.seed_gather_ms = frames.pass("gather");
    row.seed_frame_ms = frames.frame_ms;
    bench::SeedRate rate(size, mask_face_size(scene.lights.at(0).profile->photometry.web));
    std::vector<double> predicted_ns;
    for (int i = 0; i < 3; ++i) predicted_ns.push_back(rate.ns_per_sample(scene.width_px, scene.height_px, 25));
    const auto pixels = bench::stratified_pixels(scene.width_px, scene.height_px, 64);
    const auto shown = static_cast<double>(bench::receivers_of(scene, pixels).size());
    row.seed_predicted_ms = bench::median(predicted_ns) * 1e-6 * kSeedSamples * scene.width_px * scene.height_px *
                            shown / static_cast<double>(pixels.size());
    return row;
}

// Frames of cornell by each effort, in turn several times, so that what else the machine does meets them all.
std::vector<double> measure_efforts(const gl::Context& context, double seconds) {
    constexpr int kTurns = 5;
    const Scene scene = scene_of(bench::bench_asset("cornell"));
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (std::size_t effort = 0; effort < kQualityLevels.size(); ++effort) {
        renderers.push_back(std::make_unique<Renderer>(context));
        renderers.back()->set_links(transport::kMostLinks);
        renderers.back()->set_quality_level(effort);
    }
    std::vector<std::vector<double>> turns(kQualityLevels.size());
    for (int turn = 0; turn < kTurns; ++turn) {
        for (std::size_t effort = 0; effort < kQualityLevels.size(); ++effort)
            turns[effort].push_back(measure(*renderers[effort], scene, seconds / kTurns, 5).frame_ms);
    }
    std::vector<double> frame_ms;
    for (std::vector<double>& all : turns) frame_ms.push_back(bench::median(std::move(all)));
    return frame_ms;
}

struct Results {
    std::vector<ScalingRow> rows;
    std::vector<RsmRow> rsm;
    std::vector<double> efforts_ms;
};

void print_table(const Results& results, std::ostream& out) {
    out << "| scene | triangles | size | frame ms |";
    for (const char* pass : kPasses) out << " " << pass << " |";
    out << "\n|---|---|---|---|";
    for (std::size_t i = 0; i < std::size(kPasses); ++i) out << "---|";
    out << "\n" << std::fixed << std::setprecision(1);
    for (const ScalingRow& row : results.rows) {
        out << "| " << row.which.scene << " | " << row.triangles << " | " << row.which.side_px << "² | "
            << row.timed.frame_ms << " |";
        for (const char* pass : kPasses) out << " " << row.timed.pass(pass) << " |";
        out << "\n";
    }
    for (const RsmRow& row : results.rsm)
        out << "\nRSM of " << row.size << "² a face: " << row.rsm_ms << " ms, flux " << row.flux_ms << " ms, seed "
            << kSeedSamples << ": map " << row.seed_rsm_ms << " ms, gather " << row.seed_gather_ms << " ms, frame "
            << row.seed_frame_ms << " ms";
    for (std::size_t i = 0; i < results.efforts_ms.size(); ++i)
        out << "\neffort " << i << ": " << results.efforts_ms[i] << " ms, " << std::setprecision(2)
            << results.efforts_ms[i] / results.efforts_ms[0] << " of the first" << std::setprecision(1);
    out << "\n";
}

void print_json(const Results& results, const std::string& renderer, std::ostream& out) {
    nlohmann::json json = {{"renderer", renderer}, {"seed_samples", kSeedSamples}};
    for (const RsmRow& row : results.rsm) {
        json["rsm"].push_back({{"size", row.size},
                               {"rsm_ms", row.rsm_ms},
                               {"flux_ms", row.flux_ms},
                               {"shadow_ms", row.shadow_ms},
                               {"seed_rsm_ms", row.seed_rsm_ms},
                               {"seed_gather_ms", row.seed_gather_ms},
                               {"seed_frame_ms", row.seed_frame_ms},
                               {"seed_predicted_ms", row.seed_predicted_ms}});
    }
    for (const double ms : results.efforts_ms) {
        const QualityLevel& effort = kQualityLevels[json["efforts"].size()];
        json["efforts"].push_back({{"frame_ms", ms},
                                   {"cost", ms / results.efforts_ms[0]},
                                   {"scale", effort.scale},
                                   {"links", std::min(effort.links, transport::kMostLinks)},
                                   {"own_points", effort.own_points}});
    }
    for (const ScalingRow& row : results.rows) {
        json["rows"].push_back({{"scene", row.which.scene},
                                {"splits", row.which.splits},
                                {"triangles", row.triangles},
                                {"side_px", row.which.side_px},
                                {"frame_ms", row.timed.frame_ms},
                                {"pass_ms", row.timed.pass_ms}});
    }
    out << json.dump(2) << "\n";
}

}  // namespace

void run_scaling(const ScalingOptions& options, std::ostream& out) {
    const auto context = gl::Context::create({options.device, false});
    Results results;
    for (const Case& which : kCases) results.rows.push_back(measure_case(*context, which, options.seconds));
    for (const int size : kRsmSizes) results.rsm.push_back(measure_rsm(*context, size, options.seconds));
    results.efforts_ms = measure_efforts(*context, options.seconds);
    if (options.json)
        print_json(results, context->renderer(), out);
    else
        print_table(results, out);
}

}  // namespace gonio
