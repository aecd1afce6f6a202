// More luminaires than have a layer of their own: those that changed longest ago are summed.
#include <cmath>
#include <set>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

using Ran = std::set<std::string>;

// Cornell's luminaire in n parts at its place: light is linear, so that the picture is that of the whole one.
Scene parted(std::size_t n) {
    static const auto asset = of_points(*make_cornell());  // and its surfels
    Scene scene = scene_of(asset);
    scene.width_px = scene.height_px = 160;
    repeat_light(scene, n, [n](Light& part, std::size_t i) {
        part.name = "part " + std::to_string(i + 1);
        part.multiplier /= static_cast<double>(n);
    });
    return scene;
}

double mean(const std::vector<glm::vec3>& lux) {
    double sum = 0.0;
    for (const glm::vec3& value : lux) sum += static_cast<double>(value.g);
    return sum / static_cast<double>(lux.size());
}
// The mean of |a - b| over the mean of a.
double difference(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(static_cast<double>(a[i].g - b[i].g));
    return sum / static_cast<double>(a.size()) / mean(a);
}

struct Summed : testing::Test {
    Summed() : renderer(context(), direct_light()) { make_coarse(renderer); }
    // So many layers fit.
    void make_room(std::size_t layers) {
        const std::size_t one = 160 * 160 * 28 + 4500 * 72;
        renderer.set_layer_bytes(layers * one);
    }
    Ran frame(Scene& scene) {
        renderer.begin_frame(scene, monotonic_ns());
        return passes_run(renderer.finish_frame(true)->report);
    }
    void level(Scene& scene, std::size_t light, double ratio) {
        scene.lights[light].level_ratio = ratio;
        scene.lights[light].level_rev = ++scene.scene_rev;
    }
    std::vector<glm::vec3> lit(const Scene& scene, bool indirect) {
        show(renderer, scene);
        return renderer.live_illuminance(scene, indirect);
    }

    Renderer renderer;
};

TEST_F(Summed, ThePictureIsTheSame) {
    const Scene whole = parted(1);
    const auto direct = lit(whole, false), indirect = lit(whole, true);
    make_room(4);
    Scene scene = parted(20);
    const double limit = direct_light() == Renderer::DirectLight::gl ? 0.02 : 0.01;  // shadow maps beside rays
    EXPECT_LT(difference(direct, lit(scene, false)), limit);
    EXPECT_LT(difference(indirect, lit(scene, true)), 0.01);
    renderer.set_refinement(true);
    const auto refine = [&] {
        for (int steps = 0; !renderer.refined(scene) && steps < 1000; ++steps) {
            if (renderer.refine(scene, [] { return false; })) frame(scene);
        }
        EXPECT_TRUE(renderer.refined(scene));
    };
    refine();
    EXPECT_LT(difference(indirect, lit(scene, true)), 0.05) << "gathered at the pixels";
    EXPECT_NEAR(mean(lit(scene, true)), mean(indirect), 0.01 * mean(indirect));
    // Some of them come out of the sum, and go back.
    for (std::size_t i = 0; i < 9; ++i) {
        level(scene, i, 0.0);
        frame(scene);
        EXPECT_NEAR(mean(renderer.live_illuminance(scene, true)), 0.95 * mean(indirect), 0.01 * mean(indirect)) << i;
        level(scene, i, 1.0);
        EXPECT_LT(difference(direct, lit(scene, false)), limit) << i;
        EXPECT_NEAR(mean(lit(scene, true)), mean(indirect), 0.01 * mean(indirect)) << i;
    }
    scene.master_ratio = 0.5;
    scene.master_rev = ++scene.scene_rev;
    EXPECT_NEAR(mean(lit(scene, false)), 0.5 * mean(direct), 0.01 * mean(direct));
    scene.master_ratio = 1.0;
    scene.master_rev = ++scene.scene_rev;
    level(scene, 3, 0.0);
    EXPECT_NEAR(mean(lit(scene, false)), 0.95 * mean(direct), 0.01 * mean(direct));
    EXPECT_NEAR(mean(lit(scene, true)), 0.95 * mean(indirect), 0.01 * mean(indirect));
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        level(scene, i, 0.0);
        frame(scene);
    }
    EXPECT_NEAR(mean(renderer.live_illuminance(scene, false)), 0.0, 1e-3 * mean(direct));
    refine();
    EXPECT_EQ(mean(lit(scene, false)) + mean(lit(scene, true)), 0.0);
}

