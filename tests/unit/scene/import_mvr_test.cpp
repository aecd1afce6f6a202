// MVR shows as scenes: where objects and lights stand, what lights them, what drives them.
#include "server/exchange/import_mvr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "ies/core/printed.h"
#include "ies/synthetic.h"
#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/assets/assets.h"
#include "server/exchange/import_parts.h"
#include "server/scene/apply.h"
#include "server/scene/console.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "tests/shared_data.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

using namespace test;

TEST(ImportMvr, AFixtureIsALightWithItsBeamsWeb) {
    const auto scene = imported(show_mvr(fixture("Spot", kHanging), {{"Maker@Head.gdtf", head_gdtf()}}));
    ASSERT_EQ(scene->lights.size(), 1u);
    const LightSeed& light = scene->lights[0];
    EXPECT_EQ(light.name, "Spot");
    EXPECT_NEAR(light.profile->peak_cd / 54579, 1.0, 1e-3);
    EXPECT_NEAR(light.profile->flux_lm / 10000, 1.0, 1e-3);
    expect_near(light.position, {1, 4.5, -2}, 1e-9);  // the lens is 0.5 m below the base
    expect_near(aim_of(light.world_from_light), {0, -1, 0}, 1e-9);
    expect_near(c0_of(light.world_from_light), {1, 0, 0}, 1e-9);
    EXPECT_FALSE(scene->patch);
    EXPECT_EQ(std::ranges::count(scene->notes, "taken: fixture: \"Spot\""), 1);
    EXPECT_FALSE(says(*scene, "taken")) << "what was understood is no warning";
    EXPECT_TRUE(says(*scene, "left out: a fixture is not patched: \"Spot\""));
    EXPECT_FALSE(scene->bodies) << "it has no models";
}

TEST(ImportMvr, FocusPointsAimAndNumbersName) {
    const std::string focus =
        "<FocusPoint name='F' uuid='f'><Matrix>{1,0,0}{0,1,0}{0,0,1}{4000,2000,500}</Matrix></FocusPoint>";
    const auto scene =
        imported(show_mvr(focus + fixture("Spot", kHanging, "<Focus>f</Focus><FixtureID>101</FixtureID>") +
                              fixture("Spot", kHanging) + fixture("Spot", kHanging),
                          {{"Maker@Head.gdtf", head_gdtf()}}));
    ASSERT_EQ(scene->lights.size(), 3u);
    EXPECT_EQ(scene->lights[0].name, "Spot 101");
    EXPECT_EQ(scene->lights[1].name, "Spot");
    EXPECT_EQ(scene->lights[2].name, "Spot 2");
    expect_near(aim_of(scene->lights[0].world_from_light), glm::normalize(glm::dvec3(3, -4, 0)), 1e-9);
    expect_near(aim_of(scene->lights[1].world_from_light), {0, -1, 0}, 1e-9);
    EXPECT_EQ(scene->lights[0].profile, scene->lights[1].profile) << "one web for all of a type";
}

