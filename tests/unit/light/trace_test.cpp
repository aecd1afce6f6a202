// The reference against closed forms, and its own promises: reproducible, stoppable, honest about its error.
#include "server/trace/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/trace/embree_isa.h"
#include "server/trace/geometry.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {
namespace {

using trace::MeterPoint;
using trace::Settings;

double lux(const glm::dvec3& rgb) {
    return 0.2126 * rgb.r + 0.7152 * rgb.g + 0.0722 * rgb.b;
}

// Inside a diffuse sphere the n-th bounce is rho^n · flux / (4 pi R²) everywhere, wherever the luminaire stands.
TEST(Trace, IntegratingSphereBounceByBounce) {
    constexpr double radius = 2.0, rho = 0.5;
    struct Case {
        std::shared_ptr<const Profile> profile;
        glm::dvec3 light;
        PanTiltRoll turn;
    };
    const Case cases[] = {{isotropic(1000.0), {0, 0, 0}, {}},
                          {cosine_power(1000.0, 2.0), {0.5, 0.3, 0.4}, {0.3, 0.8, 0.0}},
                          {cosine_power(1000.0, 30.0), {-0.9, 0.6, 0.2}, {1.0, 2.0, 0.5}},
                          {as_point(*builtin_profile("wall_washer")), {0.2, -1.0, 0.7}, {-2.0, 1.2, 0.7}}};
    const glm::dvec3 d = glm::normalize(glm::dvec3(0.3, -0.7, 0.5));
    const MeterPoint points[] = {{d * radius * 0.9999, -d}, {-d * radius * 0.9999, d}};
    for (const Case& c : cases) {
        const Scene scene =
            scene_with({{inward_sphere(radius, 256), glm::vec3(rho)}}, c.profile, c.light, orientation_of(c.turn));
        const auto world = trace::make_world(scene);
        const double first = rho * c.profile->flux_lm / (4 * std::numbers::pi * radius * radius);
        for (const int bounces : {1, 3, trace::kAllBounces}) {
            const double expected = bounces == 1   ? first
                                    : bounces == 3 ? first * (1 + rho + rho * rho)
                                                   : first / (1 - rho);
            Settings settings;
            settings.bounces = bounces;
            settings.noise = 0.002;
            for (const trace::Reading& reading : trace::measure(*world, points, settings)) {
                // The noise asked for is of the total: where direct light prevails the indirect part is left less
                // exact.
                EXPECT_NEAR(lux(reading.indirect_lx), expected, 0.003 * expected + 4 * reading.indirect_error_lx)
                    << c.profile->name << " " << bounces;
                EXPECT_LT(reading.indirect_error_lx, 0.01 * expected);
            }
        }
    }
}

// White furnace: a closed room of emission eps and reflectance rho has luminance eps / (1 - rho), so E = pi eps / (1 -
// rho).
TEST(Trace, WhiteFurnace) {
    for (const double rho : {0.2, 0.8}) {
        Piece piece{inward_sphere(1.0, 64), glm::vec3(static_cast<float>(rho)), glm::vec3(100.0f)};
        Scene scene = scene_with({piece}, isotropic(1.0), {0, 0, 0});
        scene.lights[0].level_ratio = 0.0;
        const MeterPoint points[] = {{{0.2, -0.5, 0.1}, glm::normalize(glm::dvec3(1, 2, 3))}};
        Settings settings;
        settings.noise = 0.0015;
        const trace::Reading reading = trace::measure(*trace::make_world(scene), points, settings).front();
        EXPECT_NEAR(lux(reading.direct_lx), std::numbers::pi * 100.0, 0.004 * std::numbers::pi * 100.0);
        const double all = std::numbers::pi * 100.0 / (1.0 - rho);
        EXPECT_NEAR(lux(reading.direct_lx + reading.indirect_lx), all, 0.004 * all) << rho;
    }
}

// A ring of light a tenth of a degree wide, off the axis and between whole degrees: nothing is too narrow to be met,
// and all of its flux comes back as one bounce in a sphere.
TEST(Trace, ANarrowRingIsMet) {
    auto profile = std::make_shared<Profile>();
    profile->name = "ring";
    ies::PhotometricWeb& web = profile->photometry.web;
    for (const double v_deg : {0.0, 30.02, 30.12, 30.22, 90.0}) web.v_rad.push_back(v_deg * std::numbers::pi / 180);
    web.h_rad = {0.0, 2 * std::numbers::pi};
    for (int h = 0; h < 2; ++h) web.candela.insert(web.candela.end(), {0, 0, 1e5f, 0, 0});
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    const Scene scene = scene_with({{inward_sphere(2.0, 128), glm::vec3(0.5f)}}, profile, {0, 0, 0});
    const glm::dvec3 d = glm::normalize(glm::dvec3(1, 0.2, 0.1));
    const double angle = 30.12 * std::numbers::pi / 180;
    const glm::dvec3 lit(std::sin(angle), -std::cos(angle), 0.0);
    const MeterPoint points[] = {{d * 1.999, -d}, {lit, -lit}};
    Settings settings;
    settings.bounces = 1;
    const auto readings = trace::measure(*trace::make_world(scene), points, settings);
    const double expected = 0.5 * profile->flux_lm / (16 * std::numbers::pi);
    EXPECT_NEAR(lux(readings[0].indirect_lx), expected, 0.01 * expected + 4 * readings[0].indirect_error_lx);
    EXPECT_NEAR(lux(readings[1].direct_lx), 1e5, 1e3) << "1 m away in the middle of the ring";
}

// Distances are taken at the point itself, however large the scene around it.
TEST(Trace, AWideSceneCostsNoAccuracyNearby) {
    for (const double half : {5.0, 500.0, 5000.0}) {
        const Mesh floor = quad({-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half});
        const glm::dvec3 edge(0.9 * half, 0.0, 0.0);
        const Scene scene = scene_with({{floor, glm::vec3(0.5f)}}, isotropic(1000.0), edge + glm::dvec3(0, 1, 0));
        const MeterPoint points[] = {{edge, {0, 1, 0}}};
        Settings settings;
        settings.bounces = 0;
        EXPECT_NEAR(lux(trace::measure(*trace::make_world(scene), points, settings)[0].direct_lx), 1000.0, 1.0) << half;
    }
}

// A point that few paths light is not called dark: through a hole of 5 cm a lit screen is seen.
TEST(Trace, AFarHoleIsFound) {
    const auto wall = [](double z) {  // 4 m × 4 m with a hole of 5 cm in its middle
        std::vector<Piece> pieces;
        const double h = 0.025;
        for (const glm::dvec4& r : {glm::dvec4{-2, -2, 2, -h}, {-2, h, 2, 2}, {-2, -h, -h, h}, {h, -h, 2, h}}) {
            pieces.push_back({quad({r.x, r.y, z}, {r.z, r.y, z}, {r.z, r.w, z}, {r.x, r.w, z}), glm::vec3(0.0f)});
        }
        return pieces;
    };
    std::vector<Piece> pieces = wall(0.0);
    pieces.push_back({quad({-2, -2, -1}, {2, -2, -1}, {2, 2, -1}, {-2, 2, -1}), glm::vec3(0.8f)});
    const Scene scene = scene_with(pieces, isotropic(1000.0), {1.0, 0.5, -0.4});
    const MeterPoint points[] = {{{0.0, 0.0, 2.0}, {0, 0, -1}}};
    Settings settings;
    settings.bounces = 1;
    settings.noise = 0.1;
    const trace::Reading reading = trace::measure(*trace::make_world(scene), points, settings)[0];
    // The screen's spot behind the hole, seen under the hole's solid angle: E = L · omega, L = rho E_d / pi.
    const double d2 = 1.0 + 0.25 + 0.36, direct = 1000.0 * (0.6 / std::sqrt(d2)) / d2;
    const double expected = 0.8 * direct / std::numbers::pi * (0.05 * 0.05 / 4.0);
    EXPECT_NEAR(lux(reading.indirect_lx), expected, 0.05 * expected + 4 * reading.indirect_error_lx);
    EXPECT_GT(lux(reading.indirect_lx), 0.0);
}

// Same seed, same figures, on one thread and on three; another seed differs within the errors that both state.
TEST(Trace, ReproducibleAndHonest) {
    const Scene scene = scene_of(make_cornell());
    const auto world = trace::make_world(scene);
    std::vector<MeterPoint> points;
    for (int i = 0; i < 48; ++i) points.push_back({{-0.7 + 0.2 * (i % 8), 0.02, 0.9 + 0.15 * (i / 8)}, {0, 1, 0}});
    Settings settings;
    settings.noise = 0.015;
    settings.threads = 1;
    const auto one = trace::measure(*world, points, settings);
    settings.threads = 3;
    const auto three = trace::measure(*world, points, settings);
    settings.seed = 7;
    const auto other = trace::measure(*world, points, settings);
    double squares = 0.0;
    int counted = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(one[i].indirect_lx, three[i].indirect_lx);
        const double error = std::hypot(one[i].indirect_error_lx, other[i].indirect_error_lx);
        if (error <= 0.0) continue;
        squares += std::pow(lux(one[i].indirect_lx - other[i].indirect_lx) / error, 2.0);
        ++counted;
    }
    const double ratio = std::sqrt(squares / counted);
    std::printf("difference of two seeds over its stated error, rms of %d points: %.2f\n", counted, ratio);
    EXPECT_GT(ratio, 0.7);
    EXPECT_LT(ratio, 1.4);
}

