// Captures of many luminaires, which light them as one: against closed forms, in full precision.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "server/render/passes/passes.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/bench_scenes.h"

namespace gonio::test {
namespace {

constexpr std::size_t kMany = 12;
static_assert(kMany > lighting::kMostExactLights);

// Scenes are captured one after the other. The renderer keeps the luminaire of the last one and that of the live
// picture.
TEST(ManyCapture, KeepsNoLuminairesOfScenesThatAreGone) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(20.0, 0.0f, isotropic(1.0), {0, 2, 0});
    const auto capture = [&](std::uint32_t id) {
        scene.lights[0].id = id;
        const auto job = renderer.begin_capture(scene, View::illuminance, 32, 32, true);
        while (!renderer.continue_capture(*job)) {
        }
    };
    for (std::uint32_t id = 1; id <= 4; ++id) {
        capture(id);
        EXPECT_EQ(renderer.lights_held(), 1u) << id;
    }
    renderer.begin_frame(scene, monotonic_ns());
    renderer.finish_frame(true);
    capture(9);
    EXPECT_EQ(renderer.lights_held(), 2u) << "the live one's stays";
}

// On a black floor each pixel has the sum of I cos / d² × colour × level, of values far beyond what half floats hold
// apart; in several tiles.
TEST(ManyCapture, DirectLightIsTheSumInFullPrecision) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    Scene scene = floor_scene(20.0, 0.0f, isotropic(1.0), {0, 2, 0});
    repeat_light(scene, kMany, [](Light& light, std::size_t i) {
        const auto k = static_cast<double>(i);
        light.position = {std::cos(k), 1.5 + 0.1 * k, std::sin(k)};
        light.color = {1.0 + k, 2.0, 1.0 / (1.0 + k)};
        light.level_ratio = i == 3 ? 0.0 : 0.5;
        light.multiplier = i == 5 ? 3e7 : 1000.0;
    });
    scene.master_ratio = 0.25;
    scene.camera = {{0.0, 6.0, 0.001}, {0.0, 0.0, 0.0}, 0.8};
    const int width = 300, height = 200;
    const auto job = renderer.begin_capture(scene, View::illuminance, width, height, true);
    int tiles = 1;
    while (!renderer.continue_capture(*job)) ++tiles;
    EXPECT_GE(tiles, 2);
    const Eye eye = eye_of(scene.camera, width, height);
    for (int y = 3; y < height; y += 23) {
        for (int x = 5; x < width; x += 29) {
            const glm::dvec2 at((x + 0.5) / width * 2 - 1, 1 - (y + 0.5) / height * 2);
            const glm::dvec3 ray = ray_through(eye, at.x, at.y);
            const glm::dvec3 p = eye.position - ray * (eye.position.y / ray.y);
            double expected = 0.0;
            for (const Light& light : scene.lights) {
                const glm::dvec3 d = light.position - p;
                const double d2 = glm::dot(d, d);
                expected += 0.25 * light.level_ratio * light.multiplier * d.y / std::sqrt(d2) / d2 *
                            glm::dot(light.color, glm::dvec3(0.2126, 0.7152, 0.0722));
            }
            EXPECT_NEAR(static_cast<double>(job->picture->values[static_cast<std::size_t>(y * width + x) * 4]),
                        expected, 2e-4 * expected)
                << x << "," << y;
        }
    }
}

// Inside a diffuse sphere light after bounces is rho/(1 - rho) · flux / (4 pi R²) everywhere, of all luminaires. It is
// solved once for all tiles, and once more where one of them is dimmed.
TEST(ManyCapture, ASphereIsSolvedOnce) {
    constexpr double radius = 2.0, rho = 0.5;
    Renderer renderer(context(), direct_light());
    Scene scene = scene_with({{inward_sphere(radius, 64), glm::vec3(rho)}}, isotropic(1.0), {0, 0, 0});
    repeat_light(scene, kMany, [](Light& light, std::size_t i) {
        const auto k = static_cast<double>(i);
        light.position = {0.4 * std::cos(k), 0.05 * k - 0.3, 0.4 * std::sin(k)};
        light.multiplier = 10.0 * (1.0 + k);
    });
    scene.camera = {{0.3, 0.1, 0.0}, {1.0, 0.2, 0.1}, 1.2};
    const auto flux = [&] {
        double sum = 0.0;
        for (const Light& light : scene.lights) sum += 4 * std::numbers::pi * light.multiplier * light.level_ratio;
        return sum;
    };
    for (const double level : {1.0, 0.25}) {
        scene.lights[7].level_ratio = level;
        scene.lights[7].level_rev = ++scene.scene_rev;
        const auto job = renderer.begin_capture(scene, View::luminance, 320, 240, true);
        int tiles = 0, solves = 0;
        for (bool done = false; !done; ++tiles) {
            job->picture->report.clear_passes();
            done = renderer.continue_capture(*job);
            for (const v1::PassReport& row : job->picture->report.passes())
                solves += row.name() == "summed-solve" && row.state() == "ran";
        }
        EXPECT_GE(tiles, 2);
        EXPECT_EQ(solves, 1) << level;
        // Of the luminance rho/pi (E0 + E) what direct light is known to be is taken away.
        const double expected = rho / (1.0 - rho) * flux() / (4 * std::numbers::pi * radius * radius);
        const Eye eye = eye_of(scene.camera, 320, 240);
        double sum = 0.0, squares = 0.0;
        int count = 0;
        for (int y = 5; y < 240; y += 10) {
            for (int x = 5; x < 320; x += 10) {
                const glm::dvec2 at((x + 0.5) / 320 * 2 - 1, 1 - (y + 0.5) / 240 * 2);
                const glm::dvec3 ray = glm::normalize(ray_through(eye, at.x, at.y));
                const double b = glm::dot(eye.position, ray),
                             t = -b + std::sqrt(b * b + radius * radius - glm::dot(eye.position, eye.position));
                const glm::dvec3 p = eye.position + t * ray;
                double direct = 0.0;
                for (const Light& light : scene.lights) {
                    const glm::dvec3 d = light.position - p;
                    direct +=
                        light.multiplier * light.level_ratio * glm::dot(d, -p) / radius / std::pow(glm::dot(d, d), 1.5);
                }
                const double nit = static_cast<double>(job->picture->values[static_cast<std::size_t>(y * 320 + x) * 4]);
                const double indirect = nit * std::numbers::pi / rho - direct;
                sum += indirect, squares += (indirect - expected) * (indirect - expected), ++count;
            }
        }
        EXPECT_NEAR(sum / count, expected, 0.01 * expected) << level;
        EXPECT_LT(std::sqrt(squares / count), 0.03 * expected) << level;
    }
}

