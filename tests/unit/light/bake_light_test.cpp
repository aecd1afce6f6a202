// Baked light against what is known of closed scenes: all light of a bounce falls on surfaces, whatever their shape.
#include <cmath>
#include <numbers>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/unit/light/bake_fixture.h"

namespace gonio::test {
namespace {

// Of area-weighted means, at noise level.
constexpr double kMean = 0.003;

TEST(BakeLight, AClosedRoomHasTheFluxOverItsArea) {
    constexpr double area = 2.0 * (4.0 * 3.0 + 4.0 * 5.0 + 3.0 * 5.0), rho = 0.5;
    const auto profile = isotropic(100.0);
    const Scene scene = scene_with({{room({-2, 0, -2.5}, {2, 3, 2.5}), glm::vec3(rho)}}, profile, {0.4, 1.3, -0.6});
    bake::BakeSettings settings = small_bake(64, 128);
    settings.tolerance = 3e-4;
    const Baked baked = bake_scene(scene, settings);
    ASSERT_EQ(baked.maps.size(), 1u);
    EXPECT_NEAR(baked.layout.area_m2, area, 1e-4 * area);
    const double direct = profile->flux_lm / area;
    EXPECT_NEAR(baked.mean_direct(), direct, kMean * direct);
    ASSERT_GE(baked.maps[0].mean_bounces_lx.size(), 3u);
    for (std::size_t n = 0; n < 3; ++n) {
        const double expected = std::pow(rho, static_cast<double>(n + 1)) * direct;
        EXPECT_NEAR(baked.maps[0].mean_bounces_lx[n], expected, kMean * expected) << "bounce " << n + 1;
    }
    EXPECT_NEAR(baked.mean_all(), direct / (1.0 - rho), kMean * direct / (1.0 - rho));
}

// A white box without a lid in a dark hall: when the hall has no light left to reflect, the box still has most of it.
TEST(BakeLight, ACavityHasItsLastBouncesToo) {
    const double side = 0.6;
    Mesh open = room({0, 0, 0}, {side, side, side});
    open.indices.erase(open.indices.begin() + 6, open.indices.begin() + 12);
    const Scene scene = scene_with({{room({-6, -1, -6}, {6, 4, 6}), glm::vec3(0.1f)}, {open, glm::vec3(0.95f)}},
                                   isotropic(100.0), {0.3, 0.2, 0.3});
    const auto box_lx = [&](const Baked& baked, double& error_lx) {
        double light = 0.0, error = 0.0, area = 0.0;
        for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); ++i) {
            const bake::Texel& texel = baked.layout.atlas.texels[i];
            if (!texel.valid || texel.albedo.r < 0.5f) continue;
            const double own = static_cast<double>(texel.area_m2);
            light += own * static_cast<double>(baked.maps[0].direct[i] + baked.maps[0].indirect[3 * i + 1]);
            error += own * static_cast<double>(baked.maps[0].error[i]);
            area += own;
        }
        error_lx = error / area;
        return light / area;
    };
    bake::BakeSettings usual = small_bake(64, 64), whole = usual;
    whole.tolerance = 1e-6;
    double stated = 0.0, least = 0.0;
    const double right = box_lx(bake_scene(scene, whole), least), found = box_lx(bake_scene(scene, usual), stated);
    EXPECT_NEAR(found, right, 0.015 * right);
    EXPECT_LT(right - found, stated) << "what is missing is stated";
}

TEST(BakeLight, MeansWeighTexelsByArea) {
    // A room of thin and thick walls of texels: long, low, with a narrow slot of a chart's remainder.
    const auto profile = cosine_power(50.0, 1.0);
    const Scene scene = scene_with({{room({0, 0, 0}, {7.3, 1.1, 2.9}), glm::vec3(0.0f)}}, profile, {3, 1, 1.5});
    const Baked baked = bake_scene(scene, small_bake(96));
    const double area = 2.0 * (7.3 * 1.1 + 7.3 * 2.9 + 1.1 * 2.9);
    EXPECT_NEAR(baked.mean_direct(), profile->flux_lm / area, 0.01 * profile->flux_lm / area);
}

