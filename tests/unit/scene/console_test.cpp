// Values of consoles on a scene: lights, groups, patterns, components, and the patch as a part of the scene.
#include <gtest/gtest.h>

#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/console.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

PropertyValue value(std::string target, Property property, double x, double y = 0, double z = 0) {
    PropertyValue result;
    result.target = std::move(target);
    result.property = property;
    result.value = {x, y, z};
    return result;
}

class Console : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        scene = scene_of(*asset);
        for (const char* name : {"spot 1", "spot 2"}) {
            Light light = scene.lights[0];
            light.name = name;
            light.color = {0.1, 0.2, 0.3};
            scene.lights.push_back(light);
        }
        scene.groups["spots"] = {"spot 1", "spot 2"};
        first = scene.lights[0].name;
    }
    std::vector<std::string> named(const std::vector<v1::Command>& commands) {
        std::vector<std::string> result;
        for (const v1::Command& command : commands) result.push_back(command.set_light().name());
        return result;
    }
    Scene scene;
    std::string first;
};

TEST_F(Console, ValuesOfOneLightBecomeOneCommand) {
    const PropertyValue values[] = {value(first, Property::level, 0.25), value(first, Property::pan, 1.0),
                                    value(first, Property::level, 0.5)};
    const auto commands = commands_of(scene, values);
    ASSERT_EQ(commands.size(), 1u);
    EXPECT_DOUBLE_EQ(commands[0].set_light().level_ratio(), 0.5) << "the later one";
    EXPECT_DOUBLE_EQ(commands[0].set_light().pan_rad(), 1.0);
    EXPECT_FALSE(commands[0].set_light().has_tilt_rad());
}

TEST_F(Console, AGelGoesWithTheOtherValuesOfItsLight) {
    PropertyValue gel = value("spots", Property::gel, 0);
    gel.name = "L204";
    const PropertyValue values[] = {value("spots", Property::cct, 3200), gel};
    const auto commands = commands_of(scene, values);
    EXPECT_EQ(named(commands), (std::vector<std::string>{"spot 1", "spot 2"}));
    for (const auto& refused : apply_inputs(scene, commands)) EXPECT_FALSE(refused);
    EXPECT_EQ(scene.lights[2].gel->name, "L204 Full C.T. Orange");
    EXPECT_EQ(scene.lights[2].cct_k, 3200);
    gel.name = "no such";
    const PropertyValue bad[] = {value(first, Property::level, 0.5), gel};
    const auto refused = apply_inputs(scene, commands_of(scene, bad));
    EXPECT_EQ(refused.back()->code, "not_found");
    EXPECT_EQ(scene.lights[0].level_ratio, 0.5) << "a bad one takes no other with it";
}

TEST_F(Console, AComponentLeavesTheOthersAsTheyAre) {
    const PropertyValue values[] = {value("spot 1", Property::green, 0.9), value("spot 1", Property::blue, 0.8)};
    const auto commands = commands_of(scene, values);
    ASSERT_EQ(commands.size(), 1u);
    const auto& rgb = commands[0].set_light().color_rgb();
    EXPECT_EQ(std::vector<double>(rgb.begin(), rgb.end()), (std::vector{0.1, 0.9, 0.8}));
    const PropertyValue up[] = {value("spots", Property::y, 7.0)};
    for (const v1::Command& command : commands_of(scene, up)) {
        EXPECT_DOUBLE_EQ(command.set_light().position_m(1), 7.0);
        EXPECT_DOUBLE_EQ(command.set_light().position_m(0), scene.lights[0].position.x);
    }
}

TEST_F(Console, GroupsAndPatternsReachEveryLight) {
    const PropertyValue group[] = {value("spots", Property::level, 0.5)};
    EXPECT_EQ(named(commands_of(scene, group)), (std::vector<std::string>{"spot 1", "spot 2"}));
    PropertyValue pattern = value("spot%20[2-9]", Property::level, 0.5);
    pattern.pattern = true;
    EXPECT_EQ(named(commands_of(scene, {&pattern, 1})), (std::vector<std::string>{"spot 2"}));
    pattern.target = "*";
    EXPECT_EQ(commands_of(scene, {&pattern, 1}).size(), 3u) << "each light once, though a group matches too";
    pattern.kind = PropertyValue::Kind::group;
    EXPECT_EQ(commands_of(scene, {&pattern, 1}).size(), 2u);
}

