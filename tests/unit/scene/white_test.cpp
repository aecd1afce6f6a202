#include "server/scene/white.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/scene/chromaticity.h"

namespace gonio {
namespace {

using test::luminance;
using test::xy_of;

glm::dvec2 uv_of(const glm::dvec2& xy) {
    const double d = -2 * xy.x + 12 * xy.y + 3;
    return {4 * xy.x / d, 6 * xy.y / d};
}

// Ohno (2014), LEUKOS 10:1, 47-55: the distance from the Planckian locus by a polynomial, good to 0.00001.
double ohno_duv(const glm::dvec2& xy) {
    const auto [u, v] = [&] {
        const auto uv = uv_of(xy);
        return std::pair(uv.x, uv.y);
    }();
    const double length = std::hypot(u - 0.292, v - 0.24), a = std::acos((u - 0.292) / length);
    constexpr double k[] = {-0.471106, 1.925865, -2.4243787, 1.5317403, -0.5179722, 0.0893944, -0.00616793};
    double locus = 0;
    for (int i = 6; i >= 0; --i) locus = locus * a + k[i];
    return length - locus;
}

// McCamy (1992): the correlated colour temperature, good to 2 K near the locus.
double mccamy_cct_k(const glm::dvec2& xy) {
    const double n = (xy.x - 0.3320) / (0.1858 - xy.y);
    return 449 * n * n * n + 3525 * n * n + 6823.3 * n + 5520.33;
}

TEST(White, TheDistanceFromTheLocusChangesByTheTintAndTheLuminanceDoesNot) {
    const double white = ohno_duv(xy_of(glm::dvec3(1)));
    EXPECT_NEAR(white, 0.0032, 1e-4) << "of D65";
    for (const double duv : {-0.05, -0.02, -0.006, 0.006, 0.02, 0.05}) {
        const glm::dvec3 factors = white_factors(0, duv);
        EXPECT_NEAR(ohno_duv(xy_of(factors)) - white, duv, 1e-4) << duv;
        EXPECT_NEAR(luminance(factors), 1, 1e-12) << duv;
        EXPECT_GT(std::min({factors.r, factors.g, factors.b}), 0.3) << duv;
    }
    EXPECT_NEAR(mccamy_cct_k(xy_of(white_factors(0, 0.006))), mccamy_cct_k(xy_of(glm::dvec3(1))), 60)
        << "along an isotherm, where McCamy's formula holds";
    EXPECT_GT(white_factors(0, 0.02).g, 1) << "green";
    EXPECT_GT(white_factors(0, -0.02).r, 1) << "magenta";
}

TEST(White, NoneIsExactlyNoneAndTheRestIsContinuous) {
    EXPECT_EQ(white_factors(0, 0), glm::dvec3(1));
    EXPECT_NEAR(glm::length(white_factors(0, 1e-9) - glm::dvec3(1)), 0, 1e-6);
}

// Chromaticities of colour-science/colour, `colour.temperature`: Krystek (1985); Robertson (1968) for (4500 K, +0.025),
// whose isotherms are lines between 31 measured ones: 0.00013 off the normal of Krystek's curve.
TEST(White, TheLocusIsPlanckAsKrystekFittedIt) {
    const auto near = [](const glm::dvec2& a, const glm::dvec2& b, double most) {
        EXPECT_NEAR(a.x, b.x, most);
        EXPECT_NEAR(a.y, b.y, most);
    };
    near(white_xy(2700, 0), {0.46000, 0.41097}, 6e-6);
    near(white_xy(4000, 0), {0.38041, 0.37660}, 6e-6);
    near(uv_of(white_xy(4500, 0)), {0.217331, 0.328427}, 1e-4);
    near(uv_of(white_xy(4500, 0.025)), {0.201269, 0.347584}, 1.5e-4);
    near(white_xy(3200, 0), {0.4234, 0.3990}, 3e-4);  // CIE 15: Planckian radiator of 3,200 K
    for (const double cct_k : {2000.0, 2700.0, 3200.0, 5000.0, 6500.0, 10'000.0, 15'000.0}) {
        const glm::dvec3 factors = white_factors(cct_k, 0);
        EXPECT_NEAR(luminance(factors), 1, 1e-12) << cct_k;
        EXPECT_NEAR(xy_of(factors).x, white_xy(cct_k, 0).x, 2e-4) << cct_k;
        EXPECT_NEAR(xy_of(factors).y, white_xy(cct_k, 0).y, 2e-4) << cct_k;
        EXPECT_NEAR(ohno_duv(white_xy(cct_k, 0.01)) - ohno_duv(white_xy(cct_k, 0)), 0.01, 3e-4) << cct_k;
    }
}

// Rec.709 has no blackbody below some 1,900 K: the straight line to white ends at its edge.
TEST(White, WhatRec709DoesNotHaveGoesStraightTowardsWhiteUntilItDoes) {
    for (const glm::dvec2& xy : {glm::dvec2(0.17, 0.042), white_xy(1000, 0), {0.7, 0.29}, {0.08, 0.84}, {0.74, 0.26}}) {
        const glm::dvec3 rgb = rgb_of_xy(xy);
        EXPECT_NEAR(std::min({rgb.r, rgb.g, rgb.b}), 0, 1e-12);
        EXPECT_LE(std::max({rgb.r, rgb.g, rgb.b}), 1 / 0.0722 + 1e-9);
        EXPECT_NEAR(luminance(rgb), 1, 1e-9);
        const glm::dvec2 white{0.3127, 0.3290}, shown = xy_of(rgb) - white, wanted = xy - white;
        EXPECT_NEAR(shown.x * wanted.y - shown.y * wanted.x, 0, 2e-4) << "on the line";
        EXPECT_LT(glm::length(shown), glm::length(wanted));
        EXPECT_GT(glm::dot(shown, wanted), 0);
    }
    EXPECT_GT(white_factors(1950, 0).b, 0);
}

}  // namespace
}  // namespace gonio
