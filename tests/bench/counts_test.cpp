// What the report counts with, in pictures whose counts are known.
#include "tests/bench/counts.h"
#include "server/scene/apply.h"
#include "tests/bench/cases.h"
#include "tests/gl/test_context.h"

namespace gonio::bench {
namespace {

// A quad that fills the picture, two triangles, lit from in front of it.
TEST(Counts, OfAWallThatFillsThePicture) {
    Scene scene = test::scene_with({{test::quad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}), glm::vec3(0.5f)}},
                                   test::isotropic(100.0), {0, 0, 2});
    scene.camera = {{0, 0, 3}, {0, 0, 0}, 1.0};
    scene.width_px = scene.height_px = 128;
    const PictureCounts counts = count_picture("wall", scene);
    EXPECT_EQ(counts.triangles, 2u);
    EXPECT_EQ(counts.drawn, 2u);
    EXPECT_EQ(counts.pixels, 128u * 128u);
    EXPECT_EQ(counts.textured, 0u);
    // Both triangles are tested in every row, each about in its half, whole steps of sixteen.
    EXPECT_EQ(counts.rows, 2u * 128u);
    EXPECT_GE(counts.covered, counts.pixels);
    EXPECT_LE(counts.covered, 2u * counts.pixels);
    EXPECT_EQ(counts.blocks, 64u * 64u);
    EXPECT_EQ(counts.lit_blocks, counts.blocks);
    EXPECT_EQ(counts.points, 32u * 32u);
    EXPECT_EQ(counts.nodes, 8u * 8u);
    EXPECT_EQ(counts.second_points, 0u);
    EXPECT_EQ(counts.vpl_rays, 0u) << "VPLs on the wall itself cannot light it";
    EXPECT_TRUE(counts.web_even);
    EXPECT_FALSE(counts.emissive);
}

// More triangles are the same surfaces: the same picture takes more of them.
TEST(Counts, OfSplitTriangles) {
    const auto corridor = bench_asset("corridor"), split = split_triangles(*corridor, 2);
    EXPECT_EQ(split->triangles(), 16 * corridor->triangles());
    const auto area = [](const SceneAsset& asset) {
        double sum = 0.0;
        for (const Mesh& mesh : asset.meshes) {
            for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
                const glm::dvec3 a(mesh.vertices[mesh.indices[i]].position),
                    b(mesh.vertices[mesh.indices[i + 1]].position), c(mesh.vertices[mesh.indices[i + 2]].position);
                sum += 0.5 * glm::length(glm::cross(b - a, c - a));
            }
        }
        return sum;
    };
    EXPECT_NEAR(area(*split), area(*corridor), 1e-5 * area(*corridor));
    Scene before = scene_of(corridor), after = scene_of(split);
    before.width_px = before.height_px = after.width_px = after.height_px = 160;
    const PictureCounts few = count_picture("few", before), many = count_picture("many", after);
    EXPECT_GT(many.drawn, 4 * few.drawn);
    EXPECT_GT(many.rows, few.rows);
    EXPECT_EQ(many.points, few.points);
    EXPECT_NEAR(static_cast<double>(many.lit_blocks), static_cast<double>(few.lit_blocks), 0.01 * few.lit_blocks);
}

}  // namespace
}  // namespace gonio::bench
