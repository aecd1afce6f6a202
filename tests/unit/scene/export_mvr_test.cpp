// A scene as .mvr: what the standard asks of it, and that it comes back with the same lights, patch and light.
#include "server/exchange/export_mvr.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "protocol/dmx/patch.h"
#include "protocol/schema/console.pb.h"
#include "server/exchange/export_left_out.h"
#include "server/exchange/export_parts.h"
#include "server/exchange/import_mvr.h"
#include "server/scene/scene.h"
#include "tests/shared_data.h"
#include "tests/unit/export_fixture.h"
#include "tests/unit/scene/exchange_test_support.h"
#include "tests/unit/scene/mvr_check.h"

namespace gonio::test {
namespace {

std::string mvr_of(const Scene& scene) {
    auto bytes = exchange::export_mvr(scene);
    EXPECT_TRUE(bytes) << bytes.error().text();
    return bytes ? *bytes : std::string();
}

std::shared_ptr<const SceneAsset> read_again(const std::string& bytes) {
    auto read = exchange::import_mvr(bytes, "again.mvr", {}, std::size_t{1} << 32);
    EXPECT_TRUE(read) << read.error().text();
    return read ? *read : std::make_shared<SceneAsset>();
}

v1::PatchRow patch_row(const std::string& target, const std::string& property, unsigned universe, unsigned address,
                       unsigned bits, double low, double high) {
    v1::PatchRow row;
    row.set_protocol("sacn");
    row.set_universe(universe);
    row.set_address(address);
    row.set_target(target);
    row.set_property(property);
    row.set_bits(bits);
    row.set_low(low);
    row.set_high(high);
    return row;
}

// Heads, dimmers, colours, in 8 and 16 bits, backwards, over two universes.
v1::SetPatch some_patch() {
    v1::SetPatch patch;
    for (const v1::PatchRow& row :
         {patch_row("lopsided", "level", 2, 20, 16, 0, 1), patch_row("lopsided", "pan", 2, 11, 16, -4.7, 4.7),
          patch_row("lopsided", "tilt", 2, 13, 8, 2.0, -2.0), patch_row("lopsided", "red", 3, 101, 8, 0, 1),
          patch_row("lopsided", "green", 3, 102, 8, 0, 1), patch_row("lopsided", "blue", 3, 103, 8, 0, 0.5),
          patch_row("tilted", "level", 1, 512, 8, 0.25, 0.75), patch_row("bulb", "level", 1, 1, 8, 0, 1),
          patch_row("spot", "pan", 1, 30, 16, -1.5, 1.0)})
        *patch.add_rows() = row;
    return patch;
}

// Rows without regard to their order.
std::set<std::string> rows_of(const v1::SetPatch& patch) {
    std::set<std::string> rows;
    for (const v1::PatchRow& row : patch.rows()) {
        char numbers[96];
        std::snprintf(numbers, sizeof numbers, " %u.%u %u bits %.6g %.6g", row.universe(), row.address(), row.bits(),
                      row.low(), row.high());
        rows.insert(row.target() + " " + row.property() + numbers);
    }
    return rows;
}

void expect_same_lights(const Scene& was, const Scene& is) {
    ASSERT_EQ(is.lights.size(), was.lights.size());
    for (std::size_t i = 0; i < is.lights.size(); ++i) {
        const Light &a = was.lights[i], &b = is.lights[i];
        EXPECT_EQ(b.name, a.name);
        EXPECT_NEAR(glm::length(b.position - a.position), 0.0, 1e-9) << a.name;
        EXPECT_NEAR(glm::length(aim_of(b.world_from_light) - aim_of(a.world_from_light)), 0.0, 1e-9) << a.name;
        EXPECT_NEAR(glm::length(c0_of(b.world_from_light) - c0_of(a.world_from_light)), 0.0, 1e-9) << a.name;
        EXPECT_NEAR(b.level_ratio, a.level_ratio * was.master_ratio, 1e-12) << a.name;
        const glm::dvec3 weight = light_weight(was, a) * a.profile->flux_lm,
                         again = light_weight(is, b) * b.profile->flux_lm;
        EXPECT_NEAR(glm::length(again - weight) / glm::length(weight), 0.0, 1e-6) << a.name;
        EXPECT_EQ(b.profile->photometry.opening.shape, (a.opening ? *a.opening : a.profile->photometry.opening).shape);
    }
}

class ExportMvr : public testing::TestWithParam<const char*> {};

TEST_P(ExportMvr, KeepsTheStandardAndComesBackWithTheSameLight) {
    Scene scene = rigged(*load_scene(GetParam()), false);
    scene.patch = std::make_shared<const v1::SetPatch>(some_patch());
    ASSERT_TRUE(check_patch(*scene.patch)) << check_patch(*scene.patch).error().text();
    const std::string bytes = mvr_of(scene);
    for (const std::string& fault : MvrCheck::faults(bytes)) ADD_FAILURE() << fault;
    EXPECT_EQ(bytes, mvr_of(scene)) << "the same bytes each time";
    const auto asset = read_again(bytes);
    EXPECT_EQ(asset->triangles(), scene.asset->triangles());
    for (const std::string& warning : asset->warnings) {
        const bool leaves_out = warning.find("left out") != std::string::npos;
        EXPECT_TRUE(!leaves_out || warning.find("bodies") != std::string::npos ||
                    warning.find("not patched") != std::string::npos)
            << warning;
    }
    const Scene again = scene_of(asset);
    expect_same_lights(scene, again);
    ASSERT_TRUE(again.patch);
    EXPECT_EQ(rows_of(*again.patch), rows_of(*scene.patch));
    expect_same_light(scene, again);
}
INSTANTIATE_TEST_SUITE_P(BuiltIn, ExportMvr, testing::Values("cornell", "atrium", "cylinder"));

TEST(ExportedMvr, AClosedShutterIsDarkAndCanBeLit) {
    expect_a_closed_shutter_back([](const Scene& scene) { return scene_of(read_again(mvr_of(scene))); });
}

TEST(ExportedMvr, WithoutAPatchTheDefaultOneStays) {
    const Scene scene = rigged(make_cornell(), false);
    const std::string bytes = mvr_of(scene);
    EXPECT_TRUE(MvrCheck::faults(bytes).empty());
    EXPECT_FALSE(read_again(bytes)->patch);
}

// Lights of one web share one type; names that differ by case alone do not meet in the archive.
TEST(ExportedMvr, TypesAreSharedAndNamesAreTheirOwn) {
    Scene scene = scene_of(make_cornell());
    scene.lights.clear();
    const auto web = lopsided();
    auto shouting = std::make_shared<Profile>(*web);
    shouting->name = "LOPSIDED";
    for (const auto& [name, profile] :
         {std::pair("a", web), {"b", web}, {"A", std::shared_ptr<const Profile>(shouting)}})
        scene.lights.push_back(light_of(scene, name, profile, {0, 2, 0}));
    scene.lights[1].level_ratio = 0.5;
    scene.lights[1].color = {0.1, 0.2, 0.3};
    const std::string bytes = mvr_of(scene);
    for (const std::string& fault : MvrCheck::faults(bytes)) ADD_FAILURE() << fault;
    const auto archive = open_zip(bytes);
    ASSERT_TRUE(archive);
    std::vector<std::string> types;
    for (const ZipEntry& entry : archive->entries())
        if (entry.name.ends_with(".gdtf")) types.push_back(entry.name);
    EXPECT_EQ(types, (std::vector<std::string>{"Gonio@lopsided.gdtf", "Gonio@LOPSIDED 2.gdtf"}));
    expect_same_lights(scene, scene_of(read_again(bytes)));
}

TEST(ExportedMvr, SunsAndRowsOfGroupsAreLeftOut) {
    Scene scene = rigged(make_cornell());
    v1::SetPatch patch;
    *patch.add_rows() = patch_row("bulb", "level", 1, 5, 8, 0, 1);
    *patch.add_rows() = patch_row("some group", "level", 1, 6, 8, 0, 1);
    *patch.add_rows() = patch_row("", "master", 1, 7, 8, 0, 1);
    scene.patch = std::make_shared<const v1::SetPatch>(patch);
    const auto asset = read_again(mvr_of(scene));
    EXPECT_EQ(asset->lights.size(), scene.lights.size() - 1);
    ASSERT_TRUE(asset->patch);
    EXPECT_EQ(rows_of(*asset->patch), (std::set<std::string>{"bulb level 1.5 8 bits 0 1"}));
}

// What docs/shows.md says that glTF and MVR have no word for is named.
TEST(ExportedMvr, WhatIsLeftOutIsNamed) {
    using Lines = std::vector<std::string>;
    Scene scene = rigged(make_cornell(), false);
    std::erase_if(scene.lights, [](const Light& light) { return light.name == "tilted"; });
    v1::SetPatch patch;
    const v1::SetPatch all = some_patch();
    for (const v1::PatchRow& row : all.rows())
        if (row.target() != "tilted") *patch.add_rows() = row;
    scene.patch = std::make_shared<const v1::SetPatch>(patch);
    EXPECT_EQ(exchange::left_out_of_mvr(scene), Lines{}) << "all of it comes back";
    EXPECT_EQ(exchange::left_out_of_glb(scene), Lines{"left out: the patch"});
    scene = rigged(make_cornell());
    for (const auto& [target, property] : {std::pair("lopsided", "zoom"), {"lopsided", "shutter"}, {"bulb", "red"}})
        *patch.add_rows() = patch_row(target, property, 4, static_cast<unsigned>(patch.rows_size()) + 1, 8, 0, 1);
    *patch.add_rows() = patch_row("", "master", 4, 100, 8, 0, 1);
    scene.patch = std::make_shared<const v1::SetPatch>(patch);
    Light& light = *std::ranges::find(scene.lights, "lopsided", &Light::name);
    light.shutter_ratio = 0.0;
    light.strobe_hz = 5.0;
    auto wheel = std::make_shared<Profile>(*light.profile);
    wheel->gobos = std::make_shared<const Gobos>(Gobos{{"open"}, {"dots", 2, {0, 65535, 65535, 0}}});
    light.profile = wheel;
    scene.haze.extinction_per_m = 0.01;
    scene.groups["front"] = {"bulb"};
    scene.presets["dim"] = std::make_shared<const Preset>();
    scene.saved_views["wide"] = scene.camera;
    const Lines both{
        "left out: gobo wheels; lights keep the picture that they show now: \"lopsided\"",
        "left out: shutters; the level is that with the shutter: \"lopsided\"",
        "left out: strobes; lights are on all the time: \"lopsided\"",
        "left out: that a lamp's output follows its tilt; it stays as it is now: \"tilted\"",
        "left out: the haze",
        "left out: groups: \"front\"",
        "left out: presets: \"dim\"",
    };
    Lines glb = both, mvr = both;
    glb.push_back("left out: the patch");
    mvr.insert(mvr.begin(), "left out: suns, and their light: \"sun\"");
    mvr.push_back("left out: kept views: \"wide\"");
    mvr.push_back("left out: rows of the patch: \"lopsided zoom\", \"lopsided shutter\", \"bulb red\", \"master\"");
    EXPECT_EQ(exchange::left_out_of_glb(scene), glb);
    EXPECT_EQ(exchange::left_out_of_mvr(scene), mvr);
}

// A picture that two meshes have is written once, and a mirrored instance keeps its front.
TEST(ExportedMvr, PicturesAreWrittenOnceAndFrontsStay) {
    auto asset = std::make_shared<SceneAsset>();
    asset->images.push_back({2, 2, std::vector<std::uint8_t>(16, 200)});
    for (const int image : {0, 0, -1}) {
        asset->materials.emplace_back().base_color_image = image;
        asset->materials.back().base_color = {0.5f, 0.5f, 0.5f, 1.0f};
        Mesh mesh = quad({0, 0, 1}, {1, 0, 1}, {1, 0, 0}, {0, 0, 0});
        mesh.material = static_cast<int>(asset->meshes.size());
        asset->meshes.push_back(std::move(mesh));
    }
    const glm::dmat4 moved = glm::translate(glm::dmat4(1.0), {3, 0, 0});
    asset->instances = {{0, glm::dmat4(1.0), "rug"},
                        {1, glm::scale(moved, {-1, 1, 1}), "mirrored rug"},
                        {2, glm::dmat4(1.0), "floor"},
                        {2, glm::scale(moved, {1, 1, -2}), "mirrored floor"},
                        {2, moved, "floor"}};
    asset->bounds = {glm::dvec3(-3), glm::dvec3(6)};
    EXPECT_EQ(exchange::geometry_groups(*asset).size(), 3u);
    const std::string bytes = mvr_of(scene_of(asset));
    for (const std::string& fault : MvrCheck::faults(bytes)) ADD_FAILURE() << fault;
    const auto again = read_again(bytes);
    EXPECT_EQ(again->images.size(), 1u);
    ASSERT_EQ(again->instances.size(), asset->instances.size());
    const auto corners = [](const SceneAsset& scene) {
        std::multiset<std::string> all;
        for (const Instance& instance : scene.instances) {
            const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
            const glm::dmat3 axes(instance.world_from_mesh);
            const glm::dmat3 cofactors = glm::determinant(axes) * glm::transpose(glm::inverse(axes));
            for (const std::uint32_t index : mesh.indices) {
                const Vertex& vertex = mesh.vertices[index];
                const glm::dvec3 at(instance.world_from_mesh * glm::dvec4(glm::dvec3(vertex.position), 1.0)),
                    normal = glm::normalize(cofactors * glm::dvec3(vertex.normal));
                char text[160];
                std::snprintf(text, sizeof text, "%.5f %.5f %.5f  %.4f %.4f %.4f", at.x + 0.0, at.y + 0.0, at.z + 0.0,
                              normal.x + 0.0, normal.y + 0.0, normal.z + 0.0);
                all.insert(text);
            }
        }
        return all;
    };
    EXPECT_EQ(corners(*again), corners(*asset));
}

// Turns whose sine is only rounding (1.2e-16) or small (1e-7): MvrCheck has the schema's patterns, and the schema says
// the same where it and xmllint are there.
TEST(ExportedMvr, MatricesHaveNoExponent) {
    Scene scene = floor_scene(8.0, 0.5f, lopsided(), {0, 2, 0});
    scene.lights.clear();
    v1::SetPatch patch;
    unsigned address = 0;
    for (const double roll : {0.0, std::numbers::pi, 1e-7, -0.5 * std::numbers::pi, 2.0})
        for (const double tilt : {0.0, std::numbers::pi, -1e-7}) {
            const std::string name = "head " + std::to_string(++address);
            scene.lights.push_back(light_of(scene, name, lopsided(), {1e-7 * address, 2.0, 0.1}, {0.3, tilt, roll}));
            *patch.add_rows() = patch_row(name, "pan", 1, 2 * address, 8, -4.7, 4.7);
            *patch.add_rows() = patch_row(name, "tilt", 1, 2 * address + 1, 8, -3.5, 3.5);
        }
    scene.patch = std::make_shared<const v1::SetPatch>(patch);
    const std::string bytes = mvr_of(scene);
    for (const std::string& fault : MvrCheck::faults(bytes)) ADD_FAILURE() << fault;
    expect_same_lights(scene, scene_of(read_again(bytes)));
    const auto formats = shared_data("formats");
    if (!formats || std::system("xmllint --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no schema or no xmllint";
    const auto archive = open_zip(bytes);
    ASSERT_TRUE(archive);
    char folder[] = "/tmp/gonio_gdtf_XXXXXX";
    ASSERT_NE(::mkdtemp(folder), nullptr);
    const std::string path = std::string(folder) + "/description.xml";
    int types = 0;
    for (const ZipEntry& entry : archive->entries()) {
        if (!entry.name.ends_with(".gdtf")) continue;
        std::ofstream(path, std::ios::binary) << *open_zip(*archive->read(entry.name))->read("description.xml");
        const std::string command =
            "xmllint --noout --schema '" + (*formats / "gdtf/gdtf.xsd").string() + "' " + path + " >/dev/null";
        EXPECT_EQ(std::system(command.c_str()), 0) << entry.name;
        ++types;
    }
    EXPECT_EQ(types, 5) << "one for each roll";
    std::filesystem::remove_all(folder);
}

// The checker finds what it is there for.
TEST(MvrCheck, FindsFaults) {
    const Scene scene = [] {
        Scene made = rigged(floor_scene(4.0, 0.5f, lopsided(), {0, 2, 0}).asset, false);
        made.patch = std::make_shared<const v1::SetPatch>(some_patch());
        return made;
    }();
    const auto archive = open_zip(mvr_of(scene));
    ASSERT_TRUE(archive);
    std::vector<ZipFile> files;
    for (const ZipEntry& entry : archive->entries()) files.push_back({entry.name, *archive->read(entry.name)});
    const auto faults = [&](const std::function<void(std::vector<ZipFile>&)>& damage) {
        std::vector<ZipFile> damaged = files;
        damage(damaged);
        return MvrCheck::faults(*write_zip(damaged));
    };
    EXPECT_TRUE(faults([](auto&) {}).empty());
    const auto replaced = [&](const std::string& from, const std::string& to) {
        return faults([&](std::vector<ZipFile>& damaged) {
            const std::size_t at = damaged[0].bytes.find(from);
            ASSERT_NE(at, std::string::npos) << from;
            damaged[0].bytes.replace(at, from.size(), to);
        });
    };
    EXPECT_FALSE(replaced(" providerVersion=", " version=").empty());
    EXPECT_FALSE(replaced("verMinor=\"6\"", "verMinor=\"5\"").empty());
    EXPECT_FALSE(replaced(".gdtf</GDTFSpec>", "</GDTFSpec>").empty());
    EXPECT_FALSE(replaced("<GDTFMode>Default", "<GDTFMode>Other").empty());
    EXPECT_FALSE(replaced("<Focus>", "<Focus>0").empty());
    EXPECT_FALSE(replaced("<Matrix>{1", "<Matrix>{nan").empty());
    EXPECT_FALSE(replaced("<Matrix>{1,0,0}", "<Matrix>{0,0,0}").empty());
    EXPECT_FALSE(replaced("<Layer name=\"Surfaces\" uuid=\"", "<Layer name=\"Surfaces\" uuid=\"{").empty());
    EXPECT_FALSE(replaced("fileName=\"", "fileName=\"models/").empty());
    EXPECT_FALSE(replaced("<FixtureID>1</FixtureID>", "").empty());
    EXPECT_FALSE(replaced("break=\"0\"", "break=\"7\"").empty());
    EXPECT_FALSE(replaced(">2.11<", ">2.510<").empty());
    EXPECT_FALSE(faults([](auto& damaged) { damaged.back().name = "folder/" + damaged.back().name; }).empty());
    EXPECT_FALSE(faults([](auto& damaged) { damaged.push_back({"GENERALSCENEDESCRIPTION.XML", ""}); }).empty());
    EXPECT_FALSE(faults([](auto& damaged) { damaged.pop_back(); }).empty()) << "a file is missing";
}

// User data that say what cannot be say nothing: the light is as the fixture alone has it.
TEST(ExportedMvr, UserDataOutOfRangeAreNamed) {
    Scene scene = floor_scene(4.0, 0.5f, lopsided(), {0, 2, 0});
    scene.lights[0].level_ratio = 0.25;
    const auto archive = open_zip(mvr_of(scene));
    ASSERT_TRUE(archive);
    const auto with = [&](const std::string& level) {
        std::vector<ZipFile> files;
        for (const ZipEntry& entry : archive->entries()) files.push_back({entry.name, *archive->read(entry.name)});
        const std::string was = "level=\"0.25\"";
        files[0].bytes.replace(files[0].bytes.find(was), was.size(), "level=\"" + level + "\"");
        return read_again(*write_zip(files));
    };
    EXPECT_EQ(with("0.75")->lights.at(0).level_ratio, 0.75);
    for (const char* bad : {"7", "-1", "nan", ""}) {
        const auto asset = with(bad);
        EXPECT_EQ(asset->lights.at(0).level_ratio, 1.0) << bad;
        EXPECT_TRUE(std::ranges::any_of(asset->warnings, [](const std::string& line) {
            return line.find("left out: user data of a light") != std::string::npos;
        })) << bad;
    }
}

TEST(ExportedMvr, UuidsFollowFromTheText) {
    EXPECT_EQ(exchange::uuid_of("light key"), exchange::uuid_of("light key"));
    EXPECT_NE(exchange::uuid_of("light key"), exchange::uuid_of("light kez"));
    // RFC 9562: version 8, variant 10.
    const std::string uuid = exchange::uuid_of("");
    ASSERT_EQ(uuid.size(), 36u);
    EXPECT_EQ(uuid[14], '8');
    EXPECT_NE(std::string("89AB").find(uuid[19]), std::string::npos);
}

}  // namespace
}  // namespace gonio::test