// Guide values of the cylinder of docs/lightmaps.md, by quadrature; a 96-gon has its own area.
double own_area() {
    const double n = kCylinderFacets, step = 2.0 * std::numbers::pi / n;
    return 2.0 * 8.0 * std::sin(0.5 * step) * n * 40.0 + n * 64.0 * std::sin(step);
}

TEST(BakeLight, TheCylinderWorldHasItsMeans) {
    const auto asset = make_cylinder();
    bake::BakeSettings settings = small_bake(128, 128);
    settings.tolerance = 0.0005;
    const Baked baked = bake_scene(scene_of(asset), settings);
    ASSERT_EQ(baked.maps.size(), 6u);
    double flux = 0.0, direct = 0.0, bounce = 0.0, all = 0.0;
    for (const LightSeed& light : asset->lights) flux += light.profile->flux_lm;
    EXPECT_NEAR(flux, 208288.0, 1e-4 * flux);
    EXPECT_NEAR(baked.layout.area_m2, own_area(), 1e-4 * own_area());
    for (std::size_t s = 0; s < 6; ++s)
        direct += baked.mean_direct(s), bounce += baked.maps[s].mean_bounces_lx.at(0), all += baked.mean_all(s);
    const double own = 2412.743 / own_area();
    EXPECT_NEAR(direct, 86.328 * own, kMean * 86.328);
    EXPECT_NEAR(bounce, 12.949 * own, kMean * 12.949);
    EXPECT_NEAR(all, 101.563 * own, kMean * 101.563);
}

struct Place {
    double azimuth_deg, radius_m, z_m;
    double direct_lx, bounce_lx;
};

TEST(BakeLight, TheCylinderWorldHasItsPoints) {
    bake::BakeSettings settings = small_bake(160, 256);
    settings.bounces = 1;
    const Baked baked = bake_scene(scene_of(make_cylinder()), settings);
    ASSERT_EQ(baked.maps.size(), 6u);
    constexpr Place kPlaces[] = {{60, 8, 0, 81.520, 13.50},   {60, 8, -10, 114.721, 13.52}, {10, 8, -10, 95.530, 13.60},
                                 {30, 8, 10, 110.966, 13.87}, {60, 8, 19, 52.016, 11.65},   {0, 0, -20, 110.34, 12.93},
                                 {60, 4, -20, 95.016, 12.47}};
    for (const Place& place : kPlaces) {
        const double azimuth = place.azimuth_deg * std::numbers::pi / 180.0;
        const glm::dvec3 at(place.radius_m * std::cos(azimuth), place.radius_m * std::sin(azimuth), place.z_m);
        // Means around the place: the nearer, the more. What bounced is smooth, and noisy.
        double direct = 0.0, bounce = 0.0, sharp = 0.0, soft = 0.0;
        int count = 0;
        for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); ++i) {
            const bake::Texel& texel = baked.layout.atlas.texels[i];
            const double distance = glm::distance(glm::dvec3(texel.position), at);
            const bool on_cap = std::abs(texel.normal.z) > 0.5f;
            if (distance > 1.2 || on_cap != (std::abs(place.z_m) == 20.0)) continue;
            const double near = std::exp(-12.0 * distance * distance), around = std::exp(-4.0 * distance * distance);
            for (const bake::SourceMaps& maps : baked.maps) {
                direct += near * static_cast<double>(maps.direct[i]);
                bounce += around * static_cast<double>(maps.indirect[3 * i]);
            }
            sharp += near, soft += around, ++count;
        }
        ASSERT_GT(count, 8);
        EXPECT_NEAR(direct / sharp, place.direct_lx, 0.01 * place.direct_lx) << place.azimuth_deg << " " << place.z_m;
        EXPECT_NEAR(bounce / soft, place.bounce_lx, 0.01 * place.bounce_lx) << place.azimuth_deg << " " << place.z_m;
    }
}

