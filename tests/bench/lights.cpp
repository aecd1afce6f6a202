#include "tests/bench/lights.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/bench/cases.h"
#include "tests/bench/frame_loop.h"
#include "tests/scenes/bench_scenes.h"
#include "tests/scenes/scenes.h"

namespace gonio::bench {
namespace {

constexpr std::size_t kLeastFrames = 10, kMostFrames = 100, kMostSettling = 1000;

// A scene before a run of changes, and the change of frame number n to it.
struct Change {
    const char* name;
    bool everywhere;  // in scenes of one luminaire too, not only under the stage's
    void (*make)(Scene& scene, const Scene& home, int n);
};

void set_level(Scene& scene, std::size_t light, int n) {
    scene.lights[light].level_ratio = 0.5 + 0.5 * std::cos(0.37 * n);
    scene.lights[light].level_rev = scene.scene_rev;
}

constexpr Change kChanges[] = {
    {"level_one", true, [](Scene& scene, const Scene&, int n) { set_level(scene, scene.lights.size() / 2, n); }},
    {"color_one", true,
     [](Scene& scene, const Scene&, int n) {
         Light& light = scene.lights[scene.lights.size() / 2];
         light.color = 0.6 + 0.4 * glm::dvec3(std::cos(0.37 * n), std::sin(0.37 * n), -std::cos(0.37 * n));
         light.level_rev = scene.scene_rev;
     }},
    {"level_all", false,
     [](Scene& scene, const Scene&, int n) {
         for (std::size_t i = 0; i < scene.lights.size(); ++i) set_level(scene, i, n + static_cast<int>(i));
     }},
    {"exposure", true,
     [](Scene& scene, const Scene& home, int n) {
         scene.exposure_ev100 = home.exposure_ev100 + std::sin(0.11 * n);
         scene.exposure_rev = scene.scene_rev;
     }},
    {"move_one", false,
     [](Scene& scene, const Scene& home, int n) {
         const std::size_t which = scene.lights.size() / 2;
         scene.lights[which].position =
             home.lights[which].position + 0.3 * glm::dvec3(std::cos(0.3 * n), 0.0, std::sin(0.3 * n));
         scene.lights[which].position_rev = scene.lights[which].aim_rev = scene.scene_rev;
     }},
    {"orbit", false,
     [](Scene& scene, const Scene& home, int n) {
         const glm::dvec3 from = home.camera.eye - home.camera.target;
         const double turn = 0.35 * std::sin(0.03 * n), c = std::cos(turn), s = std::sin(turn);
         scene.camera.eye = home.camera.target + glm::dvec3(c * from.x + s * from.z, from.y, c * from.z - s * from.x);
         scene.camera_rev = scene.scene_rev;
     }},
};

FinishedFrame frame(Renderer& renderer, LaneEncoders& encoder, const Scene& scene) {
    renderer.begin_frame(scene, monotonic_ns());
    FinishedFrame done = *renderer.finish_frame(true);
    encode_beside(encoder, done);
    return done;
}

// Renders the scene as it stands until nothing more would run.
void settle(Renderer& renderer, LaneEncoders& encoder, const Scene& scene, LightsRow& row) {
    row.settling_frames = 0;
    row.settling_ms = 0.0;
    for (bool settled = false; !settled;) {
        if (row.settling_frames == kMostSettling) throw std::runtime_error("the picture does not settle");
        const FinishedFrame done = frame(renderer, encoder, scene);
        settled = done.report.settled();
        ++row.settling_frames;
        row.settling_ms += done.report.frame_ms();
    }
}

LightsRow measure(Renderer& renderer, LaneEncoders& encoder, const Scene& home, const Change& change, double seconds) {
    Scene scene = home;
    LightsRow row;
    row.scene = scene.asset->name;
    row.lights = scene.lights.size();
    row.change = change.name;
    settle(renderer, encoder, scene, row);
    std::vector<double> times;
    PassTimes passes;
    double spent_ms = 0.0;
    constexpr int kWarmUp = 3;
    for (int n = 1; times.size() < kMostFrames && (times.size() < kLeastFrames || spent_ms < seconds * 1e3); ++n) {
        ++scene.scene_rev;
        change.make(scene, home, n);
        const FinishedFrame done = frame(renderer, encoder, scene);
        const double ms = done.report.frame_ms();
        if (n <= kWarmUp) continue;
        times.push_back(ms);
        passes.add(done.report);
        spent_ms += ms;
    }
    settle(renderer, encoder, scene, row);
    std::sort(times.begin(), times.end());
    row.frame_ms = times[times.size() / 2];
    row.frame_p95_ms = times[times.size() * 95 / 100];
    row.frames = times.size();
    row.pass_ms = passes.medians();
    return row;
}

void print_table(const std::vector<LightsRow>& rows, std::ostream& out) {
    out << "scene    change       lights   median ms    p95 ms       FPS   rate   settling: frames      ms  passes, "
           "ms\n"
        << std::fixed;
    for (const LightsRow& row : rows) {
        out << std::left << std::setw(9) << row.scene << std::setw(11) << row.change << std::right << std::setw(8)
            << row.lights << std::setprecision(2) << std::setw(12) << row.frame_ms << std::setw(10) << row.frame_p95_ms
            << std::setprecision(1) << std::setw(10) << 1e3 / row.frame_ms << std::setprecision(2) << std::setw(7)
            << row.rate << std::setw(19) << row.settling_frames << std::setprecision(0) << std::setw(8)
            << row.settling_ms << std::setprecision(1);
        for (const auto& [name, ms] : row.pass_ms) {
            if (ms >= 0.1) out << "  " << name << " " << ms;
        }
        out << "\n";
    }
}

void print_json(const std::vector<LightsRow>& rows, const std::string& renderer, const LightsOptions& options,
                std::ostream& out) {
    nlohmann::json json = {{"renderer", renderer},
                           {"size", {options.width_px, options.height_px}},
                           {"threads", std::thread::hardware_concurrency()}};
    for (const LightsRow& row : rows) {
        json["rows"].push_back({{"scene", row.scene},
                                {"lights", row.lights},
                                {"change", row.change},
                                {"frame_ms", row.frame_ms},
                                {"frame_p95_ms", row.frame_p95_ms},
                                {"rate", row.rate},
                                {"frames", row.frames},
                                {"settling_frames", row.settling_frames},
                                {"settling_ms", row.settling_ms},
                                {"pass_ms", row.pass_ms}});
    }
    out << json.dump(2) << "\n";
}

}  // namespace

void run_lights(const LightsOptions& options, std::ostream& out) {
    const auto context = gl::Context::create({options.device, false});
    const auto encoder = make_idle_encoder();
    std::vector<LightsRow> rows;
    const auto measure_scene = [&](Scene scene, bool everything) {
        if (options.lights != 0 && options.lights != scene.lights.size()) return;
        if (!options.scene.empty() && options.scene != scene.asset->name) return;
        scene.width_px = options.width_px & ~1;
        scene.height_px = options.height_px & ~1;
        scene.haze.extinction_per_m = options.haze_per_m;
        Renderer renderer(*context);
        renderer.set_links(transport::kMostLinks);
        for (const Change& change : kChanges) {
            if ((everything || change.everywhere) && (options.change.empty() || options.change == change.name))
                rows.push_back(measure(renderer, *encoder, scene, change, options.seconds));
        }
    };
    for (const int side : {1, 2, 4, 8, 22}) measure_scene(scene_of(test::of_points(*test::make_stage(side))), true);
    for (const char* name : {"cornell", "atrium"}) measure_scene(scene_of(bench_asset(name)), false);
    if (rows.empty())
        throw std::runtime_error("nothing of that scene, number and change: see gonio-bench lights --help");
    std::stable_sort(rows.begin(), rows.end(), [](const LightsRow& a, const LightsRow& b) {
        const auto order = [](const LightsRow& row) {
            return std::find_if(std::begin(kChanges), std::end(kChanges),
                                [&](const Change& change) { return row.change == change.name; });
        };
        return std::pair(a.scene != "stage", order(a)) < std::pair(b.scene != "stage", order(b));
    });
    for (LightsRow& row : rows) {
        const auto single = std::find_if(rows.begin(), rows.end(), [&](const LightsRow& other) {
            return other.scene == row.scene && other.lights == 1 && other.change == row.change;
        });
        if (single != rows.end()) row.rate = single->frame_ms / row.frame_ms;
    }
    if (options.json) return print_json(rows, context->renderer(), options, out);
    out << context->description() << "; " << std::thread::hardware_concurrency() << " threads; " << options.width_px
        << "x" << options.height_px << "; rate: frame rate over that of one luminaire\n";
    print_table(rows, out);
}

}  // namespace gonio::bench
