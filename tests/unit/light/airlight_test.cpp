#include "server/lighting/airlight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/light/lamp.h"

namespace gonio::lighting {
namespace {

float along_x(const AirlightSource& source, float far, unsigned samples) {
    AirRays rays;
    rays.resize(1);
    rays.set(0, glm::vec3(0.0f), {1, 0, 0}, far, 0.5f);
    std::vector<float> out(kSimdWidth);
    airlight(source, rays, 0, kSimdWidth, samples, out.data());
    return out[0];
}

// An isotropic point in a homogeneous medium (Sun et al. 2005), by quadrature.
TEST(Airlight, OfAPoint) {
    const struct {
        double extinction, off, foot, far, nit;
    } rows[] = {{.05, 1, 5, 10, 7.8561299e-3},  {.05, 1, 5, 100, 8.0539093e-3}, {.05, 1, -2, 10, 1.0948256e-3},
                {.02, 3, 10, 20, 1.0191485e-3}, {.1, .5, 4, 8, 2.8239394e-2},   {.01, 2, 6, 12, 9.0951464e-4},
                {.2, .1, 5, 10, 0.17253699}};
    for (const auto& row : rows) {
        const Lamp lamp = bulb({row.foot, row.off, 0}, row.extinction);
        const auto error = [&](unsigned samples) {
            return std::abs(static_cast<double>(along_x(lamp.source, static_cast<float>(row.far), samples)) / row.nit -
                            1.0);
        };
        EXPECT_LT(error(30), 0.005) << row.off;
        EXPECT_LT(error(16), 0.01) << row.off;
        EXPECT_LT(error(400), 2e-4) << row.off;
    }
}

TEST(Airlight, ThePhaseFunctionLooksForwards) {
    const struct {
        double g, nit;
    } rows[] = {{-.5, 8.47994e-3}, {.3, 8.67395e-3}, {.6, 1.054945e-2}, {.8, 1.073930e-2}, {.9, 7.42808e-3}};
    for (const auto& row : rows)
        EXPECT_NEAR(static_cast<double>(along_x(bulb({5, 1, 0}, .05, row.g).source, 10.0f, 128)) / row.nit, 1.0, 0.005)
            << row.g;
}

// A cone of 10° with sharp edges, 10,000 cd, crossed at right angles 4 m below the luminaire, 8 m away.
TEST(Airlight, OfABeam) {
    const struct { double extinction, nit; } rows[] = {{.005, 0.326969}, {.02, 1.09213}, {.05, 1.90404}};
    for (const auto& row : rows) {
        Lamp lamp({web_of_rings({0, 10, 10.001, 180}, {1, 1, 0, 0})}, {8, 4, 0}, row.extinction, 0.0);
        lamp.source.light.beam_cos = static_cast<float>(std::cos(10.001 * std::numbers::pi / 180));
        EXPECT_NEAR(1e4 * static_cast<double>(along_x(lamp.source, 100.0f, 16)) / row.nit, 1.0, 0.005);
    }
}

// What a ray sees of a faint flood with a bright core does not depend on how it is cut up: sums of many samples.
TEST(Airlight, ABrightCoreInAFlood) {
    for (const float aside : {0.0f, 0.2f, 1.0f, 2.5f}) {
        Lamp lamp(web_of_rings({0, 4, 6, 80, 90, 180}, {1, 1, 0.02f, 0.02f, 0, 0}), {6, 3, aside}, .03, 0.7);
        EXPECT_GT(lamp.source.core_cos, 0.9f);
        lamp.source.light.beam_cos = 1e-3f;
        const AirlightSource cut = lamp.source;
        lamp.source.core_cos = -1.0f;
        const float exact = along_x(lamp.source, 12.0f, 20'000);
        EXPECT_NEAR(along_x(cut, 12.0f, 16) / exact, 1.0f, 0.02f) << aside;
        EXPECT_NEAR(along_x(cut, 12.0f, 400) / exact, 1.0f, 0.002f) << aside;
    }
}

// Layers against a fine sum in double precision.
TEST(Airlight, InALayer) {
    Lamp lamp = bulb({5, 3, 1}, .08, 0.6);
    lamp.source.light.air.per_height = 0.5f;
    lamp.source.light.air.floor_m = -1.0f;
    Haze haze;
    haze.extinction_per_m = .08, haze.g = 0.6, haze.layer_height_m = 2.0, haze.floor_m = -1.0;
    AirRays rays;
    rays.resize(1);
    const glm::dvec3 from{0, 0.5, 0}, along = glm::normalize(glm::dvec3(1, 0.2, 0.1)), lamp_at{5, 3, 1};
    rays.set(0, glm::vec3(from), glm::vec3(along), 15.0f, 0.5f);
    std::vector<float> out(kSimdWidth);
    airlight(lamp.source, rays, 0, kSimdWidth, 128, out.data());
    double sum = 0.0;
    constexpr int kSteps = 200'000;
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) * 15.0 / kSteps;
        const glm::dvec3 p = from + along * t, d = p - lamp_at;
        const double r = glm::length(d);
        sum += scattering_per_m(haze, p) * transmittance(haze, lamp_at, p) * transmittance(haze, p, from) *
               henyey_greenstein(haze.g, glm::dot(d / r, -along)) / (r * r) * 15.0 / kSteps;
    }
    EXPECT_NEAR(static_cast<double>(out[0]) / sum, 1.0, 0.003);
}

}  // namespace
}  // namespace gonio::lighting
