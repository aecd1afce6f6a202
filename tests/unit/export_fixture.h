// Scenes to be written to files, and whether they come back with the same light.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/gel.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"
#include "tests/unit/angles.h"

namespace gonio::test {

// A luminaire whose lamp gives 60 % where it is aimed at the horizon, with a ballast factor of 0.9.
inline std::string tilting_lm63() {
    return "IESNA:LM-63-2002\r\n[TEST] tilting\r\n[TESTLAB] a\r\n[ISSUEDATE] b\r\n[MANUFAC] c\r\nTILT=INCLUDE\r\n1\r\n"
           "3\r\n0 90 180\r\n1 0.6 0.5\r\n1 1000 1 3 1 1 2 0 0 0\r\n0.9 1 100\r\n0 45 90\r\n0\r\n1000 500 100\r\n";
}

// Brighter towards C0 than elsewhere, with nothing above 100°.
inline std::shared_ptr<const Profile> lopsided() {
    static const auto profile = profile_of("lopsided", 1.0, [](double v, double h) {
        return v <= 100.0 * kDegree ? 200.0 * (2.0 + std::sin(v) * std::cos(h)) * (1.0 + std::cos(v)) : 0.0;
    });
    return profile;
}

inline Light light_of(const Scene& scene, const std::string& name, std::shared_ptr<const Profile> profile,
                      const glm::dvec3& position, const PanTiltRoll& turn = {}) {
    Light light;
    light.id = static_cast<std::uint32_t>(scene.lights.size()) + 100;
    light.name = name;
    light.profile = std::move(profile);
    light.position = position;
    light.world_from_light = orientation_of(turn);
    light.pan_rad = turn.pan_rad;
    light.tilt_rad = turn.tilt_rad;
    light.roll_rad = turn.roll_rad;
    return light;
}

// The scene with lights that differ in all that a light can be, half-way up and around its middle.
inline Scene rigged(std::shared_ptr<const SceneAsset> asset, bool with_sun = true) {
    Scene scene = scene_of(std::move(asset));
    const Bounds& bounds = scene.asset->bounds;
    const auto at = [&](double x, double y, double z) {
        return bounds.min + (bounds.max - bounds.min) * glm::dvec3(x, y, z);
    };
    for (Light& light : scene.lights) light.level_ratio = 0.4;
    const auto add = [&](Light light) {
        scene.lights.push_back(std::move(light));
        return &scene.lights.back();
    };
    Light* made = add(light_of(scene, "lopsided", lopsided(), at(0.4, 0.6, 0.5), {0.7, 0.5, 1.1}));
    made->level_ratio = 0.37;
    made->multiplier = 3.0;
    made->color = {1.0, 0.5, 0.25};
    made = add(light_of(scene, "tilted", *make_profile("tilting.ies", tilting_lm63()), at(0.5, 0.5, 0.3),
                        {-1.2, 80.0 * kDegree, 0.2}));
    made->tilt_factor = ies::tilt_factor(*made->profile->photometry.tilt, Angle::radians(80.0 * kDegree));
    made->cct_k = 3000.0;
    made->gel = find_gel(nullptr, "L201");
    made = add(light_of(scene, "flood", *builtin_profile("flood"), at(0.6, 0.7, 0.6), {2.0, 1.0, 0.0}));
    made->opening = ies::Opening{ies::OpeningShape::rectangle, 0.2 * m, 0.3 * m, 0.0 * m};
    made->multiplier = 0.02;
    made = add(light_of(scene, "bulb", punctual_point_profile(), at(0.3, 0.5, 0.7)));
    made->multiplier = 80.0;
    made->color = {0.2, 0.4, 0.3};
    made = add(light_of(scene, "spot", punctual_spot_profile(0.2, 0.7), at(0.5, 0.8, 0.5), {0.3, 0.4, 0.0}));
    made->multiplier = 500.0;
    if (with_sun) {
        made = add(light_of(scene, "sun", sun_profile(), at(0.5, 1.5, 0.5), {0.5, 0.3, 0.0}));
        made->sun = true;
        made->multiplier = 1000.0;
    }
    scene.master_ratio = 0.8;
    return scene;
}

// Ten places all over the scene, facing all ways.
inline std::vector<trace::MeterPoint> ten_points(const Bounds& bounds) {
    std::vector<trace::MeterPoint> points;
    for (int i = 0; i < 10; ++i) {
        const glm::dvec3 share(0.2 + 0.06 * i, 0.15 + 0.07 * ((3 * i) % 10), 0.2 + 0.06 * ((7 * i) % 10));
        points.push_back({bounds.min + (bounds.max - bounds.min) * share,
                          glm::normalize(glm::dvec3(std::sin(2.0 * i), 1.5 * std::cos(1.3 * i), std::cos(2.0 * i)))});
    }
    return points;
}

// Direct and indirect light are those of the same rays.
inline std::vector<trace::Reading> readings_of(const Scene& scene, const std::vector<trace::MeterPoint>& points) {
    trace::Settings settings;
    settings.bounces = 2;
    settings.noise = 1e-6;
    settings.max_passes = 64;
    settings.threads = 1;
    return trace::measure(*trace::make_world(scene), points, settings);
}

inline void expect_same_light(const Scene& before, const Scene& after) {
    const auto points = ten_points(before.asset->bounds);
    const auto was = readings_of(before, points), is = readings_of(after, points);
    ASSERT_EQ(was.size(), is.size());
    int lit = 0;
    for (std::size_t i = 0; i < was.size(); ++i) {
        const glm::dvec3 a = was[i].direct_lx + was[i].indirect_lx, b = is[i].direct_lx + is[i].indirect_lx;
        lit += a.g > 0.1 ? 1 : 0;
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[c], a[c], 1e-3 * a[c] + 1e-6) << "point " << i << " channel " << c;
    }
    EXPECT_GE(lit, 6) << "too little is lit to tell";
}

// A luminaire of 800 cd downwards, 2 m above the floor, at level 0.6: 0.6 · 800 / 2² = 120 lx below it. saved_again: as
// a file of it reads back.
inline void expect_a_closed_shutter_back(const std::function<Scene(const Scene&)>& saved_again) {
    const auto lux = [](const Scene& scene) { return readings_of(scene, {{{0, 0, 0}, {0, 1, 0}}})[0].direct_lx.g; };
    Scene scene = floor_scene(4.0, 0.5f, lopsided(), {0, 2, 0});
    scene.lights[0].level_ratio = 0.6;
    for (const auto& [shutter, lit_lx] : {std::pair(1.0, 120.0), {0.5, 60.0}, {0.0, 0.0}}) {
        scene.lights[0].shutter_ratio = shutter;
        Scene again = saved_again(scene);
        EXPECT_NEAR(lux(again), lit_lx, 0.12) << "as it was saved, shutter " << shutter;
        again.lights.at(0).level_ratio = 0.6;
        EXPECT_NEAR(lux(again), 120.0, 0.12) << "its level lights it as before, shutter " << shutter;
    }
}

}  // namespace gonio::test
