// Charts, packing, texels, filling, seams: how surfaces come into an atlas.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"
#include "server/bake/packer.h"
#include "server/bake/seams.h"
#include "server/scene/scene.h"
#include "tests/unit/light/bake_fixture.h"

namespace gonio::test {
namespace {

double total_area(const trace::Geometry& geometry) {
    double sum = 0.0;
    for (std::size_t i = 0; i < geometry.asset().instances.size(); ++i) {
        const Mesh& mesh = geometry.asset().meshes[static_cast<std::size_t>(geometry.asset().instances[i].mesh)];
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const auto c = bake::corners_of(geometry, {static_cast<int>(i), static_cast<int>(t), false});
            sum += 0.5 * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
        }
    }
    return sum;
}

bake::AtlasSettings of_side(int side) {
    bake::AtlasSettings settings;
    settings.width = settings.height = side;
    return settings;
}

TEST(BakeAtlas, ChartsHoldEverySideOnceAndAreNearlyFlat) {
    for (const auto& asset : {make_cornell(), make_cylinder()}) {
        const trace::Geometry geometry(asset);
        const std::vector<bake::Chart> charts = bake::grow_charts(geometry);
        std::set<std::tuple<int, int, bool>> seen;
        std::size_t sides = 0;
        for (const bake::Chart& chart : charts) {
            const glm::dvec3 normal = glm::cross(chart.across, chart.up);
            for (const bake::Side& side : chart.sides) {
                ++sides;
                EXPECT_TRUE(seen.emplace(side.instance, side.triangle, side.back).second);
                const auto c = bake::corners_of(geometry, side);
                const glm::dvec3 own = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
                EXPECT_GT(glm::dot(own, normal), std::cos(bake::kChartAngle_rad) - 1e-6);
            }
        }
        EXPECT_EQ(sides, asset->triangles());
        EXPECT_LT(charts.size(), asset->triangles() / 3) << asset->name;
    }
}

// A ramp that winds round thrice lies over itself in any plane, though neighbours are nearly parallel.
TEST(BakeAtlas, ASpiralIsNotOneChart) {
    Mesh ramp;
    add_surface(
        ramp,
        [](double u, double v) {
            const double turn = 6.0 * std::numbers::pi * u, r = 2.0 + v;
            return glm::dvec3(r * std::cos(turn), 0.6 * 3.0 * u, -r * std::sin(turn));
        },
        90, 2, false, false);
    const Scene scene = scene_with({{std::move(ramp)}}, isotropic(1.0), {0, 5, 0});
    const trace::Geometry geometry(scene.asset);
    const std::vector<bake::Chart> charts = bake::grow_charts(geometry, 0.3);
    EXPECT_GE(charts.size(), 3u);
    EXPECT_LE(charts.size(), 12u);
    const auto atlas = bake::make_atlas(geometry, of_side(128));
    ASSERT_TRUE(atlas);
    double area = 0.0;
    for (const bake::Texel& texel : atlas->texels) area += static_cast<double>(texel.area_m2);
    EXPECT_NEAR(area, total_area(geometry), 1e-4 * area);
}

// No two rectangles share a texel; all lie inside.
TEST(BakeAtlas, RectanglesArePackedApart) {
    std::vector<glm::ivec2> sizes;
    std::uint32_t state = 7;
    for (int i = 0; i < 300; ++i) {
        state = state * 1664525u + 1013904223u;
        sizes.emplace_back(1 + static_cast<int>(state >> 8) % 23, 1 + static_cast<int>(state >> 16) % 17);
    }
    const auto places = bake::pack(sizes, {256, 256});
    ASSERT_TRUE(places);
    std::vector<int> used(256 * 256, 0);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        for (int y = 0; y < sizes[i].y; ++y) {
            for (int x = 0; x < sizes[i].x; ++x) {
                const glm::ivec2 p = (*places)[i] + glm::ivec2(x, y);
                ASSERT_TRUE(p.x >= 0 && p.y >= 0 && p.x < 256 && p.y < 256);
                EXPECT_EQ(used[static_cast<std::size_t>(p.y * 256 + p.x)]++, 0);
            }
        }
    }
    EXPECT_FALSE(bake::pack(sizes, {64, 64}));
    EXPECT_FALSE(bake::pack(std::vector<glm::ivec2>{{300, 1}}, {256, 256}));
}

