#include "server/scene/tint.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gonio {
namespace {

// x, y of linear Rec.709, by the primaries of ITU-R BT.709.
glm::dvec2 xy_of(const glm::dvec3& rgb) {
    const glm::dvec3 xyz = rgb.r * glm::dvec3(0.4124564, 0.2126729, 0.0193339) +
                           rgb.g * glm::dvec3(0.3575761, 0.7151522, 0.1191920) +
                           rgb.b * glm::dvec3(0.1804375, 0.0721750, 0.9503041);
    return {xyz.x / (xyz.x + xyz.y + xyz.z), xyz.y / (xyz.x + xyz.y + xyz.z)};
}

// Ohno (2014), LEUKOS 10:1, 47-55: the distance from the Planckian locus by a polynomial, good to 0.00001.
double ohno_duv(const glm::dvec2& xy) {
    const double d = -2 * xy.x + 12 * xy.y + 3, u = 4 * xy.x / d, v = 6 * xy.y / d;
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

TEST(Tint, TheDistanceFromTheLocusChangesByItAndTheLuminanceDoesNot) {
    const double white = ohno_duv(xy_of(glm::dvec3(1)));
    EXPECT_NEAR(white, 0.0032, 1e-4) << "of D65";
    for (const double duv : {-0.05, -0.02, -0.006, 0.006, 0.02, 0.05}) {
        const glm::dvec3 factors = tint_factors(duv);
        EXPECT_NEAR(ohno_duv(xy_of(factors)) - white, duv, 1e-4) << duv;
        EXPECT_NEAR(glm::dot(factors, {0.2126, 0.7152, 0.0722}), 1, 1e-12) << duv;
        EXPECT_GT(std::min({factors.r, factors.g, factors.b}), 0.3) << duv;
    }
    EXPECT_NEAR(mccamy_cct_k(xy_of(tint_factors(0.006))), mccamy_cct_k(xy_of(glm::dvec3(1))), 60)
        << "along an isotherm, where McCamy's formula holds";
    EXPECT_GT(tint_factors(0.02).g, 1) << "green";
    EXPECT_GT(tint_factors(-0.02).r, 1) << "magenta";
}

TEST(Tint, NoneIsExactlyNoneAndTheRestIsContinuous) {
    EXPECT_EQ(tint_factors(0), glm::dvec3(1));
    EXPECT_NEAR(glm::length(tint_factors(1e-9) - glm::dvec3(1)), 0, 1e-6);
}

}  // namespace
}  // namespace gonio
