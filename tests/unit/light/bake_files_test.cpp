// A bake's folder: what lies in it, what is taken over from it, what is refused before anything is computed.
#include <unistd.h>
#include <cstring>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/assets/assets.h"
#include "server/bake/glb.h"
#include "server/bake/key.h"
#include "server/bake/ktx.h"
#include "server/bake/output.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"
#include "tests/unit/light/bake_fixture.h"

namespace gonio::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class BakeFiles : public testing::Test {
protected:
    fs::path folder = fs::path(testing::TempDir()) / ("bake-" + std::to_string(::getpid()));
    Scene scene = scene_with({{room({-2, 0, -2}, {2, 3, 2}), glm::vec3(0.5f, 0.4f, 0.3f)}}, isotropic(80.0), {0, 2, 0});
    bake::BakeSettings settings = small_bake(64, 32);
    bake::Work work;

    BakeFiles() {
        settings.bounces = 2;
        repeat_light(scene, 2, [](Light& light, std::size_t i) { light.position.x = 0.5 * static_cast<double>(i); });
        scene.lights[0].name = "key light";
        scene.lights[1].name = "fill";
        scene.lights[1].level_ratio = 0.5;
    }
    ~BakeFiles() override { fs::remove_all(folder); }

    Result<bake::Summary> run(bool half = false, const std::function<void(const std::string&)>& begins = {}) {
        const trace::Geometry geometry(scene.asset);
        return bake::bake_to_folder(
            scene, geometry, settings, {folder.string(), half, true},
            [&](const std::string& what, int, int) {
                if (begins) begins(what);
            },
            work);
    }
    Json maps() const { return Json::parse(std::ifstream(folder / "maps.json")); }
};

TEST_F(BakeFiles, AreMapsTheirSumAndWhatTheyAre) {
    const auto summary = run();
    ASSERT_TRUE(summary) << summary.error().text();
    const Json document = maps();
    EXPECT_EQ(document["unit"], "lx");
    EXPECT_EQ(document["size"], Json({64, 64}));
    ASSERT_EQ(document["maps"].size(), 2u);
    EXPECT_EQ(document["maps"][0]["name"], "key_light");
    EXPECT_EQ(document["maps"][0]["light"], "key light");
    EXPECT_EQ(document["maps"][1]["weight"], Json({0.5, 0.5, 0.5}));
    for (const char* name : {"key_light_direct.exr", "key_light_indirect.exr", "fill_direct.exr", "fill_indirect.exr",
                             "sum.exr", "error.exr", "sum.ktx2", "test.glb"})
        EXPECT_TRUE(fs::exists(folder / name)) << name;
    const auto direct = read_picture((folder / "key_light_direct.exr").string());
    ASSERT_TRUE(direct);
    EXPECT_EQ(direct->channels, 1);
    const auto sum = read_picture((folder / "sum.exr").string());
    ASSERT_TRUE(sum);
    EXPECT_EQ(sum->channels, 3);
    // The flux of both at their levels over the room's area, before bounces.
    const double area = 2.0 * 16.0 + 4.0 * 12.0, flux = isotropic(80.0)->flux_lm;
    EXPECT_NEAR(summary->mean_direct_lx, 1.5 * flux / area, 0.01 * flux / area);
    EXPECT_NEAR(document["maps"][0]["direct"]["mean_lx"].get<double>(), flux / area, 0.01 * flux / area);
    EXPECT_GT(document["sum"]["mean_lx"].get<double>(), summary->mean_direct_lx);
    EXPECT_GT(document["rays"].get<double>(), 1e5);
}

TEST_F(BakeFiles, HalvesAreTheSameWithinTheirBits) {
    scene.lights[0].multiplier = 2e4;  // over 65,504 lx
    ASSERT_TRUE(run());
    const auto whole = read_picture((folder / "key_light_direct.exr").string());
    ASSERT_TRUE(run(true));
    const auto half = read_picture((folder / "key_light_direct.exr").string());
    const double lx_per_unit = maps()["maps"][0]["direct"]["lx_per_unit"];
    EXPECT_GT(lx_per_unit, 1.0);
    ASSERT_TRUE(whole && half);
    for (std::size_t i = 0; i < whole->values.size(); ++i)
        EXPECT_NEAR(static_cast<double>(half->values[i]) * lx_per_unit, static_cast<double>(whole->values[i]),
                    6e-4 * static_cast<double>(whole->values[i]));
}

