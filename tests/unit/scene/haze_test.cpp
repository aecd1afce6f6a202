#include "server/scene/haze.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

Haze haze(double extinction, double layer = 0.0) {
    Haze made;
    made.extinction_per_m = extinction, made.layer_height_m = layer;
    return made;
}

TEST(Haze, BeerAndLambert) {
    const struct {
        double extinction, length, passes;
    } rows[] = {{0.01, 10, 0.904837}, {0.05, 20, 0.367879}, {0.1, 15, 0.223130}};
    for (const auto& row : rows)
        EXPECT_NEAR(transmittance(haze(row.extinction), {1, 2, 3}, {1 + 0.6 * row.length, 2, 3 + 0.8 * row.length}),
                    row.passes, 1e-6);
}

// Integrals of sigma exp(-y / H) along straight ways.
TEST(Haze, ALayerThinsWithHeight) {
    const struct {
        double extinction, height, a, b, length, depth, passes;
    } rows[] = {{.05, 2, 0, 5, 10, 0.183583, 0.832283},
                {.05, 2, 1, 6, 8, 0.089079, 0.914773},
                {.02, 1, 0, 10, 20, 0.0399982, 0.960791}};
    for (const auto& row : rows) {
        Haze layer = haze(row.extinction, row.height);
        layer.floor_m = 7.0;
        const double along = std::sqrt(row.length * row.length - (row.b - row.a) * (row.b - row.a));
        const glm::dvec3 from{0, 7 + row.a, 0}, to{along, 7 + row.b, 0};
        EXPECT_NEAR(optical_depth(layer, from, to), row.depth, 1e-6);
        EXPECT_NEAR(transmittance(layer, to, from), row.passes, 1e-6);
    }
    // Level ways, and nearly level ones, have the density of their height; below the floor it is the floor's.
    const Haze layer = haze(0.1, 2.0);
    for (const double rise : {0.0, 1e-9, 1e-4, 2e-3, 2.1e-3})
        EXPECT_NEAR(optical_depth(layer, {0, 1, 0}, {10, 1 + rise, 0}), std::exp(-0.5 - rise / 4), 1e-7) << rise;
    EXPECT_NEAR(optical_depth(layer, {0, -3, 0}, {10, -3, 0}), 1.0, 1e-12);
    EXPECT_NEAR(optical_depth(layer, {0, -4, 0}, {0, 0, 0}), 0.4, 1e-12);
}

TEST(Haze, HenyeyAndGreenstein) {
    const double at[] = {1.50313, .0577989, .0223142, .0125226, .00826064};
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(henyey_greenstein(0.7, 1.0 - 0.5 * i) / at[i], 1.0, 1e-5);
    for (const double g : {-0.5, 0.0, 0.7, 0.95}) {
        double sum = 0.0, mean = 0.0;
        constexpr int kSteps = 200'000;
        for (int i = 0; i < kSteps; ++i) {
            const double cosine = -1.0 + (i + 0.5) * 2.0 / kSteps;
            const double share = henyey_greenstein(g, cosine) * 2.0 * std::numbers::pi * 2.0 / kSteps;
            sum += share, mean += share * cosine;
        }
        EXPECT_NEAR(sum, 1.0, 1e-5) << g;
        EXPECT_NEAR(mean, g, 1e-5) << g;
    }
}

Scene cornell() {
    return scene_of(make_cornell());
}
Result<Applied> set(Scene& scene, const std::function<void(v1::SetHaze&)>& fill) {
    v1::Command command;
    fill(*command.mutable_set_haze());
    return apply(scene, command, {});
}

TEST(Haze, IsSetToldAndKept) {
    Scene scene = cornell();
    ASSERT_TRUE(set(scene, [](auto& haze) { haze.set_preset("show"); }));
    EXPECT_EQ(scene.haze, (HazeValues{.extinction_per_m = 0.01}));
    const Revision first = scene.haze_rev;
    ASSERT_TRUE(set(scene, [](auto& haze) { haze.set_layer_height_m(2.5), haze.set_g(0.5); }));
    EXPECT_EQ(scene.haze, (HazeValues{0.01, 1.0, 0.5, 2.5}));
    EXPECT_GT(scene.haze_rev, first);
    const v1::State state = full_state(scene);
    EXPECT_EQ(state.haze().layer_height_m(), 2.5);
    EXPECT_EQ(state.haze().g(), 0.5);
    const Revision same = scene.scene_rev;
    ASSERT_TRUE(set(scene, [](auto& haze) { haze.set_g(0.5); }));
    EXPECT_EQ(scene.scene_rev, same);
    ASSERT_TRUE(set(scene, [](auto& haze) { haze.set_preset("off"); }));
    EXPECT_EQ(scene.haze, HazeValues());
}

TEST(Haze, WhatCannotBeIsRefused) {
    const struct {
        const char *field, *value;
        std::function<void(v1::SetHaze&)> fill;
    } rows[] = {
        {"set_haze.preset", "smoke", [](auto& haze) { haze.set_preset("smoke"); }},
        {"set_haze.extinction_per_m", "10.5", [](auto& haze) { haze.set_extinction_per_m(10.5); }},
        {"set_haze.extinction_per_m", "-0.1", [](auto& haze) { haze.set_extinction_per_m(-0.1); }},
        {"set_haze.albedo", "1.5", [](auto& haze) { haze.set_albedo(1.5); }},
        {"set_haze.g", "1", [](auto& haze) { haze.set_g(1.0); }},
        {"set_haze.layer_height_m", "0.001", [](auto& haze) { haze.set_layer_height_m(0.001); }},
        {"set_haze.layer_height_m", "nan", [](auto& haze) { haze.set_layer_height_m(std::nan("")); }},
    };
    Scene scene = cornell();
    for (const auto& row : rows) {
        const Revision before = scene.scene_rev;
        const auto refused = set(scene, row.fill);
        ASSERT_FALSE(refused) << row.field;
        EXPECT_EQ(refused.error().code, "invalid_argument");
        EXPECT_EQ(refused.error().where, row.field);
        EXPECT_EQ(refused.error().value, row.value);
        EXPECT_EQ(scene.scene_rev, before);
        EXPECT_EQ(scene.haze, HazeValues());
    }
}

}  // namespace
}  // namespace gonio
