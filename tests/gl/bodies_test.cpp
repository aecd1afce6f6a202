// Bodies of luminaires in the picture: where they are, how they are lit, and that nothing else changes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/scene/scene.h"
#include "server/session/pick.h"
#include "server/trace/reference.h"
#include "tests/gl/body_scene.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

constexpr int kBodySide = 96;

// A floor under a luminaire of 100 cd, seen from 4 m above, of which 4 m are as high as the picture.
Scene floor_below() {
    Scene scene = floor_scene(20.0, 0.5f, isotropic(100.0), {0, 2, 0});
    scene.camera = {{0.0, 4.0, 0.0001}, {0.0, 0.0, 0.0}, 2.0 * std::atan(0.5)};
    scene.width_px = scene.height_px = kBodySide;
    return scene;
}

// The same with a box of 0.4 m, whose top is 1.3 m below the luminaire.
Scene with_box(const Scene& scene) {
    Scene with = scene;
    with.asset = with_box_body(*scene.asset, {0.8, 0.5, 0.1}, 0.4);
    with.traced = nullptr, with.drawn = nullptr;
    return with;
}

// Whether a pixel, rows from the top, shows the box, or may; where its ray meets a height, m.
glm::dvec2 at_height(int x, int y, double height_m) {
    const double scale = (4.0 - height_m) / 4.0;
    return scale * glm::dvec2(((x + 0.5) / kBodySide - 0.5) * 4.0, ((y + 0.5) / kBodySide - 0.5) * 4.0);
}
bool in_box(const glm::dvec2& at, double slack) {
    return std::abs(at.x - 0.8) < 0.2 + slack && std::abs(at.y - 0.1) < 0.2 + slack;
}

// Illuminance on its top is that of the closed form, and the floor around is as it was, bit for bit: it has no shadow.
TEST(Bodies, AreLitAndChangeNothingElse) {
    Renderer renderer(context(), direct_light());
    make_coarse(renderer);
    const Scene without = floor_below(), with = with_box(without);
    const auto lux = [&](const Scene& scene) {
        return renderer.capture(scene, View::illuminance, kBodySide, kBodySide, true, trace::kAllBounces, 1)->values;
    };
    const std::vector<float> seen = lux(with), bare = lux(without);
    int top = 0, same = 0;
    for (int y = 0; y < kBodySide; ++y)
        for (int x = 0; x < kBodySide; ++x) {
            const std::size_t i = std::size_t{4} * static_cast<std::size_t>(y * kBodySide + x);
            const glm::dvec2 above = at_height(x, y, 0.7), below = at_height(x, y, 0.3);
            if (in_box(above, -0.03)) {
                const double d2 = 1.3 * 1.3 + glm::dot(above, above), expected = 100.0 * 1.3 / std::pow(d2, 1.5);
                EXPECT_NEAR(seen[i], expected, 0.01 * expected) << x << " " << y;
                ++top;
            } else if (!in_box(above, 0.05) && !in_box(below, 0.05)) {
                EXPECT_EQ(seen[i], bare[i]) << x << " " << y;
                ++same;
            }
        }
    EXPECT_GT(top, 80);
    EXPECT_GT(same, 7500);
    EXPECT_EQ(renderer.meter(with, {0.8, 0, 0.1}, {0, 1, 0}, Renderer::MeterQuality::interactive).total_lx(),
              renderer.meter(without, {0.8, 0, 0.1}, {0, 1, 0}, Renderer::MeterQuality::interactive).total_lx());
}

// In a diffuse sphere every plane receives rho Phi / (4 pi R²) / (1 - rho) after bounces: while it moves by links of
// the body's sides, at rest by those of each pixel; on the CPU, and where shaders gather.
TEST(Bodies, IndirectLightOfASphere) {
    constexpr double kRho = 0.5, kRadius = 2.0;
    const Scene sphere = scene_with({{inward_sphere(kRadius, 48), glm::vec3(kRho)}}, isotropic(100.0), {0, 0, 0});
    Scene scene = sphere;
    scene.asset = with_box_body(*sphere.asset, {0.5, -0.2, -0.4}, 0.5);
    scene.traced = nullptr, scene.drawn = nullptr;
    scene.camera = {{-0.6, 0.5, 1.2}, {0.5, -0.2, -0.4}, 0.6};
    scene.width_px = scene.height_px = 32;
    const double expected = kRho * 100.0 / (kRadius * kRadius) / (1.0 - kRho);
    for (const auto way : {Renderer::DirectLight::rays, Renderer::DirectLight::gl}) {
        Renderer renderer(context(), way);
        make_coarse(renderer);
        renderer.set_refinement(true);
        const auto in_the_middle = [&] {
            const std::vector<glm::vec3> lux = renderer.live_illuminance(scene, true);
            for (int y = 13; y < 19; ++y)
                for (int x = 13; x < 19; ++x)
                    EXPECT_NEAR(lux[static_cast<std::size_t>(y * 32 + x)].g, expected, 0.04 * expected)
                        << x << " " << y;
        };
        bool settled = false;
        while (!settled) {
            renderer.begin_frame(scene, monotonic_ns());
            settled = renderer.finish_frame(true)->report.settled();
        }
        in_the_middle();
        while (!renderer.refined(scene)) renderer.refine(scene, [] { return false; });
        in_the_middle();
    }
}

