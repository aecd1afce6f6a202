// Points of luminous openings against the closed forms of what they light: Lambertian openings of 1 cd/m².
#include "server/scene/opening_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/scene/opening.h"
#include "server/scene/scene.h"
#include "server/trace/luminous.h"
#include "tests/scenes/scenes.h"

namespace gonio {
namespace {

using std::numbers::pi;

ies::Opening opening(const char* text) {
    return parse_opening(text).value();
}

// Illuminance at a point below (z < 0), the normal given, of points that share I(d) in cd.
template <typename Law>
double lit(const std::vector<glm::dvec3>& points, const glm::dvec3& at, const glm::dvec3& normal, const Law& law) {
    double sum = 0.0;
    for (const glm::dvec3& point : points) {
        const glm::dvec3 d = at - point;
        const double d2 = glm::dot(d, d);
        sum += law(d / std::sqrt(d2)) * std::max(0.0, -glm::dot(d, normal)) / (d2 * std::sqrt(d2));
    }
    return sum / static_cast<double>(points.size());
}
// Of a flat opening of 1 cd/m² that faces down.
auto lambertian(double area) {
    return [area](const glm::dvec3& d) { return area * std::max(0.0, -d.z); };
}

struct Case {
    const char* opening;
    double area;
    glm::dvec3 at, normal;
    double lx;
};

// A corner at (0, 0) is half of the sides away from the middle. X = a/c, Y = b/c:
// E = 1/2 [X/√(1+X²) atan(Y/√(1+X²)) + Y/√(1+Y²) atan(X/√(1+Y²))]; upright along +a:
// E = 1/2 [atan(b/c) − c/√(a²+c²) atan(b/√(a²+c²))]; a disc at offset x:
// E = π/2 [1 − (d²+x²−R²)/√((d²+x²+R²)²−4R²x²)].
const Case kCases[] = {
    {"rect 1x1", 1.0, {-0.5, -0.5, -1}, {0, 0, 1}, 0.435210},
    {"rect 0.6x0.3", 0.18, {-0.3, -0.15, -0.5}, {0, 0, 1}, 0.346584},
    {"rect 1.2x0.15", 0.18, {-0.6, -0.075, -0.2}, {0, 0, 1}, 0.470126},
    {"rect 2x2", 4.0, {-1, -1, -0.5}, {0, 0, 1}, 0.747247},
    {"rect 1x1", 1.0, {-0.5, -0.5, -1}, {1, 0, 0}, 0.175094},
    {"rect 0.6x0.3", 0.18, {-0.3, -0.15, -0.5}, {1, 0, 0}, 0.152821},
    {"rect 1.2x0.15", 0.18, {-0.6, -0.075, -0.2}, {1, 0, 0}, 0.311666},
    {"rect 2x2", 4.0, {-1, -1, -0.5}, {1, 0, 0}, 0.569503},
    {"disc 1", pi / 4, {0, 0, -1}, {0, 0, 1}, 0.628319},
    {"disc 1", pi / 4, {1, 0, -1}, {0, 0, 1}, 0.206963},
    {"disc 0.4", pi * 0.04, {0, 0.4, -0.5}, {0, 0, 1}, 0.188957},
    {"disc 2", pi, {0, 2, -0.5}, {0, 0, 1}, 0.0694622},
};

TEST(OpeningPoints, PartsOfFlatOpeningsHaveTheClosedForms) {
    for (const Case& c : kCases) {
        const auto error = [&](unsigned level) {
            return lit(opening_parts(opening(c.opening), level).points, c.at, c.normal, lambertian(c.area)) / c.lx - 1;
        };
        const glm::dvec3 half = half_sides(opening(c.opening));
        const glm::dvec3 off = glm::max(glm::abs(c.at) - half, 0.0);
        // What the picture takes where it moves, and at rest.
        for (const auto& [fineness, limit] : {std::pair(4.0, 0.02), std::pair(8.0, 0.005)}) {
            unsigned level = 0;
            while (opening_parts(opening(c.opening), level).size_m * fineness * (level == 0 ? 2.0 : 1.0) >
                   glm::length(off))
                ++level;
            EXPECT_NEAR(error(level), 0.0, limit) << c.opening << " " << c.lx << " " << level;
        }
    }
}

// Points that emit evenly, on a sphere: those of a point in its middle (Newton's shell). E = I/d².
TEST(OpeningPoints, PartsOfASphereAreAPointInItsMiddle) {
    for (const unsigned level : {3u, 4u})
        EXPECT_NEAR(lit(opening_parts(opening("sphere 0.4"), level).points, {0, 0.3, -0.4}, {0, 0, 1},
                        [](const glm::dvec3&) { return 1.0; }),
                    0.4 / 0.125, 0.005 * 0.4 / 0.125)
            << level;
}

// I′ cd/m that falls with the sine to the axis, facing at h: E = I′/2 [x/(h²+x²) + atan(x/h)/h] between the ends.
TEST(OpeningPoints, PartsOfALine) {
    const auto law = [](double cd) { return [cd](const glm::dvec3& d) { return cd * std::sqrt(1.0 - d.x * d.x); }; };
    EXPECT_NEAR(lit(opening_parts(opening("line 1.2"), 3).points, {0, 0, -1}, {0, 0, 1}, law(1200)), 981.596, 0.5);
    EXPECT_NEAR(lit(opening_parts(opening("line 1.5"), 3).points, {-0.75, 0, -2}, {0, 0, 1}, law(1500)), 280.875, 0.2);
    EXPECT_NEAR(lit(opening_parts(opening("line 4"), 5).points, {0, 0, -0.5}, {0, 0, 1}, law(4000)), 3122.22, 3.0);
    EXPECT_NEAR(lit(opening_parts(opening("line 1.5"), 3).points, {-0.75, 0, -2}, {1, 0, 0}, law(1500)), 90.0, 0.1);
}

// Cut across by a line that goes through it anywhere, a set of n has its share of points on each side: of what is
// hidden.
TEST(OpeningPoints, SpreadIsEvenWhicheverWayItIsCut) {
    const auto points = opening_spread(opening("rect 0.8x0.4"), 64);
    ASSERT_EQ(points.size(), 64u);
    for (int i = 1; i < 8; ++i) {
        const double x = -0.4 + 0.1 * i, y = -0.2 + 0.05 * i;
        EXPECT_NEAR(std::ranges::count_if(points, [&](const glm::dvec3& p) { return p.x < x; }), 8 * i, 1) << i;
        EXPECT_NEAR(std::ranges::count_if(points, [&](const glm::dvec3& p) { return p.y < y; }), 8 * i, 1) << i;
    }
    for (const glm::dvec3& p : opening_spread(opening("disc 1"), 64)) EXPECT_LE(glm::length(p), 0.5);
    const auto box = opening_spread(opening("box 1x1x1"), 64);
    EXPECT_NEAR(std::ranges::count_if(box, [](const glm::dvec3& p) { return p.z < -0.4999; }), 64 / 5, 1)
        << "a fifth of the light comes from the bottom of a cube";
}

// I / projected area, straight on and at 60°: of I₀ cos² 1000/0.36, 250/0.18 cd/m²; nothing from behind.
TEST(Luminous, IsIntensityByProjectedArea) {
    Scene scene = test::floor_scene(10.0, 0.0f, test::cosine_power(1000.0, 2.0), {0, 3, 0});
    scene.lights[0].opening = opening("rect 0.6x0.6");
    const trace::Geometry geometry(scene.asset);
    const trace::Luminaire luminaire = trace::luminaire_of(scene.lights[0], geometry);
    const auto seen = [&](const glm::dvec3& along) {
        return trace::shining_at(luminaire, luminaire.position - 2.0 * along, along);
    };
    EXPECT_NEAR(seen({0, 1, 0})->nit, 1000.0 / 0.36, 0.01);
    EXPECT_NEAR(seen({0, 1, 0})->distance_m, 2.0, 0.002) << "a millimetre before it";
    EXPECT_NEAR(seen({std::sin(pi / 3), 0.5, 0})->nit, 250.0 / 0.18, 0.5);
    EXPECT_EQ(seen({0, -1, 0})->nit, 0.0) << "from behind";
    EXPECT_FALSE(trace::shining_at(luminaire, luminaire.position + glm::dvec3(0.31, -2, 0), {0, 1, 0})) << "beside it";
    // A cylinder stands upright; a sphere is a disc from everywhere.
    scene.lights[0].profile = test::isotropic(100.0);
    scene.lights[0].opening = opening("sphere 0.2");
    const trace::Luminaire ball = trace::luminaire_of(scene.lights[0], geometry);
    const auto met = trace::shining_at(ball, ball.position + glm::dvec3(1, 0.09, 0), {-1, 0, 0});
    ASSERT_TRUE(met);
    EXPECT_NEAR(met->nit, 100.0 / (pi * 0.01), 0.01);
    EXPECT_NEAR(met->distance_m, 1.0 - std::sqrt(0.01 - 0.0081), 1e-5);
    EXPECT_FALSE(trace::shining_at(ball, ball.position + glm::dvec3(1, 0.11, 0), {-1, 0, 0}));
}

}  // namespace
}  // namespace gonio
