// Surfaces that are finer than the grid of one point per 4 × 4 pixels are lit as what they are, not as their
// neighbours.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/trace/reference.h"
#include "server/trace/world.h"
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
    const auto world = trace::make_world(scene);
    const auto [points, pixels] = points_of(scene, *world->geometry, 3);
    ASSERT_GT(points.size(), 500u);
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.01;
    const std::vector<trace::Reading> truth = trace::measure(*world, points, settings);

    Renderer renderer(context(), Renderer::Gather::simd);
    show(renderer, scene);
    const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, true);
    double squares = 0.0, mean = 0.0, low = 0.0, high = 0.0;
    int lows = 0, highs = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double is = trace::luminance(truth[i].indirect_lx),
                     off = trace::luminance(glm::dvec3(shown[pixels[i]])) - is;
        squares += off * off;
        mean += is;
        (points[i].normal.x > 0.0 ? high : low) += is;
        ++(points[i].normal.x > 0.0 ? highs : lows);
    }
    const auto count = static_cast<double>(points.size());
    const double rms = std::sqrt(squares / count) / (mean / count), contrast = (high / highs) / (low / lows);
    std::printf("%zu points, lit pleats %.1f times the dark ones, rms %.3f\n", points.size(), contrast, rms);
    EXPECT_GT(contrast, 3.0) << "the pleats differ";
    EXPECT_LT(rms, 0.3);
}

}  // namespace
}  // namespace gonio::test