TEST(ImportMvr, ThePatchDrivesLevelPanAndTilt) {
    const std::string patch = "<Addresses><Address break='0'>2.101</Address></Addresses>";
    const auto scene = imported(show_mvr(fixture("Spot", kHanging, patch), {{"Maker@Head.gdtf", head_gdtf()}}));
    const v1::PatchRow* level = row_of(*scene, "Spot", "level");
    ASSERT_NE(level, nullptr);
    EXPECT_EQ(level->protocol(), "sacn");
    EXPECT_EQ(level->universe(), 2u);
    EXPECT_EQ(level->address(), 105u);
    EXPECT_EQ(level->bits(), 8u);
    EXPECT_EQ(level->high(), 1.0);
    const v1::PatchRow *pan = row_of(*scene, "Spot", "pan"), *tilt = row_of(*scene, "Spot", "tilt");
    ASSERT_TRUE(pan != nullptr && tilt != nullptr);
    EXPECT_EQ(pan->address(), 101u);
    EXPECT_EQ(pan->bits(), 16u);
    EXPECT_NEAR(pan->low(), -270 * kDegree, 1e-9);
    EXPECT_NEAR(pan->high(), 270 * kDegree, 1e-9);
    EXPECT_NEAR(tilt->low(), -135 * kDegree, 1e-9);
    expect_near(scene->lights[0].position, {1, 4.7, -2}, 1e-9);  // where its axes meet
    const v1::PatchRow* zoom = row_of(*scene, "Spot", "zoom");
    ASSERT_NE(zoom, nullptr);
    EXPECT_EQ(zoom->address(), 106u);
    EXPECT_NEAR(zoom->low(), 25 * kDegree, 1e-9);
    EXPECT_NEAR(zoom->high(), 50 * kDegree, 1e-9);
    EXPECT_FALSE(says(*scene, "Type Zoom"));
    // The patch is that of the scene, and goes with it; one that somebody set stays.
    Scene shown = scene_of(scene);
    EXPECT_EQ(shown.patch, scene->patch);
    v1::Command load;
    load.mutable_load_scene()->set_file("cornell");
    Loaded loaded;
    loaded.asset = make_cornell();
    ASSERT_TRUE(apply(shown, load, loaded));
    EXPECT_EQ(shown.patch, nullptr);
    const auto own = std::make_shared<const v1::SetPatch>();
    shown.patch = own;
    ASSERT_TRUE(apply(shown, load, loaded));
    EXPECT_EQ(shown.patch, own);
}

TEST(ImportMvr, ModelsOfBothKindsStandWhereTheyBelong) {
    // A triangle in the glTF's own metres, Y up: (0,0,0), (1,0,0), (0,2,0).
    const std::string gltf =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
        R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAA"}],)"
        R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,2,0]}]})";
    const std::string square = bytes_of(GONIO_SOURCE_DIR "/tests/fuzz/exchange_corpus/square.3ds");
    const auto object = [](const std::string& file, const std::string& matrix) {
        return "<SceneObject name='" + file + "'><Matrix>" + matrix + "</Matrix><Geometries><Geometry3D fileName='" +
               file + "'/></Geometries></SceneObject>";
    };
    const auto scene = imported(show_mvr(object("desk.glb", "{1,0,0}{0,1,0}{0,0,1}{3000,0,1000}") +
                                             object("rug.3ds", "{1000,0,0}{0,1000,0}{0,0,1000}{0,5000,0}") +
                                             object("rug.3ds", "{-1000,0,0}{0,1000,0}{0,0,1000}{0,5000,0}") +
                                             object("broken.glb", "") + object("gone.glb", ""),
                                         {{"desk.glb", gltf}, {"rug.3ds", square}, {"broken.glb", "no glTF"}}));
    const auto bounds_of = [&](std::size_t instance) {
        const Instance& one = scene->instances.at(instance);
        Bounds bounds;
        for (const Vertex& vertex : scene->meshes[static_cast<std::size_t>(one.mesh)].vertices) {
            const glm::dvec3 at(one.world_from_mesh * glm::dvec4(glm::dvec3(vertex.position), 1.0));
            bounds.min = glm::min(bounds.min, at);
            bounds.max = glm::max(bounds.max, at);
        }
        return bounds;
    };
    ASSERT_EQ(scene->instances.size(), 5u) << "the 3DS has two parts: one is red";
    expect_near(bounds_of(0).min, {3, 1, 0}, 1e-6);
    expect_near(bounds_of(0).max, {4, 3, 0}, 1e-6);
    // 2 × 1 × 0.5 mm, a thousand times: X stays, MVR's y is -z, its z is y.
    expect_near(bounds_of(1).min, {0, 0, -6}, 1e-6);
    expect_near(bounds_of(1).max, {2, 0, -5}, 1e-6);
    expect_near(bounds_of(2).max, {2, 0.5, -5}, 1e-6);
    expect_near(bounds_of(3).min, {-2, 0, -6}, 1e-6);
    EXPECT_GT(
        scene->materials
            .at(static_cast<std::size_t>(scene->meshes[static_cast<std::size_t>(scene->instances[2].mesh)].material))
            .base_color.r,
        0.9f);
    // The mirrored one faces up as the other does: normals are carried by the cofactors.
    for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
        const Instance& one = scene->instances[i];
        const glm::dmat3 axes(one.world_from_mesh);
        const glm::dvec3 normal = glm::determinant(axes) * glm::transpose(glm::inverse(axes)) *
                                  glm::dvec3(scene->meshes[static_cast<std::size_t>(one.mesh)].vertices[0].normal);
        EXPECT_GT(normal.y, 0.0) << i;
    }
    EXPECT_TRUE(says(*scene, "left out: a model cannot be read: bad_gltf: \"broken.glb ("));
    EXPECT_TRUE(says(*scene, "left out: a model's file is not in the archive: \"gone.glb\""));
    EXPECT_LE(scene->bounds.max.y, 3.001);
}

