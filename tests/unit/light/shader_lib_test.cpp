// The GLSL of shaders/lib compiled as C++: closed forms, without a GPU.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "ies/web.h"
#include "shaders/lib/as_cpp.h"
#include "tests/unit/angles.h"

namespace gonio {
namespace {

TEST(CubeMap, TexelSolidAnglesSumToTheSphere) {
    for (int n : {1, 2, 16, 128}) {
        double sum = 0.0;
        float single = 0.0f;
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) {
                sum += glsl64::cube_texel_solid_angle(i, j, n);
                single += glsl::cube_texel_solid_angle(i, j, n);
            }
        }
        EXPECT_NEAR(6 * sum, 4 * kPi, 1e-12);
        EXPECT_NEAR(6.0 * static_cast<double>(single), 4 * kPi, 4 * kPi * 1e-4) << n;
    }
}

TEST(CubeMap, CornerAndCentreTexelsOfAFineFace) {
    // d_omega relative to a uniform share: 1.910 at the face's centre, 0.368 at its corners.
    const int n = 512;
    const double uniform = 4 * kPi / (6.0 * n * n);
    EXPECT_NEAR(glsl64::cube_texel_solid_angle(n / 2, n / 2, n) / uniform, 1.910, 0.005);
    EXPECT_NEAR(glsl64::cube_texel_solid_angle(0, 0, n) / uniform, 0.368, 0.005);
    EXPECT_NEAR(glsl64::cube_texel_solid_angle_midpoint(glm::dvec2(0.25, -0.5), n),
                glsl64::cube_texel_solid_angle(5 * n / 8, n / 4, n), 3e-3 * uniform);
}

TEST(CubeMap, ProjectInvertsDirection) {
    for (int face = 0; face < 6; ++face) {
        const glm::vec2 st(0.3f, -0.6f);
        const glm::vec3 d = glsl::cube_direction(face, st), q = glsl::cube_project(face, d * 2.0f);
        EXPECT_EQ(glsl::cube_face(d), face);
        EXPECT_FLOAT_EQ(q.x / q.z, st.x);
        EXPECT_FLOAT_EQ(q.y / q.z, st.y);
        EXPECT_FLOAT_EQ(q.z, 2.0f);
    }
}

TEST(Octahedral, RoundTripIn16Bits) {
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    for (int k = 0; k < 2000; ++k) {
        const glm::vec3 n = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
        const glm::vec2 stored = glm::round(glsl::octahedral_encode(n) * 32767.0f) / 32767.0f;
        EXPECT_LT(glm::distance(n, glsl::octahedral_decode(stored)), 8e-5f);  // 0.005 degrees
    }
}

TEST(Vpl, TwiceTheDistanceGivesAQuarter) {
    const glm::vec3 d(0, -1, 0), down(0, -1, 0), up(0, 1, 0);
    EXPECT_FLOAT_EQ(glsl::vpl_geometry(d, down, up, 0.0f) / glsl::vpl_geometry(2.0f * d, down, up, 0.0f), 4.0f);
}

TEST(Vpl, DiscOnAxisFromContactToFar) {
    // A disc of radius R seen on its axis from d: form factor R² / (R² + d²), which the kernel reproduces exactly: with
    // area / pi = R², cos = 1: area · geometry / pi = R² d² / (d² (d² + R²)).
    const double radius = 0.3;
    for (double distance : {1e-4, 0.01, 0.3, 1.0, 20.0}) {
        const double geometry = glsl64::vpl_geometry(glm::dvec3(0, 0, distance), glm::dvec3(0, 0, 1),
                                                     glm::dvec3(0, 0, -1), radius * radius);
        EXPECT_NEAR(geometry * radius * radius, radius * radius / (radius * radius + distance * distance), 1e-9);
    }
}

TEST(Vpl, FacingAwayGivesNothingAndContactIsFinite) {
    const glm::vec3 z(0, 0, 1);
    EXPECT_EQ(glsl::vpl_geometry(z, -z, -z, 0.1f), 0.0f);
    EXPECT_EQ(glsl::vpl_geometry(z, z, z, 0.1f), 0.0f);
    EXPECT_EQ(glsl::vpl_geometry(glm::vec3(0), z, -z, 0.0f), 0.0f);
    EXPECT_TRUE(std::isfinite(glsl::vpl_geometry(glm::vec3(0, 0, 1e-18f), z, -z, 0.0f)));
}

TEST(Web, AnglesInvertTheGoniometersDirections) {
    for (auto goniometer : {ies::Goniometer::type_c, ies::Goniometer::type_b, ies::Goniometer::type_a}) {
        for (double v : {0.1, 0.8, 1.3}) {
            for (double h : {-1.2, -0.3, 0.4, 1.1}) {
                const double turned = goniometer == ies::Goniometer::type_c && h < 0 ? h + 2 * kPi : h;
                const ies::Direction d = ies::direction_of(goniometer, Angle::radians(v), Angle::radians(turned));
                const glm::dvec2 angles =
                    glsl64::web_angles(static_cast<int>(goniometer), glm::dvec3(d[0], d[1], d[2]));
                EXPECT_NEAR(angles.x, v, 1e-6);
                EXPECT_NEAR(angles.y, turned, 1e-6);
            }
        }
    }
}

TEST(Display, ExposureSunnySixteen) {
    // EV100 15 saturates at 1.2 · 2^15 = 39,322 cd/m²; a grey of 18 % under 81,920 lx then shows 0.119.
    EXPECT_NEAR(glsl64::expose(glm::dvec3(39321.6), 15.0).x, 1.0, 1e-6);
    EXPECT_NEAR(glsl64::expose(glm::dvec3(0.18 * 81920 / kPi), 15.0).x, 0.1194, 1e-3);
}

TEST(Display, ShoulderIsMonotoneAndBounded) {
    EXPECT_DOUBLE_EQ(glsl64::shoulder(0.5), 0.5);
    double last = 0.0;
    for (double x = 0.0; x < 20.0; x += 0.01) {
        const double y = glsl64::shoulder(x);
        EXPECT_GE(y, last);
        EXPECT_LE(y, 1.0);
        last = y;
    }
}

TEST(Display, YcbcrOfPureColours) {
    // ITU-R BT.709 limited range: white 235/128/128, black 16/128/128, red 63/102/240.
    const auto bytes = [](const glm::dvec3& rgb) { return glm::round(glsl64::ycbcr_709(rgb) * 255.0); };
    EXPECT_EQ(bytes({1, 1, 1}), glm::dvec3(235, 128, 128));
    EXPECT_EQ(bytes({0, 0, 0}), glm::dvec3(16, 128, 128));
    EXPECT_EQ(bytes({1, 0, 0}), glm::dvec3(63, 102, 240));
    EXPECT_NEAR(glsl64::srgb_encode(0.2140), 0.5, 1e-3);
}

}  // namespace
}  // namespace gonio
