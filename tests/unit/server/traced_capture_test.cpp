// Captures of reference quality of one light alone and of a difference: against closed forms on a floor, which no
// bounce reaches, and against the sum of single lights in a room with every bounce.
#include "server/session/traced_capture.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/assets/assets.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {
namespace {

constexpr int kSide = 48;
constexpr double kCandela = 1000.0;

class TracedCapture : public testing::Test {
protected:
    // A floor, seen from above; two lights 2 m over it.
    TracedCapture() : scene(floor_scene(8.0, 0.5f, isotropic(kCandela), {-1.0, 2.0, 0.0})) {
        repeat_light(scene, 2, [](Light& light, std::size_t i) { light.position = {i == 0 ? -1.0 : 1.5, 2.0, 0.5}; });
        scene.view = View::illuminance;
        scene.camera = {{0.0, 6.0, 0.01}, {0.0, 0.0, 0.0}, 0.8};
    }
    void run(const std::function<void(v1::Command&)>& fill) {
        v1::Command command;
        fill(command);
        const auto done = apply(scene, command, {});
        ASSERT_TRUE(done) << done.error().text();
    }
    // In lux, at the centres of pixels, rows from the top.
    gonio::TracedCapture capture(int bounces = trace::kAllBounces, double noise = 0.01) const {
        v1::CaptureQuery query;
        query.set_format("exr");
        query.set_quality("reference");
        query.set_width_px(kSide);
        query.set_height_px(kSide);
        query.set_samples_per_pixel(1);
        auto request = check_capture(scene, query);
        EXPECT_TRUE(request) << request.error().text();
        request->settings.bounces = bounces;
        request->settings.noise = noise;
        auto traced = trace_capture(trace::make_world(scene), scene, *request, {}, [](const trace::Progress&) {});
        EXPECT_TRUE(traced);
        return *traced;
    }
    // visit: for each pixel that shows a surface: its point of the plane y = 0, and its lux.
    void each(const CapturedPicture& picture, const std::function<void(const glm::dvec3&, double)>& visit) const {
        const Eye eye = eye_of(scene.camera, kSide, kSide);
        int seen = 0;
        for (int y = 0; y < kSide; ++y) {
            for (int x = 0; x < kSide; ++x) {
                const float* value = &picture.values[4 * static_cast<std::size_t>(y * kSide + x)];
                if (!(value[3] > 0.0f)) continue;
                const glm::dvec3 ray = ray_through(eye, (x + 0.5) / kSide * 2.0 - 1.0, 1.0 - (y + 0.5) / kSide * 2.0);
                visit(eye.position - ray * (eye.position.y / ray.y), static_cast<double>(value[0]));
                ++seen;
            }
        }
        EXPECT_GT(seen, kSide * kSide / 2);
    }
    // I cos / d² of an isotropic point, on the floor.
    static double lux(const glm::dvec3& from, const glm::dvec3& at) {
        const glm::dvec3 d = from - at;
        return kCandela * d.y / std::pow(glm::dot(d, d), 1.5);
    }
    Scene scene;
};

TEST_F(TracedCapture, OneLightAloneIsItsOwn) {
    scene.view_only = scene.lights[1].name;
    const auto traced = capture();
    EXPECT_TRUE(traced.progress.noise_reached);
    each(traced.picture, [&](const glm::dvec3& at, double found) {
        const double expected = lux(scene.lights[1].position, at);
        EXPECT_NEAR(found, expected, 0.01 * expected) << at.x << " " << at.z;
    });
    scene.lights[1].level_ratio = 0.0;
    const auto dark = capture();
    EXPECT_TRUE(dark.progress.noise_reached) << "and at once: nothing is there to be traced";
    EXPECT_LE(dark.progress.passes, trace::kLeastPassesOfNoise);
    each(dark.picture, [](const glm::dvec3&, double found) { EXPECT_EQ(found, 0.0); });
}

// The first is dimmed to a quarter, the second moves.
TEST_F(TracedCapture, ADifferenceIsNowLessThen) {
    const glm::dvec3 then = scene.lights[1].position, now{0.5, 1.2, -0.5};
    run([](auto& c) { c.mutable_save_preset()->set_name("A"); });
    run([&](auto& c) {
        c.mutable_set_light()->set_name(scene.lights[0].name);
        c.mutable_set_light()->set_level_ratio(0.25);
    });
    run([&](auto& c) {
        c.mutable_set_light()->set_name(scene.lights[1].name);
        for (int k = 0; k < 3; ++k) c.mutable_set_light()->add_position_m(now[k]);
    });
    run([](auto& c) { c.mutable_set_view()->set_compare("A"); });
    bool more = false, less = false;
    each(capture().picture, [&](const glm::dvec3& at, double found) {
        const double expected = -0.75 * lux(scene.lights[0].position, at) + lux(now, at) - lux(then, at);
        EXPECT_NEAR(found, expected, 0.01 * (std::abs(expected) + lux(then, at))) << at.x << " " << at.z;
        more |= found > 1.0;
        less |= found < -1.0;
    });
    EXPECT_TRUE(more && less);
    // Of one light alone.
    scene.view_only = scene.lights[0].name;
    each(capture().picture, [&](const glm::dvec3& at, double found) {
        const double expected = -0.75 * lux(scene.lights[0].position, at);
        EXPECT_NEAR(found, expected, -0.01 * expected);
    });
}

// With every bounce: single lights sum up to all. Emissive surfaces are no light's.
TEST_F(TracedCapture, SingleLightsSumUpToAll) {
    scene = scene_of(*load_scene("cornell"));
    scene.view = View::illuminance;
    const glm::dvec3 first = scene.lights[0].position;
    repeat_light(scene, 2, [&](Light& light, std::size_t i) {
        light.position = first + glm::dvec3(i == 0 ? -0.5 : 0.5, -0.3, 0.0);
        light.level_ratio = i == 0 ? 1.0 : 0.4;
    });
    const auto sum_of = [](const CapturedPicture& picture) {
        double sum = 0.0;
        for (std::size_t i = 0; i < picture.values.size(); i += 4) sum += static_cast<double>(picture.values[i]);
        return sum;
    };
    constexpr double kNoise = 0.05;
    const double all = sum_of(capture(trace::kAllBounces, kNoise).picture);
    double parts = 0.0, last = 0.0;
    for (const Light& light : scene.lights) {
        scene.view_only = light.name;
        const auto alone = capture(trace::kAllBounces, kNoise);
        EXPECT_LE(alone.progress.noise, kNoise);
        last = sum_of(alone.picture);
        EXPECT_GT(last, 0.2 * all);
        parts += last;
    }
    EXPECT_NEAR(parts, all, 0.01 * all);  // of thousands of pixels: their noise is off by a hundredth of its own
    scene.view_only.clear();
    run([](auto& c) { c.mutable_save_preset()->set_name("A"); });
    run([](auto& c) { c.mutable_set_view()->set_compare("A"); });
    scene.lights[1].level_ratio = 0.0;
    EXPECT_NEAR(sum_of(capture(trace::kAllBounces, kNoise).picture), -last, 0.01 * all) << "what went is the last one";
}

// A wall that emits beside the floor.
TEST_F(TracedCapture, EmissionIsNoLights) {
    const glm::dvec3 position{0.5, 2.0, 0.0};
    Piece floor{quad({-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}), glm::vec3(0.5f)};
    Piece wall{quad({-6, 0, 2}, {-6, 0, -2}, {-6, 3, -2}, {-6, 3, 2}), glm::vec3(0.0f), glm::vec3(2000.0f)};
    const Camera camera = scene.camera;
    scene = scene_with({floor, wall}, isotropic(kCandela), position);
    scene.camera = camera;
    scene.view = View::illuminance;
    double with = 0.0, alone = 0.0;
    each(capture(0, 0.2).picture, [&](const glm::dvec3&, double found) { with += found; });
    scene.view_only = scene.lights[0].name;
    each(capture(0, 0.2).picture, [&](const glm::dvec3& at, double found) {
        EXPECT_NEAR(found, lux(position, at), 0.01 * lux(position, at));
        alone += found;
    });
    EXPECT_GT(with, 1.1 * alone);
}

}  // namespace
}  // namespace gonio::test