// Light adds up: a capture of many is the sum of captures of each, at their shadows' edges too, which have sixteen
// samples there.
TEST(ManyCapture, ShadowEdgesAreThoseOfEachLuminaire) {
    constexpr int kSide = 160;
    Scene scene = scene_of(builtin("cornell"));
    repeat_light(scene, kMany, [](Light& light, std::size_t i) {
        const auto k = static_cast<double>(i);
        light.position += glm::dvec3(0.15 * std::cos(2.0 * k), -0.02 * k, 0.15 * std::sin(2.0 * k));
        light.color = {1.0, 0.2 + 0.1 * k, 1.0 / (1.0 + k)};
        light.level_ratio = i == 4 ? 0.0 : 0.2 + 0.05 * k;
    });
    Renderer renderer(context(), Renderer::DirectLight::rays);
    make_coarse(renderer);
    const auto captured = [&](unsigned samples) {
        return renderer.capture(scene, View::direct, kSide, kSide, true, 0, samples)->values;
    };
    const std::vector<float> centres = captured(1), smooth = captured(16);
    const std::vector<Light> lights = scene.lights;
    std::vector<double> sum(smooth.size(), 0.0);
    for (const Light& light : lights) {
        scene.lights = {light};
        const std::vector<float> own = captured(16);
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<double>(own[i]);
    }
    int edges = 0, off = 0;
    double before = 0.0, after = 0.0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        if (i % 4 == 3 || !(sum[i] > 0.0)) continue;
        const double jagged = std::abs(static_cast<double>(centres[i]) / sum[i] - 1.0),
                     here = std::abs(static_cast<double>(smooth[i]) / sum[i] - 1.0);
        off += here > 0.002 ? 1 : 0;
        if (jagged < 0.02) continue;
        ++edges, before += jagged * jagged, after += here * here;
    }
    std::printf("%d values at edges: off by %.4f rms with one sample, %.5f with sixteen; %d of all off by 0.2 %%\n",
                edges, std::sqrt(before / edges), std::sqrt(after / edges), off);
    EXPECT_GT(edges, 500);
    EXPECT_LT(after, 1e-4 * before);
    EXPECT_LE(off, 4);
}

// Seconds of all processors that this process has used: other work of the machine does not count.
double processor_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Sixty-four luminaires, points, are captured in no more than three times the processor time of one.
TEST(ManyCapture, TimeOfSixtyFour) {
    const Scene scene_of_one = scene_of(of_points(*make_stage(1))), scene_of_many = scene_of(of_points(*make_stage(8)));
    Renderer renderer_of_one(context(), Renderer::DirectLight::rays),
        renderer_of_many(context(), Renderer::DirectLight::rays);
    make_coarse(renderer_of_one);
    make_coarse(renderer_of_many);
    const auto captured = [](Renderer& renderer, const Scene& scene) {
        const double began = processor_seconds();
        renderer.capture(scene, View::beauty, 400, 400, false);
        return processor_seconds() - began;
    };
    captured(renderer_of_one, scene_of_one);  // traces the links
    captured(renderer_of_many, scene_of_many);
    double one = std::numeric_limits<double>::infinity(), many = one;
    for (int turn = 0; turn < 3; ++turn) {
        one = std::min(one, captured(renderer_of_one, scene_of_one));
        many = std::min(many, captured(renderer_of_many, scene_of_many));
    }
    std::printf("one luminaire %.2f s, 64 %.2f s of processors: %.1f times\n", one, many, many / one);
    EXPECT_LT(many, 3.0 * one);
}

}  // namespace
}  // namespace gonio::test
