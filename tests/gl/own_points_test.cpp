// Surfaces that are finer than the grid of one point per 4 × 4 pixels are lit as what they are, not as their
// neighbours.
#include <cmath>
#include <cstdio>

#include "server/scene/scene.h"
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

struct Deviation {
    double rms, contrast;  // of indirect light over its mean; of the lit pleats over the dark ones
};
Deviation off_of(const Scene& scene, int step) {
    const TracedPoints traced = traced_points(scene, step, 0.01);
    EXPECT_GT(traced.points.size(), 500u);
    Renderer renderer(context(), Renderer::DirectLight::rays);
    show(renderer, scene);
    Deviation off{rms_of(traced, renderer.live_illuminance(scene, true)), 0.0};
    double low = 0.0, high = 0.0;
    int lows = 0, highs = 0;
    for (std::size_t i = 0; i < traced.points.size(); ++i) {
        const bool lit = traced.points[i].normal.x > 0.0;
        (lit ? high : low) += trace::luminance(traced.truth[i].indirect_lx);
        ++(lit ? highs : lows);
    }
    off.contrast = (high / highs) / (low / lows);
    std::printf("%zu points, lit pleats %.1f times the dark ones, rms %.3f\n", traced.points.size(), off.contrast,
                off.rms);
    return off;
}

// 320 pixels see 2 · 4 m · tan 0.3.
constexpr double kSeen = 8.0 * 0.30933625;

TEST(OwnPoints, FoldsOfTwoPixels) {
    const Deviation off = off_of(pleated(2.3 * kSeen / 320.0), 3);
    EXPECT_GT(off.contrast, 3.0) << "the pleats differ";
    EXPECT_LT(off.rms, 0.25);
}

// Where many more pixels want a point than there are places the others take what is around them.
TEST(OwnPoints, FoldsOfTwoPixelsAllOverThePicture) {
    Scene scene = pleated(0.6 * kSeen / 320.0);
    scene.camera.eye.z = 1.1;
    const Deviation off = off_of(scene, 7);
    EXPECT_GT(off.contrast, 3.0);
    EXPECT_LT(off.rms, 1.0) << "half of them are lit";
}

}  // namespace
}  // namespace gonio::test