TEST_F(Summed, OneThatIsRiddenCostsAComposite) {
    if (direct_light() == Renderer::DirectLight::gl) GTEST_SKIP() << "passes have other names";
    make_room(4);
    Scene scene = parted(20);
    show(renderer, scene);
    level(scene, 7, 0.5);
    EXPECT_EQ(frame(scene), (Ran{"solve", "direct", "gather", "composite"})) << "it gets a layer, of the difference";
    for (const double ratio : {0.4, 0.3, 0.2}) {
        level(scene, 7, ratio);
        EXPECT_EQ(frame(scene), Ran{"composite"});
    }
    scene.master_ratio = 0.7;
    scene.master_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(scene), Ran{"composite"});
    const auto move = [&] {
        scene.lights[7].position.x += 0.1;
        scene.lights[7].position_rev = ++scene.scene_rev;
        return frame(scene);
    };
    EXPECT_TRUE(move().contains("summed-direct")) << "it comes out of the sum, once";
    EXPECT_EQ(move(), (Ran{"surfels", "solve", "direct", "gather", "composite"}));
    scene.camera.eye.x += 0.1;
    scene.camera_rev = ++scene.scene_rev;
    EXPECT_FALSE(frame(scene).contains("surfels"));
    scene.camera.eye.x += 0.1;
    scene.camera_rev = ++scene.scene_rev;
    const Ran ran = frame(scene);
    EXPECT_TRUE(ran.contains("summed-direct") && ran.contains("summed-gather"));
    EXPECT_FALSE(ran.contains("summed-merge") || ran.contains("summed-solve") || ran.contains("surfels"));
}

TEST_F(Summed, ACaptureAndTheOtherViewsShowThem) {
    const Scene layered = parted(20);
    Scene scene = parted(kMostLayers + 6);
    // At pixel centres: shadows of summed luminaires have no samples of their own.
    const auto lux_of = [&](const Scene& of) {
        return renderer.capture(of, View::illuminance, 64, 64, true, trace::kAllBounces, 1)->values;
    };
    const std::vector<float> one = lux_of(layered), all = lux_of(scene);
    ASSERT_EQ(one.size(), all.size());
    double off = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < one.size(); i += 4) {
        off += static_cast<double>(std::abs(one[i] - all[i]));
        sum += static_cast<double>(one[i]);
    }
    EXPECT_GT(sum, 0.0);
    EXPECT_LT(off / sum, 0.003);
    // Of the live picture too, whose luminance is shown by shaders.
    make_room(4);
    show(renderer, scene);
    scene.view = View::luminance;
    scene.view_rev = ++scene.scene_rev;
    EXPECT_TRUE(frame(scene).contains("besides") || direct_light() == Renderer::DirectLight::gl);
}

// A smaller picture has room for more layers; the whole one that follows, of the same revision, for fewer again.
TEST_F(Summed, FewerLayersWhenThePictureGrows) {
    make_room(4);
    Scene scene = parted(20);
    show(renderer, scene);
    renderer.set_quality_level(3);
    for (std::size_t light = 0; light < 8; ++light) level(scene, light, 0.9);
    show(renderer, scene);
    renderer.set_quality_level(0);
    const auto whole = lit(scene, true);
    Renderer fresh(context(), direct_light());
    make_coarse(fresh);
    show(fresh, scene);
    EXPECT_LT(difference(fresh.live_illuminance(scene, true), whole), 0.01);
    EXPECT_LT(difference(fresh.live_illuminance(scene, false), renderer.live_illuminance(scene, false)), 0.02);
}

// As many as a scene holds.
TEST_F(Summed, FiveHundredAndAThousand) {
    const Scene whole = parted(1);
    const auto direct = lit(whole, false), indirect = lit(whole, true);
    const double limit = direct_light() == Renderer::DirectLight::gl ? 0.02 : 0.01;  // rays beside a shadow map
    for (const std::size_t lights : {std::size_t{500}, kMaxLights}) {
        const Scene scene = parted(lights);
        EXPECT_LT(difference(direct, lit(scene, false)), limit) << lights;
        EXPECT_LT(difference(indirect, lit(scene, true)), 0.01) << lights;
        if (lights < kMaxLights) continue;
        const auto reading = [&](const Scene& of) {
            return renderer.meter(of, {0.3, 0.0, 0.2}, {0, 1, 0}, Renderer::MeterQuality::interactive);
        };
        const v1::MeterReading one = reading(whole), many = reading(scene);
        EXPECT_NEAR(many.direct_lx(), one.direct_lx(), 1e-3 * one.direct_lx());
        EXPECT_NEAR(many.indirect_lx(), one.indirect_lx(), 0.01 * one.indirect_lx());
    }
}

}  // namespace
}  // namespace gonio::test
