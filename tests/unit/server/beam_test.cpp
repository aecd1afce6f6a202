// Where the edges of a beam lie: against the law of the web and plain trigonometry.
#include "server/session/beam.h"

#include <gtest/gtest.h>

#include <cmath>

#include "protocol/schema/measure.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/trace/geometry.h"
#include "tests/scenes/scenes.h"

namespace gonio {
namespace {

constexpr double kHeight = 3.0;

v1::Beam beam_in(Scene scene) {
    scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
    v1::BeamQuery query;
    query.set_light(scene.lights[0].name);
    const auto beam = beam_of(scene, query);
    EXPECT_TRUE(beam);
    return beam ? *beam : v1::Beam();
}
glm::dvec3 point_of(const v1::BeamEdge& edge, int i) {
    return {edge.points_m(3 * i), edge.points_m(3 * i + 1), edge.points_m(3 * i + 2)};
}

// I = I0 cosⁿ v is I0/2 at cos v = 2^(-1/n).
TEST(Beam, EdgesOfACosinePowerAreCirclesOnTheFloor) {
    const v1::Beam beam = beam_in(test::floor_scene(40, 0.5f, test::cosine_power(1000, 12), {1.0, kHeight, -2.0}));
    ASSERT_EQ(beam.edges_size(), 2);
    for (const v1::BeamEdge& edge : beam.edges()) {
        ASSERT_EQ(edge.hit_size(), kBeamHalfPlanes);
        const double radius = kHeight * std::tan(std::acos(std::pow(edge.ratio(), 1.0 / 12.0)));
        for (int i = 0; i < edge.hit_size(); ++i) {
            EXPECT_TRUE(edge.hit(i));
            const glm::dvec3 point = point_of(edge, i);
            EXPECT_NEAR(std::hypot(point.x - 1.0, point.z + 2.0), radius, 0.01 * radius) << "a web of 1° steps";
            EXPECT_NEAR(point.y, 0.0, 1e-5);
        }
    }
    EXPECT_EQ(beam.edges(0).ratio(), 0.5);
    EXPECT_EQ(beam.edges(1).ratio(), 0.1);
}

TEST(Beam, ATiltedOneIsLongerWhereItIsThrown) {
    Scene scene =
        test::floor_scene(60, 0.5f, test::cosine_power(1000, 40), {0.0, kHeight, 0.0}, orientation_of({0.0, 0.6, 0.0}));
    const v1::Beam beam = beam_in(scene);
    const double half = std::acos(std::pow(0.5, 1.0 / 40.0));
    double nearest = 1e9, farthest = -1e9;
    for (int i = 0; i < beam.edges(0).hit_size(); ++i) {
        nearest = std::min(nearest, -point_of(beam.edges(0), i).z);
        farthest = std::max(farthest, -point_of(beam.edges(0), i).z);
    }
    EXPECT_NEAR(nearest, kHeight * std::tan(0.6 - half), 0.02);
    EXPECT_NEAR(farthest, kHeight * std::tan(0.6 + half), 0.05);
}

TEST(Beam, AnUplightIsAboutTheUpwardAxis) {
    const auto up =
        test::profile_of("up", 1, [](double v, double) { return std::pow(std::max(0.0, -std::cos(v)), 12); });
    const v1::Beam beam = beam_in(test::floor_scene(10, 0.5f, up, {0.0, 1.0, 0.0}));
    ASSERT_EQ(beam.edges(0).hit_size(), kBeamHalfPlanes);
    EXPECT_FALSE(beam.edges(0).hit(0)) << "nothing is above";
    EXPECT_GT(point_of(beam.edges(0), 0).y, 1.0);
}

// Only the half planes of h = -90°..90° are as bright as that.
TEST(Beam, DarkHalfPlanesAreLeftOut) {
    const auto half = test::profile_of("half", 1, [](double v, double h) {
        return v < 1.5 && std::cos(h) > 0 ? 100.0 * std::cos(h) * std::sin(v) : 0.0;
    });
    const v1::Beam beam = beam_in(test::floor_scene(40, 0.5f, half, {0.0, kHeight, 0.0}));
    EXPECT_NEAR(beam.edges(0).hit_size(), kBeamHalfPlanes / 3, 4) << "cos h above 1/2";
    for (int i = 0; i < beam.edges(0).hit_size(); ++i) EXPECT_GT(point_of(beam.edges(0), i).x, 0.0);
}

TEST(Beam, RefusesWhatHasNone) {
    Scene scene = test::floor_scene(4, 0.5f, test::isotropic(100), {0.0, 1.0, 0.0});
    v1::BeamQuery query;
    query.set_light("none");
    EXPECT_EQ(beam_of(scene, query).error().code, "not_found");
    scene.lights[0].sun = true;
    query.set_light(scene.lights[0].name);
    EXPECT_EQ(beam_of(scene, query).error().code, "unsupported");
}

}  // namespace
}  // namespace gonio
