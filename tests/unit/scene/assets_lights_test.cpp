// glTF import: what lights are that say little of themselves, and those of EXT_lights_area.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/exchange/export_glb.h"
#include "server/scene/apply.h"
#include "server/scene/opening.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/unit/angles.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

class AssetsLights : public GltfFixture {
protected:
    // A small floor at 0; lights 3 m above it, which look down, one after the other on nodes 2 m apart along X.
    Json with_lights(const char* extension, const std::string& lights) {
        Json document = with_positions({-9, 0, 9, 9, 0, 9, 0, 0, -9});
        document["extensionsUsed"] = {extension};
        document["extensions"][extension]["lights"] = Json::parse(lights);
        for (std::size_t i = 0; i < document["extensions"][extension]["lights"].size(); ++i) {
            Json node = Json::parse(R"({"name": "Light", "scale": [10, 10, 10],
                "rotation": [-0.70710678118654752, 0, 0, 0.70710678118654752]})");
            node["translation"] = {2.0 * static_cast<double>(i), 3, 0};
            node["extensions"][extension]["light"] = i;
            document["nodes"].push_back(std::move(node));
            document["scenes"][0]["nodes"].push_back(i + 1);
        }
        return document;
    }
    // Direct light on the floor at x, z of one light alone.
    static glm::dvec3 lux_of(const std::shared_ptr<const SceneAsset>& asset, std::size_t light, double x_m,
                             double z_m = 0.0, double noise = 1e-3) {
        Scene scene = scene_of(asset);
        for (std::size_t i = 0; i < scene.lights.size(); ++i)
            if (i != light) scene.lights[i].level_ratio = 0.0;
        const trace::MeterPoint points[] = {{{x_m, 0, z_m}, {0, 1, 0}}};
        trace::Settings settings;
        settings.bounces = 0;
        settings.noise = noise;
        return trace::measure(*trace::make_world(scene), points, settings).front().direct_lx;
    }
    void refused(const Json& document, const std::string& where) {
        const auto result = load(document);
        ASSERT_FALSE(result) << where;
        EXPECT_EQ(result.error().where, where) << result.error().text();
    }
};

// E = I / d²; a spot of 900 cd has its 100 lx below it, and none beyond 45 degrees, 3 m beside it.
TEST_F(AssetsLights, DefaultsOfPunctualLights) {
    const auto scene = good(with_lights("KHR_lights_punctual", R"([{"type": "point"},
        {"type": "spot", "intensity": 900}, {"type": "point", "intensity": 900, "range": 3.0},
        {"type": "point", "intensity": 0}])"));
    ASSERT_EQ(scene->lights.size(), 4u);
    const char* const names[] = {"Light", "Light 2", "Light 3", "Light 4"};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(scene->lights[i].name, names[i]);
        EXPECT_EQ(scene->lights[i].color, glm::dvec3(1.0));
        EXPECT_EQ(scene->lights[i].profile->photometry.opening.shape, ies::OpeningShape::point);
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(lux_of(scene, 0, 0.0)[c], 1.0 / 9.0, 1e-6);
    EXPECT_NEAR(lux_of(scene, 1, 2.0).g, 100.0, 1e-3);
    EXPECT_GT(lux_of(scene, 1, 2.0 + 2.95).g, 0.0);
    EXPECT_EQ(lux_of(scene, 1, 2.0 + 3.01).g, 0.0);
    // (cos v - cos 45°)² / (1 - cos 45°)² at v = 30°, and E = I cos³ v / h².
    const double v = kPi / 6.0, edge = (std::cos(v) - std::cos(kPi / 4)) / (1.0 - std::cos(kPi / 4));
    EXPECT_NEAR(lux_of(scene, 1, 2.0 + 3.0 * std::tan(v)).g, 100.0 * edge * edge * std::pow(std::cos(v), 3), 2e-2);
    EXPECT_NEAR(lux_of(scene, 2, 4.0).g, 100.0, 1e-3);
    EXPECT_NEAR(lux_of(scene, 2, 4.0 + 4.0).g, 900.0 * 3.0 / 125.0, 1e-3);  // 5 m away, beyond the range
    EXPECT_TRUE(warns(*scene, "the range of lights is ignored"));
    EXPECT_EQ(lux_of(scene, 3, 6.0).g, 0.0);
}

// Configuration factor of a small plane to a parallel rectangle, one corner above it: sides a, b, distance 1.
double corner_factor(double a, double b) {
    const double x = std::sqrt(1.0 + a * a), y = std::sqrt(1.0 + b * b);
    return (a / x * std::atan(b / x) + b / y * std::atan(a / y)) / (2.0 * kPi);
}