// Godot #94236: packing with gutters never ended where the atlas was too small.
TEST(BakeAtlas, AnAtlasThatIsTooSmallIsAnError) {
    const trace::Geometry geometry(make_cornell());
    for (const double texel_m : {0.0, 0.05}) {
        bake::AtlasSettings settings = of_side(32);
        settings.texel_m = texel_m;
        const auto atlas = bake::make_atlas(geometry, settings);
        ASSERT_FALSE(atlas);
        EXPECT_EQ(atlas.error().code, "too_small");
        EXPECT_EQ(atlas.error().where, "bake.size");
        EXPECT_EQ(atlas.error().value, "32x32");
    }
    for (const int side : {0, 15, 8193}) {
        const auto atlas = bake::make_atlas(geometry, of_side(side));
        ASSERT_FALSE(atlas);
        EXPECT_EQ(atlas.error().code, "invalid_argument");
    }
}

TEST(BakeAtlas, TexelsHoldAllAreaAndLieOnTheirTriangles) {
    const auto asset = make_cornell();
    const trace::Geometry geometry(asset);
    const auto atlas = bake::make_atlas(geometry, of_side(512));
    ASSERT_TRUE(atlas) << atlas.error().text();
    double area = 0.0;
    std::set<int> pixels;
    for (std::size_t i = 0; i < atlas->texels.size(); ++i) {
        const bake::Texel& texel = atlas->texels[i];
        area += static_cast<double>(texel.area_m2);
        EXPECT_TRUE(pixels.insert(texel.pixel).second);
        EXPECT_EQ(atlas->texel_at[static_cast<std::size_t>(texel.pixel)], static_cast<int>(i));
        EXPECT_NEAR(glm::length(texel.normal), 1.0f, 1e-5f);
    }
    EXPECT_NEAR(area, total_area(geometry), 2e-4 * area);
    // The way back: a triangle's points lead to a texel near them.
    const double texel_m = 1.0 / atlas->texels_per_m;
    int asked = 0;
    for (std::size_t i = 0; i < asset->instances.size(); ++i) {
        const auto triangles =
            static_cast<int>(asset->meshes[static_cast<std::size_t>(asset->instances[i].mesh)].indices.size() / 3);
        for (int t = 0; t < triangles; t += 37) {
            const auto corner = geometry.corners(static_cast<int>(i), t);
            for (const glm::vec2 w : {glm::vec2(0.2f, 0.3f), {0.0f, 0.0f}, {0.5f, 0.5f}}) {
                const int texel = atlas->texel_of(static_cast<int>(i), t, false, w.x, w.y);
                ASSERT_GE(texel, 0) << i << " " << t;
                const glm::vec3 p = (1.0f - w.x - w.y) * corner[0] + w.x * corner[1] + w.y * corner[2];
                EXPECT_LT(
                    static_cast<double>(glm::distance(p, atlas->texels[static_cast<std::size_t>(texel)].position)),
                    2.2 * texel_m);
                ++asked;
            }
        }
    }
    EXPECT_GT(asked, 1000);
}

// A right triangle over 2 × 2 squares: areas and centroids by hand.
TEST(BakeAtlas, SquaresAreClippedExactly) {
    bake::Sheet sheet;
    sheet.size = {2, 2};
    sheet.sides = {{0, 0, false}};
    sheet.flat = {{glm::dvec2(0, 0), glm::dvec2(2, 0), glm::dvec2(0, 2)}};
    sheet.m2_per_texel = {3.0};
    sheet.pieces = {{0, {{0, 0}, {2, 0}, {0, 2}}}};
    const std::vector<bake::Covered> covered = bake::cover(sheet);
    ASSERT_EQ(covered.size(), 3u);
    EXPECT_NEAR(covered[0].area_m2, 3.0, 1e-12);
    EXPECT_NEAR(covered[1].area_m2, 1.5, 1e-12);
    EXPECT_NEAR(covered[2].area_m2, 1.5, 1e-12);
    EXPECT_NEAR(covered[0].point.x, 0.5, 1e-12);
    EXPECT_NEAR(covered[1].point.x, 4.0 / 3.0, 1e-12);
    EXPECT_NEAR(covered[1].point.y, 1.0 / 3.0, 1e-12);
    EXPECT_NEAR(static_cast<double>(covered[1].u), 2.0 / 3.0, 1e-6);
    EXPECT_NEAR(static_cast<double>(covered[1].v), 1.0 / 6.0, 1e-6);
}

