// What a command's names stand for where no light and no group has them.
#include "server/scene/named_lights.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/scene/apply.h"
#include "server/scene/imported.h"
#include "server/scene/scene.h"
#include "tests/scenes/scenes.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio::test {
namespace {

using Names = std::vector<std::string>;

Scene rig() {
    Scene scene = floor_scene(4.0, 0.5f, isotropic(100.0), {0, 2, 0});
    const std::array<const char*, 4> names = {"Spot 1", "Spot 12", "Wash", "Büh ne*"};
    repeat_light(scene, names.size(), [&](Light& light, std::size_t i) { light.name = names[i]; });
    scene.groups["front"] = {"Wash"};
    return scene;
}

Names in(const auto& repeated) {
    return {repeated.begin(), repeated.end()};
}

TEST(NamedLights, PatternsMatchWholeNames) {
    for (const char* pattern : {"*", "Spot*", "*1", "S*t ?", "Spot 1", "?pot*1", "**Spot**1**"})
        EXPECT_TRUE(matches_pattern("Spot 1", pattern)) << pattern;
    for (const char* pattern : {"", "Spot", "spot*", "*2", "Spot ??", "?Spot 1", "Spot 1?"})
        EXPECT_FALSE(matches_pattern("Spot 1", pattern)) << pattern;
    EXPECT_TRUE(matches_pattern("Bühne", "B?hne")) << "one character, two bytes";
    EXPECT_TRUE(matches_pattern("", "*"));
    // A pattern that a matcher with recursion takes ages for.
    EXPECT_FALSE(matches_pattern(std::string(128, 'a'), "*a*a*a*a*a*a*a*a*a*a*a*a*b"));
}

TEST(NamedLights, CommandsNameSeveral) {
    const Scene scene = rig();
    v1::Command set;
    set.mutable_set_light()->set_name("Spot*");
    set.mutable_set_light()->set_level_ratio(0.25);
    ASSERT_FALSE(spell_out_lights(scene, set));
    EXPECT_EQ(in(set.edit_lights().names()), (Names{"Spot 1", "Spot 12"}));
    EXPECT_EQ(set.edit_lights().same().level_ratio(), 0.25);
    EXPECT_TRUE(set.edit_lights().same().name().empty());
    Scene changed = scene;
    ASSERT_TRUE(apply(changed, set, {}));
    EXPECT_EQ(changed.lights[0].level_ratio, 0.25);
    EXPECT_EQ(changed.lights[2].level_ratio, scene.lights[2].level_ratio);

    v1::Command all;
    all.mutable_set_light()->set_name("all");
    ASSERT_FALSE(spell_out_lights(scene, all));
    EXPECT_EQ(all.edit_lights().names_size(), 4);

    v1::Command remove;
    remove.mutable_remove_light()->set_name("Spot 1?");
    ASSERT_FALSE(spell_out_lights(scene, remove));
    EXPECT_EQ(in(remove.edit_lights().remove()), Names{"Spot 12"});

    v1::Command group;
    group.mutable_set_group()->set_name("side");
    for (const char* name : {"Spot*", "Wash", "Spot 1"}) group.mutable_set_group()->add_lights(name);
    ASSERT_FALSE(spell_out_lights(scene, group));
    EXPECT_EQ(in(group.set_group().lights()), (Names{"Spot 1", "Spot 12", "Wash"})) << "each once";

    v1::Command recess;
    recess.mutable_recess_light()->set_name("Sp*");
    ASSERT_FALSE(spell_out_lights(scene, recess));
    EXPECT_EQ(recess.edit_lights().same().mount(), "recessed");
    EXPECT_EQ(recess.edit_lights().names_size(), 2);
}

TEST(NamedLights, NamesThatAreTakenStandForThemselves) {
    Scene scene = rig();
    scene.groups["all"] = {"Wash"};
    for (const char* name : {"Büh ne*", "front", "all", "Spot 1"}) {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        ASSERT_FALSE(spell_out_lights(scene, command)) << name;
        EXPECT_EQ(command.set_light().name(), name);
    }
}

TEST(NamedLights, WhatNothingHasIsToldWithTheNearestName) {
    const Scene scene = rig();
    const auto refused = [&](const char* name) {
        v1::Command command;
        command.mutable_set_light()->set_name(name);
        const auto error = spell_out_lights(scene, command);
        return error ? error->code + " " + error->where + ": " + error->message : std::string("taken");
    };
    EXPECT_EQ(refused("spot 12"),
              "not_found set_light.name: there is no light or group of this name. Did you mean Spot 12?");
    EXPECT_EQ(refused("frnt"),
              "not_found set_light.name: there is no light or group of this name. Did you mean front?");
    EXPECT_EQ(refused("Moon"), "not_found set_light.name: there is no light or group of this name");
    EXPECT_EQ(refused("Moon*"), "not_found set_light.name: there is no light or group of this name");
}

TEST(NamedLights, AFixtureHasANumber) {
    const auto asset = imported(show_mvr(fixture("Spot", kHanging, "<FixtureID>101</FixtureID>") +
                                             fixture("Wash", kHanging, "<FixtureIDNumeric>7</FixtureIDNumeric>"),
                                         {{"Maker@Head.gdtf", head_gdtf()}}));
    Scene scene = scene_of(asset);
    ASSERT_EQ(scene.lights.size(), 2u);
    EXPECT_EQ(lights_called(scene, "101"), Names{scene.lights[0].name});
    EXPECT_EQ(lights_called(scene, "7"), Names{scene.lights[1].name});
    EXPECT_EQ(lights_called(scene, ""), Names{});
    EXPECT_EQ(fixture_of(scene, scene.lights[1]), "7");
}

}  // namespace
}  // namespace gonio::test
