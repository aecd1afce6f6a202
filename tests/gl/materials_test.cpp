// What shaders draw of surfaces, against closed forms: reflectance is a capture's luminance × π over its illuminance.
#include <cmath>
#include <numbers>

#include "server/trace/sources.h"
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

// Under light from straight ahead a normal that is tilted by 30° has the cosine of it, in captures, the live picture
// and the reference; what comes after bounces does not see it.
TEST(ShownMaterials, ATiltedNormalHasItsCosine) {
    const double tilt = std::numbers::pi / 6;
    const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(127.5 * (value + 1.0))); };
    Scene scene = square_scene([&](SceneAsset& asset) {
        asset.images.push_back({1, 1, {byte(std::sin(tilt)), byte(0.0), byte(std::cos(tilt)), 255}, true});
        asset.materials[0].normal_image = 0;
        asset.meshes[0].tangents.assign(4, glm::vec4(1, 0, 0, 1));
    });
    scene.lights[0].position = {0, 0, 4};
    // Of a column and a row from the bottom of a square picture.
    const auto expected = [&](int column, int row, int side) {
        const double extent = 2.4 * std::tan(0.35);
        const glm::dvec3 to(-0.013 - extent * ((column + 0.5) / side * 2.0 - 1.0),
                            -0.007 - extent * ((row + 0.5) / side * 2.0 - 1.0), 4.0);
        return 1000.0 * glm::dot(glm::dvec3(std::sin(tilt), 0.0, std::cos(tilt)), to) / std::pow(glm::length(to), 3.0);
    };
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto picture = renderer.capture(scene, View::illuminance, kSide, kSide, true, 0);
    renderer.begin_frame(scene, monotonic_ns());
    while (!renderer.finish_frame(true)->report.settled()) renderer.begin_frame(scene, monotonic_ns());
    const std::vector<glm::vec3> live = renderer.live_illuminance(scene, false);
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const double lux = expected(column, row, kSide);
            ASSERT_NEAR(picture->values[static_cast<std::size_t>(4 * ((kSide - 1 - row) * kSide + column))], lux,
                        0.005 * lux);
            ASSERT_NEAR(live[static_cast<std::size_t>(row * kSide + column)].r, lux, 0.005 * lux);
        }
    }
    constexpr int kTraced = 16;
    trace::PictureRequest request;
    request.camera = scene.camera;
    request.width_px = request.height_px = kTraced;
    request.quantity = trace::Quantity::irradiance_direct;
    trace::Picture traced(trace::make_world(scene), request, {});
    traced.refine(60.0);
    const std::vector<float> values = traced.values();
    for (int row = 0; row < kTraced; ++row) {
        for (int column = 0; column < kTraced; ++column) {
            const double lux = expected(column, row, kTraced);
            ASSERT_NEAR(values[static_cast<std::size_t>(4 * ((kTraced - 1 - row) * kTraced + column))], lux,
                        0.005 * lux);
        }
    }
}

}  // namespace
}  // namespace gonio::test
