// What write_glb writes, load_scene reads back as the same scene.
#include "tests/scenes/write_glb.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {
namespace {

std::shared_ptr<const SceneAsset> round_trip(const SceneAsset& asset) {
    const auto bytes = write_glb(asset);
    EXPECT_TRUE(bytes);
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("gonio-write-glb-" + std::to_string(getpid()) + ".glb");
    std::ofstream(path, std::ios::binary) << *bytes;
    auto read = load_scene(path.string());
    std::filesystem::remove(path);
    EXPECT_TRUE(read) << (read ? "" : read.error().text());
    return read ? *read : nullptr;
}

// Vertices may be numbered anew: corner by corner.
void expect_same_triangles(const Mesh& a, const Mesh& b) {
    ASSERT_EQ(a.indices.size(), b.indices.size());
    for (std::size_t i = 0; i < a.indices.size(); ++i) {
        const Vertex &v = a.vertices[a.indices[i]], &w = b.vertices[b.indices[i]];
        ASSERT_EQ(v.position, w.position) << i;
        ASSERT_LT(glm::length(v.normal - w.normal), 1e-6f) << i;
        ASSERT_EQ(v.uv, w.uv) << i;
    }
    EXPECT_EQ(a.material, b.material);
}

void expect_same(const SceneAsset& a, const SceneAsset& b) {
    ASSERT_LE(a.materials.size(), b.materials.size());  // the importer's own default comes last
    for (std::size_t i = 0; i < a.materials.size(); ++i) {
        EXPECT_EQ(a.materials[i].base_color, b.materials[i].base_color) << i;
        EXPECT_LE(glm::length(a.materials[i].emissive_nit - b.materials[i].emissive_nit),
                  1e-6f * glm::length(a.materials[i].emissive_nit))
            << i;
        EXPECT_EQ(a.materials[i].double_sided, b.materials[i].double_sided);
        EXPECT_EQ(a.materials[i].alpha_mask, b.materials[i].alpha_mask);
    }
    ASSERT_EQ(a.meshes.size(), b.meshes.size());
    for (std::size_t i = 0; i < a.meshes.size(); ++i) expect_same_triangles(a.meshes[i], b.meshes[i]);
    ASSERT_EQ(a.instances.size(), b.instances.size());
    for (std::size_t i = 0; i < a.instances.size(); ++i) {
        EXPECT_EQ(a.instances[i].mesh, b.instances[i].mesh);
        EXPECT_EQ(a.instances[i].world_from_mesh, b.instances[i].world_from_mesh);
        EXPECT_EQ(a.instances[i].node, b.instances[i].node);
    }
    ASSERT_EQ(a.cameras.size(), b.cameras.size());
    for (std::size_t i = 0; i < a.cameras.size(); ++i) {
        EXPECT_LT(glm::length(a.cameras[i].eye - b.cameras[i].eye), 1e-12);
        EXPECT_DOUBLE_EQ(a.cameras[i].fov_rad, b.cameras[i].fov_rad);
        EXPECT_GT(glm::dot(glm::normalize(a.cameras[i].target - a.cameras[i].eye),
                           glm::normalize(b.cameras[i].target - b.cameras[i].eye)),
                  1 - 1e-12);
    }
    ASSERT_EQ(a.lights.size(), b.lights.size());
    for (std::size_t i = 0; i < a.lights.size(); ++i) {
        EXPECT_EQ(a.lights[i].name, b.lights[i].name);
        EXPECT_LT(glm::length(a.lights[i].position - b.lights[i].position), 1e-12);
        EXPECT_GT(std::abs(glm::dot(a.lights[i].world_from_light, b.lights[i].world_from_light)), 1 - 1e-12);
        EXPECT_EQ(a.lights[i].multiplier, b.lights[i].multiplier);
        EXPECT_EQ(a.lights[i].color, b.lights[i].color);
        const ies::PhotometricWeb &v = a.lights[i].profile->photometry.web, &w = b.lights[i].profile->photometry.web;
        EXPECT_EQ(v.candela, w.candela);
        EXPECT_EQ(v.v_rad.size(), w.v_rad.size());
        EXPECT_EQ(v.h_rad.size(), w.h_rad.size());
    }
    EXPECT_TRUE(b.warnings.empty()) << b.warnings.front();
}

TEST(WriteGlb, TheCornellSceneComesBackEqual) {
    const auto asset = make_cornell();
    const auto read = round_trip(*asset);
    ASSERT_TRUE(read);
    expect_same(*asset, *read);
    EXPECT_EQ(read->triangles(), asset->triangles());
}

TEST(WriteGlb, EmissionTurnsAndColoursComeBackEqual) {
    const Scene scene = scene_with(
        {{quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}), {0.2f, 0.4f, 0.6f}, {500.0f, 1000.0f, 3.0f}}},
        *builtin_profile("street"), {1, 2, 3}, orientation_of({0.5, 1.0, -2.0}), {10, 20, 30});
    SceneAsset asset = *scene.asset;
    asset.lights[0].multiplier = 0.5;
    asset.lights[0].color = {1.0, 0.5, 0.25};
    asset.cameras = {{{3, 4, 5}, {0, 1, 0}, 0.8}};
    asset.materials[0].double_sided = true;
    const auto read = round_trip(asset);
    ASSERT_TRUE(read);
    expect_same(asset, *read);
}

TEST(WriteGlb, TexturesAreRefused) {
    const auto refused = write_glb(*make_atrium());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "unsupported");
}

}  // namespace
}  // namespace gonio::test
