// The sun in the reference: illuminance, penumbra, and every bounce of what comes through a hole.
#include "server/scene/sun.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/trace/reference.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {
namespace {

double lux(const glm::dvec3& rgb) {
    return 0.2126 * rgb.r + 0.7152 * rgb.g + 0.0722 * rgb.b;
}

// The scene's light becomes a sun of so many lux.
Scene under_sun(std::vector<Piece> pieces, double lx, const glm::dvec3& aim) {
    Scene scene = scene_with(std::move(pieces), sun_profile(), {7, 8, 9}, orientation_aiming(aim));
    scene.lights[0].sun = true;
    scene.lights[0].multiplier = lx;
    return scene;
}

Mesh square(double side, double y) {
    return quad({-side, y, side}, {side, y, side}, {side, y, -side}, {-side, y, -side});
}

trace::Reading read(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, double noise = 0.005) {
    trace::Settings settings;
    settings.noise = noise;
    const trace::MeterPoint at[] = {{point, normal}};
    return trace::measure(*trace::make_world(scene), at, settings).front();
}

// E cos θ everywhere on a plane, in a small scene and in a large one, wherever the node stands.
TEST(Sun, LightsAnOpenPlane) {
    for (const double side : {0.5, 10.0, 500.0}) {
        for (const glm::dvec3 aim : {glm::dvec3(0, -1, 0), glm::dvec3(1, -1, 0.3), glm::dvec3(-3, -0.5, 1)}) {
            const Scene scene = under_sun({{square(side, 0), glm::vec3(0.5f)}}, 50000.0, aim);
            const double expected = 50000.0 * -glm::normalize(aim).y;
            for (const double x : {-0.9, 0.0, 0.6}) {
                const glm::dvec3 p(x * side, 0, 0.3 * side);
                EXPECT_NEAR(lux(read(scene, p, {0, 1, 0}).direct_lx), expected, 0.002 * expected) << side << " " << x;
                EXPECT_EQ(lux(read(scene, p, {0, -1, 0}).direct_lx), 0.0) << "from below";
            }
        }
    }
}

// Behind the edge of a roof h above a floor the disc sinks within h · 0.53°. A share of x = (distance from the point's
// shadow) / (radius of the disc's picture) is left: 1/2 + (x √(1−x²) + asin x)/π.
TEST(Sun, HasAPenumbraOfHalfADegree) {
    constexpr double h = 4.0, radius = h * 0.53 / 2 * std::numbers::pi / 180.0;
    const Mesh roof = quad({-9, h, 9}, {0, h, 9}, {0, h, -9}, {-9, h, -9});
    const Scene scene = under_sun({{square(9, 0), glm::vec3(0.0f)}, {roof, glm::vec3(0.0f)}}, 1000.0, {0, -1, 0});
    for (const double x : {-1.2, -0.7, -0.2, 0.0, 0.4, 0.9, 1.2}) {
        const double c = std::clamp(x, -1.0, 1.0),
                     share = 0.5 + (c * std::sqrt(1 - c * c) + std::asin(c)) / std::numbers::pi;
        EXPECT_NEAR(lux(read(scene, {x * radius, 0, 0.1}, {0, 1, 0}).direct_lx), 1000.0 * share, 10.0) << x;
    }
}

// A sphere with a hole, through which the sun shines: its flux E A is reflected once (rho) and then as in any sphere:
// E = rho Φ / (4πR²) / (1 − rho (1 − hole's share)), less what leaves by the hole.
TEST(Sun, ThroughAHoleIntoASphere) {
    constexpr double radius = 2.0, rho = 0.6, cap = 0.2;  // half angle of the hole, rad
    Mesh sphere = inward_sphere(radius, 256);
    std::vector<std::uint32_t> kept;
    for (std::size_t i = 0; i + 2 < sphere.indices.size(); i += 3) {
        bool inside = true;
        for (std::size_t k = i; k < i + 3; ++k)
            inside = inside &&
                     sphere.vertices[sphere.indices[k]].position.y <= static_cast<float>(radius * std::cos(cap) + 1e-6);
        if (inside) kept.insert(kept.end(), sphere.indices.begin() + i, sphere.indices.begin() + i + 3);
    }
    sphere.indices = kept;
    double top = -10.0;
    for (const std::uint32_t i : kept) top = std::max(top, static_cast<double>(sphere.vertices[i].position.y));
    const double area = std::numbers::pi * (radius * radius - top * top), share = (1.0 - top / radius) / 2.0;
    const Scene scene = under_sun({{std::move(sphere), glm::vec3(static_cast<float>(rho))}}, 80000.0, {0, -1, 0});
    const double expected =
        rho * 80000.0 * area / (4 * std::numbers::pi * radius * radius) / (1.0 - rho * (1.0 - share));
    for (const glm::dvec3 d : {glm::dvec3(1, 0.2, 0.1), glm::dvec3(-0.5, -0.6, 0.7)}) {
        const glm::dvec3 n = glm::normalize(d);
        const trace::Reading reading = read(scene, n * radius * 0.9999, -n);
        EXPECT_EQ(lux(reading.direct_lx), 0.0);
        EXPECT_NEAR(lux(reading.indirect_lx), expected, 0.01 * expected + 3 * reading.indirect_error_lx);
    }
}

TEST(Sun, IsALightOfTheStateWithoutAWeb) {
    Scene scene = under_sun({{square(9, 0), glm::vec3(0.5f)}}, 1000.0, {0, -1, 0});
    const std::string name = scene.lights[0].name;
    v1::Command command;
    v1::SetLight& set = *command.mutable_set_light();
    set.set_name(name);
    set.set_level_ratio(0.5);
    for (const double x : {1.0, -1.0, 0.0}) set.add_aim(x);
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_NEAR(lux(read(scene, {0, 0, 0}, {0, 1, 0}).direct_lx), 500.0 / std::sqrt(2.0), 1.0);
    const v1::Light told = full_state(scene).lights(0);
    EXPECT_NEAR(told.sun_lx(), 500.0, 1e-9);
    EXPECT_EQ(told.max_cd(), 0.0) << "parallel light has no candela";
    EXPECT_EQ(told.flux_lm(), 0.0);
    for (const double x : {-3.0, 2.0, 1.0}) set.add_position_m(x);
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_NEAR(lux(read(scene, {0, 0, 0}, {0, 1, 0}).direct_lx), 500.0 / std::sqrt(2.0), 1.0) << "it is nowhere";
    set.mutable_profile()->set_name("downlight");
    const auto refused = apply(scene, command, {.profile = *builtin_profile("downlight")});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().where, "set_light.profile");
    ASSERT_TRUE(apply(scene, command, {.profile = scene.lights[0].profile})) << "as a saved show has it";
    // A preset of another scene's luminaire of this name.
    PresetLight kept;
    static_cast<LightValues&>(kept) = scene.lights[0];
    kept.name = name;
    kept.profile = *builtin_profile("downlight");
    kept.level_ratio = 0.25;
    scene.presets["look"] = std::make_shared<const Preset>(Preset{kept});
    command.mutable_recall_preset()->set_name("look");
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_EQ(scene.lights[0].level_ratio, 0.25);
    EXPECT_EQ(scene.lights[0].profile, sun_profile());
    command.mutable_set_technique()->set_technique("seed");
    const auto applied = apply(scene, command, {});
    ASSERT_TRUE(applied);
    ASSERT_EQ(applied->warnings.size(), 1u);
    EXPECT_NE(applied->warnings[0].find("no sun"), std::string::npos);
}

}  // namespace
}  // namespace gonio::test
