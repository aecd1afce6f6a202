// base_rev: whose change stands between a client and what it wants to set.
#include "server/session/changes.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/grid.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

constexpr std::uint32_t kAnn = 1, kBob = 2;

class ChangesTest : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        scene = scene_of(*asset, 10);
        changes = Changes(scene.scene_rev);
        name = scene.lights[0].name;
    }
    // Result: "ok" or the code of the refusal, as the stage does it.
    std::string run(const v1::Command& command, std::uint32_t by, const Loaded& loaded = {}) {
        refused = {};
        if (command.has_base_rev()) {
            if (const auto conflict = changes.conflict(scene, command, command.base_rev(), by)) {
                refused = *conflict;
                return conflict->code;
            }
        }
        const Revision before = scene.scene_rev;
        const auto applied = apply(scene, command, loaded);
        if (!applied) return applied.error().code;
        changes.note(scene, before, command, by);
        return "ok";
    }
    v1::Command level(double ratio) const {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        command.mutable_set_light()->set_level_ratio(ratio);
        return command;
    }
    v1::Command color(double red) const {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        for (const double c : {red, 1.0, 1.0}) command.mutable_set_light()->add_color_rgb(c);
        return command;
    }
    v1::Command pan(double rad) const {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        command.mutable_set_light()->set_pan_rad(rad);
        return command;
    }
    static v1::Command at(v1::Command command, Revision base_rev) {
        command.set_base_rev(base_rev);
        return command;
    }
    Scene scene;
    Changes changes{1};
    std::string name;
    Error refused;
};

TEST_F(ChangesTest, OnlyThePropertyThatSomebodyElseChangedConflicts) {
    const Revision before = scene.scene_rev;
    ASSERT_EQ(run(level(0.5), kAnn), "ok");
    const Revision changed = scene.scene_rev;
    EXPECT_EQ(run(at(level(0.2), before), kBob), "conflict");
    EXPECT_EQ(refused.where, "lights." + name + ".level_ratio");
    EXPECT_EQ(refused.value, std::to_string(changed));
    EXPECT_NE(refused.message.find("client 1"), std::string::npos);
    EXPECT_EQ(scene.lights[0].level_ratio, 0.5);
    EXPECT_EQ(run(at(color(0.5), before), kBob), "ok") << "level and colour are two properties";
    EXPECT_EQ(run(at(pan(1), before), kBob), "ok");
    EXPECT_EQ(run(at(level(0.2), changed), kBob), "ok") << "Bob knows Ann's change";
    EXPECT_EQ(run(at(level(0.3), before), kBob), "ok") << "the last change is Bob's own";
    EXPECT_EQ(run(level(0.9), kAnn), "ok") << "without base_rev the last writer wins";
}

TEST_F(ChangesTest, ACommandThatChangedNothingIsNoChange) {
    ASSERT_EQ(run(level(0.5), kAnn), "ok");
    const Revision known = scene.scene_rev;
    ASSERT_EQ(run(level(0.5), kAnn), "ok");
    ASSERT_EQ(run(color(0.25), kAnn), "ok");
    EXPECT_EQ(run(at(level(0.1), known), kBob), "ok");
}

TEST_F(ChangesTest, WhatWasBeforeTheStartOrALoadConflictsWithOlderKnowledge) {
    EXPECT_EQ(run(at(level(0.5), 9), kBob), "conflict") << "nobody knows what happened before revision 10";
    EXPECT_EQ(run(at(level(0.5), 10), kBob), "ok");
    EXPECT_EQ(run(at(level(0.5), scene.scene_rev + 1), kBob), "invalid_argument");
    const Revision before = scene.scene_rev;
    v1::Command load;
    load.mutable_load_scene()->set_file("cornell");
    Loaded loaded;
    loaded.asset = scene.asset;
    EXPECT_EQ(run(at(load, 10), kAnn, loaded), "conflict") << "it would undo Bob's level";
    ASSERT_EQ(run(at(load, before), kAnn, loaded), "ok");
    EXPECT_EQ(run(at(level(0.2), before), kBob), "conflict");
    EXPECT_EQ(run(at(level(0.2), before), kAnn), "ok") << "Ann loaded it herself";
}

