#include "server/trace/haze_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"

namespace gonio::trace {
namespace {

std::shared_ptr<const World> world_of(Scene scene, double extinction, double g = 0.0) {
    scene.haze = {.extinction_per_m = extinction, .g = g};
    return make_world(scene);
}

// A luminaire of 1 cd in empty air, but for a crumb far away.
std::shared_ptr<const World> in_the_air(const glm::dvec3& position, double extinction, double g = 0.0) {
    return world_of(test::scene_with({{test::quad({0, -500, 0}, {0, -500, 0.1}, {0.1, -500, 0.1}, {0.1, -500, 0})}},
                                     test::isotropic(1.0), position),
                    extinction, g);
}

// An isotropic point in a homogeneous medium (Sun et al. 2005), by quadrature.
TEST(HazePath, AirlightOfAPoint) {
    const struct {
        double extinction, off, foot, far, nit, g = 0.0;
    } rows[] = {{.05, 1, 5, 10, 7.8561299e-3},    {.05, 1, -2, 10, 1.0948256e-3},     {.02, 3, 10, 20, 1.0191485e-3},
                {.2, .1, 5, 10, 0.17253699},      {.05, 1, 5, 10, 8.47994e-3, -0.5},  {.05, 1, 5, 10, 1.054945e-2, 0.6},
                {.05, 1, 5, 10, 7.42808e-3, 0.9}, {.05, 1, 5, 100, 8.0539093e-3, 0.0}};
    for (const auto& row : rows) {
        const auto world = in_the_air({row.foot, row.off, 0}, row.extinction, row.g);
        const glm::vec3 from = world->geometry->local({0, 0, 0});
        constexpr std::uint32_t kSamples = 1u << 13;
        double sum = 0.0;
        for (std::uint32_t i = 0; i < kSamples; ++i) {
            Sample sample(7, i);
            sum +=
                static_cast<double>(scattered_light(*world, from, {1, 0, 0}, static_cast<float>(row.far), 1, sample).g);
        }
        EXPECT_NEAR(sum / kSamples / row.nit, 1.0, 0.003) << row.extinction << " " << row.g;
    }
}

// A plane that faces 100 cd in boundless haze: direct light, and what is scattered once.
TEST(HazePath, LightFromTheHaze) {
    const struct {
        double extinction, distance, direct, scattered;
    } rows[] = {{.02, 3, 10.4641, 0.74558}, {.05, 3, 9.56342, 1.58128}, {.1, 5, 2.42612, 1.10733}};
    for (const auto& row : rows) {
        const auto world =
            world_of(test::floor_scene(0.02, 0.0f, test::isotropic(100.0), {0, row.distance, 0}), row.extinction);
        Settings settings;
        settings.bounces = 1;
        settings.noise = 0.002;
        const MeterPoint point{{0, 0, 0}, {0, 1, 0}};
        const Reading reading = measure(*world, {&point, 1}, settings).front();
        EXPECT_NEAR(luminance(reading.direct_lx) / row.direct, 1.0, 1e-4);
        EXPECT_NEAR(luminance(reading.indirect_lx) / row.scattered, 1.0, 0.02) << row.extinction;
    }
}

// Haze that absorbs nothing takes no light out of a closed room, however dense it is and wherever it scatters.
TEST(HazePath, AClosedSphereLosesNothing) {
    for (const auto& [extinction, g] : {std::pair(0.1, 0.0), {0.5, 0.7}, {1.0, -0.5}}) {
        const auto world = world_of(
            test::scene_with({{test::inward_sphere(1.0, 48), glm::vec3(0.0f)}}, test::isotropic(100.0), {0, 0, 0}),
            extinction, g);
        Settings settings;
        settings.noise = 0.01;
        const MeterPoint point{{0, -0.999, 0}, {0, 1, 0}};
        const Reading reading = measure(*world, {&point, 1}, settings).front();
        EXPECT_NEAR(luminance(reading.direct_lx) / (100.0 * std::exp(-extinction)), 1.0, 0.005);
        EXPECT_NEAR(luminance(reading.direct_lx + reading.indirect_lx) / 100.0, 1.0, 0.02) << extinction << " " << g;
    }
}

// Within walls of one luminance everything has it, the haze too.
TEST(HazePath, AFurnace) {
    Scene scene = test::scene_with({{test::inward_sphere(1.0, 24), glm::vec3(0.5f), glm::vec3(100.0f)}},
                                   test::isotropic(1e-6), {0, 0, 0});
    scene.haze = {.extinction_per_m = 0.8, .g = 0.5};
    scene.camera = {{0, 0, 0}, {0, 0, -1}, 1.0};
    PictureRequest request;
    request.camera = scene.camera;
    request.width_px = request.height_px = 8;
    Settings settings;
    settings.noise = 0.03;
    Picture picture(make_world(scene), request, settings);
    while (!picture.refine(5.0).complete) {
    }
    double mean = 0.0, air = 0.0;
    const std::vector<float> values = picture.values(), haze = picture.haze();
    ASSERT_EQ(haze.size(), 3u * 64u);
    for (std::size_t i = 0; i < 64; ++i)
        mean += static_cast<double>(values[4 * i + 1]) / 64, air += static_cast<double>(haze[3 * i + 1]) / 64;
    // Walls that emit L and reflect a half of what reaches them have 2 L.
    EXPECT_NEAR(mean / 200.0, 1.0, 0.015);
    EXPECT_NEAR(air / (200.0 * (1.0 - std::exp(-0.8))), 1.0, 0.03);
}

}  // namespace
}  // namespace gonio::trace