// In this square room seen from its axis the pictures' diagonals are rays that meet the room's edges exactly.
TEST(Trace, ExactEdgesAreNotDark) {
    trace::PictureRequest request;
    request.camera = make_cornell()->cameras.at(0);
    request.width_px = request.height_px = 40;
    request.quantity = trace::Quantity::irradiance_indirect;
    Settings settings;
    settings.bounces = 1;
    settings.noise = 0.05;
    trace::Picture picture(trace::make_world(scene_of(make_cornell())), request, settings);
    picture.refine(60.0);
    const std::vector<float> values = picture.values();
    const auto at = [&](int x, int y) {
        return static_cast<double>(values[static_cast<std::size_t>(4 * (y * 40 + x))]);
    };
    for (int i = 3; i < 8; ++i) {
        const double around = 0.25 * (at(i - 1, i) + at(i + 1, i) + at(i, i - 1) + at(i, i + 1));
        EXPECT_GT(at(i, i), 0.6 * around) << i;
    }
}

TEST(Trace, StopsWhenAsked) {
    const auto world = trace::make_world(scene_of(make_cornell()));
    std::stop_source stop;
    stop.request_stop();
    const MeterPoint points[] = {{{0, 0.01, 0}, {0, 1, 0}}};
    Settings settings;
    settings.noise = 1e-9;
    EXPECT_EQ(trace::measure(*world, points, settings, stop.get_token()).front().samples, 0u);
    trace::PictureRequest request;
    request.camera = make_cornell()->cameras.at(0);
    request.width_px = request.height_px = 8;
    trace::Picture picture(world, request, settings);
    EXPECT_EQ(picture.refine(10.0, stop.get_token()).passes, 0u);
}

