#include "tests/bench/transport_bench.h"

#include <algorithm>
#include <chrono>
#include <glm/gtc/matrix_transform.hpp>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/bench/cases.h"
#include "tests/bench/errors.h"
#include "tests/bench/frame_loop.h"
#include "tests/bench/reference.h"
#include "tests/scenes/show.h"

namespace gonio::bench {
namespace {

struct Sized {
    const char* name;
    const char* scene;
    int splits = 0;       // as of split_triangles
    double larger = 1.0;  // all lengths times this, all light times its square: the same picture
};
constexpr Sized kSizes[] = {{"cornell", "cornell"},
                            {"atrium", "atrium"},
                            {"cornell, 64 for each triangle", "cornell", 3},
                            {"cornell, 400 times as large", "cornell", 0, 400.0}};

Scene scene_of_size(const Sized& which) {
    std::shared_ptr<const SceneAsset> asset = bench_asset(which.scene);
    if (which.splits > 0) asset = split_triangles(*asset, which.splits);
    Scene scene = scene_of(asset);
    if (which.larger == 1.0) return scene;
    auto larger = std::make_shared<SceneAsset>(*asset);
    for (Instance& instance : larger->instances)
        instance.world_from_mesh =
            glm::scale(glm::dmat4(1.0), glm::dvec3(which.larger)) * glm::dmat4(instance.world_from_mesh);
    larger->bounds.min *= which.larger;
    larger->bounds.max *= which.larger;
    scene.asset = larger;
    scene.camera.eye *= which.larger;
    scene.camera.target *= which.larger;
    for (Light& light : scene.lights) {
        light.position *= which.larger;
        light.multiplier *= which.larger * which.larger;
    }
    return scene;
}

struct SceneRow {
    const Sized* which;
    std::size_t triangles = 0;
    double extent_m = 0.0;                      // the longest side of the scene
    double first_s = 0.0, ready_s = 0.0;        // after the first picture: first and last generation of links
    double meanwhile_ms = 0.0, later_ms = 0.0;  // median frame until then, and afterwards
    double longest_ms = 0.0;                    // frame until then, after the first
    v1::TransportStats stats;
    Errors errors;
};

SceneRow measure(const gl::Context& context, const Sized& which, const TransportOptions& options,
                 std::ostream& progress) {
    using Clock = std::chrono::steady_clock;
    const auto seconds_since = [](Clock::time_point begin) {
        return std::chrono::duration<double>(Clock::now() - begin).count();
    };
    Scene scene = scene_of_size(which);
    ReferenceSettings settings;
    settings.seconds = options.reference_seconds;
    const Reference reference = reference_of(scene, settings, options.cache, progress);
    SceneRow row{&which};
    row.triangles = scene.asset->triangles();
    const glm::dvec3 size = scene.asset->bounds.max - scene.asset->bounds.min;
    row.extent_m = std::max({size.x, size.y, size.z});
    Renderer renderer(context);
    renderer.make_transport_beside();
    const glm::dvec3 home = scene.camera.eye;
    int n = 0;
    const auto frame_ms = [&] {
        scene.camera.eye = home + 0.001 * row.extent_m * glm::dvec3(std::cos(0.3 * n), std::sin(0.3 * n), 0.0);
        ++n;
        scene.camera_rev = ++scene.scene_rev;
        const auto begin = Clock::now();
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
        return 1e3 * seconds_since(begin);
    };
    frame_ms();
    const auto shown = Clock::now();
    std::vector<double> meanwhile, later;
    while (renderer.ready(scene) != Readiness::all) {
        meanwhile.push_back(frame_ms());
        if (row.first_s == 0.0 && renderer.transport_stats().surfels() > 0) row.first_s = seconds_since(shown);
    }
    row.ready_s = seconds_since(shown);
    row.stats = renderer.transport_stats();
    row.longest_ms = meanwhile.empty() ? 0.0 : *std::max_element(meanwhile.begin(), meanwhile.end());
    while (later.size() < std::max<std::size_t>(meanwhile.size(), 40)) later.push_back(frame_ms());
    row.meanwhile_ms = meanwhile.empty() ? 0.0 : median(meanwhile);
    row.later_ms = median(later);
    scene.camera.eye = home;
    scene.camera_rev = ++scene.scene_rev;
    test::show(renderer, scene);
    row.errors = errors_of(shown_lx(renderer.live_illuminance(scene, true), scene.width_px, reference.receivers),
                           reference.all_lx, reference.all_variance);
    return row;
}

}  // namespace

void run_transport(const TransportOptions& options, std::ostream& out, std::ostream& progress) {
    const auto context = gl::Context::create({options.device, false});
    std::vector<SceneRow> rows;
    for (const Sized& which : kSizes) rows.push_back(measure(*context, which, options, progress));
    if (options.json) {
        nlohmann::json json = {{"renderer", context->renderer()}};
        for (const SceneRow& row : rows)
            json["rows"].push_back({{"scene", row.which->name},
                                    {"triangles", row.triangles},
                                    {"extent_m", row.extent_m},
                                    {"surfels", row.stats.surfels()},
                                    {"links", row.stats.links_per_surfel()},
                                    {"bytes", row.stats.bytes()},
                                    {"first_s", row.first_s},
                                    {"ready_s", row.ready_s},
                                    {"meanwhile_ms", row.meanwhile_ms},
                                    {"later_ms", row.later_ms},
                                    {"longest_ms", row.longest_ms},
                                    {"rmse", row.errors.rmse},
                                    {"rmse99", row.errors.rmse99},
                                    {"bias", row.errors.bias}});
        out << json.dump(2) << "\n";
        return;
    }
    out << std::fixed;
    for (const SceneRow& row : rows)
        out << row.which->name << ": " << row.triangles << " triangles, " << std::setprecision(1) << row.extent_m
            << " m; " << row.stats.surfels() << " surfels, " << row.stats.links_per_surfel() << " links of each, "
            << row.stats.bytes() / (1 << 20) << " MiB; first after " << row.first_s << " s, all after " << row.ready_s
            << " s; a frame " << row.meanwhile_ms << " ms meanwhile, " << row.longest_ms << " at most, " << row.later_ms
            << " afterwards; rmse " << std::setprecision(3) << row.errors.rmse << ", rmse99 " << row.errors.rmse99
            << ", bias " << row.errors.bias << "\n";
}

}  // namespace gonio::bench
