// Scenes in survey coordinates: what is shifted, and what is said.
#include "server/assets/far_place.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"
#include "tests/shared_data.h"

namespace gonio {
namespace {

// A square of 2 m with a light 3 m above it and a camera, at this place; moved: its vertices lie there, not its node.
SceneAsset asset_at(const glm::dvec3& place, bool moved = false) {
    const glm::dvec3 in_mesh = moved ? place : glm::dvec3(0.0);
    const Scene scene = test::scene_with({{test::quad(in_mesh + glm::dvec3(-1, 0, 1), in_mesh + glm::dvec3(1, 0, 1),
                                                      in_mesh + glm::dvec3(1, 0, -1), in_mesh + glm::dvec3(-1, 0, -1)),
                                           glm::vec3(0.5f)}},
                                         test::isotropic(100.0), in_mesh + glm::dvec3(0.25, 3, 0.5), orientation_of({}),
                                         moved ? glm::dvec3(0) : place);
    SceneAsset asset = *scene.asset;
    asset.cameras.push_back({place + glm::dvec3(0, 1, 5), place + glm::dvec3(0, 1, 0), 0.7});
    return asset;
}

bool says(const SceneAsset& asset, const std::string& words) {
    for (const std::string& warning : asset.warnings)
        if (warning.find(words) != std::string::npos) return true;
    return false;
}

TEST(FarPlace, IsShiftedAsAWholeAndSaid) {
    const SceneAsset near = asset_at({0, 0, 0});
    SceneAsset far = asset_at({350000, 0, 5200000});
    warn_of_coarse_vertices(far);
    EXPECT_TRUE(far.warnings.empty()) << "nodes are in double precision";
    bring_near(far);
    EXPECT_TRUE(says(far, "relative to 350000, 0, 5200000 m"));
    EXPECT_EQ(far.place, glm::dvec3(350000, 0, 5200000));
    EXPECT_EQ(far.lights[0].position, near.lights[0].position);
    EXPECT_EQ(far.cameras[0].eye, near.cameras[0].eye);
    EXPECT_EQ(far.cameras[0].target, near.cameras[0].target);
    EXPECT_EQ(far.bounds.min, near.bounds.min);
    EXPECT_EQ(far.bounds.max, near.bounds.max);
    EXPECT_EQ(far.instances[0].world_from_mesh, near.instances[0].world_from_mesh);
}

TEST(FarPlace, PlacesThatCanBeSetAreKept) {
    SceneAsset kept = asset_at({350000, 0, 900000});
    bring_near(kept);
    EXPECT_TRUE(kept.warnings.empty());
    EXPECT_EQ(kept.place, glm::dvec3(0.0));
    EXPECT_EQ(kept.lights[0].position, glm::dvec3(350000.25, 3, 900000.5));
    SceneAsset odd = asset_at({-1234567, 89, 0});
    bring_near(odd);
    EXPECT_TRUE(says(odd, "relative to -1235000, 0, 0 m")) << "whole kilometres";
    EXPECT_LT(glm::distance(odd.lights[0].position, glm::dvec3(433.25, 92, 0.5)), 1e-9);
}

// Steps of single precision are 0.5 at 5,200,000, and 0.0078 at 90,000.
TEST(FarPlace, CoarseVerticesAreSaid) {
    SceneAsset coarse = asset_at({350000, 0, 5200000}, true), fine = asset_at({35000, 0, 90000}, true);
    warn_of_coarse_vertices(coarse);
    EXPECT_TRUE(says(coarse, "steps of 0.5 m"));
    warn_of_coarse_vertices(fine);
    EXPECT_TRUE(fine.warnings.empty());
    bring_near(coarse);
    EXPECT_EQ(coarse.lights[0].position, glm::dvec3(0.25, 3, 0.5));
    EXPECT_EQ(coarse.bounds.min, glm::dvec3(-1, 0, -1));
}

// 900 cd at 3 m are 100 lx, wherever the room stands.
TEST(FarPlace, TheSharedCases) {
    const auto folder = test::shared_data("cases/51-survey-coordinates");
    if (!folder) GTEST_SKIP() << "no shared cases on this machine";
    for (const char* file :
         {"origin.gltf", "near.gltf", "nodes.gltf", "hundredth.gltf", "tenth.gltf", "within.gltf", "vertices.gltf"}) {
        const auto asset = load_scene(*folder / file);
        ASSERT_TRUE(asset) << asset.error().text();
        const Scene scene = scene_of(*asset);
        trace::Settings settings;
        settings.bounces = 0;
        const trace::MeterPoint below{scene.lights.at(0).position - glm::dvec3(0, 2.999, 0), {0, 1, 0}};
        EXPECT_NEAR(trace::measure(*trace::make_world(scene), {&below, 1}, settings).front().direct_lx.y, 100.0, 0.5)
            << file;
        EXPECT_EQ(says(**asset, "vertices lie"),
                  std::string(file) == "vertices.gltf" || std::string(file) == "within.gltf")
            << file << testing::PrintToString((*asset)->warnings);
    }
}

}  // namespace
}  // namespace gonio
