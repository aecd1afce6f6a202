// While the camera moves among several luminaires the picture is made of all of them at once; when it rests, of their
// own layers. Both show the same light.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "server/assets/assets.h"
#include "server/scene/eye.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/bench_scenes.h"

namespace gonio::test {
namespace {

float luminance(const glm::vec3& rgb) {
    return glm::dot(rgb, glm::vec3(0.2126f, 0.7152f, 0.0722f));
}

// Of one picture against another, relative to the mean of the second.
struct Difference {
    double bias = 0.0;
    double rms99 = 0.0;    // without the 1 % of pixels that differ most
    double visible = 0.0;  // share of pixels that differ by more than 5 % of their own value and 2 % of the mean
};
Difference difference(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    double sum = 0.0, excess = 0.0, visible = 0.0, pixels = 0.0;
    for (const glm::vec3& value : b) {
        sum += static_cast<double>(luminance(value));
        pixels += luminance(value) > 0.0f ? 1.0 : 0.0;
    }
    const double mean = sum / pixels;
    std::vector<double> squares;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double shown = static_cast<double>(luminance(a[i])), wanted = static_cast<double>(luminance(b[i]));
        excess += shown - wanted;
        if (std::abs(shown - wanted) > 0.05 * wanted + 0.02 * mean) visible += 1.0;
        if (wanted > 0.0 || shown > 0.0) squares.push_back((shown - wanted) * (shown - wanted));
    }
    std::sort(squares.begin(), squares.end());
    squares.resize(squares.size() * 99 / 100);
    double total = 0.0;
    for (const double square : squares) total += square;
    return {excess / sum, std::sqrt(total / static_cast<double>(squares.size())) / mean, visible / pixels};
}

class Merging : public testing::Test {
protected:
    explicit Merging(const std::shared_ptr<const SceneAsset>& asset)
        : renderer(context(), direct_light()), scene(scene_of(asset)) {
        scene.width_px = scene.height_px = 400;
    }
    void SetUp() override {
        if (direct_light() == Renderer::DirectLight::gl ||
            (direct_light() == Renderer::DirectLight::automatic && !context().software()))
            GTEST_SKIP() << "luminaires are merged where the CPU shades";
    }
    bool frame() {
        renderer.begin_frame(scene, monotonic_ns());
        return renderer.finish_frame(true)->report.settled();
    }
    void settle() {
        for (int frames = 0; !frame(); ++frames) ASSERT_LT(frames, 100);
    }

    // The picture of all at once against the one of the luminaires' own layers.
    std::array<Difference, 2> differences() {
        EXPECT_FALSE(frame());
        const auto direct = renderer.live_illuminance(scene, false), indirect = renderer.live_illuminance(scene, true);
        settle();
        const std::array<Difference, 2> found = {difference(direct, renderer.live_illuminance(scene, false)),
                                                 difference(indirect, renderer.live_illuminance(scene, true))};
        std::printf("%s, %zu luminaires: direct: bias %.4f, rms %.4f, visible %.4f; indirect: bias %.4f, rms %.4f\n",
                    scene.asset->name.c_str(), scene.lights.size(), found[0].bias, found[0].rms99, found[0].visible,
                    found[1].bias, found[1].rms99);
        return found;
    }

    Renderer renderer;
    Scene scene;
};

// The same asset each time: a renderer takes the surfels and links of the one before.
std::shared_ptr<const SceneAsset> stage_of(int side) {
    static std::map<int, std::shared_ptr<const SceneAsset>> made;
    if (!made[side]) made[side] = make_stage(side);
    return made[side];
}

class Merged : public Merging, public testing::WithParamInterface<int> {
protected:
    Merged() : Merging(stage_of(GetParam())) {}
};
INSTANTIATE_TEST_SUITE_P(Stage, Merged, testing::Values(2));
INSTANTIATE_TEST_SUITE_P(DeepStage, Merged, testing::Values(4));

TEST_P(Merged, ShowsTheLightOfTheLuminairesOwnLayers) {
    // Levels and colours differ, one luminaire is out.
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        scene.lights[i].level_ratio = i == 1 ? 0.0 : 0.3 + 0.7 * static_cast<double>(i * 5 % 7) / 6.0;
        scene.lights[i].color = {1.0, 0.4 + 0.1 * static_cast<double>(i % 7), 0.9};
    }
    const auto [direct, indirect] = differences();
    EXPECT_LT(std::abs(direct.bias), 0.002);
    EXPECT_LT(direct.rms99, 0.01);
    EXPECT_LT(direct.visible, 0.01);
    EXPECT_LT(std::abs(indirect.bias), 0.03);
    EXPECT_LT(indirect.rms99, 0.1);
}

