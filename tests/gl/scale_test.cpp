// The size of a scene: a room of 3 cm and one of 500 m are lit and drawn as that of 4 m. With lengths × s and
// candela × s² all lux stay, at the same pixels. The scales are powers of two, so that rounding is the same.
#include <cmath>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

Scene cornell_at(double scale) {
    Scene scene = scene_of(*load_scene("cornell", "", {.scale = scale}));
    scene.width_px = scene.height_px = 120;
    scene.lights[0].multiplier *= scale * scale;
    scene.lights[0].opening = ies::Opening();  // a point at each scale
    return scene;
}

// Result: the share of values that are not within 1 % of each other, or 0.1 % of the mean.
double differing(const std::vector<float>& a, const std::vector<float>& b) {
    double mean = 0.0, count = 0.0;
    for (const float value : a) mean += static_cast<double>(value) / static_cast<double>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i)
        count += std::abs(static_cast<double>(a[i] - b[i])) > 0.01 * static_cast<double>(a[i]) + 0.001 * mean;
    return count / static_cast<double>(a.size());
}

struct Lux {
    std::vector<float> live, captured;
    double indirect = 0.0;  // mean
};
Lux lit(double scale) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene scene = cornell_at(scale);
    show(renderer, scene);
    Lux lux;
    for (const glm::vec3& value : renderer.live_illuminance(scene, false)) lux.live.push_back(value.g);
    for (const glm::vec3& value : renderer.live_illuminance(scene, true))
        lux.indirect += static_cast<double>(value.g) / static_cast<double>(lux.live.size());
    lux.captured = renderer.capture(scene, View::illuminance, 120, 120, true, 0)->values;
    return lux;
}

TEST(Scale, ARoomOfThreeCentimetresAndOneOfFiveHundredMetres) {
    const Lux plain = lit(1.0);
    for (const double scale : {1.0 / 128, 128.0}) {
        const Lux scaled = lit(scale);
        EXPECT_LT(differing(plain.live, scaled.live), 0.005) << scale;
        EXPECT_LT(differing(plain.captured, scaled.captured), 0.005) << scale;
        EXPECT_NEAR(scaled.indirect, plain.indirect, 0.05 * plain.indirect) << scale << ": of other surfels";
    }
}

}  // namespace
}  // namespace gonio::test
