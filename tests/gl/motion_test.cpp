// A luminaire that moves by a millimetre changes the light by what the physics says, not by what a new sample of it
// would.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

// A luminaire's two places, a millimetre apart along x, as the picture and as the path tracer show them. The reference
// takes the same random numbers for both, so that its own noise cancels.
struct Move {
    std::vector<double> change_lx, true_change_lx, true_lx;  // indirect light, luminance, by receiver
    double mean_lx = 0.0;                                    // of the truth over all of the picture
};
constexpr double kAnywhere = 0.0;
// step: pixels between receivers; samples: of the truth at each; at_m: their distance from the luminaire, ±10 %.
Move a_millimetre(Scene scene, int step, std::uint32_t samples, double at_m) {
    scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);
    scene.width_px = scene.height_px = 400;
    Scene moved = scene;
    moved.lights[0].position.x += 0.001;
    moved.lights[0].position_rev = ++moved.scene_rev;
    const auto world = trace::make_world(scene), moved_world = trace::make_world(moved, world.get());
    PicturePoints receivers = points_of(scene, *world->geometry, step);
    trace::Settings settings;
    settings.noise = 0.0;
    settings.max_passes = samples;
    Move move;
    if (at_m != kAnywhere) {
        const PicturePoints all = points_of(scene, *world->geometry, 40);
        for (const trace::Reading& reading : trace::measure(*world, all.points, settings))
            move.mean_lx += trace::luminance(reading.indirect_lx) / static_cast<double>(all.points.size());
        const PicturePoints any = std::exchange(receivers, {});
        for (std::size_t i = 0; i < any.points.size(); ++i) {
            const double far_m = glm::distance(any.points[i].position, scene.lights[0].position);
            if (std::abs(far_m - at_m) > 0.1 * at_m) continue;
            receivers.points.push_back(any.points[i]);
            receivers.pixels.push_back(any.pixels[i]);
        }
    }
    const auto truth = trace::measure(*world, receivers.points, settings),
               moved_truth = trace::measure(*moved_world, receivers.points, settings);
    Renderer renderer(context(), Renderer::DirectLight::rays);
    renderer.set_links(128);
    const auto shown = [&](const Scene& which) {
        show(renderer, which);
        return renderer.live_illuminance(which, true);
    };
    const std::vector<glm::vec3> before = shown(scene), after = shown(moved);
    for (std::size_t i = 0; i < receivers.points.size(); ++i) {
        const std::size_t at = receivers.pixels[i];
        const double before_lx = trace::luminance(glm::dvec3(before[at]));
        move.change_lx.push_back(trace::luminance(glm::dvec3(after[at])) - before_lx);
        move.true_change_lx.push_back(trace::luminance(moved_truth[i].indirect_lx) -
                                      trace::luminance(truth[i].indirect_lx));
        move.true_lx.push_back(trace::luminance(truth[i].indirect_lx));
        if (at_m == kAnywhere) move.mean_lx += move.true_lx.back() / static_cast<double>(receivers.points.size());
    }
    return move;
}

struct Off {
    double median, p95, most;
};
// relative_to: of each receiver, lx.
Off off_of(const Move& move, const std::function<double(std::size_t)>& relative_to) {
    std::vector<double> off;
    for (std::size_t i = 0; i < move.change_lx.size(); ++i)
        off.push_back(std::abs(move.change_lx[i] - move.true_change_lx[i]) / relative_to(i));
    std::sort(off.begin(), off.end());
    const Off found{off[off.size() / 2], off[off.size() * 95 / 100], off.back()};
    std::printf("a millimetre: median %.2f %%, p95 %.2f %%, most %.1f %%, %zu receivers\n", 100 * found.median,
                100 * found.p95, 100 * found.most, off.size());
    return found;
}

// Wherever receivers are, relative to the mean illuminance.
void moves_smoothly(const std::shared_ptr<const SceneAsset>& asset, const Off& bounds) {
    const Move move = a_millimetre(scene_of(asset), 20, 1024, kAnywhere);
    const Off off = off_of(move, [&](std::size_t) { return move.mean_lx; });
    EXPECT_LT(off.median, bounds.median);
    EXPECT_LT(off.p95, bounds.p95);
    EXPECT_LT(off.most, bounds.most) << "no spot flashes";
}

// Of one scene first, then of the other: a renderer keeps the links of the scene before alone.
TEST(Motion, AMillimetreInCornell) {
    moves_smoothly(builtin("cornell"), {0.002, 0.01, 0.03});
}

// Receivers at 2 m from the luminaire, relative to their own illuminance; where that is less than a twentieth of the
// picture's mean, to this.
void moves_smoothly_at_2_m(const Scene& scene, int step, std::uint32_t samples, const Off& bounds) {
    const Move move = a_millimetre(scene, step, samples, 2.0);
    ASSERT_GT(move.change_lx.size(), 200u);
    const auto own = [&](std::size_t i) { return std::max(move.true_lx[i], 0.05 * move.mean_lx); };
    const Off off = off_of(move, own);
    EXPECT_LT(off.median, bounds.median);
    EXPECT_LT(off.p95, bounds.p95);
    EXPECT_LT(off.most, bounds.most);
}

TEST(Motion, AMillimetreAtTwoMetresInCornell) {
    // The worst are in the sculpture's own shadow, where windows over the grid see round its folds.
    moves_smoothly_at_2_m(scene_of(builtin("cornell")), 6, 1024, {0.0025, 0.01, 0.12});
}

TEST(Motion, AMillimetreInTheAtrium) {
    moves_smoothly(builtin("atrium"), {0.004, 0.02, 0.08});  // small leaves come and go from the light
}

TEST(Motion, AMillimetreAtTwoMetresInTheAtrium) {
    Scene scene = scene_of(builtin("atrium"));
    scene.lights[0].position = {-6.0, 2.0, 0.3};  // above the floor, before the camera
    // All receivers share what is left: VPLs that glide over the flutes of columns turn with them. 1 % is not reached.
    moves_smoothly_at_2_m(scene, 4, 2048, {0.01, 0.02, 0.04});
}

// The camera turns by a tenth of a degree, the light rests: in a diffuse sphere, where all places are lit alike, no
// pixel breathes.
TEST(Motion, ATurnOfTheCameraLeavesTheLight) {
    Scene scene = scene_with({{inward_sphere(2.0, 64), glm::vec3(0.5f)}}, cosine_power(1000.0, 2.0), {0.5, 0.3, 0.4});
    scene.camera.eye = {-0.4, 0.2, 0.1};
    scene.width_px = scene.height_px = 320;
    Renderer renderer(context(), direct_light());
    std::vector<glm::vec3> before;
    for (int turn = 0; turn < 20; ++turn) {
        const double angle = glm::radians(30.0 + 0.1 * turn);
        scene.camera.target = scene.camera.eye + glm::dvec3(std::cos(angle), 0.2, std::sin(angle));
        scene.camera_rev = ++scene.scene_rev;
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
        const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, true);
        std::vector<double> changes;
        double mean = 0.0;
        for (std::size_t i = 0; i < before.size(); ++i) {
            changes.push_back(std::abs(static_cast<double>(shown[i].g) - static_cast<double>(before[i].g)));
            mean += static_cast<double>(shown[i].g) / static_cast<double>(before.size());
        }
        before = shown;
        if (changes.empty()) continue;
        std::sort(changes.begin(), changes.end());
        EXPECT_LT(changes[changes.size() * 999 / 1000], 0.02 * mean) << turn;
    }
}

}  // namespace
}  // namespace gonio::test