// A second bake computes nothing; one of a luminaire that moved computes that one alone; a bake that was stopped goes
// on where it was.
TEST_F(BakeFiles, FinishedPartsAreTakenOver) {
    const auto first = run();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->computed, 6);
    EXPECT_EQ(first->taken_over, 0);
    const auto before = read_picture((folder / "sum.exr").string());
    const std::uint64_t rays = work.rays;
    const auto again = run();
    ASSERT_TRUE(again);
    EXPECT_EQ(again->computed, 0);
    EXPECT_EQ(again->taken_over, 6);
    EXPECT_EQ(work.rays, rays);
    EXPECT_EQ(read_picture((folder / "sum.exr").string())->values, before->values);
    scene.lights[1].level_ratio = 1.0;
    scene.master_ratio = 0.25;
    EXPECT_EQ(run()->computed, 0) << "levels change no part";
    scene.lights[1].position.y -= 0.5;
    EXPECT_EQ(run()->computed, 3) << "a luminaire that moves is computed anew";
    settings.directions = 64;
    EXPECT_EQ(run()->computed, 6);
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    asset->materials[0].base_color.r = 0.6f;
    scene.asset = asset;
    EXPECT_EQ(run()->computed, 6) << "another reflectance";
    scene.haze.extinction_per_m = 0.01;
    settings.steps = 2;
    EXPECT_EQ(run()->computed, 6) << "haze";
    EXPECT_EQ(run()->computed, 0);
    std::ofstream(folder / "parts" / "fill_direct.part", std::ios::binary) << "damaged";
    EXPECT_EQ(run()->computed, 1) << "a damaged part is computed anew";
}

TEST_F(BakeFiles, AStoppedBakeKeepsWhatIsFinishedAndGoesOn) {
    std::stop_source stop;
    work.stop = stop.get_token();
    const auto stopped = run(false, [&](const std::string& what) {
        if (what.find("bounce 2") != std::string::npos) stop.request_stop();
    });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, "stopped");
    EXPECT_FALSE(fs::exists(folder / "maps.json"));
    work.stop = {};
    const auto rest = run();
    ASSERT_TRUE(rest);
    EXPECT_EQ(rest->taken_over, 4);
    EXPECT_EQ(rest->computed, 2);
    const auto sum = read_picture((folder / "sum.exr").string());
    fs::remove_all(folder);
    ASSERT_TRUE(run());
    EXPECT_EQ(sum->values, read_picture((folder / "sum.exr").string())->values);
}

TEST_F(BakeFiles, ThreadsDoNotChangeMaps) {
    work.threads = 1;
    ASSERT_TRUE(run());
    const auto one = read_picture((folder / "sum.exr").string());
    fs::remove_all(folder);
    work.threads = 3;
    ASSERT_TRUE(run());
    EXPECT_EQ(one->values, read_picture((folder / "sum.exr").string())->values);
}

TEST_F(BakeFiles, TooMuchMemoryIsRefusedWithBothFigures) {
    settings.atlas.width = settings.atlas.height = 4096;
    settings.memory_bytes = std::size_t{64} << 20;
    const auto refused = run();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
    EXPECT_EQ(refused.error().where, "bake.memory");
    EXPECT_EQ(refused.error().value, "64 MiB");
    EXPECT_NE(refused.error().message.find(" MiB"), std::string::npos);
    EXPECT_EQ(work.rays, 0u);
}

// Sources one by one, where memory holds no more at a time, give the same maps.
TEST_F(BakeFiles, LittleMemoryGivesTheSameMaps) {
    ASSERT_TRUE(run());
    const auto together = read_picture((folder / "sum.exr").string());
    fs::remove_all(folder);
    const bake::MemoryNeed need = bake::memory_of(settings.atlas);
    settings.memory_bytes = need.fixed + need.per_source;
    ASSERT_TRUE(run());
    EXPECT_EQ(together->values, read_picture((folder / "sum.exr").string())->values);
}

TEST_F(BakeFiles, ScenesWithoutLightOrWithTooMuchAreRefused) {
    repeat_light(scene, 65, [](Light&, std::size_t) {});
    EXPECT_EQ(run().error().code, "too_many_lights");
    scene.lights.clear();
    EXPECT_EQ(run().error().code, "nothing_to_bake");
    EXPECT_FALSE(fs::exists(folder));
}

TEST_F(BakeFiles, AFolderThatCannotBeWrittenIsRefused) {
    std::ofstream(folder.string()) << "a file";
    const auto refused = run();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "file_unwritable");
    EXPECT_EQ(refused.error().where, "bake.out");
}

