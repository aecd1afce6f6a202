// Presets: what they keep, recall at once and over time, and what another hand takes out of a fade.
#include "server/scene/preset.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "tests/unit/second.h"

namespace gonio {
namespace {

class Presets : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        scene = scene_of(*asset);
        name = scene.lights[0].name;
    }
    Light& light() { return scene.lights[0]; }
    std::string run(const v1::Command& command) {
        const auto applied = apply(scene, command, {});
        return applied ? "ok" : applied.error().code;
    }
    std::string save(const std::string& preset) {
        v1::Command command;
        command.mutable_save_preset()->set_name(preset);
        return run(command);
    }
    std::string recall(const std::string& preset, double fade_s = 0) {
        v1::Command command;
        command.mutable_recall_preset()->set_name(preset);
        command.mutable_recall_preset()->set_fade_s(fade_s);
        return run(command);
    }
    std::string set_level(double level, double pan = 0) {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        command.mutable_set_light()->set_level_ratio(level);
        if (pan != 0) command.mutable_set_light()->set_pan_rad(pan);
        return run(command);
    }
    void step(Fade& fade, double at_s) {
        for (const v1::Command& command : fade.step(scene, static_cast<std::int64_t>(at_s * kSecond)))
            EXPECT_EQ(run(command), "ok");
    }
    Scene scene;
    std::string name;
};

// A button, OSC and the protocol turn a luminaire alike, and its lamp's output follows.
TEST_F(Presets, ARecallByAHandTiltsTheLamp) {
    auto profile = std::make_shared<Profile>(*light().profile);
    profile->photometry.tilt = ies::TiltTable{1, {0.0, 1.0}, {1.0, 0.5}};
    light().profile = profile;
    v1::Command turn;
    turn.mutable_set_light()->set_name(name);
    turn.mutable_set_light()->set_tilt_rad(0.0);
    ASSERT_EQ(run(turn), "ok");
    ASSERT_EQ(save("down"), "ok");
    turn.mutable_set_light()->set_tilt_rad(1.0);
    ASSERT_EQ(run(turn), "ok");
    EXPECT_NEAR(light().tilt_factor, 0.5, 1e-9);
    v1::Command recall_down;
    recall_down.mutable_recall_preset()->set_name("down");
    EXPECT_FALSE(apply_inputs(scene, {&recall_down, 1})[0].has_value());
    EXPECT_NEAR(light().tilt_factor, 1.0, 1e-9);
}