TEST_F(AssetsLights, AreaLightsShineAsTheirSurfaceDoes) {
    Json document = with_lights("EXT_lights_area", R"([{"type": "rect", "intensity": 1000, "size": 0.1},
        {"type": "rect", "intensity": 500, "size": 0.05, "rect": {"aspect": 4}, "color": [1, 0.5, 0.25]},
        {"type": "disk", "size": 0.2}])");
    document["extensionsRequired"] = {"EXT_lights_area"};
    const auto scene = good(document);
    ASSERT_EQ(scene->lights.size(), 3u);
    EXPECT_EQ(scene->warnings.size(), 1u) << "--max-albedo of the default material alone";
    // The nodes' scale is 10: 1 x 1 m, 2 x 0.5 m along X, and a disc of 2 m. E = L pi F.
    const double square = 1000.0 * kPi * 4.0 * corner_factor(0.5 / 3.0, 0.5 / 3.0);
    EXPECT_NEAR(square, 107.0, 0.2);
    EXPECT_NEAR(lux_of(scene, 0, 0.0).g, square, 3e-3 * square);
    const double strip = 500.0 * kPi * 4.0 * corner_factor(1.0 / 3.0, 0.25 / 3.0);
    const glm::dvec3 coloured = lux_of(scene, 1, 2.0);
    EXPECT_NEAR(coloured.r, strip, 3e-3 * strip);
    EXPECT_NEAR(coloured.g, 0.5 * strip, 3e-3 * strip);
    EXPECT_NEAR(coloured.b, 0.25 * strip, 3e-3 * strip);
    // Below one corner of its longer side, and of its shorter one: the strip lies along X.
    const double corner = 500.0 * kPi * corner_factor(2.0 / 3.0, 0.5 / 3.0);
    EXPECT_NEAR(lux_of(scene, 1, 2.0 + 1.0, 0.25).r, corner, 3e-3 * corner);
    const double disc = 1000.0 * kPi * 1.0 / (1.0 + 9.0);  // sin² of the half angle
    EXPECT_NEAR(lux_of(scene, 2, 4.0).g, disc, 3e-3 * disc);
    // Phi = pi L A, of light to the front alone.
    EXPECT_NEAR(scene->lights[2].profile->flux_lm * scene->lights[2].multiplier, kPi * 1000.0 * kPi, 0.1);
}

TEST_F(AssetsLights, AnAreaLightIsScaledWithItsScene) {
    Json document = with_lights("EXT_lights_area", R"([{"type": "rect", "luminance": 2000, "size": 0.1}])");
    const auto scene = load_scene(write("scene.gltf", document.dump()), "", {.scale = 0.5});
    ASSERT_TRUE(scene) << scene.error().text();
    // Half as far, half as long: the same light.
    const double square = 2000.0 * kPi * 4.0 * corner_factor(0.5 / 3.0, 0.5 / 3.0);
    EXPECT_NEAR(lux_of(*scene, 0, 0.0).g, square, 3e-3 * square);
}

TEST_F(AssetsLights, AnAreaLightComesBackFromASavedScene) {
    const auto scene = good(with_lights("EXT_lights_area", R"([{"type": "disc", "intensity": 700, "size": 0.1},
        {"type": "rect", "size": 0.1, "rect": {"aspect": 0.5}, "color": [0.2, 0.4, 0.1]}])"));
    const auto bytes = exchange::export_glb(scene_of(scene));
    ASSERT_TRUE(bytes) << bytes.error().text();
    const auto again = load_scene(write("again.glb", *bytes));
    ASSERT_TRUE(again) << again.error().text();
    ASSERT_EQ((*again)->lights.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ((*again)->lights[i].profile->photometry.opening.shape,
                  scene->lights[i].profile->photometry.opening.shape);
        const double x_m = 2.0 * static_cast<double>(i), lux = lux_of(scene, i, x_m).g;
        EXPECT_GT(lux, 1.0);
        EXPECT_NEAR(lux_of(*again, i, x_m).g, lux, 1e-4 * lux);
    }
}

TEST_F(AssetsLights, AreaLightsThatAreNone) {
    for (const auto& [light, where] :
         {std::pair(R"({"type": "sphere"})", "/type"), std::pair(R"({"type": "rect", "size": 0})", "/size"),
          std::pair(R"({"type": "rect", "rect": {"aspect": -1}})", "/rect/aspect"),
          std::pair(R"({"type": "disk", "intensity": -1})", "/intensity"),
          std::pair(R"({"type": "disk", "intensity": 1e12})", "/intensity"),
          std::pair(R"({"type": "rect", "color": [1, -1, 1]})", "/color"), std::pair(R"({"size": 1})", "/type")})
        refused(with_lights("EXT_lights_area", "[" + std::string(light) + "]"),
                "/extensions/EXT_lights_area/lights/0" + std::string(where));
    Json document = with_lights("EXT_lights_area", R"([{"type": "rect"}])");
    document["nodes"][1]["extensions"]["EXT_lights_area"]["light"] = 1;
    refused(document, "/nodes/1/extensions/EXT_lights_area/light");
    document["nodes"][1]["extensions"]["EXT_lights_area"]["light"] = 0;
    document["nodes"][1]["scale"] = {0, 0, 0};
    const auto flat = good(document);
    EXPECT_TRUE(flat->lights.empty());
    EXPECT_TRUE(warns(*flat, "was left out; changes lux (/nodes/1)"));
    document["nodes"][1]["scale"] = {1, 1, 1};
    document["extensions"]["KHR_lights_punctual"]["lights"] = Json::parse(R"([{"type": "point"}])");
    document["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    const auto both = good(document);
    EXPECT_EQ(both->lights.size(), 1u);
    EXPECT_TRUE(warns(*both, "the punctual light beside the area light was left out; changes lux (/nodes/1)"));
}

}  // namespace
}  // namespace gonio
