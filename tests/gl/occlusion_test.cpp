// Shadows in indirect light are as sharp as what is asked allows: nodes 16 pixels apart do not mix what one sees with
// what its neighbours do not.
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
    const auto world = trace::make_world(scene);
    const auto [points, pixels] = points_of(scene, *world->geometry, 13);
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.03;
    const std::vector<trace::Reading> truth = trace::measure(*world, points, settings);

    Renderer renderer(context(), Renderer::Gather::simd);
    show(renderer, scene);
    const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, true);
    double mean = 0.0, squares = 0.0;
    std::size_t dark = 0;
    for (const trace::Reading& reading : truth) mean += trace::luminance(reading.indirect_lx);
    mean /= static_cast<double>(truth.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double is = trace::luminance(truth[i].indirect_lx),
                     off = trace::luminance(glm::dvec3(shown[pixels[i]])) - is;
        dark += is < 0.1 * mean;
        squares += off * off;
    }
    const auto count = static_cast<double>(points.size());
    const double rms = std::sqrt(squares / count) / mean;
    std::printf("%zu points, %zu in shadow, rms %.3f\n", points.size(), dark, rms);
    EXPECT_GT(10 * dark, points.size()) << "the laths' shadows";
    EXPECT_LT(rms, 0.15);  // mixed over 3 × 3 nodes, whatever they see: 0.18
}

}  // namespace
}  // namespace gonio::test