TEST_F(Console, AimAndPanExcludeEachOther) {
    const PropertyValue values[] = {value(first, Property::pan, 1.0), value(first, Property::aim, 0, -1, 0.5)};
    auto commands = commands_of(scene, values);
    EXPECT_TRUE(apply(scene, commands.at(0), {}));
    const PropertyValue other[] = {values[1], values[0]};
    commands = commands_of(scene, other);
    EXPECT_TRUE(apply(scene, commands.at(0), {}));
    EXPECT_EQ(commands[0].set_light().aim_size(), 0);
}

TEST_F(Console, TheCameraGoesRoundItsTarget) {
    scene.camera.target = {0, 1, 0};
    scene.camera.eye = {0, 1, 5};
    const auto drive = [&](std::vector<PropertyValue> values) {
        for (const v1::Command& command : commands_of(scene, values)) ASSERT_TRUE(apply(scene, command, {}));
    };
    drive({value("", Property::orbit, std::numbers::pi / 2)});
    EXPECT_NEAR(scene.camera.eye.x, 5, 1e-12) << "from +Z towards +X";
    EXPECT_NEAR(scene.camera.eye.z, 0, 1e-12);
    drive({value("", Property::elevation, std::numbers::pi / 6), value("", Property::distance, 2)});
    EXPECT_NEAR(scene.camera.eye.y, 2, 1e-12) << "both in one command";
    EXPECT_NEAR(*values_now(scene)("", Property::distance), 2, 1e-12);
    EXPECT_NEAR(*values_now(scene)("", Property::orbit), std::numbers::pi / 2, 1e-12);
    EXPECT_NEAR(*values_now(scene)("", Property::elevation), std::numbers::pi / 6, 1e-12);
}

TEST_F(Console, ValuesAreReadBackAsTheyWereSet) {
    for (const PropertyRow& row : property_table()) {
        if (row.values != 1 || row.by_name) continue;
        const double quarter = row.least + 0.25 * (row.most - row.least);
        const double middle = row.of_camera ? 0.5 : row.whole ? std::round(quarter) : quarter;
        const PropertyValue one = value(row.of_scene ? "" : "spot 1", row.property, middle);
        for (const v1::Command& command : commands_of(scene, {&one, 1}))
            ASSERT_TRUE(apply(scene, command, {})) << row.name;
        const auto now = values_now(scene)(row.of_scene ? "" : "spot 1", row.property);
        ASSERT_TRUE(now) << row.name;
        EXPECT_NEAR(*now, middle, 1e-9) << row.name;
    }
    EXPECT_EQ(values_now(scene)("spots", Property::level), values_now(scene)("spot 1", Property::level))
        << "a group: its first";
    EXPECT_FALSE(values_now(scene)("nobody", Property::level));
}

TEST_F(Console, TheSceneKeepsEveryFieldOfTheTable) {
    for (const PropertyRow& row : property_table()) {
        if (row.field.empty() || row.property == Property::aim) continue;  // an aim is kept as pan, tilt and roll
        const LightRow* light_row = light_row_of(row.property);
        ASSERT_NE(light_row, nullptr) << row.name;
        EXPECT_EQ(count_of(*light_row), row.component >= 0 ? 3u : row.values) << row.name;
    }
    for (std::size_t i = 0; i < property_table().size(); ++i)
        EXPECT_EQ(static_cast<std::size_t>(property_table()[i].property), i) << "rows stand in the order of the enum";
}

TEST_F(Console, TheLimitsOfTheTableAreThoseOfTheScene) {
    for (const PropertyRow& row : property_table()) {
        if (row.by_name || row.of_camera || row.property == Property::aim) continue;  // no number; any length
        const auto takes = [&](double x) {
            const PropertyValue one = value(row.of_scene ? "" : first, row.property, x, row.least, row.least);
            Scene copy = scene;
            return apply(copy, commands_of(scene, {&one, 1}).at(0), {}).ok();
        };
        const double beyond = 1e-3 * (row.most - row.least);
        EXPECT_TRUE(takes(row.least) && takes(row.most)) << row.name;
        EXPECT_FALSE(takes(row.least - beyond) || takes(row.most + beyond)) << row.name;
    }
}