TEST_F(ChangesTest, GroupsAndPresetsStandForTheirLights) {
    v1::Command group;
    group.mutable_set_group()->set_name("all");
    group.mutable_set_group()->add_lights(name);
    ASSERT_EQ(run(group, kAnn), "ok");
    v1::Command save;
    save.mutable_save_preset()->set_name("look");
    ASSERT_EQ(run(save, kAnn), "ok");
    const Revision before = scene.scene_rev;
    v1::Command both = level(0.4);
    both.mutable_set_light()->set_name("all");
    ASSERT_EQ(run(both, kAnn), "ok");
    EXPECT_EQ(run(at(level(0.1), before), kBob), "conflict");
    v1::Command recall;
    recall.mutable_recall_preset()->set_name("look");
    EXPECT_EQ(run(at(recall, before), kBob), "conflict");
    ASSERT_EQ(run(at(recall, scene.scene_rev), kBob), "ok");
    EXPECT_EQ(run(at(level(0.1), scene.scene_rev - 1), kAnn), "conflict") << "Bob's recall changed it";
    EXPECT_EQ(run(at(pan(0.1), before), kAnn), "ok") << "the recall did not turn it";
    const Revision known = scene.scene_rev;
    v1::Command fill, wider = group;
    fill.mutable_add_light()->mutable_light()->set_name("fill");
    Loaded loaded;
    loaded.profile = scene.lights[0].profile;
    ASSERT_EQ(run(fill, kAnn, loaded), "ok");
    wider.mutable_set_group()->add_lights("fill");
    ASSERT_EQ(run(wider, kAnn), "ok");
    EXPECT_EQ(run(at(both, known), kBob), "conflict") << "other lights than Bob means";
    EXPECT_EQ(refused.where, "groups.all");
    v1::Command another = group;
    another.mutable_set_group()->set_name("another");
    const Revision wide = scene.scene_rev;
    ASSERT_EQ(run(another, kAnn), "ok");
    EXPECT_EQ(run(at(both, wide), kBob), "ok") << "another group is another";
    ASSERT_EQ(run(both, kAnn), "ok");
    ASSERT_EQ(run(save, kAnn), "ok");
    EXPECT_EQ(run(at(recall, known), kBob), "conflict") << "another look than Bob means";
    EXPECT_EQ(refused.where, "presets.look");
}

// The table of properties, walked: what a command sets of a light is what it conflicts in.
TEST_F(ChangesTest, EveryPropertyOfALightIsNamed) {
    for (const LightRow& light_row : light_rows()) {
        const PropertyRow& row = row_of(light_row.property);
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        write_numbers(*command.mutable_set_light(), row.field, light_row, numbers_of(scene.lights[0], light_row));
        const auto touched = touched_properties(scene, command);
        ASSERT_EQ(touched.size(), 1u) << row.name;
        const bool turns = light_row.stale == &Light::aim_rev;
        EXPECT_EQ(touched[0].path, "lights." + name + "." + std::string(turns ? "aim" : row.state_field));
    }
}

TEST_F(ChangesTest, LightsThatComeAndGo) {
    const Revision before = scene.scene_rev;
    v1::Command add, remove;
    add.mutable_add_light()->mutable_light()->set_name("spot");
    Loaded loaded;
    loaded.profile = scene.lights[0].profile;
    ASSERT_EQ(run(add, kAnn, loaded), "ok");
    v1::Command set = level(0.5);
    set.mutable_set_light()->set_name("spot");
    EXPECT_EQ(run(at(set, before), kBob), "conflict");
    remove.mutable_remove_light()->set_name("spot");
    EXPECT_EQ(run(at(remove, before), kBob), "conflict");
    const Revision there = scene.scene_rev;
    ASSERT_EQ(run(set, kAnn), "ok");
    EXPECT_EQ(run(at(remove, there), kBob), "conflict") << "Ann has set it since";
    EXPECT_EQ(refused.where, "lights.spot.level_ratio");
    EXPECT_EQ(run(at(remove, scene.scene_rev), kBob), "ok");
    EXPECT_EQ(run(at(add, before), kAnn, loaded), "conflict") << "Bob removed it meanwhile";
}