// Beams that end, and leave most of the stage out.
TEST_P(Merged, ShowsNarrowBeams) {
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        scene.lights[i].profile = i % 2 == 0 ? as_point(*builtin_profile("narrow_spot")) : cosine_power(5000.0, 400.0);
        scene.lights[i].world_from_light = orientation_aiming(
            {2.0 * std::sin(2.1 * static_cast<double>(i)), -5.0, -2.0 * std::cos(1.3 * static_cast<double>(i))});
    }
    const auto [direct, indirect] = differences();
    EXPECT_LT(std::abs(direct.bias), 0.01);
    EXPECT_LT(direct.rms99, 0.02);
    EXPECT_LT(direct.visible, 0.02);
    EXPECT_LT(std::abs(indirect.bias), 0.05);
}

// Shadows of things as thin as railings.
class MergedAtrium : public Merging {
protected:
    MergedAtrium() : Merging(builtin("atrium")) { make_coarse(renderer); }
};
TEST_F(MergedAtrium, ShowsTheLightOfTheLuminairesOwnLayers) {
    repeat_light(scene, 6, [](Light& light, std::size_t i) {
        const auto k = static_cast<double>(i);
        if (i > 0) light.position += glm::dvec3(0.7 * std::cos(k), -0.2 * k, 0.7 * std::sin(k));
    });
    const auto [direct, indirect] = differences();
    EXPECT_LT(std::abs(direct.bias), 0.01);
    EXPECT_LT(direct.visible, 0.05);
    EXPECT_LT(std::abs(indirect.bias), 0.03);
    EXPECT_LT(indirect.rms99, 0.15);
}

// Both against the path tracer, at points all over the stage.
TEST_P(Merged, AgreesWithTheReference) {
    std::vector<trace::MeterPoint> points;
    for (double x = -5.5; x <= 5.5; x += 1.0) {
        for (double z : {-3.7, -0.5, 0.5, 2.0, 3.5}) points.push_back({{x, 0.0, z}, {0, 1, 0}});
        for (double y = 0.5; y <= 4.5; y += 0.8) points.push_back({{x, y, -4.0}, {0, 0, 1}});
    }
    for (double y = 0.5; y <= 4.5; y += 0.5) {
        for (double z = -3.5; z <= 3.5; z += 1.0) {
            points.push_back({{-6.0, y, z}, {1, 0, 0}});
            points.push_back({{6.0, y, z}, {-1, 0, 0}});
        }
    }
    // Those that the camera sees, and the pixels that show them.
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const trace::Geometry geometry(scene.asset);
    std::vector<std::size_t> pixels;
    std::erase_if(points, [&](const trace::MeterPoint& point) {
        const glm::dvec3 d = point.position - eye.position;
        const double depth = glm::dot(d, eye.forward);
        const double x = 0.5 + 0.5 * glm::dot(d, eye.right) / (depth * eye.tan_half_x),
                     y = 0.5 + 0.5 * glm::dot(d, eye.up) / (depth * eye.tan_half_y);
        if (depth <= 0.0 || x <= 0.01 || x >= 0.99 || y <= 0.01 || y >= 0.99) return true;
        if (geometry.occluded(geometry.local(point.position + 1e-3 * point.normal), geometry.local(eye.position)))
            return true;
        pixels.push_back(static_cast<std::size_t>(y * scene.height_px) * static_cast<std::size_t>(scene.width_px) +
                         static_cast<std::size_t>(x * scene.width_px));
        return false;
    });
    trace::Settings settings;
    settings.noise = 0.01;
    const auto truth = trace::measure(*trace::make_world(scene), points, settings);
    const auto errors = [&](const char* name) {
        const auto direct = renderer.live_illuminance(scene, false), indirect = renderer.live_illuminance(scene, true);
        double sum = 0.0, excess = 0.0, squares = 0.0, direct_sum = 0.0, direct_excess = 0.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double wanted = glm::dot(truth[i].indirect_lx, glm::dvec3(0.2126, 0.7152, 0.0722)),
                         direct_wanted = glm::dot(truth[i].direct_lx, glm::dvec3(0.2126, 0.7152, 0.0722));
            const double off = static_cast<double>(luminance(indirect[pixels[i]])) - wanted;
            sum += wanted, excess += off, squares += off * off;
            direct_sum += direct_wanted;
            direct_excess += static_cast<double>(luminance(direct[pixels[i]])) - direct_wanted;
        }
        const double n = static_cast<double>(points.size());
        std::printf("%zu luminaires, %s, %zu points: direct: bias %.4f; indirect: bias %.4f, rms %.4f\n",
                    scene.lights.size(), name, points.size(), direct_excess / direct_sum, excess / sum,
                    std::sqrt(squares / n) / (sum / n));
        return std::array{direct_excess / direct_sum, excess / sum, std::sqrt(squares / n) / (sum / n)};
    };
    EXPECT_FALSE(frame());
    const auto merged = errors("merged");
    settle();
    const auto own = errors("own layers");
    EXPECT_LT(std::abs(merged[0]), 0.01);
    EXPECT_LT(std::abs(merged[1]), 0.05);
    EXPECT_LT(merged[2], 0.15);
    EXPECT_LT(std::abs(own[0]), 0.01);
    EXPECT_LT(std::abs(own[1]), 0.03);
    EXPECT_LT(own[2], 0.12);
}

}  // namespace
}  // namespace gonio::test