TEST(ImportMvr, PairedPhotometryGoesBeforeTheFormula) {
    const auto scene = imported(show_mvr(fixture("Spot", kHanging) + "<Fixture name='Old'><GDTFSpec/></Fixture>",
                                         {{"Maker@Head.gdtf", head_gdtf()},
                                          {"Maker@Head.ies", ies::synthetic_lm63("flood")},
                                          {"old.IES", ies::synthetic_lm63("downlight")}}));
    ASSERT_EQ(scene->lights.size(), 2u);
    EXPECT_NEAR(scene->lights[0].profile->peak_cd, 2500.0, 1.0);
    EXPECT_NEAR(scene->lights[1].profile->peak_cd, 2400.0, 1.0);
    expect_near(aim_of(scene->lights[1].world_from_light), {0, -1, 0}, 1e-9);
}

TEST(ImportMvr, WhatCannotBeReadIsNamedOrRefused) {
    const auto scene =
        imported(show_mvr(fixture("Spot", kHanging) + "<Fixture name='Bare'><GDTFSpec>X</GDTFSpec></Fixture>",
                          {{"Maker@Head.gdtf", "no archive"}}));
    ASSERT_EQ(scene->lights.size(), 2u) << "they are there, dark";
    EXPECT_EQ(scene->lights[0].name, "Spot");
    expect_near(scene->lights[0].position, {1, 5, -2}, 1e-9);
    for (const LightSeed& light : scene->lights) EXPECT_EQ(light.profile->flux_lm, 0.0) << light.name;
    EXPECT_EQ(scene->lights[0].profile->photometry.diagnostics.at(0).code, "missing_file");
    EXPECT_TRUE(says(*scene, "left out: a GDTF file cannot be read: not_a_zip: \"Maker@Head.gdtf ("));
    EXPECT_TRUE(says(*scene, "a fixture is dark: it has neither GDTF nor photometry; changes lux: \"Spot\", \"Bare\""));
    EXPECT_GE(scene->materials.size(), 1u);
    EXPECT_LT(scene->bounds.max.x - scene->bounds.min.x, 10.0);
    EXPECT_EQ(exchange::import_mvr("PK\x05\x06", "s", {}, kRoom).error().code, "not_a_zip");
    const auto empty = exchange::import_mvr(*write_zip(std::vector<ZipFile>{{"a", "b"}}), "s", {}, kRoom);
    ASSERT_FALSE(empty);
    EXPECT_EQ(empty.error().code, "zip_no_such_entry");
    const auto poor =
        exchange::import_mvr(show_mvr(fixture("Spot", kHanging), {{"Maker@Head.gdtf", head_gdtf()}}), "s", {}, 20'000);
    ASSERT_FALSE(poor);
    EXPECT_EQ(poor.error().code, "too_large");
}

// "ü" is one character in the show, and "u" with two dots in an archive that was packed on a Mac; or the other way
// round.
TEST(ImportMvr, AccentsMayBeSpeltOtherwise) {
    const std::string composed = "Gr\xc3\xbcn", decomposed = "gru\xcc\x88n";
    for (const auto& [in_show, in_archive] : {std::pair(composed, decomposed), std::pair(decomposed, composed)}) {
        const auto scene = imported(show_mvr(
            "<Fixture name='Spot'><Matrix>" + kHanging + "</Matrix><GDTFSpec>" + in_show + "</GDTFSpec></Fixture>",
            {{in_archive + ".gdtf", head_gdtf()}}));
        ASSERT_EQ(scene->lights.size(), 1u);
        EXPECT_NEAR(scene->lights[0].profile->flux_lm / 10000, 1.0, 1e-3) << in_archive;
    }
}

// Each matrix is fine by itself, what they come to is not.
TEST(ImportMvr, WhatIsTooFarOrHasNoAxesIsLeftOut) {
    const auto within = [](const char* axis, const std::string& inner) {
        const std::string a = axis;
        return "<GroupObject name='G'><Matrix>{" + a + ",0,0}{0," + a + ",0}{0,0," + a +
               "}{0,0,0}</Matrix><ChildList>" + inner + "</ChildList></GroupObject>";
    };
    for (const char* axis : {"1e9", "1e-9"}) {
        std::string nested = fixture("Spot", kHanging);
        for (int i = 0; i < 40; ++i) nested = within(axis, nested);
        const auto scene = imported(show_mvr(nested, {{"Maker@Head.gdtf", head_gdtf()}}));
        EXPECT_TRUE(scene->lights.empty()) << axis;
        EXPECT_TRUE(says(*scene, "left out: a light is more than 1,000 km away, or its axes span no space: \"Spot\""));
    }
    const std::string square = bytes_of(GONIO_SOURCE_DIR "/tests/fuzz/exchange_corpus/square.3ds");
    const auto scene = imported(
        show_mvr(within("1e5", within("1e5",
                                      "<SceneObject name='Rug'><Matrix>{1,0,0}{0,1,0}{0,0,1}{1000,0,0}</Matrix>"
                                      "<Geometries><Geometry3D fileName='rug.3ds'/></Geometries></SceneObject>")),
                 {{"rug.3ds", square}}));
    EXPECT_TRUE(says(*scene, "left out: a model's place is too far or has no size: \"Rug\""));
    EXPECT_LT(scene->bounds.max.x, 1e6);
}

// A function of a part of its channel drives what it has there, and leaves the rest alone.
TEST(ImportMvr, ShareOfAChannel) {
    const auto half = [](const char* attribute, const char* offset) {
        const std::string a = attribute;
        return "<DMXChannel DMXBreak='1' Offset='" + std::string(offset) +
               "' Geometry='Base'><LogicalChannel Attribute='" + a + "'><ChannelFunction Attribute='" + a +
               "' DMXFrom='0/1' PhysicalFrom='0' PhysicalTo='1'/><ChannelFunction Attribute='NoFeature' "
               "DMXFrom='128/1'/></LogicalChannel></DMXChannel>";
    };
    const auto shown = [&](const std::string& channels) {
        const std::string text =
            gdtf_text({.geometries = "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='1000'/></Geometry>",
                       .modes = mode_text("Base", channels)});
        return imported(show_mvr(fixture("Spot", kHanging, "<Addresses><Address break='0'>1.1</Address></Addresses>"),
                                 {{"Maker@Head.gdtf", *write_zip(std::vector<ZipFile>{{"description.xml", text}})}}));
    };
    const auto whole = shown(channel_text("Base", "Dimmer", "1", "0", "100"));
    ASSERT_NE(row_of(*whole, "Spot", "level"), nullptr);
    EXPECT_EQ(row_of(*whole, "Spot", "level")->high(), 1.0) << "percent";
    const auto part = shown(half("Dimmer", "1") + half("ColorAdd_R", "2") + channel_text("Base", "ColorAdd_G", "3") +
                            channel_text("Base", "ColorAdd_B", "4", "1", "0"));
    const auto only_range = [&](const char* property) {
        const v1::PatchRow* row = row_of(*part, "Spot", property);
        return row != nullptr && row->ranges_size() == 1 ? row->ranges(0) : v1::PatchRange();
    };
    const v1::PatchRange level = only_range("level"), red = only_range("red");
    EXPECT_EQ(level.from(), 0u);
    EXPECT_EQ(level.to(), 127u);
    EXPECT_DOUBLE_EQ(level.low(), 0.0);
    EXPECT_DOUBLE_EQ(level.high(), 1.0);
    EXPECT_EQ(red.to(), 127u);
    EXPECT_GT(red.high(), 0.0);
    const v1::PatchRow *green = row_of(*part, "Spot", "green"), *blue = row_of(*part, "Spot", "blue");
    ASSERT_TRUE(green != nullptr && blue != nullptr);
    EXPECT_EQ(green->low(), 0.0);
    EXPECT_EQ(blue->high(), 0.0) << "its function runs backwards";
    EXPECT_GT(blue->low(), 0.0);
}

// A dimmer with the curve x² of a DMX profile: each value of the slot has what the curve gives, within a step of it.
TEST(ImportMvr, DmxProfileOfADimmer) {
    const std::string text = gdtf_text(
        {.geometries = "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='1000'/></Geometry>",
         .modes = mode_text("Base",
                            "<DMXChannel DMXBreak='1' Offset='1' Geometry='Base'><LogicalChannel "
                            "Attribute='Dimmer'><ChannelFunction Attribute='Dimmer' DMXFrom='0/1' "
                            "PhysicalFrom='0' PhysicalTo='1' DMXProfile='Square'/></LogicalChannel>"
                            "</DMXChannel>"),
         .physics =
             "<DMXProfiles><DMXProfile Name='Square'><Point DMXPercentage='0' CFC0='0' CFC1='0' CFC2='1' CFC3='0'/>"
             "</DMXProfile></DMXProfiles>"});
    const auto scene =
        imported(show_mvr(fixture("Spot", kHanging, "<Addresses><Address break='0'>1.1</Address></Addresses>"),
                          {{"Maker@Head.gdtf", *write_zip(std::vector<ZipFile>{{"description.xml", text}})}}));
    const v1::PatchRow* row = row_of(*scene, "Spot", "level");
    ASSERT_NE(row, nullptr);
    EXPECT_LE(row->ranges_size(), 256);
    EXPECT_EQ(row->bits(), 8u);
    unsigned next = 0;
    for (const v1::PatchRange& range : row->ranges()) {
        EXPECT_EQ(range.from(), next);
        next = range.to() + 1;
        EXPECT_NEAR(range.low(), std::pow(range.from() / 255.0, 2.0), 1e-6);
        EXPECT_NEAR(range.high(), std::pow(range.to() / 255.0, 2.0), 1e-6);
    }
    EXPECT_EQ(next, 256u);
}

// Beams beside each other below one axis are lights beside each other; a measured web is that of the whole fixture.
TEST(ImportMvr, SeveralBeamsOfAHead) {
    const std::string text = gdtf_text(
        {.geometries = "<Geometry Name='Base'><Axis Name='Bar'>"
                       "<Beam Name='A' LuminousFlux='1000' Position='{1,0,0,-0.5}{0,1,0,0}{0,0,1,0}{0,0,0,1}'/>"
                       "<Beam Name='B' LuminousFlux='1000' Position='{1,0,0,0.5}{0,1,0,0}{0,0,1,0}{0,0,0,1}'/>"
                       "</Axis></Geometry>",
         .modes = mode_text("Base", channel_text("Bar", "Tilt", "1", "-90", "90"))});
    const std::string gdtf = *write_zip(std::vector<ZipFile>{{"description.xml", text}}),
                      objects = fixture("Bar", kHanging, "<Addresses><Address break='0'>1.1</Address></Addresses>");
    const auto beams = imported(show_mvr(objects, {{"Maker@Head.gdtf", gdtf}}));
    ASSERT_EQ(beams->lights.size(), 2u);
    expect_near(beams->lights[0].position, {0.5, 5, -2}, 1e-9);
    expect_near(beams->lights[1].position, {1.5, 5, -2}, 1e-9);
    EXPECT_TRUE(says(*beams, "guessed: several beams of a head that swings stay where they are at home"));
    const auto paired =
        imported(show_mvr(objects, {{"Maker@Head.gdtf", gdtf}, {"Maker@Head.ies", ies::synthetic_lm63("flood")}}));
    ASSERT_EQ(paired->lights.size(), 1u);
    EXPECT_EQ(paired->lights[0].name, "Bar");
    EXPECT_TRUE(says(*paired, "guessed: photometry of a fixture with several beams is that of all: one light"));
}

TEST(ImportMvr, UniversesMoveByTheOffset) {
    const auto path = std::filesystem::temp_directory_path() / "gonio_offset_test.mvr";
    std::ofstream(path, std::ios::binary) << show_mvr(
        fixture("Spot", kHanging, "<Addresses><Address break='0'>513</Address></Addresses>"),  // universe 2, slot 1
        {{"Maker@Head.gdtf", head_gdtf()}});
    const auto universe = [&](int offset) -> unsigned {
        const auto scene = exchange::load_any_scene(path.string(), "", {.universe_offset = offset}, kRoom);
        EXPECT_TRUE(scene) << scene.error().text();
        EXPECT_EQ(scene ? (*scene)->imported->universe_offset : 99, offset);
        const v1::PatchRow* row = scene ? row_of(**scene, "Spot", "level") : nullptr;
        return row == nullptr ? 0 : row->universe();
    };
    EXPECT_EQ(universe(0), 2u);
    EXPECT_EQ(universe(10), 12u);
    EXPECT_EQ(universe(-1), 1u);
    EXPECT_EQ(universe(-2), 0u) << "there is no universe 0: the fixture is not patched";
    const auto far = exchange::load_any_scene(path.string(), "", {.universe_offset = 63'999}, kRoom);
    std::filesystem::remove(path);
    ASSERT_FALSE(far);
    EXPECT_EQ(far.error().where, "load_scene.universe_offset");
    EXPECT_EQ(far.error().value, "63999");
}

TEST(ImportMvr, FilesAreToldApartByContent) {
    const auto path = std::filesystem::temp_directory_path() / "gonio_import_test.zip";
    std::ofstream(path, std::ios::binary) << show_mvr(fixture("Spot", kHanging), {{"Maker@Head.gdtf", head_gdtf()}});
    const auto scene = exchange::load_any_scene(path.string(), "shown", {.scale = 2.0}, kRoom);
    std::filesystem::remove(path);
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_EQ((*scene)->name, "shown");
    expect_near((*scene)->lights.at(0).position, {2, 9, -4}, 1e-9);
    EXPECT_EQ((*exchange::load_any_scene("cornell"))->name, "cornell");
    EXPECT_EQ(exchange::load_any_scene("/nowhere/show.mvr").error().code, "not_found");
}

TEST(ImportMvr, Samples) {
    const auto folder = shared_data("formats");
    if (!folder) GTEST_SKIP() << "the samples are not on this machine";
    const auto basic = imported(bytes_of(*folder / "mvr" / "basic_fixture.mvr"));
    ASSERT_EQ(basic->lights.size(), 1u);
    EXPECT_EQ(basic->lights[0].name, "LED PAR 64 RGBW");
    EXPECT_NEAR(basic->lights[0].profile->peak_cd / 7295.8, 1.0, 1e-3);
    expect_near(basic->lights[0].position, {5, 4.866, -5}, 1e-9);
    // Red, green and blue are on by default, and white with half of the luminance is not.
    EXPECT_NEAR(basic->lights[0].color.g, 0.5, 0.01);
    const auto seven = imported(bytes_of(*folder / "mvr" / "7-fixtures-sample.mvr"));
    ASSERT_EQ(seven->lights.size(), 7u);
    EXPECT_EQ(seven->lights[6].name, "Robe ColorWash 2500 AT 7");
    // {1,0,0}{0,-1,0}{0,0,-1}: it stands, and its beam goes up.
    expect_near(aim_of(seven->lights[0].world_from_light), {0, 1, 0}, 1e-9);
    // {0,-1,0}{0,0,-1}{1,0,0}: down its own Z is -X.
    expect_near(aim_of(seven->lights[1].world_from_light), {-1, 0, 0}, 1e-9);
    EXPECT_NEAR(seven->lights[0].profile->flux_lm, 10000, 10);
    EXPECT_TRUE(says(*seven, "defaulted: a beam has only default photometry: \"Robe ColorWash 2500 AT: Lamp\""));
    EXPECT_TRUE(says(*seven, "left out: a fixture is not patched"));
}

}  // namespace
}  // namespace gonio
