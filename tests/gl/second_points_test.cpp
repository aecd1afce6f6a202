// Surfaces that are finer than the grid of one point per 4 × 4 pixels are lit as what they are, not as their
// neighbours.
#include <cmath>
#include <cstdio>

#include "server/trace/sources.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

// A screen pleated along the picture's rows, whose pleats turn by turn face a lit wall to the right and a dark one to
// the left. fold_m: width of a pleat.
Scene pleated(double fold_m) {
    constexpr double kHalf = 0.3;  // of the screen, m
    std::vector<Piece> pieces = {
        {quad({2, -2, -1}, {2, -2, 3}, {2, 2, 3}, {2, 2, -1}), glm::vec3(0.8f)},        // faces -x
        {quad({-2, -2, 3}, {-2, -2, -1}, {-2, 2, -1}, {-2, 2, 3}), glm::vec3(0.02f)}};  // faces +x
    bool right = true;
    for (double x = -kHalf; x < kHalf; x += fold_m, right = !right) {
        const double from = right ? 0.6 * fold_m : 0.0, to = right ? 0.0 : 0.6 * fold_m;  // depth at both sides
        pieces.push_back({quad({x, -kHalf, from}, {x + fold_m, -kHalf, to}, {x + fold_m, kHalf, to}, {x, kHalf, from}),
                          glm::vec3(0.1f)});
    }
    Scene scene = scene_with(pieces, isotropic(1000.0), {1.4, 0.2, 1.5});
    scene.camera = {{0.003, 0.002, 4.0}, {0, 0, 0}, 0.6};
    scene.width_px = scene.height_px = 320;
    return scene;
}

TEST(SecondPoints, FoldsOfTwoPixels) {
    // 320 pixels see 2 · 4 m · tan 0.3.
    const double pixel_m = 8.0 * std::tan(0.3) / 320.0;
    Scene scene = pleated(2.3 * pixel_m);
    const TracedPoints traced = traced_points(scene, 3, 0.01);
    ASSERT_GT(traced.points.size(), 500u);

    Renderer renderer(context(), Renderer::Gather::simd);
    show(renderer, scene);
    const double rms = rms_of(traced, renderer.live_illuminance(scene, true));
    double low = 0.0, high = 0.0;
    int lows = 0, highs = 0;
    for (std::size_t i = 0; i < traced.points.size(); ++i) {
        const bool lit = traced.points[i].normal.x > 0.0;
        (lit ? high : low) += trace::luminance(traced.truth[i].indirect_lx);
        ++(lit ? highs : lows);
    }
    const double contrast = (high / highs) / (low / lows);
    std::printf("%zu points, lit pleats %.1f times the dark ones, rms %.3f\n", traced.points.size(), contrast, rms);
    EXPECT_GT(contrast, 3.0) << "the pleats differ";
    EXPECT_LT(rms, 0.3);
}

}  // namespace
}  // namespace gonio::test