// The two rasterisers agree, and so does the reference.
TEST(Bodies, TheCpuGlAndTheReferenceSeeTheSame) {
    Scene scene = scene_of(builtin("cornell"));
    const Bounds& room = scene.asset->bounds;
    const glm::dvec3 middle = glm::mix(0.5 * (room.min + room.max), scene.lights[0].position, 0.4);
    scene.asset = with_box_body(*scene.asset, middle, 0.1 * glm::length(room.max - room.min));
    scene.traced = nullptr, scene.drawn = nullptr;
    scene.width_px = scene.height_px = kBodySide;
    v1::Command turn;
    turn.mutable_set_light()->set_name(scene.lights[0].name);
    turn.mutable_set_light()->set_tilt_rad(0.3);
    std::vector<std::vector<float>> nits;
    for (const auto way : {Renderer::DirectLight::rays, Renderer::DirectLight::gl}) {
        Renderer renderer(context(), way);
        make_coarse(renderer);
        ASSERT_TRUE(apply(scene, turn, {}));
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
        const std::vector<glm::vec3> lux = renderer.live_illuminance(scene, false);
        std::vector<float>& own = nits.emplace_back();
        for (int y = kBodySide; y-- > 0;)  // from the top
            for (int x = 0; x < kBodySide; ++x) own.push_back(lux[static_cast<std::size_t>(y * kBodySide + x)].g);
    }
    trace::PictureRequest request{scene.camera, kBodySide, kBodySide, trace::Quantity::irradiance_direct};
    trace::Picture picture(trace::make_world(scene), request, {.max_passes = 8});
    while (!picture.refine(0.1).complete) {
    }
    const std::vector<float> truth = picture.values();
    float mean = 0.0f;
    for (std::size_t i = 0; i < nits[0].size(); ++i) mean += truth[4 * i + 1] / static_cast<float>(nits[0].size());
    for (const std::vector<float>& own : nits) {
        std::size_t off = 0;
        for (std::size_t i = 0; i < own.size(); ++i)
            off += std::abs(own[i] - truth[4 * i + 1]) > 0.05f * (mean + truth[4 * i + 1]) ? 1 : 0;
        EXPECT_LT(off, own.size() / 50) << "edges of shadows and of surfaces";
    }
    // And they see it: it covers some of the picture.
    Scene bare = scene;
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    asset->bodies = nullptr;
    bare.asset = asset;
    trace::Picture without(trace::make_world(bare), request, {.max_passes = 8});
    while (!without.refine(0.1).complete) {
    }
    const std::vector<float> empty = without.values();
    std::size_t changed = 0;
    for (std::size_t i = 0; i < nits[0].size(); ++i) changed += truth[4 * i + 1] != empty[4 * i + 1] ? 1 : 0;
    EXPECT_GT(changed, 60u);
    EXPECT_LT(changed, 1500u);
}

TEST(Bodies, APickNamesTheirLight) {
    const Scene scene = with_box(floor_below());
    v1::PickQuery query;
    query.set_x(0.5 + 0.8 / 4.0 * 4.0 / 3.3);
    query.set_y(0.5 + 0.1 / 4.0 * 4.0 / 3.3);
    const auto picked = pick_at(scene, query);
    ASSERT_TRUE(picked && picked->pick.hit());
    EXPECT_EQ(picked->pick.node(), scene.lights[0].name);
    EXPECT_LT(glm::distance(picked->point.position, glm::dvec3(0.8, 0.7, 0.1)), 0.001);
    query.set_x(0.2);
    EXPECT_NE(pick_at(scene, query)->pick.node(), scene.lights[0].name);
}

}  // namespace
}  // namespace gonio::test
