// Bodies of luminaires: how they stand as their lights aim, and what a show's GDTF makes of them.
#include "server/scene/body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>

#include "ies/core/zip.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"
#include "server/assets/scale.h"
#include "server/exchange/import_mvr.h"
#include "server/exchange/import_parts.h"
#include "server/scene/apply.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/trace/bodies.h"
#include "server/trace/reference.h"
#include "tests/scenes/write_glb.h"
#include "tests/unit/angles.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio {
namespace {

using test::channel_text;
using test::mode_text;

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double most) {
    EXPECT_NEAR(glm::length(a - b), 0.0, most) << a.x << " " << a.y << " " << a.z;
}

glm::dvec3 point(const glm::dmat4& place, const glm::dvec3& at) {
    return glm::dvec3(place * glm::dvec4(at, 1.0));
}
glm::dvec3 direction(const glm::dmat4& place, const glm::dvec3& along) {
    return glm::dvec3(place * glm::dvec4(along, 0.0));
}

// A head as GDTF's axes have it: pan about Z through (0, 0, -0.1), tilt about X through (0, 0, -0.4), beam along -Z.
BodyMount head_mount(const glm::dmat4& world_from_fixture) {
    BodyMount mount;
    mount.world_from_fixture = world_from_fixture;
    mount.joints = {{{0, 0, -0.1}, {0, 0, 1}}, {{0, 0, -0.4}, {1, 0, 0}}};
    return mount;
}

// Whatever way the light aims, and however the fixture hangs: the front of the head looks there, the base stands still,
// the yoke turns about the pan axis alone, and the head about the yoke's tilt axis.
TEST(Body, TheHeadLooksWhereTheLightShines) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto any = [&] { return glm::dvec3(unit(random), unit(random), unit(random)); };
    const auto any_turn = [&] {
        return glm::normalize(glm::dquat(unit(random), unit(random), unit(random), unit(random)));
    };
    for (int i = 0; i < 2000; ++i) {
        const glm::dmat4 hang = glm::translate(glm::dmat4(1.0), 5.0 * any()) * glm::mat4_cast(any_turn());
        const BodyMount mount = head_mount(hang);
        LightSeed seed;
        seed.position = point(hang, {0, 0, -0.4});
        LightValues light;
        light.position = seed.position + (i % 3 == 0 ? any() : glm::dvec3(0.0));
        light.world_from_light = i % 2 == 0 ? orientation_aiming(any()) : any_turn();
        light.pan_rad = angles_of(light.world_from_light).pan_rad;
        const auto places = body_places(mount, seed, light);
        expect_near(direction(places[2], {0, 0, -1}), aim_of(light.world_from_light), 1e-6);
        const glm::dmat4 base = glm::translate(glm::dmat4(1.0), light.position - seed.position) * hang;
        for (const glm::dvec3& at : {glm::dvec3(0.0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)})
            expect_near(point(places[0], at), point(base, at), 1e-9);
        expect_near(direction(places[1], {0, 0, 1}), direction(base, {0, 0, 1}), 1e-9);
        expect_near(point(places[1], {0, 0, -0.1}), point(base, {0, 0, -0.1}), 1e-9);
        expect_near(direction(places[2], {1, 0, 0}), direction(places[1], {1, 0, 0}), 1e-9);
        expect_near(point(places[2], {0, 0, -0.4}), light.position, 1e-9);
    }
}

// Axes that are neither upright nor square to each other, and a beam that is off its tilt's plane, which reaches a part
// of all directions: those that it reaches.
TEST(Body, OddAxesAimToo) {
    BodyMount mount;
    mount.joints = {{{0.1, 0, 0}, glm::normalize(glm::dvec3(0.2, 0.1, 1))},
                    {{0, 0.3, -0.2}, glm::normalize(glm::dvec3(1, 0.3, 0.1))}};
    mount.aim = glm::normalize(glm::dvec3(0.2, 0.1, -1));
    for (const double first : {-2.0, 0.1, 1.3})
        for (const double last : {-1.1, 0.4, 2.0}) {
            const glm::dvec3 aim =
                glm::angleAxis(first, mount.joints[0].axis) * (glm::angleAxis(last, mount.joints[1].axis) * mount.aim);
            LightValues light;
            light.world_from_light = orientation_aiming(aim);
            light.pan_rad = angles_of(light.world_from_light).pan_rad;
            const auto places = body_places(mount, LightSeed(), light);
            expect_near(direction(places[2], mount.aim), aim, 1e-6);
        }
}

