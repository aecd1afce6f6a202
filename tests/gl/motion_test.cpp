// A luminaire that moves by a millimetre changes the light by what the physics says, not by what a new sample of it
// would.
#include <algorithm>
#include <cmath>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/shade/raster.h"
#include "server/shade/screen.h"
#include "server/trace/reference.h"
#include "server/trace/world.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

struct Receivers {
    std::vector<trace::MeterPoint> points;
    std::vector<std::size_t> pixels;
};

Receivers every_pixel_of(const Scene& scene, const trace::Geometry& geometry, int step) {
    shade::Surfaces surfaces;
    shade::Raster raster;
    shade::Pool pool;
    shade::look_through(eye_of(scene.camera, scene.width_px, scene.height_px), geometry, 1e-4f, scene.width_px,
                        scene.height_px, surfaces);
    shade::draw_surfaces(shade::make_clusters(geometry), shade::make_looks(geometry), false, surfaces, raster, pool);
    Receivers receivers;
    for (int y = step / 2; y < scene.height_px; y += step) {
        for (int x = step / 2; x < scene.width_px; x += step) {
            const shade::Spot spot = shade::spot_at(surfaces, x, y);
            if (!(spot.depth > 0.0f)) continue;
            receivers.points.push_back({geometry.origin() + glm::dvec3(spot.position), glm::dvec3(spot.normal)});
            receivers.pixels.push_back(static_cast<std::size_t>(y * scene.width_px + x));
        }
    }
    return receivers;
}

// Relative to the mean illuminance: indirect light, luminance. The reference takes the same random numbers for both
// places, so that its own noise cancels.
void moves_smoothly(const std::shared_ptr<const SceneAsset>& asset, double median, double p95, double most) {
    Scene scene = scene_of(asset);
    scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);
    scene.width_px = scene.height_px = 400;
    Scene moved = scene;
    moved.lights[0].position.x += 0.001;
    moved.lights[0].position_rev = ++moved.scene_rev;
    const auto world = trace::make_world(scene), moved_world = trace::make_world(moved);
    const Receivers receivers = every_pixel_of(scene, *world->geometry, 20);
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.0;
    settings.max_passes = 1024;
    const auto truth = trace::measure(*world, receivers.points, settings),
               moved_truth = trace::measure(*moved_world, receivers.points, settings);
    Renderer renderer(context(), Renderer::Gather::simd);
    const auto shown = [&](const Scene& which) {
        renderer.begin_frame(which, monotonic_ns());
        renderer.finish_frame(true);
        return renderer.live_illuminance(which, true);
    };
    const std::vector<glm::vec3> before = shown(scene), after = shown(moved);
    double mean = 0.0;
    std::vector<double> off;
    for (std::size_t i = 0; i < receivers.points.size(); ++i) {
        const std::size_t at = receivers.pixels[i];
        const double change = trace::luminance(glm::dvec3(after[at])) - trace::luminance(glm::dvec3(before[at])),
                     true_change =
                         trace::luminance(moved_truth[i].indirect_lx) - trace::luminance(truth[i].indirect_lx);
        off.push_back(std::abs(change - true_change));
        mean += trace::luminance(truth[i].indirect_lx) / static_cast<double>(receivers.points.size());
    }
    std::sort(off.begin(), off.end());
    EXPECT_LT(off[off.size() / 2] / mean, median);
    EXPECT_LT(off[off.size() * 95 / 100] / mean, p95);
    EXPECT_LT(off.back() / mean, most) << "no spot flashes";
}

TEST(Motion, AMillimetreInCornell) {
    moves_smoothly(make_cornell(), 0.002, 0.01, 0.03);
}

TEST(Motion, AMillimetreInTheAtrium) {
    moves_smoothly(make_atrium(), 0.004, 0.02, 0.08);  // small leaves come and go from the light
}

}  // namespace
}  // namespace gonio::test
