// What baked maps are known to get wrong elsewhere: light through walls, after filtering too.
#include <algorithm>
#include <cmath>
#include <functional>

#include "server/bake/seams.h"
#include "server/bake/validity.h"
#include "server/scene/scene.h"
#include "tests/unit/light/bake_fixture.h"

namespace gonio::test {
namespace {

constexpr double kTexel_m = 0.2, kWall_m = 0.1;

struct Greatest {
    double nearest = 0.0, bilinear = 0.0;
    int points = 0;
};

// What a map shows at points of its surfaces, edges included: the greatest where `counts` says so.
Greatest greatest(const Baked& baked, const std::vector<float>& picture, int channels,
                  const std::function<bool(const glm::dvec3& position, const glm::dvec3& normal)>& counts) {
    const bake::Atlas& atlas = baked.layout.atlas;
    Greatest result;
    constexpr int kSteps = 48;
    for (const bake::PlacedSide& placed : atlas.sides) {
        const auto corner = bake::corners_of(*baked.geometry, placed.side);
        const glm::dvec3 normal = glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
        for (int i = 0; i <= kSteps; ++i) {
            for (int j = 0; i + j <= kSteps; ++j) {
                const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
                const glm::dvec2 at = placed.corner[0] + u * (placed.corner[1] - placed.corner[0]) +
                                      v * (placed.corner[2] - placed.corner[0]);
                if (!placed.pieces.empty() &&
                    std::none_of(placed.pieces.begin(), placed.pieces.end(),
                                 [&](const bake::Polygon& p) { return bake::contains(p, at, 1e-9); }))
                    continue;
                const glm::dvec3 position =
                    corner[0] + u * (corner[1] - corner[0]) + v * (corner[2] - corner[0]) + baked.geometry->origin();
                if (!counts(position, normal)) continue;
                ++result.points;
                const auto x = static_cast<std::size_t>(std::clamp(static_cast<int>(at.x), 0, atlas.width - 1)),
                           y = static_cast<std::size_t>(std::clamp(static_cast<int>(at.y), 0, atlas.height - 1));
                for (int c = 0; c < channels; ++c) {
                    const auto n = static_cast<std::size_t>(channels);
                    result.nearest =
                        std::max(result.nearest,
                                 static_cast<double>(picture[(y * static_cast<std::size_t>(atlas.width) + x) * n +
                                                             static_cast<std::size_t>(c)]));
                    result.bilinear = std::max(
                        result.bilinear,
                        static_cast<double>(bake::bilinear(picture, atlas.width, atlas.height, channels, c, at)));
                }
            }
        }
    }
    return result;
}

// Maps as files have them: filled and levelled.
std::vector<float> finished(const Baked& baked, const std::vector<float>& values, int channels) {
    std::vector<float> picture = bake::picture_of(baked.layout.atlas, baked.layout.fill, values, channels);
    bake::level_seams(baked.layout.atlas, baked.layout.fill, picture, channels);
    return picture;
}

void expect_dark(const Baked& baked, const char* what,
                 const std::function<bool(const glm::dvec3&, const glm::dvec3&)>& dark, bool all_bounces = true) {
    ASSERT_EQ(baked.maps.size(), 1u) << what;
    const std::vector<float> direct = finished(baked, baked.maps[0].direct, 1);
    const Greatest first = greatest(baked, direct, 1, dark);
    EXPECT_GT(first.points, 500) << what;
    EXPECT_EQ(first.nearest, 0.0) << what;
    EXPECT_EQ(first.bilinear, 0.0) << what;
    const Greatest lit =
        greatest(baked, direct, 1, [&](const glm::dvec3& p, const glm::dvec3& n) { return !dark(p, n); });
    EXPECT_GT(lit.bilinear, 1.0) << what;
    if (!all_bounces) return;
    const Greatest rest = greatest(baked, finished(baked, baked.maps[0].indirect, 3), 3, dark);
    EXPECT_EQ(rest.nearest, 0.0) << what;
    EXPECT_EQ(rest.bilinear, 0.0) << what;
}

bake::BakeSettings coarse() {
    bake::BakeSettings settings = small_bake(256, 64);
    settings.atlas.texel_m = kTexel_m;
    settings.bounces = 3;
    return settings;
}

bool in_second_room(const glm::dvec3& p, const glm::dvec3& normal) {
    return p.x > 0.5 * kWall_m + 1e-4 || (p.x > 0.5 * kWall_m - 1e-4 && normal.x > 0.5);
}

// Godot #117468 (closed corners leak through bilinear filtering), #98685 (boxes whose edges are no texels' edges):
// rooms of odd measures, each modelled from within, a tenth of a metre apart.
TEST(BakeLeak, ARoomBesideALitOneIsDark) {
    for (const double far : {3.0, 2.93, 2.77}) {
        Mesh both = room({-far, 0, -1.37}, {-0.5 * kWall_m, 2.51, 1.61});
        add_room(both, {0.5 * kWall_m, 0, -1.37}, {far, 2.51, 1.61});
        const Scene scene = scene_with({{std::move(both), glm::vec3(0.8f)}}, isotropic(100.0), {-0.4, 1.2, 0.3});
        expect_dark(bake_scene(scene, coarse()), "rooms apart", in_second_room);
    }
}

// In haze too: what the volume of air has on both sides of a wall must not be mixed.
TEST(BakeLeak, HazeDoesNotShineThroughAWall) {
    Mesh both = room({-2.93, 0, -1.37}, {-0.5 * kWall_m, 2.51, 1.61});
    add_room(both, {0.5 * kWall_m, 0, -1.37}, {2.93, 2.51, 1.61});
    Scene scene = scene_with({{std::move(both), glm::vec3(0.8f)}}, isotropic(100.0), {-0.4, 1.2, 0.3});
    scene.haze = {.extinction_per_m = 0.1, .g = 0.7};
    expect_dark(bake_scene(scene, coarse()), "rooms apart, in fog", in_second_room);
}

// One floor, one ceiling, one shell: a wall that is half a texel thick stands in it, wherever the texels' edges lie.
// Texels in the wall are filled from their own side alone (Godot #87815: light from occluded texels was carried on).
TEST(BakeLeak, AWallOnACommonFloorKeepsTheLight) {
    for (const double left : {-3.0, -2.95, -2.9, -2.87, -2.84, -2.8}) {
        std::vector<Piece> pieces{
            {room({left, 0, -1.4}, {3, 2.4, 1.6}), glm::vec3(0.8f)},
            {block({-0.5 * kWall_m, -0.01, -1.41}, {0.5 * kWall_m, 2.41, 1.61}), glm::vec3(0.7f)}};
        const Scene scene = scene_with(std::move(pieces), isotropic(100.0), {-0.4, 1.2, 0.3});
        expect_dark(bake_scene(scene, coarse()), "a wall on a floor", in_second_room);
    }
}

// A wall that one can walk round: the shadow right behind it is as dark as the truth, direct light alone.
TEST(BakeLeak, TheFootOfAFreeWallIsDarkBehind) {
    std::vector<Piece> pieces{{room({-3, 0, -3}, {3.1, 2.4, 3}), glm::vec3(0.8f)},
                              {block({-0.5 * kWall_m, -0.01, -1.5}, {0.5 * kWall_m, 2.41, 1.5}), glm::vec3(0.7f)}};
    bake::BakeSettings settings = coarse();
    settings.bounces = 0;
    const Scene scene = scene_with(std::move(pieces), isotropic(100.0), {-1.0, 1.2, 0.0});
    expect_dark(
        bake_scene(scene, settings), "a free wall",
        [](const glm::dvec3& p, const glm::dvec3& normal) {
            return in_second_room(p, normal) && p.x < 1.5 && std::abs(p.z) < 1.0;
        },
        false);
}

// Godot #51638: the first bounce met backs and took them for lit fronts. A thin solid between two rooms, whose inner
// sides are lit by nobody; texels below it lie in it.
TEST(BakeLeak, TexelsInsideSolidsAreInvalid) {
    std::vector<Piece> pieces{{quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), glm::vec3(0.5f)},
                              {block({-0.5, -0.05, -0.5}, {0.5, 1.0, 0.5}), glm::vec3(0.5f)}};
    const Scene scene = scene_with(std::move(pieces), isotropic(100.0), {1.5, 2.0, 0.0});
    bake::BakeSettings settings = coarse();
    settings.atlas.texel_m = 0.1;
    const Baked baked = bake_scene(scene, settings);
    int below = 0, beside = 0;
    for (const bake::Texel& texel : baked.layout.atlas.texels) {
        const glm::dvec3 p = glm::dvec3(texel.position) + baked.geometry->origin();
        if (std::abs(p.y) > 1e-3 || texel.normal.y < 0.5f) continue;
        const double out = std::max(std::abs(p.x), std::abs(p.z));
        if (out < 0.49) ++below;
        if (out > 0.51) ++beside;
        if (out < 0.49 || out > 0.51) {
            EXPECT_EQ(texel.valid, out > 0.51) << p.x << " " << p.z;
        }
    }
    EXPECT_GT(below, 60);
    EXPECT_GT(beside, 1000);
    // They are filled: the floor has no dark rim around the block on its lit side.
    const std::vector<float> picture = finished(baked, baked.maps[0].direct, 1);
    double least = 1e9;
    for (const bake::Texel& texel : baked.layout.atlas.texels) {
        const glm::dvec3 p = glm::dvec3(texel.position) + baked.geometry->origin();
        if (std::abs(p.y) < 1e-3 && texel.normal.y > 0.5f && p.x > 0.35 && p.x < 0.6 && std::abs(p.z) < 0.3)
            least = std::min(least, static_cast<double>(picture[static_cast<std::size_t>(texel.pixel)]));
    }
    EXPECT_GT(least, 5.0);
}

// A box without its bottom is a solid; a room that is modelled from within, and a double-sided box, are none.
TEST(BakeLeak, SolidsAreClosedAndTurnedOutwards) {
    const glm::dvec3 low(-1), high(1);
    Mesh open = block(low, high);
    open.indices.erase(open.indices.begin(), open.indices.begin() + 6);
    Mesh torn = block(low, high);
    torn.indices.erase(torn.indices.begin(), torn.indices.begin() + 3);
    torn.indices.erase(torn.indices.end() - 3, torn.indices.end());
    Scene scene = scene_with({{block(low, high)},
                              {std::move(open)},
                              {room(low, high)},
                              {std::move(torn)},
                              {quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1})},
                              {block(low, high)}},
                             isotropic(1.0), {0, 5, 0});
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    asset->materials.back().double_sided = true;
    const trace::Geometry geometry(asset);
    EXPECT_EQ(bake::solids_of(geometry), (std::vector<char>{1, 1, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace gonio::test