// Two maps at level 1 and the scene's: light is linear.
TEST(BakeLight, WeightsAreLevelAndColour) {
    Scene scene = scene_with({{room({-2, 0, -2}, {2, 3, 2}), glm::vec3(0.4f)}}, isotropic(80.0), {0, 2, 0});
    scene.lights[0].level_ratio = 0.25;
    scene.lights[0].color = {1.0, 0.5, 0.0};
    scene.master_ratio = 0.5;
    const Baked dimmed = bake_scene(scene, small_bake(48, 32));
    EXPECT_EQ(dimmed.sources[0].weight, glm::vec3(0.125f, 0.0625f, 0.0f));
    scene.lights[0].level_ratio = 1.0, scene.lights[0].color = glm::dvec3(1.0), scene.master_ratio = 1.0;
    const Baked full = bake_scene(scene, small_bake(48, 32));
    EXPECT_EQ(dimmed.maps[0].direct, full.maps[0].direct);
    EXPECT_EQ(dimmed.maps[0].indirect, full.maps[0].indirect);
    EXPECT_EQ(dimmed.sources[0].key, full.sources[0].key);
    scene.lights[0].position.x += 0.1;
    const auto moved = bake::sources_of(scene, *full.geometry, small_bake());
    EXPECT_NE((*moved)[0].key, full.sources[0].key);
}

// An emissive ceiling fills a closed room as a luminaire would: its flux is pi L A.
TEST(BakeLight, EmissiveSurfacesAreASource) {
    std::vector<Piece> pieces{{room({-2, 0, -2}, {2, 3, 2}), glm::vec3(0.5f)},
                              {quad({-1, 2.99, -1}, {1, 2.99, -1}, {1, 2.99, 1}, {-1, 2.99, 1}), glm::vec3(0.0f),
                               glm::vec3(100.0f, 50.0f, 0.0f)}};
    Scene scene = scene_with(std::move(pieces), isotropic(0.0), {0, 1, 0});
    const Baked baked = bake_scene(scene, small_bake(80, 256));
    ASSERT_EQ(baked.maps.size(), 1u);
    EXPECT_EQ(baked.sources[0].name, "emissive");
    double red = 0.0, green = 0.0, blue = 0.0, shown = 0.0;
    for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); ++i) {
        const double area = static_cast<double>(baked.layout.atlas.texels[i].area_m2);
        red += area * static_cast<double>(baked.maps[0].direct[3 * i]);
        green += area * static_cast<double>(baked.maps[0].direct[3 * i + 1]);
        blue += area * static_cast<double>(baked.maps[0].direct[3 * i + 2]);
        shown += area;
    }
    const double flux = std::numbers::pi * 100.0 * 4.0;
    EXPECT_NEAR(red, flux, 0.01 * flux);
    EXPECT_NEAR(green, 0.5 * flux, 0.01 * flux);
    EXPECT_EQ(blue, 0.0);
    EXPECT_NEAR(shown, 2.0 * 16.0 + 4.0 * 12.0 + 4.0, 0.01);
}

// The error that maps state is the one that they have, of another seed's difference within a factor of two.
TEST(BakeLight, TheStatedErrorIsTheErrorThereIs) {
    const Scene scene = scene_with({{room({-2, 0, -2}, {2, 3, 2}), glm::vec3(0.6f)}}, isotropic(80.0), {1.5, 2.5, 0});
    bake::BakeSettings settings = small_bake(48, 64);
    settings.bounces = 1;
    const Baked one = bake_scene(scene, settings);
    settings.seed = 2;
    const Baked other = bake_scene(scene, settings);
    double stated = 0.0, found = 0.0;
    for (std::size_t i = 0; i < one.layout.atlas.texels.size(); ++i) {
        stated += std::pow(static_cast<double>(one.maps[0].error[i]), 2);
        found += 0.5 * std::pow(static_cast<double>(one.maps[0].indirect[3 * i] - other.maps[0].indirect[3 * i]), 2);
    }
    EXPECT_GT(found, 0.0);
    EXPECT_LT(found, 4.0 * stated);
    EXPECT_GT(found, 0.25 * stated);
}

}  // namespace
}  // namespace gonio::test
