#include "tests/bench/refinement.h"

#include <chrono>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/scene.h"
#include "tests/bench/cases.h"
#include "tests/bench/errors.h"
#include "tests/bench/reference.h"
#include "tests/scenes/show.h"

namespace gonio::bench {
namespace {

struct RefinementRow {
    std::string scene;
    double seconds = 0.0;  // spent refining
    unsigned rounds = 0;
    Errors errors;
};

void measure(const gl::Context& context, const Case& which, const Reference& reference,
             std::vector<RefinementRow>& rows) {
    const Scene scene = scene_of_case(which);
    Renderer renderer(context);
    renderer.set_links(transport::kMostLinks);
    renderer.set_refinement(true);
    test::show(renderer, scene);
    double spent_s = 0.0;
    unsigned rounds = 0;
    const auto measure_errors = [&] {
        rows.push_back({which.scene, spent_s, rounds,
                        errors_of(shown_lx(renderer.live_illuminance(scene, true), scene.width_px, reference.receivers),
                                  reference.all_lx, reference.all_variance)});
    };
    measure_errors();
    for (bool more = true; more;) {
        const auto began = std::chrono::steady_clock::now();
        const bool step = renderer.refine(scene, [] { return false; });
        if (step) {
            renderer.begin_frame(scene, monotonic_ns());
            rounds = renderer.finish_frame(true)->report.refined_rounds();
        }
        spent_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
        if (step) measure_errors();
        more = !renderer.refined(scene);
    }
}

}  // namespace

void run_refinement(const RefinementOptions& options, std::ostream& out, std::ostream& progress) {
    const auto context = gl::Context::create({options.device, false});
    std::vector<RefinementRow> rows;
    for (const char* scene : {"cornell", "atrium", "corridor"}) {
        if (!options.scene.empty() && options.scene != scene) continue;
        const Case which{scene, options.profile};
        ReferenceSettings settings;
        settings.seconds = options.reference_seconds;
        measure(*context, which, reference_of(scene_of_case(which), settings, options.cache, progress), rows);
    }
    if (rows.empty()) throw std::runtime_error("no scene is left: see gonio-bench refinement --help");
    if (options.json) {
        nlohmann::json json = {{"renderer", context->renderer()}};
        for (const RefinementRow& row : rows)
            json["rows"].push_back({{"scene", row.scene},
                                    {"seconds", row.seconds},
                                    {"rounds", row.rounds},
                                    {"rmse", row.errors.rmse},
                                    {"rmse99", row.errors.rmse99},
                                    {"p95", row.errors.p95},
                                    {"bias", row.errors.bias}});
        out << json.dump(2) << "\n";
        return;
    }
    out << "scene      seconds  rounds   rmse  rmse99   p95    bias\n" << std::fixed;
    for (const RefinementRow& row : rows)
        out << std::left << std::setw(9) << row.scene << std::right << std::setprecision(2) << std::setw(9)
            << row.seconds << std::setw(8) << row.rounds << std::setprecision(3) << std::setw(8) << row.errors.rmse
            << std::setw(7) << row.errors.rmse99 << std::setw(7) << row.errors.p95 << std::setw(8) << row.errors.bias
            << "\n";
}

}  // namespace gonio::bench
