// Shadows in indirect light are as sharp as what is asked allows: nodes 16 pixels apart do not mix what one sees with
// what its neighbours do not.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/trace/sources.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

// A wall lit by the spot of a beam on a slab beside it, which is narrow but for a fiftieth all around; laths before the
// wall throw shadows with penumbras of about a node's distance.
Scene laths() {
    std::vector<Piece> pieces = {
        {quad({-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}), glm::vec3(0.1f)},                           // faces +z
        {quad({0.5, -1.5, 3.5}, {1.5, -1.5, 3.5}, {1.5, -1.5, 2.5}, {0.5, -1.5, 2.5}), glm::vec3(0.8f)}};  // faces +y
    for (double x = -1.5; x < 2.0; x += 0.6)
        pieces.push_back({quad({x, -2, 0.6}, {x + 0.2, -2, 0.6}, {x + 0.2, 2, 0.6}, {x, 2, 0.6}), glm::vec3(0.1f)});
    Scene scene = scene_with(
        pieces,
        profile_of("beam", 1.0,
                   [](double v, double) { return 200.0 + 1e4 * std::pow(std::max(std::cos(v), 0.0), 200.0); }),
        {1.0, -0.5, 3.0});
    scene.camera = {{0.003, 0.002, 4.0}, {0, 0, 0}, 0.6};
    scene.width_px = scene.height_px = 320;
    return scene;
}

TEST(Occlusion, ShadowsOfLaths) {
    const Scene scene = laths();
    const TracedPoints traced = traced_points(scene, 13, 0.03);
    Renderer renderer(context(), Renderer::Gather::simd);
    show(renderer, scene);
    const double rms = rms_of(traced, renderer.live_illuminance(scene, true));
    double all = 0.0;
    for (const trace::Reading& reading : traced.truth) all += trace::luminance(reading.indirect_lx);
    const double dim = 0.1 * all / static_cast<double>(traced.truth.size());
    const auto dark = std::count_if(traced.truth.begin(), traced.truth.end(), [&](const trace::Reading& reading) {
        return trace::luminance(reading.indirect_lx) < dim;
    });
    std::printf("%zu points, %td in shadow, rms %.3f\n", traced.points.size(), dark, rms);
    EXPECT_GT(10 * dark, static_cast<std::ptrdiff_t>(traced.points.size())) << "the laths' shadows";
    EXPECT_LT(rms, 0.15);  // mixed over 3 × 3 nodes, whatever they see: 0.18
}

}  // namespace
}  // namespace gonio::test
