// What shaders draw of surfaces, against closed forms: reflectance is a capture's luminance × π over its illuminance.
#include <cmath>
#include <numbers>

#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

constexpr int kSide = 64;

// A square of 2 m around the origin that faces +Z, seen from the front and lit from there. change: of its asset.
Scene square_scene(const std::function<void(SceneAsset&)>& change, double uv = 1.0) {
    Mesh mesh = quad({-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    const auto t = static_cast<float>(uv);
    const glm::vec2 at[] = {{0, 0}, {t, 0}, {t, t}, {0, t}};
    for (std::size_t i = 0; i < 4; ++i) mesh.vertices[i].uv = at[i];
    auto asset =
        std::make_shared<SceneAsset>(*scene_with({{mesh, glm::vec3(0.5f)}}, isotropic(1000.0), {0, 0, 2}).asset);
    change(*asset);
    Scene scene = scene_of(asset);
    scene.width_px = scene.height_px = kSide;
    scene.camera = {{0.013, 0.007, 2.4}, {0.013, 0.007, 0.0}, 0.7};
    return scene;
}

// Reflectance at each pixel, rows from the top; negative: no surface, or it is dark.
std::vector<float> reflectance(const Scene& scene) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto luminance = renderer.capture(scene, View::luminance, kSide, kSide, true, 0),
               illuminance = renderer.capture(scene, View::illuminance, kSide, kSide, true, 0);
    std::vector<float> found;
    for (std::size_t i = 0; i < luminance->values.size(); i += 4) {
        const float lux = illuminance->values[i];
        found.push_back(lux > 0.0f ? luminance->values[i] * std::numbers::pi_v<float> / lux : -1.0f);
    }
    return found;
}

// x of the square's plane at a column's centre.
double across(int column) {
    return 0.013 + 2.4 * std::tan(0.35) * ((column + 0.5) / kSide * 2.0 - 1.0);
}

TEST(ShownMaterials, MirroredRepetitionTurnsOver) {
    const Scene scene = square_scene(
        [](SceneAsset& asset) {
            Image ramp{64, 1, {}};  // reflectance 0 to 0.9 along u
            for (int i = 0; i < 64; ++i) {
                const double linear = 0.9 * (i + 0.5) / 64,
                             encoded = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
                const auto byte = static_cast<std::uint8_t>(std::lround(255.0 * encoded));
                ramp.rgba.insert(ramp.rgba.end(), {byte, byte, byte, 255});
            }
            asset.images.push_back(ramp);
            Material& material = asset.materials[0];
            material.base_color = glm::vec4(1.0f);
            material.base_color_image = 0;
            material.wrap_s = material.wrap_t = Wrap::mirror;
        },
        3.0);
    const std::vector<float> found = reflectance(scene);
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const double u = 1.5 * (across(column) + 1.0), there = std::fmod(u, 2.0);
            ASSERT_NEAR(found[static_cast<std::size_t>(row * kSide + column)],
                        0.9 * (there > 1.0 ? 2.0 - there : there), 0.03)
                << u;
        }
    }
}

TEST(ShownMaterials, VertexColoursMultiplyAndCut) {
    const Scene scene = square_scene([](SceneAsset& asset) {
        // From 0.2 to 0.8 along x; alpha from 0 to 1.
        const glm::u16vec4 left(13107, 13107, 13107, 0), right(52428, 52428, 52428, 65535);
        asset.meshes[0].colors = {left, right, right, left};
        asset.materials[0].alpha_mask = true;
        asset.materials[0].base_color = glm::vec4(0.5f, 0.5f, 0.5f, 1.0f);
    });
    const std::vector<float> found = reflectance(scene);
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const double x = across(column), share = 0.5 * (x + 1.0);
            if (std::abs(x) < 0.01) continue;
            const float value = found[static_cast<std::size_t>(row * kSide + column)];
            ASSERT_NEAR(value, x < 0.0 ? -1.0 : 0.5 * (0.2 + 0.6 * share), 2e-3) << x;
        }
    }
}

TEST(ShownMaterials, BacksAreShownIfAskedFor) {
    for (const bool shown : {false, true}) {
        Scene scene = square_scene([&](SceneAsset& asset) { asset.materials[0].show_back = shown; });
        scene.camera.eye.z = -2.4;
        scene.lights[0].position.z = -2.0;
        const std::vector<float> found = reflectance(scene);
        EXPECT_NEAR(found[kSide * kSide / 2 + kSide / 2], shown ? 0.5 : -1.0, 2e-3);
    }
}

}  // namespace
}  // namespace gonio::test