TEST(Body, WithoutAxesItTurnsWithItsLight) {
    BodyMount mount;
    mount.world_from_fixture = glm::translate(glm::dmat4(1.0), {1, 2, 3});
    LightSeed seed;
    seed.position = {1, 1.9, 3};
    seed.world_from_light = orientation_of({});
    LightValues light;
    light.position = {4, 1.9, 3};
    light.world_from_light = orientation_of({0.7, 0.5, 0.2});
    const auto places = body_places(mount, seed, light);
    const auto in_light = [](const glm::dquat& turn, const glm::dvec3& at) { return glm::inverse(turn) * at; };
    for (const glm::dvec3& at : {glm::dvec3(0.0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)})
        expect_near(in_light(light.world_from_light, point(places[0], at) - light.position),
                    in_light(seed.world_from_light, point(mount.world_from_fixture, at) - seed.position), 1e-9);
    EXPECT_EQ(places[0], places[2]);
}

// A base of 0.3 x 0.2 x 0.1 m, a yoke, a head of a cylinder, and a model that is not there.
std::string body_gdtf(const std::string& more_models = "", const std::string& geometries = "") {
    const std::string text = test::gdtf_text(
        {.geometries =
             !geometries.empty()
                 ? geometries
                 : "<Geometry Name='Base' Model='Foot'><Axis Name='Yoke' Model='Fork' "
                   "Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.3}{0,0,0,1}'><Axis Name='Body' Model='Barrel' "
                   "Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.2}{0,0,0,1}'><Beam Name='Lens' LuminousFlux='10000' "
                   "BeamAngle='25' FieldAngle='40' Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.2}{0,0,0,1}'/>"
                   "</Axis></Axis></Geometry>",
         .modes = mode_text("Base", channel_text("Yoke", "Pan", "1,2", "-270", "270") +
                                        channel_text("Body", "Tilt", "3,4", "-135", "135")),
         .models = "<Model Name='Foot' Length='0.3' Width='0.2' Height='0.1' PrimitiveType='Cube'/>"
                   "<Model Name='Fork' Length='0.4' Width='0.1' Height='0.4' PrimitiveType='Yoke'/>"
                   "<Model Name='Barrel' Length='0.2' Width='0.2' Height='0.4' PrimitiveType='Cylinder'/>" +
                   more_models});
    return *write_zip(std::vector<ZipFile>{{"description.xml", text}});
}

constexpr const char* kHanging = "{1,0,0}{0,1,0}{0,0,1}{1000,2000,5000}";

std::shared_ptr<SceneAsset> imported_type(const std::string& gdtf, const std::string& matrix = kHanging,
                                          const std::string& more = "", const std::string& beside = "") {
    const std::string fixture = "<Fixture name='Spot'><Matrix>" + matrix + "</Matrix><GDTFSpec>Maker@Head</GDTFSpec>" +
                                "<Addresses><Address break='0'>1</Address></Addresses>" + more + "</Fixture>";
    const auto bytes = write_zip(std::vector<ZipFile>{
        {"Maker@Head.gdtf", gdtf},
        {"GeneralSceneDescription.xml",
         "<GeneralSceneDescription verMajor='1' verMinor='6'><Scene><Layers><Layer name='L'><ChildList>" + beside +
             fixture + "</ChildList></Layer></Layers></Scene></GeneralSceneDescription>"}});
    auto scene = exchange::import_mvr(*bytes, "show.mvr", {}, std::size_t{1} << 30);
    EXPECT_TRUE(scene) << scene.error().text();
    return *scene;
}

// World box of the part that is named so many.
Bounds box_of(const SceneAsset& shown, std::size_t part, const glm::dmat4& place) {
    Bounds box;
    const Instance& instance = shown.instances.at(part);
    for (const Vertex& vertex : shown.meshes.at(static_cast<std::size_t>(instance.mesh)).vertices) {
        const glm::dvec3 at = point(place * instance.world_from_mesh, glm::dvec3(vertex.position));
        box.min = glm::min(box.min, at), box.max = glm::max(box.max, at);
    }
    return box;
}

