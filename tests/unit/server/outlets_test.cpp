// Luminaires whose light gets nowhere are said, and one command puts them into the ceiling. A room of 8 x 8 x 4 m.
#include "server/session/outlets.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <map>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/mounts.h"
#include "server/trace/outlet.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"
#include "tests/shared_data.h"

namespace gonio {
namespace {

using RoomPieces = std::vector<test::Piece>;
constexpr glm::vec3 kRoomGrey(0.5f);

// The sides that `sides` has of: x, X, y (bottom), Y (top), z, Z.
void add_sides(RoomPieces& pieces, const glm::dvec3& a, const glm::dvec3& b, const std::string& sides) {
    const std::map<char, std::array<glm::dvec3, 4>> corners = {
        {'x', {{{a.x, a.y, b.z}, {a.x, b.y, b.z}, {a.x, b.y, a.z}, {a.x, a.y, a.z}}}},
        {'X', {{{b.x, a.y, a.z}, {b.x, b.y, a.z}, {b.x, b.y, b.z}, {b.x, a.y, b.z}}}},
        {'y', {{{a.x, a.y, a.z}, {b.x, a.y, a.z}, {b.x, a.y, b.z}, {a.x, a.y, b.z}}}},
        {'Y', {{{a.x, b.y, b.z}, {b.x, b.y, b.z}, {b.x, b.y, a.z}, {a.x, b.y, a.z}}}},
        {'z', {{{a.x, a.y, a.z}, {a.x, b.y, a.z}, {b.x, b.y, a.z}, {b.x, a.y, a.z}}}},
        {'Z', {{{b.x, a.y, b.z}, {b.x, b.y, b.z}, {a.x, b.y, b.z}, {a.x, a.y, b.z}}}}};
    for (const char side : sides) {
        const auto& [p, q, r, s] = corners.at(side);
        pieces.push_back({test::quad(p, q, r, s), kRoomGrey});
    }
}
RoomPieces lamp_room() {
    RoomPieces pieces;
    add_sides(pieces, {-4, 0, -4}, {4, 4, 4}, "xXyYzZ");
    return pieces;
}
Scene with_lamp(RoomPieces pieces, const glm::dvec3& at, std::shared_ptr<const Profile> profile) {
    Scene scene = test::scene_with(std::move(pieces), std::move(profile), at);
    scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
    return scene;
}
std::shared_ptr<const Profile> plain_downlight() {
    return test::as_point(test::cosine_power(900.0, 1.0));
}
double floor_lx(const Scene& scene) {
    trace::Settings settings;
    settings.bounces = 0;
    const trace::MeterPoint middle;
    return trace::measure(*trace::make_world(scene), {&middle, 1}, settings).front().direct_lx.y;
}
std::string carried_out(Scene& scene, v1::Command command) {
    if (const auto refused = carry_out_mounts(scene, command, {})) return refused->code + " " + refused->where;
    EXPECT_FALSE(command.has_recess_light());
    const auto applied = apply(scene, command, {});
    return applied ? "ok" : applied.error().text();
}
std::string recessing(Scene& scene, const std::string& name = "light") {
    v1::Command command;
    command.mutable_recess_light()->set_name(name);
    return carried_out(scene, command);
}

TEST(Outlets, ALuminaireAboveTheCeilingIsSaidAndRecessed) {
    Scene scene = with_lamp(lamp_room(), {0, 4.02, 0}, plain_downlight());
    EXPECT_EQ(floor_lx(scene), 0.0);
    const auto warnings = outlet_warnings(scene);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("'light'"), std::string::npos) << warnings[0];
    EXPECT_NE(warnings[0].find("0.02 m"), std::string::npos) << warnings[0];
    ASSERT_EQ(recessing(scene), "ok");
    EXPECT_NEAR(scene.lights[0].position.y, 4.0 - 1e-3, 1e-5);
    EXPECT_TRUE(outlet_warnings(scene).empty());
    EXPECT_NEAR(floor_lx(scene), 56.25, 0.05) << "900 / 16, and 1 mm nearer";
    EXPECT_EQ(recessing(scene), "ok") << "before the surface behind it: it stays";
    EXPECT_NEAR(scene.lights[0].position.y, 4.0 - 1e-3, 1e-5);
}

// All sides shine at the ceiling's back, half of them into the sky.
TEST(Outlets, LightToAllSidesToo) {
    Scene scene = with_lamp(lamp_room(), {0, 4.02, 0}, test::as_point(test::isotropic(900.0)));
    EXPECT_EQ(outlet_warnings(scene).size(), 1u);
    EXPECT_EQ(recessing(scene), "ok");
    EXPECT_NEAR(floor_lx(scene), 56.25, 0.05);
}

TEST(Outlets, AClosedHousingIsSaidAndAnOpenOneIsNot) {
    const struct {
        const char* sides;
        std::size_t warnings;
    } rows[] = {{"xXyYzZ", 1}, {"xXYzZ", 0}, {"xYzZ", 0}};
    for (const auto& row : rows) {
        RoomPieces pieces = lamp_room();
        add_sides(pieces, {-0.1, 2.9, -0.1}, {0.1, 3.1, 0.1}, row.sides);
        Scene scene = with_lamp(std::move(pieces), {0, 3, 0}, test::as_point(test::isotropic(900.0)));
        EXPECT_EQ(outlet_warnings(scene).size(), row.warnings) << row.sides;
        if (row.warnings == 0) continue;
        EXPECT_EQ(recessing(scene), "ok");
        EXPECT_NEAR(scene.lights[0].position.y, 2.899, 1e-5);
        EXPECT_TRUE(outlet_warnings(scene).empty());
    }
    RoomPieces tube = lamp_room();  // 0.1 m wide and 0.25 m deep: 1 % of the light of a bare lamp gets out
    add_sides(tube, {-0.05, 3.75, -0.05}, {0.05, 4.0, 0.05}, "xXzZ");
    EXPECT_TRUE(
        outlet_warnings(with_lamp(std::move(tube), {0, 3.99, 0}, test::as_point(test::isotropic(900.0)))).empty());
}

TEST(Outlets, WhatShinesFreelyIsNotSaid) {
    EXPECT_TRUE(outlet_warnings(with_lamp(lamp_room(), {0, 4.0, 0}, plain_downlight())).empty()) << "in the plane";
    EXPECT_TRUE(outlet_warnings(with_lamp(lamp_room(), {0, 3.98, 0}, plain_downlight())).empty());
    EXPECT_TRUE(outlet_warnings(with_lamp(lamp_room(), {0, 0.25, 0}, plain_downlight())).empty()) << "near the floor";
    Scene upwards = test::floor_scene(20, 0.5f, plain_downlight(), {0, 3, 0}, orientation_aiming({0, 1, 0}));
    upwards.traced = std::make_shared<const trace::Geometry>(upwards.asset);
    EXPECT_TRUE(outlet_warnings(upwards).empty()) << "into the sky, as it is meant";
    EXPECT_EQ(recessing(upwards), "not_found recess_light.name") << "no surface within half a metre";
    EXPECT_EQ(recessing(upwards, "nobody"), "not_found recess_light.name");
}

// A housing that reaches through the ceiling: its bottom and the ceiling are passed together.
TEST(Outlets, TheLastSurfaceCounts) {
    RoomPieces pieces = lamp_room();
    add_sides(pieces, {-0.1, 3.99, -0.1}, {0.1, 4.2, 0.1}, "xXyYzZ");
    Scene scene = with_lamp(std::move(pieces), {0, 4.1, 0}, plain_downlight());
    EXPECT_EQ(outlet_warnings(scene).size(), 1u);
    EXPECT_EQ(recessing(scene), "ok");
    EXPECT_NEAR(scene.lights[0].position.y, 3.989, 1e-5);
}

// Of set_light, edit_lights and add_light alike: whatever else they say comes first.
TEST(Outlets, EveryCommandThatPlacesALightRecessesIt) {
    Scene scene = with_lamp(lamp_room(), {0, 2, 0}, plain_downlight());
    v1::Command set;
    set.mutable_set_light()->set_name("light");
    for (const double x : {1.0, 4.02, 1.0}) set.mutable_set_light()->add_position_m(x);
    set.mutable_set_light()->set_level_ratio(0.5);
    set.mutable_set_light()->set_mount("recessed");
    ASSERT_EQ(carried_out(scene, set), "ok");
    EXPECT_NEAR(glm::distance(scene.lights[0].position, glm::dvec3(1, 3.999, 1)), 0.0, 1e-5);
    EXPECT_EQ(scene.lights[0].level_ratio, 0.5);

    v1::Command add;
    add.mutable_add_light()->set_like("light");
    v1::SetLight& added = *add.mutable_add_light()->mutable_light();
    added.set_name("other");
    for (const double x : {-1.0, 4.1, 0.0}) added.add_position_m(x);
    added.set_mount("recessed");
    ASSERT_EQ(carried_out(scene, add), "ok");
    EXPECT_NEAR(glm::distance(scene.lights[1].position, glm::dvec3(-1, 3.999, 0)), 0.0, 1e-5);

    v1::Command edit;  // one moves by itself, and both are mounted
    v1::EditLights& edits = *edit.mutable_edit_lights();
    v1::SetLight& own = *edits.add_set();
    own.set_name("other");
    for (const double x : {2.0, 4.08, 0.0}) own.add_position_m(x);
    for (const char* name : {"light", "other"}) edits.add_names(name);
    edits.mutable_same()->set_level_ratio(0.25);
    edits.mutable_same()->set_mount("recessed");
    ASSERT_EQ(carried_out(scene, edit), "ok");
    EXPECT_NEAR(glm::distance(scene.lights[0].position, glm::dvec3(1, 3.999, 1)), 0.0, 1e-5);
    EXPECT_NEAR(glm::distance(scene.lights[1].position, glm::dvec3(2, 3.999, 0)), 0.0, 1e-5);
    EXPECT_EQ(scene.lights[0].level_ratio, 0.25);
    EXPECT_EQ(scene.lights[1].level_ratio, 0.25);
}

TEST(Outlets, AMountInACommandThatNamesALightTwice) {
    Scene scene = with_lamp(lamp_room(), {0, 4.02, 0}, plain_downlight());
    const auto with_position = [](v1::SetLight& set, double x) {
        set.set_name("light");
        for (const double value : {x, 4.05, 0.0}) set.add_position_m(value);
    };
    v1::Command removes;  // mounted and removed: there is nothing to mount
    v1::SetLight& gone = *removes.mutable_edit_lights()->add_set();
    gone.set_name("light");
    gone.set_mount("recessed");
    removes.mutable_edit_lights()->add_remove("light");
    Scene without = scene;
    EXPECT_EQ(carried_out(without, removes), "ok");
    EXPECT_TRUE(without.lights.empty());

    v1::Command twice;  // the last position counts, and is mounted
    with_position(*twice.mutable_edit_lights()->add_set(), 1.0);
    twice.mutable_edit_lights()->mutable_set(0)->set_mount("recessed");
    with_position(*twice.mutable_edit_lights()->add_set(), 2.0);
    ASSERT_EQ(carried_out(scene, twice), "ok");
    EXPECT_NEAR(glm::distance(scene.lights[0].position, glm::dvec3(2, 3.999, 0)), 0.0, 1e-5);

    v1::Command add;
    add.mutable_add_light()->set_like("light");
    add.mutable_add_light()->mutable_light()->set_name("other");
    ASSERT_EQ(carried_out(scene, add), "ok");
    v1::Command both;  // one position for a mounted light and another
    v1::EditLights& edit = *both.mutable_edit_lights();
    with_position(*edit.add_set(), 1.0);
    edit.mutable_set(0)->set_mount("recessed");
    for (const char* name : {"light", "other"}) edit.add_names(name);
    for (const double value : {0.0, 4.05, 0.0}) edit.mutable_same()->add_position_m(value);
    EXPECT_EQ(carried_out(scene, both), "conflict edit_lights.same.position_m");
}

TEST(Outlets, AGroupIsRecessedAsOneStep) {
    Scene scene = with_lamp(lamp_room(), {0, 4.02, 0}, plain_downlight());
    v1::Command add;
    add.mutable_add_light()->set_like("light");
    v1::SetLight& other = *add.mutable_add_light()->mutable_light();
    other.set_name("other");
    for (const double x : {-1.0, 4.05, 0.0}) other.add_position_m(x);
    ASSERT_EQ(carried_out(scene, add), "ok");
    v1::Command group;
    group.mutable_set_group()->set_name("row");
    for (const char* name : {"light", "other"}) group.mutable_set_group()->add_lights(name);
    ASSERT_EQ(carried_out(scene, group), "ok");
    v1::Command set;
    set.mutable_set_light()->set_name("row");
    set.mutable_set_light()->set_level_ratio(0.5);
    set.mutable_set_light()->set_mount("recessed");
    ASSERT_EQ(carried_out(scene, set), "ok");
    for (const Light& light : scene.lights) {
        EXPECT_NEAR(light.position.y, 3.999, 1e-5) << light.name;
        EXPECT_EQ(light.level_ratio, 0.5) << light.name;
    }
}

TEST(Outlets, AMountThatCannotBeChangesNothing) {
    Scene scene = with_lamp(lamp_room(), {0, 2, 0}, plain_downlight());
    v1::Command set;
    set.mutable_set_light()->set_name("light");
    set.mutable_set_light()->set_mount("glued");
    EXPECT_EQ(carried_out(scene, set), "invalid_argument set_light.mount");
    set.mutable_set_light()->set_mount("recessed");
    EXPECT_EQ(carried_out(scene, set), "not_found set_light.mount") << "2 m below the ceiling";
    set.mutable_set_light()->set_name("nobody");
    EXPECT_EQ(carried_out(scene, set), "not_found set_light.name");
    set.mutable_set_light()->set_name("light");
    const auto applied = apply(scene, set, {});
    ASSERT_FALSE(applied) << "without the session";
    EXPECT_EQ(applied.error().code, "unsupported");
    EXPECT_EQ(scene.lights[0].position, glm::dvec3(0, 2, 0));
}

// Once a light shines into nothing, dragging it on there says it no more; other changes say nothing of it.
TEST(Outlets, ChangesSayItOnce) {
    Scene scene = with_lamp(lamp_room(), {0, 3, 0}, plain_downlight());
    const auto moved = [&](double y) {
        const Scene before = scene;
        v1::Command command;
        command.mutable_set_light()->set_name("light");
        for (const double x : {0.0, y, 0.0}) command.mutable_set_light()->add_position_m(x);
        EXPECT_TRUE(apply(scene, command, {}));
        return outlet_warnings(scene, &before).size();
    };
    EXPECT_EQ(moved(3.5), 0u);
    EXPECT_EQ(moved(4.02), 1u);
    EXPECT_EQ(moved(4.03), 0u);
    EXPECT_EQ(moved(3.5), 0u);
}

// 900 cd at 4 m are 56.25 lx. Above the ceiling and in a closed housing nothing comes out until it is recessed.
TEST(Outlets, TheSharedCases) {
    const auto folder = test::shared_data("cases/55-recessed-luminaire");
    if (!folder) GTEST_SKIP() << "no shared cases on this machine";
    struct Case {
        const char* file;
        bool hidden;
        double lx;
    };
    for (const Case& one : {Case{"plane.gltf", false, 900.0 / 16.0},
                            {"below.gltf", false, 900.0 / (3.98 * 3.98)},
                            {"above.gltf", true, 0.0},
                            {"housing.gltf", true, 0.0}}) {
        const auto asset = load_scene(*folder / one.file);
        ASSERT_TRUE(asset) << asset.error().text();
        Scene scene = scene_of(*asset);
        scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
        const std::vector<std::string> said = outlet_warnings(scene);
        EXPECT_EQ(said.size(), one.hidden ? 1u : 0u) << one.file;
        EXPECT_NEAR(floor_lx(scene), one.lx, 0.01 * one.lx) << one.file;
        if (!one.hidden) continue;
        EXPECT_NE(said.front().find("'" + scene.lights[0].name + "' shines into nothing"), std::string::npos);
        ASSERT_EQ(recessing(scene, scene.lights[0].name), "ok") << one.file;
        EXPECT_EQ(outlet_warnings(scene), std::vector<std::string>{}) << one.file;
        EXPECT_GT(floor_lx(scene), 50.0) << one.file;
    }
}

}  // namespace
}  // namespace gonio
