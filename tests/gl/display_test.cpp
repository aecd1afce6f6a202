// The picture that the CPU makes of the light against the one that shaders make: two ways, one maths source.
#include <algorithm>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

using Nv12 = std::shared_ptr<const std::vector<std::uint8_t>>;

struct Shown {
    View view;
    gonio::Look look;
};

// The pictures at rest of these views and looks, one after the other, of one renderer: the light is made once.
std::vector<Nv12> pictures(Renderer::DirectLight gather, Scene scene, const std::vector<Shown>& shown) {
    Renderer renderer(context(), gather);
    make_coarse(renderer);
    renderer.set_refinement(true);  // at rest both gather at every pixel
    Nv12 newest;
    const auto frame = [&] {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        if (done->nv12) newest = done->nv12;
        return done->report.settled();
    };
    std::vector<Nv12> all;
    for (const auto& [view, look] : shown) {
        scene.view = view;
        scene.look = look;
        scene.view_rev = scene.look_rev = ++scene.scene_rev;
        while (!frame()) {
        }
        while (!renderer.refined(scene)) renderer.refine(scene, [] { return false; });
        scene.look_rev = ++scene.scene_rev;
        frame();
        all.push_back(newest);
    }
    return all;
}

Nv12 picture(Renderer::DirectLight gather, const Scene& scene, View view) {
    return pictures(gather, scene, {{view, {}}}).front();
}

// How two pictures differ: the share of values that are more than 2 codes apart, and the mean difference in codes.
struct Difference {
    double off, bias;
};
Difference between(const Nv12& cpu, const Nv12& gpu) {
    EXPECT_EQ(cpu->size(), gpu->size());
    std::size_t off = 0;
    double sum = 0.0;
    for (std::size_t i = 0; i < cpu->size(); ++i) {
        const int difference = (*cpu)[i] - (*gpu)[i];
        sum += difference;
        off += std::abs(difference) > 2 ? 1 : 0;
    }
    const auto count = static_cast<double>(cpu->size());
    return {static_cast<double>(off) / count, sum / count};
}
Difference between(const Scene& scene, View view) {
    return between(picture(Renderer::DirectLight::rays, scene, view), picture(Renderer::DirectLight::gl, scene, view));
}

// Direct light differs at shadow edges only (rays against a shadow map), the rest by rounding.
TEST(Display, TheCpuShowsWhatShadersShow) {
    Scene scene = scene_of(builtin("cornell"));
    scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);  // else edges of the room run through the centres of pixels
    scene.width_px = 272;                               // not a multiple of the kernels' 64 pixels
    scene.height_px = 250;
    scene.view_gain = 2.0;
    const std::vector<Shown> views = {{View::beauty, {}},      {View::direct, {}},    {View::indirect, {}},
                                      {View::illuminance, {}}, {View::luminance, {}}, {View::solid, {}}};
    const std::vector<Nv12> cpu = pictures(Renderer::DirectLight::rays, scene, views),
                            gpu = pictures(Renderer::DirectLight::gl, scene, views);
    for (std::size_t i = 0; i < views.size(); ++i) {
        const View view = views[i].view;
        const Difference found = between(cpu[i], gpu[i]);
        // Of the solid view no final gather: a grid's indirect light on the CPU, each pixel's by shaders.
        EXPECT_LT(found.off, view == View::solid ? 0.05 : 0.02) << view_name(view);
        EXPECT_LT(std::abs(found.bias), 0.1) << view_name(view);
    }
}

// Each tone curve and another white, on the CPU and by shaders; and they differ from the default.
TEST(Display, LooksAreTheSameOnBoth) {
    Scene scene = scene_of(builtin("cornell"));
    scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);
    scene.width_px = 272;
    scene.height_px = 250;
    scene.exposure_ev100 -= 1.0;  // that some of it is bent
    const std::vector<Shown> looks = {{View::beauty, {}},
                                      {View::beauty, {Tone::linear, 0, 0}},
                                      {View::beauty, {Tone::aces, 0, 0}},
                                      {View::beauty, {Tone::agx, 0, 0}},
                                      {View::beauty, {Tone::neutral, 0, 0}},
                                      {View::beauty, {Tone::knee, 3200, 0.01}},
                                      {View::beauty, {Tone::agx, 9000, 0}}};
    const std::vector<Nv12> cpu = pictures(Renderer::DirectLight::rays, scene, looks),
                            gpu = pictures(Renderer::DirectLight::gl, scene, looks);
    for (std::size_t i = 0; i < looks.size(); ++i) {
        SCOPED_TRACE(i);
        const Difference found = between(cpu[i], gpu[i]);
        EXPECT_LT(found.off, 0.02);
        EXPECT_LT(std::abs(found.bias), 0.1);
        if (i > 0) {
            EXPECT_GT(between(cpu[i], cpu[0]).off, 0.05);
        }
    }
}

TEST(Display, WhatIsMeasuredHasNoLook) {
    Scene scene = scene_of(builtin("cornell"));
    scene.width_px = scene.height_px = 64;
    const std::vector<Nv12> lux = pictures(Renderer::DirectLight::gl, scene,
                                           {{View::illuminance, {}}, {View::illuminance, {Tone::agx, 3200, 0.0}}});
    EXPECT_EQ(*lux[0], *lux[1]);
}

// Textures, alpha masks, two-sided leaves and small triangles: the CPU rasterises what GL does. Levels of textures are
// told from a triangle's own scale rather than from neighbouring pixels.
TEST(Display, TheCpuDrawsWhatGlDraws) {
    Scene scene = scene_of(builtin("atrium"));
    scene.width_px = 320;
    scene.height_px = 240;
    // Its light is the same; shadow maps would differ. But where a pixel's rounding decides, another one is its cell's
    // second point.
    const Difference found = between(scene, View::indirect);
    EXPECT_LT(found.off, 0.02);
    EXPECT_LT(std::abs(found.bias), 0.15);
}

TEST(Display, EmittersAndEmptinessLookTheSame) {
    Scene scene = scene_with(
        {{quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}), glm::vec3(0.5f), glm::vec3(30.0f, 60.0f, 5.0f)}},
        isotropic(100.0), {0, 1.5, 0});
    scene.camera = {{0, 3, 0.001}, {0, 0, 0}, 1.2};  // sees past the emitter
    const auto cpu = picture(Renderer::DirectLight::rays, scene, View::beauty),
               gpu = picture(Renderer::DirectLight::gl, scene, View::beauty);
    for (std::size_t i = 0; i < cpu->size(); ++i) ASSERT_NEAR((*cpu)[i], (*gpu)[i], 2) << i;
}

}  // namespace
}  // namespace gonio::test