// Each command sets something, and each property is told by the name that `gonio get` has for it.
TEST_F(ChangesTest, EveryCommandNamesItsProperties) {
    std::map<std::string, v1::Command> commands;
    commands["camera"].mutable_set_camera()->set_fov_rad(1);
    commands["exposure_ev100"].mutable_set_exposure()->set_ev100(3);
    commands["master_ratio"].mutable_set_master()->set_ratio(0.5);
    commands["view"].mutable_set_view()->set_gain(3);
    commands["technique"].mutable_set_technique()->set_samples(100);
    commands["size_px"].mutable_set_size()->set_width_px(640);
    commands["size_px"].mutable_set_size()->set_height_px(480);
    commands["patch"].mutable_set_patch();
    commands["surfaces"].mutable_set_surfaces();
    commands["presets.a"].mutable_save_preset()->set_name("a");
    commands["saved_views.a"].mutable_save_view()->set_name("a");
    v1::Grid& grid = *commands["grids.a"].mutable_set_grid()->mutable_grid();
    v1::Observer& observer = *commands["observers.a"].mutable_set_observer()->mutable_observer();
    grid.set_name("a");
    observer.set_name("a");
    for (int i = 0; i < 3; ++i) {
        grid.add_corner_m(0);
        grid.add_u_m(i == 0 ? 1 : 0);
        grid.add_v_m(i == 2 ? 1 : 0);
        observer.add_eye_m(0);
        observer.add_direction(i == 0 ? 1 : 0);
    }
    commands["groups.g"].mutable_set_group()->set_name("g");
    commands["groups.g"].mutable_set_group()->add_lights(name);
    commands["lights." + name + ".aim"] = pan(0.5);
    commands["lights." + name + ".position"].mutable_set_light()->set_name(name);
    for (int i = 0; i < 3; ++i) commands["lights." + name + ".position"].mutable_set_light()->add_position_m(i);
    for (const auto& [path, command] : commands) {
        const Revision before = scene.scene_rev;
        ASSERT_EQ(run(command, kAnn), "ok") << path;
        ASSERT_GT(scene.scene_rev, before) << path;
        EXPECT_EQ(run(at(command, before), kBob), "conflict") << path;
        EXPECT_EQ(refused.where, path);
        EXPECT_FALSE(changes.conflict(scene, command, before, kAnn)) << path;
    }
}

TEST_F(ChangesTest, TheTableIsBounded) {
    v1::Command command;
    for (std::size_t i = 0; i < 2 * kMaxChanges; ++i) {
        const Revision before = scene.scene_rev;
        command.mutable_remove_light()->set_name("light " + std::to_string(i));
        scene.lights_rev = ++scene.scene_rev;  // as if it had been there
        changes.note(scene, before, command, kAnn);
    }
    EXPECT_EQ(run(at(level(0.5), 10), kBob), "conflict") << "what was forgotten counts as changed";
    EXPECT_EQ(run(at(level(0.5), scene.scene_rev), kBob), "ok");
}

TEST_F(ChangesTest, ARenamedLightKeepsWhoChangedIt) {
    const Revision seen = scene.scene_rev;
    ASSERT_EQ(run(level(0.5), kAnn), "ok");
    v1::Command rename;
    rename.mutable_rename_light()->set_name(name);
    rename.mutable_rename_light()->set_new_name("main");
    ASSERT_EQ(run(rename, kBob), "ok");
    name = "main";
    v1::Command stale = level(0.25);
    stale.set_base_rev(seen);
    EXPECT_EQ(run(stale, kBob), "conflict");
    EXPECT_EQ(refused.where, "lights.main.level_ratio");
    rename.mutable_rename_light()->set_name("main");
    rename.mutable_rename_light()->set_new_name("other");
    rename.set_base_rev(seen);
    EXPECT_EQ(run(rename, kAnn), "conflict") << "bob has renamed it";
}

}  // namespace
}  // namespace gonio