// Every number of the table of properties is kept, recalled at once and in time.
TEST_F(Presets, EveryNumberOfALightComesBack) {
    ASSERT_EQ(save("before"), "ok");
    const Light before = light();
    for (const double fade_s : {0.0, 2.0}) {
        for (const LightRow& light_row : light_rows()) {
            const PropertyRow& row = row_of(light_row.property);
            const double value = row.least + 0.3 * (row.most - row.least);
            v1::Command command;
            command.mutable_set_light()->set_name(name);
            write_numbers(*command.mutable_set_light(), row.field, std::vector<double>(count_of(light_row), value));
            ASSERT_EQ(run(command), "ok") << row.name;
            ASSERT_NE(numbers_of(light(), light_row), numbers_of(before, light_row)) << row.name;
        }
        if (fade_s == 0) {
            ASSERT_EQ(recall("before"), "ok");
        } else {
            Fade fade(scene, *scene.presets.at("before"), fade_s, 0);
            apply_inputs(scene, fade.step(scene, 2'000'000'000));
            EXPECT_FALSE(fade.running());
        }
        for (const LightRow& light_row : light_rows())
            EXPECT_EQ(numbers_of(light(), light_row), numbers_of(before, light_row))
                << row_of(light_row.property).name << fade_s;
    }
}

// The white of Rec.709 is D65, whose correlated colour temperature is 6,504 K (CIE 15).
TEST_F(Presets, AFadeBetweenAColourTemperatureAndNoneGoesByWayOfWhite) {
    const auto set = [&](double cct_k, const char* gel) {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        command.mutable_set_light()->set_cct_k(cct_k);
        command.mutable_set_light()->set_gel(gel);
        ASSERT_EQ(run(command), "ok");
    };
    set(2500, "L201");
    ASSERT_EQ(save("warm"), "ok");
    set(0, "");
    Fade to(scene, *scene.presets.at("warm"), 2, 0);
    for (const auto& refused : apply_inputs(scene, to.step(scene, 1'000'000'000))) EXPECT_FALSE(refused);
    EXPECT_DOUBLE_EQ(light().cct_k, (6504 + 2500) / 2.0);
    ASSERT_TRUE(to.running());
    apply_inputs(scene, to.step(scene, 2'000'000'000));
    EXPECT_EQ(light().cct_k, 2500);
    EXPECT_EQ(light().gel, nullptr) << "gels change with the recall, not with the fade";
    ASSERT_EQ(recall("warm"), "ok");
    EXPECT_EQ(light().gel->name, "L201 Full C.T. Blue");
}

TEST_F(Presets, ARecallBringsBackTheLookAndCostsOnlyWhatDiffers) {
    const Light before = light();
    ASSERT_EQ(save("look 1"), "ok");
    ASSERT_EQ(set_level(0.2), "ok");
    const Revision aim_rev = light().aim_rev, position_rev = light().position_rev;
    ASSERT_EQ(recall("look 1"), "ok");
    EXPECT_EQ(light().level_ratio, before.level_ratio);
    EXPECT_EQ(light().aim_rev, aim_rev) << "nothing was turned";
    EXPECT_EQ(light().position_rev, position_rev);
    EXPECT_EQ(light().level_rev, scene.scene_rev);
    ASSERT_EQ(set_level(0.2, 1.0), "ok");
    ASSERT_EQ(recall("look 1"), "ok");
    EXPECT_EQ(light().world_from_light, before.world_from_light) << "to the last bit";
}

TEST_F(Presets, AreToldAndStayWhateverIsLoaded) {
    save("b");
    save("a");
    const v1::State state = full_state(scene);
    ASSERT_EQ(state.presets().names_size(), 2);
    EXPECT_EQ(state.presets().names(0), "a");
    EXPECT_EQ(state.presets().recalled(), "a");
    EXPECT_EQ(recall("c"), "not_found");
    v1::Command command;
    command.mutable_remove_preset()->set_name("a");
    EXPECT_EQ(run(command), "ok");
    EXPECT_EQ(run(command), "not_found");
    EXPECT_EQ(full_state(scene).presets().recalled(), "");
    EXPECT_EQ(recall("b", -1), "invalid_argument");
    EXPECT_EQ(save(""), "invalid_argument");
    for (std::size_t i = scene.presets.size(); i < kMaxPresets; ++i) save("p" + std::to_string(i));
    EXPECT_EQ(save("one more"), "too_many_presets");
    EXPECT_EQ(save("b"), "ok") << "overwritten";
    command.mutable_load_scene()->set_file("cornell");
    Loaded loaded;
    loaded.asset = scene.asset;
    ASSERT_TRUE(apply(scene, command, loaded));
    EXPECT_EQ(scene.presets.size(), kMaxPresets) << "the same file once more";
    const auto first = scene.asset;
    auto other = std::make_shared<SceneAsset>(*first);
    for (LightSeed& seed : other->lights) seed.name = "another " + seed.name;
    loaded.asset = other;
    ASSERT_TRUE(apply(scene, command, loaded));
    EXPECT_EQ(scene.presets.size(), kMaxPresets)
        << "another file, of whose lights they know none: the first may come back";
    EXPECT_EQ(full_state(scene).presets().names_size(), 0) << "and none is listed until then";
    loaded.asset = first;
    ASSERT_TRUE(apply(scene, command, loaded));
    EXPECT_EQ(full_state(scene).presets().names_size(), static_cast<int>(kMaxPresets));
}

TEST_F(Presets, AFadeGoesInEqualStepsAndEndsExactly) {
    ASSERT_EQ(set_level(0.75), "ok");
    save("bright");
    ASSERT_EQ(set_level(0.25, 1.0), "ok");
    ASSERT_EQ(recall("bright", 2.0), "ok");
    EXPECT_DOUBLE_EQ(light().level_ratio, 0.25) << "nothing jumps";
    Fade fade(scene, *scene.presets["bright"], 2.0, 10 * kSecond);
    step(fade, 10.5);
    EXPECT_DOUBLE_EQ(light().level_ratio, 0.375);
    EXPECT_NEAR(light().pan_rad, 0.75, 1e-9);
    step(fade, 11);
    EXPECT_DOUBLE_EQ(light().level_ratio, 0.5);
    EXPECT_TRUE(fade.running());
    step(fade, 12.3);
    EXPECT_DOUBLE_EQ(light().level_ratio, 0.75);
    EXPECT_NEAR(light().pan_rad, 0.0, 1e-15);
    EXPECT_FALSE(fade.running());
}

TEST_F(Presets, WhatAnotherHandMovesLeavesTheFade) {
    save("bright");
    ASSERT_EQ(set_level(0.2, 1.0), "ok");
    Fade fade(scene, *scene.presets["bright"], 1.0, 0);
    step(fade, 0.5);
    ASSERT_EQ(set_level(0.05), "ok");
    step(fade, 0.75);
    EXPECT_DOUBLE_EQ(light().level_ratio, 0.05);
    EXPECT_NEAR(light().pan_rad, 0.25, 1e-9) << "the rest goes on";
    step(fade, 1);
    EXPECT_DOUBLE_EQ(light().level_ratio, 0.05);
    EXPECT_NEAR(light().pan_rad, 0.0, 1e-15);
}

TEST_F(Presets, LightsThatCameOrWentAreLeftAlone) {
    save("look");
    Light other = light();
    other.name = "other";
    other.level_ratio = 0.4;
    scene.lights.push_back(other);
    v1::Command remove;
    remove.mutable_remove_light()->set_name(name);
    ASSERT_EQ(run(remove), "ok");
    EXPECT_EQ(recall("look"), "ok");
    EXPECT_DOUBLE_EQ(scene.lights[0].level_ratio, 0.4);
    Fade fade(scene, *scene.presets["look"], 1, 0);
    EXPECT_FALSE(fade.running());
}

}  // namespace
}  // namespace gonio
