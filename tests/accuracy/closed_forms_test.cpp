// The closed forms themselves, against the numbers that CIE 171:2006 prints (5.7: against the corrected table, since
// table 19 of the standard is known to be wrong) and against integrals done numerically.
#include <gtest/gtest.h>

#include <cmath>

#include "ies/web.h"
#include "tests/accuracy/closed_forms.h"

namespace gonio::accuracy {
namespace {

using ies::kPi;

// Midpoint rule over the rectangle: cos cos / (pi d²).
TEST(ClosedForms, ConfigurationFactorsAreTheIntegralTheyStandFor) {
    constexpr int n = 400;
    const auto integral = [](double x0, double x1, double y0, double y1, auto&& kernel) {
        double sum = 0.0;
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) sum += kernel(x0 + (x1 - x0) * (i + 0.5) / n, y0 + (y1 - y0) * (j + 0.5) / n);
        }
        return sum * (x1 - x0) * (y1 - y0) / (n * n);
    };
    const double c = 1.3;
    EXPECT_NEAR(parallel_factor(-0.4, 1.7, 0.3, 0.9, c),
                integral(-0.4, 1.7, 0.3, 0.9,
                         [=](double x, double y) {
                             const double d2 = x * x + y * y + c * c;
                             return c * c / (kPi * d2 * d2);
                         }),
                1e-6);
    EXPECT_NEAR(perpendicular_factor(-0.4, 1.7, 0.3, 0.9, c),
                integral(-0.4, 1.7, 0.3, 0.9,
                         [=](double x, double z) {
                             const double d2 = x * x + z * z + c * c;
                             return c * z / (kPi * d2 * d2);
                         }),
                1e-6);
}

TEST(ClosedForms, AreaSource53) {
    const double wall[] = {32.68, 75.19, 81.32, 69.06, 53.40, 40.00};
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(area_source_on_wall(1000.0, 2.75 - 0.5 * i), wall[i], 0.006) << i;
    const double floor[] = {61.42, 79.26, 95.67, 105.78, 105.78, 95.67, 79.26, 61.42};
    for (int i = 0; i < 8; ++i) EXPECT_NEAR(area_source_on_floor(1000.0, 0.25 + 0.5 * i), floor[i], 0.006) << i;
}

TEST(ClosedForms, FluxConservation54) {
    const double per_sr = 10000.0 / (4 * kPi);
    EXPECT_NEAR(per_sr * rectangle_solid_angle(4, 4, 1.5), 2210.66, 0.005);
    EXPECT_NEAR(per_sr * rectangle_solid_angle(4, 3, 2.0), 1394.67, 0.005);
    EXPECT_NEAR(2 * rectangle_solid_angle(4, 4, 1.5) + 4 * rectangle_solid_angle(4, 3, 2.0), 4 * kPi, 1e-12);
}

TEST(ClosedForms, DiffuseReflection56) {
    const double wall[] = {35.901, 27.992, 21.639, 16.716, 12.967};  // table 17, z = 0.75 … 2.75
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(100 * reflection_on_wall(4, 0.75 + 0.5 * i), wall[i], 0.0006) << i;
    const double ceiling[] = {26.795, 30.939, 33.976, 35.567, 35.567, 33.976, 30.939, 26.795};
    for (int i = 0; i < 8; ++i) EXPECT_NEAR(100 * reflection_on_ceiling(4, 0.25 + 0.5 * i), ceiling[i], 0.0006) << i;
    const double small_wall[] = {0.246, 0.580, 0.644, 0.556, 0.433, 0.325};
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(100 * reflection_on_wall(0.5, 0.25 + 0.5 * i), small_wall[i], 0.0006) << i;
    const double small_ceiling[] = {0.491, 0.639, 0.778, 0.864};
    for (int i = 0; i < 4; ++i)
        EXPECT_NEAR(100 * reflection_on_ceiling(0.5, 0.25 + 0.5 * i), small_ceiling[i], 0.0006) << i;
    EXPECT_NEAR(100 * reflection_on_wall(500, 0.25), 49.943, 0.0006);
    EXPECT_NEAR(100 * reflection_on_wall(500, 2.75), 49.378, 0.0006);
    for (int i = 0; i < 8; ++i) EXPECT_NEAR(100 * reflection_on_ceiling(500, 0.25 + 0.5 * i), 99.988, 0.0011) << i;
}

TEST(ClosedForms, Obstructed57) {
    const double wall[] = {16.071, 16.330, 15.399, 13.322, 10.317, 7.079};
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(100 * obstructed_on_wall(2.75 - 0.5 * i), wall[i], 0.0006) << i;
    const double floor[] = {3.382, 3.629, 3.013, 0.0, 0.0};
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(100 * obstructed_on_floor(0.25 + 0.5 * i), floor[i], 0.0006) << i;
    // Without the box more is seen, and a wall that is all seen from close by fills half the hemisphere's floor.
    for (double z : {0.25, 1.25, 2.75}) EXPECT_GT(unobstructed_on_wall(z), obstructed_on_wall(z));
    for (double y : {0.25, 2.25}) EXPECT_GT(unobstructed_on_floor(y), obstructed_on_floor(y));
}

TEST(ClosedForms, InternalReflection58) {
    const std::pair<double, double> table[] = {{0.05, 5.48},  {0.1, 11.57},  {0.2, 26.04},   {0.3, 44.64},
                                               {0.4, 69.44},  {0.5, 104.17}, {0.6, 156.25},  {0.7, 243.06},
                                               {0.8, 416.67}, {0.9, 937.5},  {0.95, 1979.17}};
    for (const auto& [rho, lux] : table) EXPECT_NEAR(mean_indirect(10000.0, 96.0, rho), lux, 0.006) << rho;
}

TEST(ClosedForms, DiscBecomesAPointFarAway) {
    EXPECT_NEAR(disc_on_axis(1000.0, 0.1, 100.0), 1000.0 * kPi * 0.01 / 1e4, 1e-7);
    EXPECT_NEAR(disc_on_axis(1000.0, 1e6, 1.0), kPi * 1000.0, 1e-3);  // an infinite plane
}

}  // namespace
}  // namespace gonio::accuracy