// Godot #100397: dilation copied from the wrong side. Two sheets of different values, gutters between them.
TEST(BakeAtlas, GuttersTakeTheirOwnSheet) {
    const Scene scene = scene_with({{room({0, 0, 0}, {2, 2, 2})}}, isotropic(1.0), {1, 1, 1});
    const trace::Geometry geometry(scene.asset);
    const auto atlas = bake::make_atlas(geometry, of_side(64));
    ASSERT_TRUE(atlas);
    const bake::FillPlan plan = bake::plan_fill(*atlas);
    std::vector<float> values;
    for (const bake::Texel& texel : atlas->texels) values.push_back(static_cast<float>(1 + texel.sheet));
    const std::vector<float> picture = bake::picture_of(*atlas, plan, values, 1);
    int gutters = 0;
    for (std::size_t p = 0; p < picture.size(); ++p) {
        const std::int32_t sheet = plan.sheet_at[p];
        EXPECT_EQ(picture[p], static_cast<float>(1 + sheet)) << p;
        gutters += sheet >= 0 && atlas->texel_at[p] < 0 ? 1 : 0;
    }
    // Six squares with two rings each.
    const double side = std::sqrt(static_cast<double>(atlas->texels.size()) / 6.0);
    EXPECT_NEAR(gutters, 6.0 * (8.0 * side + 16.0), 1e-6);
}

// Godot #90929: texels too coarse and noise looked like seams. A smooth cylinder in several charts reads the same on
// both sides of its edges once it is levelled; hard edges keep their step.
TEST(BakeAtlas, SmoothEdgesAreLevelledAndHardOnesKept) {
    const trace::Geometry geometry(make_cylinder());
    const auto atlas = bake::make_atlas(geometry, of_side(96));
    ASSERT_TRUE(atlas);
    ASSERT_FALSE(atlas->seams.empty());
    const bake::FillPlan plan = bake::plan_fill(*atlas);
    std::vector<float> values;
    for (const bake::Texel& texel : atlas->texels)
        values.push_back(50.0f + 5.0f * std::sin(3.0f * std::atan2(texel.position.y, texel.position.x)) +
                         static_cast<float>(texel.pixel * 2654435761u % 1000u) * 2e-3f);
    std::vector<float> picture = bake::picture_of(*atlas, plan, values, 1);
    const std::vector<float> before = picture;
    const double step = bake::seam_difference(*atlas, picture, 1);
    bake::level_seams(*atlas, plan, picture, 1);
    EXPECT_LT(bake::seam_difference(*atlas, picture, 1), 0.15 * step);
    double change = 0.0;
    for (std::size_t i = 0; i < picture.size(); ++i)
        change = std::max(change, static_cast<double>(std::abs(picture[i] - before[i])));
    EXPECT_LT(change, 6.0);

    const Scene box = scene_with({{room({0, 0, 0}, {2, 2, 2})}}, isotropic(1.0), {1, 1, 1});
    const trace::Geometry hard(box.asset);
    const auto sharp = bake::make_atlas(hard, of_side(64));
    ASSERT_TRUE(sharp);
    EXPECT_TRUE(sharp->seams.empty());
}

// A quad of second texture coordinates: `squares` of it side by side, in one mesh.
Scene with_second_uv(const std::vector<glm::vec4>& rectangles) {
    Mesh mesh;
    for (std::size_t i = 0; i < rectangles.size(); ++i) {
        const double x = 1.5 * static_cast<double>(i);
        add_quad(mesh, {x, 0, 1}, {x + 1, 0, 1}, {x + 1, 0, 0}, {x, 0, 0});
        const glm::vec4& r = rectangles[i];
        for (const glm::vec2 uv : {glm::vec2(r.x, r.y), {r.z, r.y}, {r.z, r.w}, {r.x, r.w}})
            mesh.second_uv.push_back(uv);
    }
    return scene_with({{std::move(mesh), glm::vec3(0.5f)}}, isotropic(100.0), {0.5, 1, 0.5});
}