// The scene of a bake is read back: the same triangles, the map in its second set of texture coordinates.
TEST_F(BakeFiles, TheSceneShowsItsMap) {
    ASSERT_TRUE(run());
    const auto loaded = load_scene((folder / "test.glb").string());
    ASSERT_TRUE(loaded) << loaded.error().text();
    const SceneAsset& asset = **loaded;
    EXPECT_EQ(asset.triangles(), 12u);
    ASSERT_EQ(asset.meshes.size(), 1u);
    ASSERT_EQ(asset.meshes[0].second_uv.size(), asset.meshes[0].vertices.size());
    ASSERT_EQ(asset.materials[0].emissive_nit.r > 0.0f, true);
    // Its coordinates are an atlas that the bake takes itself, with the same light.
    Scene second = scene_of(*loaded);
    second.lights = scene.lights;
    second.emission_hidden = true;
    settings.atlas.second_uv = true;
    const Baked baked = bake_scene(second, settings);
    ASSERT_EQ(baked.maps.size(), 2u);
    const auto direct = read_picture((folder / "key_light_direct.exr").string());
    for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); i += 7) {
        const float lx = direct->values[static_cast<std::size_t>(baked.layout.atlas.texels[i].pixel)];
        EXPECT_NEAR(static_cast<double>(baked.maps[0].direct[i]), static_cast<double>(lx),
                    0.02 * static_cast<double>(lx) + 1e-3);
    }
    // What the emissive texture shows is ρE/π of the sum.
    const auto sum = read_picture((folder / "sum.exr").string());
    const bake::Texel& texel = baked.layout.atlas.texels[100];
    const auto pixel = static_cast<std::size_t>(texel.pixel);
    const Image& image = asset.images[static_cast<std::size_t>(asset.materials[0].emissive_image)];
    const auto byte = static_cast<double>(image.rgba[4 * pixel]) / 255.0,
               linear = byte <= 0.04045 ? byte / 12.92 : std::pow((byte + 0.055) / 1.055, 2.4);
    const double expected = 0.5 * static_cast<double>(sum->values[3 * pixel]) / std::numbers::pi;
    EXPECT_NEAR(linear * static_cast<double>(asset.materials[0].emissive_nit.r), expected, 0.02 * expected);
}

// EXT_texture_shared_exponent's own rule: within 2⁻⁹ of the greatest channel; and values that are exact.
TEST(BakeKtx, ThreeValuesShareAnExponent) {
    EXPECT_EQ(bake::pack_rgb9e5(glm::vec3(0.0f)), 0u);
    // 1.0 = 256 · 2^(16 − 15 − 9)
    EXPECT_EQ(bake::pack_rgb9e5(glm::vec3(1.0f)), 16u << 27 | 256u << 18 | 256u << 9 | 256u);
    EXPECT_EQ(bake::pack_rgb9e5(glm::vec3(65408.0f, 0, 0)), 31u << 27 | 511u);
    EXPECT_EQ(bake::pack_rgb9e5(glm::vec3(1e9f, 0, 0)), 31u << 27 | 511u);
    EXPECT_EQ(bake::pack_rgb9e5(glm::vec3(-1.0f, 0, 0)), 0u);
    std::uint32_t state = 1;
    for (int i = 0; i < 2000; ++i) {
        glm::vec3 c;
        for (int k = 0; k < 3; ++k) {
            state = state * 1664525u + 1013904223u;
            c[k] = std::exp2(static_cast<float>(state >> 8) / 16777216.0f * 26.0f - 10.0f);
        }
        const glm::vec3 back = bake::unpack_rgb9e5(bake::pack_rgb9e5(c));
        const float greatest = std::max({c.r, c.g, c.b});
        for (int k = 0; k < 3; ++k) EXPECT_LE(std::abs(back[k] - std::min(c[k], 65408.0f)), greatest / 512.0f);
    }
}

// KTX 2.0, section 3: the identifier, the head's fields, offsets that lie in the file.
TEST(BakeKtx, TheFileIsAKtx2) {
    const std::string bytes = bake::ktx2_rgb9e5(std::vector<float>{1, 1, 1, 0, 0, 0}, 2, 1, 1.0f);
    ASSERT_GT(bytes.size(), 80u);
    EXPECT_EQ(bytes.substr(0, 12), std::string("\xABKTX 20\xBB\r\n\x1A\n", 12));
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, &bytes[at], 4);
        return value;
    };
    EXPECT_EQ(word(12), 123u);
    EXPECT_EQ(word(16), 4u);
    EXPECT_EQ(word(20), 2u);
    EXPECT_EQ(word(24), 1u);
    EXPECT_EQ(word(36), 1u);
    EXPECT_EQ(word(40), 1u);
    EXPECT_EQ(word(word(48)), word(52)) << "the descriptor's own size";
    const std::uint32_t data = word(80);
    EXPECT_EQ(data % 4, 0u);
    EXPECT_EQ(data + 8, bytes.size());
    EXPECT_EQ(word(data), bake::pack_rgb9e5(glm::vec3(1.0f)));
    EXPECT_EQ(word(data + 4), 0u);
}

}  // namespace
}  // namespace gonio::test
