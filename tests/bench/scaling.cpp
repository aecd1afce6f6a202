#include "tests/bench/scaling.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "tests/bench/cases.h"
#include "tests/bench/frame_loop.h"

namespace gonio {
namespace {

struct Case {
    const char* scene;
    int side_px;
    unsigned vpls;
};
// One thing at a time, from the default on.
constexpr Case kCases[] = {{"cornell", 800, 4096},  {"cornell", 200, 4096},  {"cornell", 400, 4096},
                           {"cornell", 1200, 4096}, {"cornell", 1600, 4096}, {"cornell", 800, 256},
                           {"cornell", 800, 1024},  {"corridor", 800, 4096}, {"atrium", 800, 4096}};
constexpr const char* kPasses[] = {"gbuffer", "direct", "vpl", "occlusion", "gather", "composite"};

struct Row {
    Case which;
    std::size_t triangles = 0;
    double frame_ms = 0.0;
    std::map<std::string, double> pass_ms;  // medians

    // What the gather counts: one grid point per 4 × 4 pixels sums a sixteenth of the list.
    double evaluations() const {
        const double points = std::pow(std::ceil(which.side_px / 4.0), 2.0);
        return points * which.vpls / 16.0;
    }
    // What the occlusion counts at most: every fourth grid point asks 128 VPLs.
    double occlusion_rays() const {
        return std::pow(std::ceil(which.side_px / 16.0), 2.0) * std::min(128.0, which.vpls / 4.0);
    }
};

Row measure(const gl::Context& context, const Case& which, double seconds) {
    const auto asset = bench::bench_asset(which.scene);
    Scene scene = scene_of(asset);
    scene.width_px = scene.height_px = which.side_px;
    scene.samples = which.vpls;
    Renderer renderer(context);
    const glm::dvec3 home = scene.lights[0].position;
    std::vector<double> frames;
    bench::PassTimes passes;
    double spent_ms = 0.0;
    for (int n = -2; n < 100 && (n < 10 || spent_ms < seconds * 1e3); ++n) {  // two frames to warm up
        Light& light = scene.lights[0];
        light.position = home + 0.05 * glm::dvec3(std::cos(0.3 * n), 0.0, std::sin(0.3 * n));
        light.position_rev = light.aim_rev = scene.camera_rev = ++scene.scene_rev;
        renderer.begin_frame(scene, monotonic_ns());
        const v1::FrameReport report = renderer.finish_frame(true)->report;
        if (n < 0) continue;
        spent_ms += report.frame_ms();
        frames.push_back(report.frame_ms());
        passes.add(report);
    }
    return {which, asset->triangles(), bench::median(frames), passes.medians()};
}

void print_table(const std::vector<Row>& rows, std::ostream& out) {
    out << "| scene | triangles | size | VPLs | frame ms |";
    for (const char* pass : kPasses) out << " " << pass << " |";
    out << " VPL evaluations, 10⁶ | occlusion rays, 10⁶ |\n|---|---|---|---|---|";
    for (std::size_t i = 0; i < std::size(kPasses) + 2; ++i) out << "---|";
    out << "\n" << std::fixed;
    for (const Row& row : rows) {
        out << "| " << row.which.scene << " | " << row.triangles << " | " << row.which.side_px << "² | "
            << row.which.vpls << " | " << std::setprecision(1) << row.frame_ms << " |";
        for (const char* pass : kPasses) {
            const auto found = row.pass_ms.find(pass);
            if (found == row.pass_ms.end())
                out << " |";
            else
                out << " " << found->second << " |";
        }
        out << " " << std::setprecision(2) << row.evaluations() * 1e-6 << " | " << row.occlusion_rays() * 1e-6
            << " |\n";
    }
}

void print_json(const std::vector<Row>& rows, const std::string& renderer, std::ostream& out) {
    nlohmann::json json = {{"renderer", renderer}};
    for (const Row& row : rows) {
        json["rows"].push_back({{"scene", row.which.scene},
                                {"triangles", row.triangles},
                                {"side_px", row.which.side_px},
                                {"vpls", row.which.vpls},
                                {"frame_ms", row.frame_ms},
                                {"pass_ms", row.pass_ms},
                                {"vpl_evaluations", row.evaluations()},
                                {"occlusion_rays", row.occlusion_rays()}});
    }
    out << json.dump(2) << "\n";
}

}  // namespace

void run_scaling(const ScalingOptions& options, std::ostream& out) {
    const auto context = gl::Context::create({options.device, false});
    std::vector<Row> rows;
    for (const Case& which : kCases) rows.push_back(measure(*context, which, options.seconds));
    if (options.json)
        print_json(rows, context->renderer(), out);
    else
        print_table(rows, out);
}

}  // namespace gonio
