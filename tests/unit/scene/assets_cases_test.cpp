// glTF import of the shared cases, each against what its README says. Without the shared folder they are skipped; each
// trait has a test of its own beside it.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/shared_data.h"

namespace gonio {
namespace {

// Direct light on the floor at x, 0, 0. light: alone, -1: all.
glm::dvec3 floor_lux(const std::shared_ptr<const SceneAsset>& asset, double x_m, int light = -1) {
    Scene scene = scene_of(asset);
    for (std::size_t i = 0; i < scene.lights.size(); ++i)
        if (light >= 0 && static_cast<int>(i) != light) scene.lights[i].level_ratio = 0.0;
    const trace::MeterPoint points[] = {{{x_m, 0, 0}, {0, 1, 0}}};
    trace::Settings settings;
    settings.bounces = 0;
    settings.noise = 1e-3;
    return trace::measure(*trace::make_world(scene), points, settings).front().direct_lx;
}

class AssetsCases : public testing::Test {
protected:
    // Result: the scene; empty where there is no such file.
    static std::shared_ptr<const SceneAsset> scene_of_case(const std::string& path) {
        const auto file = test::shared_data("cases/" + path);
        if (!file) return nullptr;
        const auto scene = load_scene(*file);
        EXPECT_TRUE(scene) << path << ": " << scene.error().text();
        return scene ? *scene : nullptr;
    }
};

TEST_F(AssetsCases, AHiddenBoardCastsNoShadow) {
    for (const char* file : {"21-node-visibility/visibility.gltf", "21-node-visibility/required.gltf"}) {
        const auto scene = scene_of_case(file);
        if (!scene) GTEST_SKIP() << "no shared cases on this machine";
        EXPECT_EQ(scene->lights.size(), 1u) << file;
        EXPECT_NEAR(floor_lux(scene, 0.0).g, 100.0, 0.01) << file;
    }
}

TEST_F(AssetsCases, APanelOfAThousandCandelasASquareMetre) {
    const auto scene = scene_of_case("20-ext-lights-area/area.gltf");
    if (!scene) GTEST_SKIP() << "no shared cases on this machine";
    EXPECT_NEAR(floor_lux(scene, 0.0).g, 106.9, 0.4);
}

TEST_F(AssetsCases, LightsThatSayLittle) {
    for (const char* file : {"25-light-defaults/lights.gltf", "25-light-defaults/lights2.gltf"}) {
        const auto scene = scene_of_case(file);
        if (!scene) GTEST_SKIP() << "no shared cases on this machine";
        ASSERT_EQ(scene->lights.size(), 4u) << file;
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t k = 0; k < i; ++k) EXPECT_NE(scene->lights[i].name, scene->lights[k].name);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(floor_lux(scene, -3.0, 0)[c], 1.0 / 9.0, 1e-5);
        EXPECT_NEAR(floor_lux(scene, -1.0, 1).g, 100.0, 0.01);
        EXPECT_EQ(floor_lux(scene, 2.01, 1).g, 0.0) << "beyond 45 degrees";
        EXPECT_NEAR(floor_lux(scene, 1.0, 2).g, 100.0, 0.01);
        EXPECT_NEAR(floor_lux(scene, -3.0, 2).g, 900.0 * 3.0 / 125.0, 0.01) << "beyond its range";
    }
}

// 900 cd at 3 m, by a URI with %20 and by a buffer view; the file halves B and its green. The missing one is named.
TEST_F(AssetsCases, PhotometryByUriAndByBufferView) {
    for (const char* file : {"27-ext-lights-ies/good.gltf", "27-ext-lights-ies/missing.gltf"}) {
        const auto scene = scene_of_case(file);
        if (!scene) GTEST_SKIP() << "no shared cases on this machine";
        std::size_t lit = 0;
        for (std::size_t i = 0; i < scene->lights.size(); ++i) {
            const LightSeed& light = scene->lights[i];
            if (light.profile->flux_lm == 0.0) continue;
            ++lit;
            const double expected_lx = light.name == "B" ? 25.0 : 100.0;
            EXPECT_NEAR(floor_lux(scene, light.position.x, static_cast<int>(i)).g, expected_lx, 0.1) << light.name;
        }
        EXPECT_EQ(lit, 2u) << file;
        const bool missing = lit < scene->lights.size();
        EXPECT_EQ(missing, std::string(file).find("missing") != std::string::npos);
        std::string all;
        for (const std::string& warning : scene->warnings) all += warning + "\n";
        EXPECT_EQ(all.find("the file is missing") != std::string::npos, missing) << all;
    }
}

// Names as planning software writes them are kept letter by letter.
TEST_F(AssetsCases, OddNamesAreKept) {
    const auto scene = scene_of_case("28-odd-names/names.gltf");
    if (!scene) GTEST_SKIP() << "no shared cases on this machine";
    std::set<std::string> names;
    for (const LightSeed& light : scene->lights) names.insert(light.name);
    for (const char* name : {"M_Downlight: 0600x0600 - \"A\"/3000K", "<script>alert(1)</script>", "-5 dB", "照明 💡",
                             "مصباح", "a,b", "50%", "#1"})
        EXPECT_TRUE(names.contains(name)) << name;
    EXPECT_EQ(names.size(), 9u);
}

// Both stand as they were bound: as large as their POSITION accessors say, which the nodes' scales would shrink.
TEST_F(AssetsCases, SkinsStandAsTheyWereBound) {
    const struct {
        const char* file;
        glm::dvec3 low, high;
    } cases[] = {{"public/skin-hand.glb", {-0.05828, -0.18968, -0.01926}, {0.08762, 0.02236, 0.05777}},
                 {"public/skin-player.glb", {-0.83906, 0.00031, -0.26895}, {0.83906, 2.11875, 0.36738}}};
    for (const auto& each : cases) {
        const auto scene = scene_of_case(each.file);
        if (!scene) GTEST_SKIP() << "no shared cases on this machine";
        EXPECT_LT(glm::length(scene->bounds.min - each.low), 2e-5) << each.file;
        EXPECT_LT(glm::length(scene->bounds.max - each.high), 2e-5) << each.file;
    }
}

}  // namespace
}  // namespace gonio