TEST(BakeAtlas, TheFilesOwnCoordinatesAreTaken) {
    const Scene scene = with_second_uv({{0.05f, 0.05f, 0.45f, 0.45f}, {0.95f, 0.55f, 0.55f, 0.95f}});  // one mirrored
    bake::BakeSettings settings = small_bake(64);
    settings.atlas.second_uv = true;
    const Baked baked = bake_scene(scene, settings);
    ASSERT_EQ(baked.maps.size(), 1u);
    EXPECT_NEAR(baked.layout.area_m2, 2.0, 1e-3);
    // 100 cd, one metre above the first square's middle, which is the atlas's quarter's.
    const int texel = baked.layout.atlas.texel_at[16 * 64 + 16];
    ASSERT_GE(texel, 0);
    EXPECT_NEAR(static_cast<double>(baked.maps[0].direct[static_cast<std::size_t>(texel)]), 100.0, 0.5);
    const int mirrored = baked.layout.atlas.texel_at[48 * 64 + 60];  // u 0.95 is x = 1.5
    ASSERT_GE(mirrored, 0);
    EXPECT_NEAR(static_cast<double>(baked.layout.atlas.texels[static_cast<std::size_t>(mirrored)].position.x) +
                    baked.geometry->origin().x,
                1.5, 0.05);
}

TEST(BakeAtlas, OverlappingCoordinatesAreRefusedWithTheirTriangles) {
    bake::AtlasSettings settings = of_side(64);
    settings.second_uv = true;
    const auto refused = [&](const Scene& scene) {
        const auto atlas = bake::make_atlas(trace::Geometry(scene.asset), settings);
        return atlas ? Error{} : atlas.error();
    };
    const Error over = refused(with_second_uv({{0.0f, 0.0f, 0.5f, 0.5f}, {0.4f, 0.4f, 0.9f, 0.9f}}));
    EXPECT_EQ(over.code, "overlapping_uv");
    EXPECT_NE(over.value.find("triangle 0 of instance 0"), std::string::npos) << over.value;
    EXPECT_NE(over.value.find("triangle 2 of instance 0"), std::string::npos) << over.value;
    EXPECT_EQ(refused(with_second_uv({{0.5f, 0.5f, 1.5f, 0.9f}})).code, "overlapping_uv");
    EXPECT_EQ(refused(with_second_uv({{0.5f, 0.5f, 0.5f, 0.9f}})).code, "overlapping_uv");
    EXPECT_EQ(refused(floor_scene(1.0, 0.5f, isotropic(1.0), {0, 1, 0})).code, "no_second_uv");
    EXPECT_EQ(refused(with_second_uv({{0.0f, 0.0f, 0.5f, 0.5f}, {0.5f, 0.0f, 1.0f, 0.5f}})).code, "");
}

// The backs of double-sided surfaces have a chart of their own.
TEST(BakeAtlas, DoubleSidedSurfacesHaveTwoCharts) {
    Scene scene = floor_scene(2.0, 0.5f, isotropic(100.0), {0, -1, 0});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    asset->materials[0].double_sided = true;
    scene.asset = asset;
    const Baked baked = bake_scene(scene, small_bake(32));
    ASSERT_EQ(baked.maps.size(), 1u);
    EXPECT_NEAR(baked.layout.area_m2, 8.0, 1e-3);
    double below = 0.0, above = 0.0;
    for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); ++i) {
        const bool up = baked.layout.atlas.texels[i].normal.y > 0.0f;
        double& greatest = up ? above : below;
        greatest = std::max(greatest, static_cast<double>(baked.maps[0].direct[i]));
    }
    EXPECT_NEAR(below, 100.0, 3.0);
    EXPECT_EQ(above, 0.0);
}

TEST(BakeAtlas, NamesAreSafeForFiles) {
    const std::vector<std::string> names =
        bake::file_names({"Key light", "key_light", "../etc", "", std::string(200, 'x'), std::string(200, 'x'), "ä"});
    EXPECT_EQ(names[0], "Key_light");
    EXPECT_EQ(names[1], "key_light-2");
    EXPECT_EQ(names[2], "___etc");
    EXPECT_EQ(names[3], "light");
    EXPECT_EQ(names[4], std::string(64, 'x'));
    EXPECT_EQ(names[5], std::string(62, 'x') + "-2");
    EXPECT_EQ(names[6], "__");
}

}  // namespace
}  // namespace gonio::test