TEST_F(Console, ARefusedPropertyTakesNoOtherWithIt) {
    const PropertyValue values[] = {value(first, Property::level, 0.25), value(first, Property::aim, 0, 0, 0),
                                    value("spot 1", Property::level, 0.5), value("", Property::master, 2.0),
                                    value("", Property::exposure, 3.0)};
    const Scene before = scene;
    const auto refused = apply_inputs(scene, commands_of(scene, values));
    ASSERT_EQ(refused.size(), 4u) << "two lights, master, exposure";
    ASSERT_TRUE(refused[0]);
    EXPECT_EQ(refused[0]->where, "set_light.aim");
    EXPECT_FALSE(refused[1]);
    ASSERT_TRUE(refused[2]);
    EXPECT_EQ(refused[2]->where, "set_master.ratio");
    EXPECT_FALSE(refused[3]);
    EXPECT_DOUBLE_EQ(scene.lights[0].level_ratio, 0.25) << "the aim was refused, not the level";
    EXPECT_EQ(scene.lights[0].aim_rev, before.lights[0].aim_rev);
    EXPECT_DOUBLE_EQ(scene.lights[1].level_ratio, 0.5);
    EXPECT_DOUBLE_EQ(scene.exposure_ev100, 3.0);
    EXPECT_DOUBLE_EQ(scene.master_ratio, before.master_ratio);
    EXPECT_EQ(scene.scene_rev, before.scene_rev + 1) << "all of a frame is one revision";
    EXPECT_EQ(scene.lights[0].level_rev, scene.scene_rev);
    // The same again changes nothing, and is refused again.
    const auto again = apply_inputs(scene, commands_of(scene, values));
    EXPECT_TRUE(again[0] && again[2]);
    EXPECT_EQ(scene.scene_rev, before.scene_rev + 1);
}

TEST_F(Console, InputsMayNotDoWhatNeedsMore) {
    v1::Command remove;
    remove.mutable_remove_light()->set_name(first);
    EXPECT_EQ(apply_inputs(scene, {&remove, 1}).at(0)->code, "unsupported");
    v1::Command nobody;
    nobody.mutable_set_light()->set_name("nobody");
    EXPECT_EQ(apply_inputs(scene, {&nobody, 1}).at(0)->code, "not_found");
}

TEST_F(Console, TargetsAreKnownByTheirLights) {
    const auto before = targets_of(scene);
    EXPECT_EQ(before.at("spots").size(), 2u);
    scene.lights[1].id = 99;  // removed, and another one of that name added
    const auto after = targets_of(scene);
    EXPECT_NE(before.at("spot 1"), after.at("spot 1"));
    EXPECT_NE(before.at("spots"), after.at("spots"));
    EXPECT_EQ(before.at(first), after.at(first));
}

TEST_F(Console, WhatNamesNothingIsLeftOut) {
    const PropertyValue values[] = {value(first, Property::level, 1), value("nobody", Property::level, 1),
                                    value("", Property::master, 0.5), value("", Property::exposure, 9)};
    const auto commands = commands_of(scene, values);
    ASSERT_EQ(commands.size(), 3u);
    EXPECT_EQ(commands[0].set_light().name(), first);
    EXPECT_DOUBLE_EQ(commands[1].set_master().ratio(), 0.5);
    EXPECT_DOUBLE_EQ(commands[2].set_exposure().ev100(), 9.0);
}

TEST_F(Console, ThePatchIsAPartOfTheScene) {
    EXPECT_EQ(patch_in_force(scene).rows_size(), 6) << "three lights in two protocols";
    v1::Command command;
    v1::PatchRow& row = *command.mutable_set_patch()->add_rows();
    row.set_protocol("sacn");
    row.set_universe(3);
    row.set_address(1);
    row.set_target("later");
    row.set_property("level");
    const Revision before = scene.scene_rev;
    const auto applied = apply(scene, command, {});
    ASSERT_TRUE(applied);
    EXPECT_EQ(applied->warnings.size(), 1u) << "no light is named later";
    EXPECT_EQ(scene.scene_rev, before + 1);
    EXPECT_EQ(scene.patch_rev, before + 1);
    v1::Patch patch = patch_in_force(scene);
    EXPECT_FALSE(patch.is_default());
    ASSERT_EQ(patch.warnings_size(), 1);
    EXPECT_NE(patch.warnings(0).find("sacn 3/1"), std::string::npos);
    // It survives the change of the scene.
    auto asset = load_scene("cornell");
    v1::Command load;
    load.mutable_load_scene()->set_file("cornell");
    Loaded loaded;
    loaded.asset = *asset;
    ASSERT_TRUE(apply(scene, load, loaded));
    EXPECT_EQ(patch_in_force(scene).rows_size(), 1);
    // A bad one changes nothing.
    row.set_address(600);
    const auto refused = apply(scene, command, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().where, "set_patch.rows[0].address");
    v1::Command none;
    none.mutable_set_patch();
    ASSERT_TRUE(apply(scene, none, {}));
    EXPECT_EQ(patch_in_force(scene).rows_size(), 0);
    none.mutable_set_patch()->set_use_default(true);
    ASSERT_TRUE(apply(scene, none, {}));
    EXPECT_TRUE(patch_in_force(scene).is_default());
}

}  // namespace
}  // namespace gonio
