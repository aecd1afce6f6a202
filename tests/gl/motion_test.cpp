// A luminaire that moves by a millimetre changes the light by what the physics says, not by what a new sample of it
// would.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/trace/reference.h"
#include "server/trace/world.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

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
    const PicturePoints receivers = points_of(scene, *world->geometry, 20);
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
    std::printf("a millimetre: median %.2f %%, p95 %.2f %%, most %.1f %% of the mean\n",
                100 * off[off.size() / 2] / mean, 100 * off[off.size() * 95 / 100] / mean, 100 * off.back() / mean);
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
