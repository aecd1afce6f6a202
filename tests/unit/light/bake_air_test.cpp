// Haze in baked maps against the airlight of a point (Sun et al. 2005; docs/lightmaps.md) and closed forms.
#include <cmath>
#include <numbers>

#include "server/bake/air.h"
#include "server/scene/scene.h"
#include "tests/unit/light/bake_fixture.h"

namespace gonio::test {
namespace {

// A point of `candela` at `height` over a small square, in a world that is far larger and otherwise empty.
Scene in_the_open(double candela, double height_m) {
    constexpr double s = 0.1, far = 40.0;
    const auto square = [&](const glm::dvec3& at) {
        return quad(at + glm::dvec3(-s, 0, s), at + glm::dvec3(s, 0, s), at + glm::dvec3(s, 0, -s),
                    at + glm::dvec3(-s, 0, -s));
    };
    return scene_with({{square({0, 0, 0}), glm::vec3(0.0f)},
                       {square({far, far, far}), glm::vec3(0.0f)},
                       {square({-far, -far, -far}), glm::vec3(0.0f)}},
                      isotropic(candela), {0, height_m, 0});
}

struct Airlight {
    double extinction, h, b, d, g, nit;  // 1/m, m; cd/m² of 1 cd
};

TEST(BakeAir, APointInHazeHasItsAirlight) {
    constexpr Airlight kRows[] = {
        {.05, 1, 5, 10, 0, 7.8561299e-3},  {.05, 1, 5, 100, 0, 8.0539093e-3}, {.05, 1, -2, 10, 0, 1.0948256e-3},
        {.02, 3, 10, 20, 0, 1.0191485e-3}, {.1, .5, 4, 8, 0, 2.8239394e-2},   {.01, 2, 6, 12, 0, 9.0951464e-4},
        {.2, .1, 5, 10, 0, 0.17253699},    {.05, 1, 5, 10, -.5, 8.47994e-3},  {.05, 1, 5, 10, .3, 8.67395e-3},
        {.05, 1, 5, 10, .6, 1.054945e-2},  {.05, 1, 5, 10, .8, 1.073930e-2},  {.05, 1, 5, 10, .9, 7.42808e-3}};
    const Scene scene = in_the_open(1.0, 2.0);
    const trace::Geometry geometry(scene.asset);
    const auto luminaires = trace::luminaires_of(scene, geometry);
    ASSERT_EQ(luminaires.size(), 1u);
    for (const Airlight& row : kRows) {
        bake::AirSettings air;
        air.haze = {{row.extinction, 1.0, row.g, 0.0}, -100.0};
        air.shadow_rays = true;
        air.steps = 256;
        // Along X, so that the point is `h` beside the ray and its foot `b` ahead.
        const glm::dvec3 from = luminaires[0].position - glm::dvec3(row.b, 0.0, row.h);
        std::uint64_t rays = 0;
        const double nit = bake::scattered_in(geometry, luminaires[0], {}, air, from, {1, 0, 0}, row.d, 0.5, rays);
        EXPECT_NEAR(nit, row.nit, 0.005 * row.nit) << row.extinction << " " << row.h << " " << row.g;
        EXPECT_GT(rays, 0u);
    }
}

// Thirty even steps fail where a ray passes a luminaire closely; equiangular ones do not (-27 % and +0.1 %).
TEST(BakeAir, EvenStepsMissWhatIsNear) {
    const Scene scene = in_the_open(1.0, 2.0);
    const trace::Geometry geometry(scene.asset);
    const auto luminaires = trace::luminaires_of(scene, geometry);
    bake::AirSettings air;
    air.haze = {{0.2, 1.0, 0.0, 0.0}, -100.0};
    air.shadow_rays = true;
    std::uint64_t rays = 0;
    const glm::dvec3 from = luminaires[0].position - glm::dvec3(5.0, 0.0, 0.1);
    const auto nit = [&] {
        return bake::scattered_in(geometry, luminaires[0], {}, air, from, {1, 0, 0}, 10.0, 0.5, rays);
    };
    EXPECT_NEAR(nit(), 0.17253699, 0.005 * 0.17253699);
    air.even = true;
    EXPECT_LT(nit(), 0.85 * 0.17253699);
}

// The same from the volume, which is smooth here.
TEST(BakeAir, TheVolumeHoldsWhatReachesTheAir) {
    const Scene scene = in_the_open(1.0, 2.0);
    const trace::Geometry geometry(scene.asset);
    const auto luminaires = trace::luminaires_of(scene, geometry);
    bake::AirSettings air;
    air.haze = {{0.05, 1.0, 0.0, 0.0}, -100.0};
    bake::Work work;
    const bake::AirVolume volume = bake::air_volume(geometry, luminaires[0], air, work);
    ASSERT_FALSE(volume.passed.empty());
    for (const double far : {8.0, 12.0, 20.0}) {
        const glm::dvec3 p = luminaires[0].position + glm::dvec3(far * 0.6, far * 0.64, far * 0.48);
        EXPECT_NEAR(volume.at(volume.passed, p).value_or(-1.0), std::exp(-0.05 * far), 0.02 * std::exp(-0.05 * far))
            << far;
        const double lx = std::exp(-0.05 * far) / (far * far);
        EXPECT_NEAR(volume.at(volume.lx, p).value_or(-1.0), lx, 0.03 * lx) << far;
    }
}

struct Onto {
    double extinction, d, direct, scattered;  // lx of 100 cd
};

// A plane that faces a point in an infinite medium gets its direct light through the haze, and what this scatters.
TEST(BakeAir, HazeSendsLightOntoSurfaces) {
    const auto expect = [](const Onto& row, bool air_rays) {
        Scene scene = in_the_open(100.0, row.d);
        scene.haze = {row.extinction, 1.0, 0.0, 0.0};
        bake::BakeSettings settings = small_bake(16, 16384);
        settings.bounces = 1;
        settings.air_rays = air_rays;
        settings.steps = 6;
        settings.atlas.texel_m = 0.1;
        const Baked baked = bake_scene(scene, settings);
        ASSERT_EQ(baked.maps.size(), 1u);
        double direct = 0.0, scattered = 0.0, count = 0.0;
        for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); ++i) {
            if (glm::length(glm::dvec3(baked.layout.atlas.texels[i].position) + baked.geometry->origin()) > 1.0)
                continue;
            direct += static_cast<double>(baked.maps[0].direct[i]);
            scattered += static_cast<double>(baked.maps[0].indirect[3 * i]);
            ++count;
        }
        ASSERT_GT(count, 0.0);
        EXPECT_NEAR(direct / count, row.direct, 0.005 * row.direct);
        EXPECT_NEAR(scattered / count, row.scattered, 0.025 * row.scattered) << row.extinction << " " << row.d;
    };
    for (const Onto& row : {Onto{.02, 3, 10.4641, 0.74558}, {.05, 3, 9.56342, 1.58128}, {.1, 5, 2.42612, 1.10733}})
        expect(row, true);
    expect({.05, 3, 9.56342, 1.58128}, false);  // the volume knows nothing above the plane
}

// Nothing is lost but what scatters twice: the walls of a closed black room get less than the flux, and more than the
// direct light.
TEST(BakeAir, AClosedRoomLosesWhatScattersTwice) {
    constexpr double area = 6.0 * 16.0;
    const auto profile = isotropic(100.0);
    Scene scene = scene_with({{room({-2, 0, -2}, {2, 4, 2}), glm::vec3(0.0f)}}, profile, {0, 2, 0});
    scene.haze = {0.05, 1.0, 0.5, 0.0};
    bake::BakeSettings settings = small_bake(32, 64);
    settings.steps = 8;
    settings.bounces = 1;
    const Baked baked = bake_scene(scene, settings);
    const double all = profile->flux_lm / area, direct = baked.mean_direct(), once = baked.mean_all();
    EXPECT_LT(direct, 0.93 * all);
    EXPECT_GT(once, 0.97 * all);
    EXPECT_LT(once, 1.001 * all);
    settings.air_rays = true;  // the volume's light is that of exact rays
    EXPECT_NEAR(bake_scene(scene, settings).mean_all(), once, 0.01 * all);
}

}  // namespace
}  // namespace gonio::test