bool says(const SceneAsset& scene, const std::string& words) {
    return std::ranges::any_of(scene.warnings,
                               [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

void set(Scene& scene, const std::function<void(v1::SetLight&)>& fill) {
    v1::Command command;
    command.mutable_set_light()->set_name("Spot");
    fill(*command.mutable_set_light());
    ASSERT_TRUE(apply(scene, command, {}));
}

TEST(BodyImport, PartsHaveTheirModelsSizeAndPlace) {
    const auto asset = imported_type(body_gdtf());
    ASSERT_TRUE(asset->bodies);
    const Bodies& bodies = *asset->bodies;
    ASSERT_EQ(bodies.parts.size(), 3u);
    ASSERT_EQ(bodies.mounts.size(), 1u);
    ASSERT_EQ(bodies.mounts[0].joints.size(), 2u);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(bodies.parts[i].joints, i);
    const BodyPlaces places = body_places(scene_of(asset));
    ASSERT_TRUE(places.at(0) && places.at(1) && places.at(2));
    // The fixture hangs at (1, 5, -2); lengths are along X, widths along -Z of the scene, heights along Y.
    const Bounds foot = box_of(bodies.shown, 0, *places[0]), fork = box_of(bodies.shown, 1, *places[1]),
                 barrel = box_of(bodies.shown, 2, *places[2]);
    expect_near(foot.min, {0.85, 4.95, -2.1}, 1e-6);
    expect_near(foot.max, {1.15, 5.05, -1.9}, 1e-6);
    expect_near(fork.max - fork.min, {0.4, 0.4, 0.1}, 1e-6);
    expect_near(0.5 * (barrel.min + barrel.max), {1, 4.5, -2}, 1e-6);
    expect_near(barrel.max - barrel.min, {0.2, 0.4, 0.2}, 1e-6);
    EXPECT_EQ(asset->instances.size(), 0u) << "bodies are no surfaces of the scene";
    EXPECT_FALSE(says(*asset, "bodies of fixtures are not drawn"));
}

// The guide's directions of a plain head, of GDTF's axes: Z up.
TEST(BodyImport, AHeadSwingsAsGdtfSays) {
    const auto asset = imported_type(body_gdtf());
    Scene scene = scene_of(asset);
    struct Row {
        double pan_deg, tilt_deg;
        glm::dvec3 beam;
    };
    for (const Row& row : {Row{0, 0, {0, 0, -1}}, Row{0, 90, {0, 1, 0}}, Row{90, 90, {-1, 0, 0}},
                           Row{0, 45, {0, std::sqrt(0.5), -std::sqrt(0.5)}}, Row{-90, 60, {std::sqrt(0.75), 0, -0.5}},
                           Row{30, -70, {}}, Row{200, 0, {}}, Row{-120, -10, {}}}) {
        SCOPED_TRACE(testing::Message() << row.pan_deg << " " << row.tilt_deg);
        // Hanging straight a console's pan and tilt are the light's.
        set(scene, [&](v1::SetLight& light) {
            light.set_pan_rad(row.pan_deg * kDegree);
            light.set_tilt_rad(row.tilt_deg * kDegree);
        });
        const auto places = body_places(scene);
        const auto to_gdtf = [](const glm::dvec3& v) { return glm::dvec3(v.x, -v.z, v.y); };
        const glm::dvec3 yoke(std::cos(row.pan_deg * kDegree), std::sin(row.pan_deg * kDegree), 0.0);
        if (row.beam != glm::dvec3(0.0)) expect_near(to_gdtf(direction(*places[2], {0, 0, -1})), row.beam, 1e-6);
        expect_near(to_gdtf(direction(*places[1], {1, 0, 0})), yoke, 1e-6);
        expect_near(to_gdtf(direction(*places[1], {0, 0, 1})), {0, 0, 1}, 1e-9);
        EXPECT_EQ(*places[0], *body_places(scene_of(asset))[0]) << "the base stands still";
        expect_near(direction(*places[2], {0, 0, -1}), aim_of(scene.lights[0].world_from_light), 1e-6);
    }
}

// However it is mounted: what a console says turns the yoke by so much, as well as the head.
TEST(BodyImport, MountedUprightAndTurnedTheYokeFollowsThePan) {
    for (const char* matrix : {"{0,1,0}{-1,0,0}{0,0,1}{0,0,5000}", "{1,0,0}{0,-1,0}{0,0,-1}{0,0,1000}",
                               "{0,-1,0}{-1,0,0}{0,0,-1}{0,0,1000}"}) {
        SCOPED_TRACE(matrix);
        const auto asset = imported_type(body_gdtf(), matrix);
        Scene scene = scene_of(asset);
        const auto at_home = body_places(scene);
        const v1::PatchRow *pan = nullptr, *tilt = nullptr;
        for (const v1::PatchRow& row : asset->patch->rows())
            (row.property() == "pan" ? pan : row.property() == "tilt" ? tilt : pan) = &row;
        ASSERT_TRUE(pan != nullptr && tilt != nullptr);
        for (const double pan_deg : {-200.0, 0.0, 35.0})
            for (const double tilt_deg : {-80.0, 25.0}) {
                const auto said = [](const v1::PatchRow& row, double share) {
                    return row.low() + share * (row.high() - row.low());
                };
                set(scene, [&](v1::SetLight& light) {
                    light.set_pan_rad(said(*pan, (pan_deg + 270.0) / 540.0));
                    light.set_tilt_rad(said(*tilt, (tilt_deg + 135.0) / 270.0));
                    light.set_roll_rad(0.0);
                });
                const auto places = body_places(scene);
                const glm::dmat4 fixture = *at_home[0];
                const glm::dmat4 yoke = fixture * glm::rotate(glm::dmat4(1.0), pan_deg * kDegree, glm::dvec3(0, 0, 1)),
                                 head = yoke * glm::rotate(glm::dmat4(1.0), tilt_deg * kDegree, glm::dvec3(1, 0, 0));
                for (const glm::dvec3& axis : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)}) {
                    expect_near(direction(*places[1], axis), direction(yoke, axis), 1e-6);
                    expect_near(direction(*places[2], axis), direction(head, axis), 1e-6);
                }
            }
    }
}

TEST(BodyImport, AFocusPointTurnsHeadsAndWholeBodies) {
    const std::string focus =
        "<FocusPoint name='F' uuid='f'><Matrix>{1,0,0}{0,1,0}{0,0,1}{4000,2000,500}</Matrix></FocusPoint>";
    const auto head = imported_type(body_gdtf(), kHanging, "<Focus>f</Focus>", focus);
    const auto places = body_places(scene_of(head));
    expect_near(direction(*places[2], {0, 0, -1}), aim_of(head->lights[0].world_from_light), 1e-6);
    expect_near(direction(*places[0], {0, 0, 1}), {0, 1, 0}, 1e-9);
    const auto par = imported_type(body_gdtf("", "<Geometry Name='Base' Model='Foot'><Beam Name='Lens'/></Geometry>"),
                                   kHanging, "<Focus>f</Focus>", focus);
    ASSERT_EQ(par->bodies->parts.size(), 1u);
    const glm::dmat4 place = *body_places(scene_of(par))[0];
    expect_near(direction(place, {0, 0, -1}), aim_of(par->lights[0].world_from_light), 1e-9);
    expect_near(point(place, {0, 0, 0}), par->lights[0].position, 1e-9);
}

// A .glb is Y up and in metres: what is high there is GDTF's Z. It emits nothing here, whatever its material says.
TEST(BodyImport, AGlbStandsUprightAndHasItsModelsSize) {
    SceneAsset tower;
    Mesh box;
    add_box(box, {-0.5, 0.0, -1.5}, {0.5, 2.0, 1.5});
    const int material = add_material(tower, "paint", glm::vec3(0.3f));
    tower.materials[0].emissive_nit = glm::vec3(100.0f);
    add_instance(tower, add_mesh(tower, std::move(box), material), "tower");
    measure(tower);
    const auto glb = test::write_glb(tower);
    ASSERT_TRUE(glb);
    const std::string text =
        test::gdtf_text({.geometries = "<Geometry Name='Base' Model='Tower'><Beam Name='Lens'/></Geometry>",
                         .modes = mode_text("Base", channel_text("Base", "Dimmer", "1")),
                         .models = "<Model Name='Tower' Length='2' Width='0.3' Height='0.4' File='tower'/>"});
    const auto asset =
        imported_type(*write_zip(std::vector<ZipFile>{{"description.xml", text}, {"models/gltf/tower.glb", *glb}}));
    ASSERT_TRUE(asset->bodies);
    const SceneAsset& shown = asset->bodies->shown;
    const Bounds box_m = box_of(shown, 0, glm::dmat4(1.0));
    expect_near(box_m.min, {-1, -0.15, 0}, 1e-6);
    expect_near(box_m.max, {1, 0.15, 0.4}, 1e-6);
    for (const Material& one : shown.materials) EXPECT_EQ(one.emissive_nit, glm::vec3(0.0f));
}

// Two heads that tilt on one foot, each with a light: each follows its own, the foot the first one's place alone.
TEST(BodyImport, PartsFollowTheLightBelowThem) {
    const auto head = [](const std::string& name, const std::string& x) {
        return "<Axis Name='" + name + "' Model='Barrel' Position='{1,0,0," + x +
               "}{0,1,0,0}{0,0,1,-0.2}{0,0,0,1}'><Beam Name='Lens" + name + "'/></Axis>";
    };
    const std::string text = test::gdtf_text(
        {.geometries = "<Geometry Name='Base' Model='Foot'>" + head("A", "-0.3") + head("B", "0.3") + "</Geometry>",
         .modes = mode_text("Base",
                            channel_text("A", "Tilt", "1", "-90", "90") + channel_text("B", "Tilt", "2", "-90", "90")),
         .models = "<Model Name='Foot' Length='0.8' Width='0.2' Height='0.1' PrimitiveType='Cube'/>"
                   "<Model Name='Barrel' Length='0.2' Width='0.2' Height='0.4' PrimitiveType='Cylinder'/>"});
    const auto asset = imported_type(*write_zip(std::vector<ZipFile>{{"description.xml", text}}));
    ASSERT_EQ(asset->lights.size(), 2u);
    ASSERT_TRUE(asset->bodies);
    ASSERT_EQ(asset->bodies->mounts.size(), 2u);
    Scene scene = scene_of(asset);
    const BodyPlaces before = body_places(scene);
    ASSERT_EQ(before.size(), 3u);
    v1::Command command;
    command.mutable_set_light()->set_name(scene.lights[1].name);
    command.mutable_set_light()->set_tilt_rad(0.5);
    ASSERT_TRUE(apply(scene, command, {}));
    const BodyPlaces after = body_places(scene);
    EXPECT_EQ(after[0], before[0]);
    EXPECT_EQ(after[1], before[1]);
    expect_near(direction(*after[2], {0, 0, -1}), {0, -std::cos(0.5), -std::sin(0.5)}, 1e-6);
    expect_near(point(*after[2], {0.3, 0, -0.2}), point(*before[2], {0.3, 0, -0.2}), 1e-9);
}

TEST(BodyImport, WhatIsMissingIsNamed) {
    const auto asset = imported_type(
        body_gdtf("<Model Name='Gone' Length='1' Width='1' Height='1' File='gone'/><Model Name='Tail' Length='1' "
                  "Width='1' Height='1' PrimitiveType='Pigtail'/>",
                  "<Geometry Name='Base' Model='Gone'><Geometry Name='Cable' Model='Tail'/><Geometry Name='Foot' "
                  "Model='Foot'/><Beam Name='Lens'/></Geometry>"));
    ASSERT_TRUE(asset->bodies);
    EXPECT_EQ(asset->bodies->parts.size(), 1u);
    EXPECT_TRUE(says(*asset, "left out: a model's file is not in the archive: \"Type: gone\""));
    EXPECT_TRUE(says(*asset, "left out: a model of a fixture is not drawn: \"Type: Gone\", \"Type: Tail\""));
}

TEST(BodyImport, AllPrimitivesHaveMeshes) {
    for (const char* name : {"Cube", "Cylinder", "Sphere", "Base", "Yoke", "Head", "Scanner", "Conventional", "Base1_1",
                             "Scanner1_1", "Conventional1_1"}) {
        const auto asset = imported_type(body_gdtf(
            std::string("<Model Name='One' Length='0.5' Width='0.3' Height='0.7' PrimitiveType='") + name + "'/>",
            "<Geometry Name='Base' Model='One'><Beam Name='Lens'/></Geometry>"));
        ASSERT_TRUE(asset->bodies) << name;
        ASSERT_EQ(asset->bodies->parts.size(), 1u) << name;
        const Bounds box = box_of(asset->bodies->shown, 0, glm::dmat4(1.0));
        expect_near(box.max - box.min, {0.5, 0.3, 0.7}, 1e-6);
    }
}

TEST(BodyImport, BodiesFollowTheirLightsLives) {
    Scene scene = scene_of(imported_type(body_gdtf()));
    v1::Command command;
    command.mutable_rename_light()->set_name("Spot");
    command.mutable_rename_light()->set_new_name("Other");
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_TRUE(body_places(scene).at(0));
    command.mutable_remove_light()->set_name("Other");
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_FALSE(body_places(scene).at(0));
}

TEST(BodyImport, AScaledSceneHasScaledBodies) {
    const auto asset = imported_type(body_gdtf());
    SceneAsset scaled = *asset;
    scale_scene(scaled, 2.5);
    const auto as_shared = std::make_shared<const SceneAsset>(scaled);
    Scene before = scene_of(asset), after = scene_of(as_shared);
    for (Scene* scene : {&before, &after}) set(*scene, [](v1::SetLight& light) { light.set_tilt_rad(0.8); });
    for (std::size_t part = 0; part < 3; ++part) {
        const Bounds a = box_of(asset->bodies->shown, part, *body_places(before)[part]),
                     b = box_of(scaled.bodies->shown, part, *body_places(after)[part]);
        expect_near(b.min, 2.5 * a.min, 1e-5);
        expect_near(b.max, 2.5 * a.max, 1e-5);
    }
}

// A floor under a head: rays of viewers meet the head, those of light pass it.
TEST(BodyImport, ViewersSeeThemAndLightDoesNot) {
    auto asset = imported_type(body_gdtf());
    Mesh floor;
    add_quad(floor, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4});
    add_instance(*asset, add_mesh(*asset, std::move(floor), add_material(*asset, "floor", glm::vec3(0.5f))), "floor");
    measure(*asset);
    auto bare = std::make_shared<SceneAsset>(*asset);
    bare->bodies = nullptr;
    const Scene with = scene_of(asset), without = scene_of(std::shared_ptr<const SceneAsset>(bare));
    const trace::MeterPoint below{{1, 0, -2}, {0, 1, 0}};
    const auto lit = trace::measure(*trace::make_world(with), {&below, 1}, {.bounces = 1, .max_passes = 1024}),
               truth = trace::measure(*trace::make_world(without), {&below, 1}, {.bounces = 1, .max_passes = 1024});
    EXPECT_EQ(lit[0].direct_lx, truth[0].direct_lx);
    EXPECT_EQ(lit[0].indirect_lx, truth[0].indirect_lx);
    EXPECT_GT(lit[0].direct_lx.g, 0.0);

    const auto geometry = trace::geometry_of(with);
    const glm::dvec3 eye(1, 4.5, 2);
    const glm::dvec3 along(0, 0, -1);  // to the barrel, 0.1 m before its middle
    for (const bool only : {false, true}) {
        const auto bodies = trace::body_geometry(body_places(with), *geometry,
                                                 only ? std::optional(trace::WorldRay{eye, along}) : std::nullopt);
        ASSERT_TRUE(bodies);
        trace::SeenHit hit;
        ASSERT_TRUE(trace::closest_seen(*geometry, bodies.get(), geometry->local(eye), glm::vec3(along), hit));
        EXPECT_EQ(hit.part, 2);
        EXPECT_NEAR(hit.distance, 3.9, 1e-3);
        EXPECT_GT(hit.normal.z, 0.99f);
        trace::SeenHit past;
        ASSERT_TRUE(trace::closest_seen(*geometry, bodies.get(), geometry->local({1, 4.5, 2}),
                                        glm::vec3(glm::normalize(glm::dvec3(0, -4.5, -1))), past));
        EXPECT_EQ(past.part, -1);
    }
}

}  // namespace
}  // namespace gonio