// Packets of sixteen, of which only every third is a ray: from 2 m above a floor straight down, and past its edge. What
// else lies in the packet counts nothing, by any instruction set; without AVX-512 Embree parts it.
TEST(Trace, UnusedRaysOfAPacketMayHoldAnything) {
    const Scene scene = floor_scene(4.0, 0.5f, isotropic(1.0), {0, 1, 0});
    for (const char* isa : {"avx2", ""}) {
        trace::set_embree_isa(isa);
        const trace::Geometry geometry(scene.asset);
        for (const float garbage :
             {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e38f}) {
            trace::RayPacket rays;
            for (int i = 0; i < trace::kPacket; ++i)
                rays.set(i, glm::vec3(garbage), glm::vec3(garbage), std::abs(garbage));
            unsigned active = 0, above = 0;
            for (int i = 0; i < trace::kPacket; i += 3) {
                const bool over = i % 2 == 0;
                rays.set(i, geometry.local({over ? 0.3 : 7.0, 2.0, 0.1 * i}), {0, -1, 0}, 3.0f);
                active |= 1u << i;
                above |= over ? 1u << i : 0u;
            }
            trace::HitPacket hits;
            EXPECT_EQ(geometry.occluded(rays, active), above) << isa << garbage;
            EXPECT_EQ(geometry.closest(rays, active, hits), above) << isa << garbage;
            EXPECT_NEAR(static_cast<double>(hits.distance[0]), 2.0, 1e-5);
        }
    }
}

}  // namespace
}  // namespace gonio::test
