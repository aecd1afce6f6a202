// What shaders draw of surfaces, against closed forms: reflectance is a capture's luminance × π over its illuminance.
#include <cmath>
#include <numbers>

#include "server/scene/scene.h"
#include "server/trace/sources.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

constexpr int kPatchSide = 64;

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
    scene.width_px = scene.height_px = kPatchSide;
    scene.camera = {{0.013, 0.007, 2.4}, {0.013, 0.007, 0.0}, 0.7};
    return scene;
}

// Reflectance at each pixel, rows from the top; negative: no surface, or it is dark.
std::vector<float> reflectance(const Scene& scene) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const auto luminance = renderer.capture(scene, View::luminance, kPatchSide, kPatchSide, true, 0),
               illuminance = renderer.capture(scene, View::illuminance, kPatchSide, kPatchSide, true, 0);
    std::vector<float> found;
    for (std::size_t i = 0; i < luminance->values.size(); i += 4) {
        const float lux = illuminance->values[i];
        found.push_back(lux > 0.0f ? luminance->values[i] * std::numbers::pi_v<float> / lux : -1.0f);
    }
    return found;
}

// x of the square's plane at a column's centre.
double across(int column) {
    return 0.013 + 2.4 * std::tan(0.35) * ((column + 0.5) / kPatchSide * 2.0 - 1.0);
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
    for (int row = 0; row < kPatchSide; ++row) {
        for (int column = 0; column < kPatchSide; ++column) {
            const double u = 1.5 * (across(column) + 1.0), there = std::fmod(u, 2.0);
            ASSERT_NEAR(found[static_cast<std::size_t>(row * kPatchSide + column)],
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
    for (int row = 0; row < kPatchSide; ++row) {
        for (int column = 0; column < kPatchSide; ++column) {
            const double x = across(column), share = 0.5 * (x + 1.0);
            if (std::abs(x) < 0.01) continue;
            const float value = found[static_cast<std::size_t>(row * kPatchSide + column)];
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
        EXPECT_NEAR(found[kPatchSide * kPatchSide / 2 + kPatchSide / 2], shown ? 0.5 : -1.0, 2e-3);
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
    const auto picture = renderer.capture(scene, View::illuminance, kPatchSide, kPatchSide, true, 0);
    renderer.begin_frame(scene, monotonic_ns());
    while (!renderer.finish_frame(true)->report.settled()) renderer.begin_frame(scene, monotonic_ns());
    const std::vector<glm::vec3> live = renderer.live_illuminance(scene, false);
    for (int row = 0; row < kPatchSide; ++row) {
        for (int column = 0; column < kPatchSide; ++column) {
            const double lux = expected(column, row, kPatchSide);
            ASSERT_NEAR(picture->values[static_cast<std::size_t>(4 * ((kPatchSide - 1 - row) * kPatchSide + column))],
                        lux, 0.005 * lux);
            ASSERT_NEAR(live[static_cast<std::size_t>(row * kPatchSide + column)].r, lux, 0.005 * lux);
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

// A pane of 2 m at y = 1.5 over the right half of a floor, under a luminaire at y = 3. change: of its material.
Scene paned_floor(const std::function<void(Material&)>& change) {
    const Mesh floor = quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}),
               pane = quad({0, 1.5, 2}, {2, 1.5, 2}, {2, 1.5, -2}, {0, 1.5, -2});
    auto asset = std::make_shared<SceneAsset>(
        *scene_with({{floor, glm::vec3(0.5f)}, {pane, glm::vec3(0.8f)}}, isotropic(1000.0), {0, 3, 0}).asset);
    change(asset->materials[1]);
    Scene scene = scene_of(asset);
    scene.width_px = 128, scene.height_px = 96;
    scene.camera = {{0.013, 1.2, 0.007}, {0.013, 0.0, 0.0}, 1.2};  // below the pane
    return scene;
}

// Shadow rays take what passes: at grid points and pixels while something moves, at rest, in captures and meters.
// Shadow maps know all or nothing.
TEST(ShownGlass, DimsLightBehindIt) {
    for (const float alpha : {0.3f, 0.7f}) {
        const Scene scene = paned_floor([&](Material& material) {
            material.alpha_blend = true;
            material.base_color.a = alpha;
        });
        const bool rays = direct_light() != Renderer::DirectLight::gl;  // else those of what moves are maps
        const double passes = 1.0 - static_cast<double>(alpha), passes_moving = rays           ? passes
                                                                                : alpha < 0.5f ? 1.0
                                                                                               : 0.0;
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        for (const double x : {-0.5, 0.5}) {
            const double d2 = x * x + 9.0, expected = 1000.0 * 3.0 / (d2 * std::sqrt(d2)) * (x > 0.0 ? passes : 1.0);
            EXPECT_NEAR(
                renderer.meter(scene, {x, 0, 0.1 * x}, {0, 1, 0}, Renderer::MeterQuality::interactive, 0).direct_lx(),
                expected * std::pow(d2 / (d2 + 0.01 * x * x), 1.5), 0.001 * expected + 1e-3);
        }
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
        const std::vector<glm::vec3> moving = renderer.live_illuminance(scene, false);
        const auto captured = renderer.capture(scene, View::illuminance, 128, 96, true, 0);
        const double extent = 1.2 * std::tan(0.6);
        for (int row = 0; row < 96; ++row) {
            for (int column = 0; column < 128; ++column) {
                const double x = 0.013 + extent * 128 / 96 * ((column + 0.5) / 128 * 2.0 - 1.0);
                const std::size_t at = static_cast<std::size_t>(row * 128 + column),
                                  from_top = static_cast<std::size_t>((95 - row) * 128 + column);
                if (std::abs(x) < 0.05) continue;
                const double z = 0.007 - extent * ((row + 0.5) / 96 * 2.0 - 1.0), d2 = x * x + z * z + 9.0;
                const double open = 3000.0 / (d2 * std::sqrt(d2)), lux = open * (x > 0.0 ? passes : 1.0),
                             lux_moving = open * (x > 0.0 ? passes_moving : 1.0);
                ASSERT_NEAR(moving[at].r, lux_moving, 0.01 * lux_moving + 0.1) << x << " " << z;
                ASSERT_NEAR(captured->values[4 * from_top], lux, 0.01 * lux + 0.1) << x << " " << z;
            }
        }
    }
}

// A sphere that is half open and loses no light, around the luminaire in a diffuse sphere: as
// GlassPaths.AnInnerSphereChangesOnlyTheWay, by surfels and links.
TEST(ShownGlass, LinksPassAsOftenAsLight) {
    constexpr double radius = 2.0, rho = 0.5, passes = 0.4;
    auto asset = std::make_shared<SceneAsset>(
        *scene_with({{inward_sphere(radius, 96), glm::vec3(rho)}, {inward_sphere(0.8, 96), glm::vec3(1.0f)}},
                    isotropic(1000.0), {0, 0, 0})
             .asset);
    asset->materials[1].alpha_blend = true;
    asset->materials[1].base_color.a = static_cast<float>(1.0 - passes);
    const Scene scene = scene_of(asset);
    Renderer renderer(context(), Renderer::DirectLight::rays);
    make_coarse(renderer);
    const glm::dvec3 d = glm::normalize(glm::dvec3(0.3, -0.7, 0.5));
    const auto reading = renderer.meter(scene, d * radius * 0.999, -d, Renderer::MeterQuality::interactive);
    const double first = scene.lights[0].profile->flux_lm / (4 * std::numbers::pi * radius * radius);
    EXPECT_NEAR(reading.direct_lx(), passes * first, 0.002 * first);
    EXPECT_NEAR(reading.total_lx(), first / (1.0 - rho), 0.03 * first / (1.0 - rho));
}

// What shaders draw of coloured glass before a wall: the wall in its colour.
TEST(ShownGlass, ColouredGlassTintsWhatIsSeen) {
    const auto square = [](double z) { return quad({-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}); };
    auto asset = std::make_shared<SceneAsset>(
        *scene_with({{square(0.0), glm::vec3(0.4f), glm::vec3(3.0f)}, {square(0.5), glm::vec3(0.9f, 0.5f, 0.25f)}},
                    isotropic(1000.0), {0, 0, 4})
             .asset);
    asset->materials[1].transmission = 1.0f;
    for (const float nits : {0.0f, 3.0f}) {
        asset->materials[0].emissive_nit = glm::vec3(nits);
        Scene scene = scene_of(std::make_shared<SceneAsset>(*asset));
        scene.camera = {{0, 0, 2.0}, {0, 0, 0}, 0.5};
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const auto radiance = renderer.capture(scene, View::beauty, 32, 32, true, 0),
                   illuminance = renderer.capture(scene, View::illuminance, 32, 32, true, 0);
        for (std::size_t i = 0; i < radiance->values.size(); i += 4) {
            for (std::size_t k = 0; k < 3; ++k) {
                const float tint = asset->materials[1].base_color[static_cast<int>(k)],
                            expected = tint * (nits + 0.4f * illuminance->values[i + k] / std::numbers::pi_v<float>);
                ASSERT_NEAR(radiance->values[i + k], expected, 2e-3f * expected + 1e-3f) << i << " " << k;
            }
        }
    }
}

}  // namespace
}  // namespace gonio::test
