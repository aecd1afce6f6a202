// A picture that nobody touches gets better, at the price of its own passes only: links of the grid's points take the
// place of the surfels around them.
#include <set>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/trace/sources.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

using Ran = std::set<std::string>;

struct Refine : testing::Test {
    Refine() : renderer(context(), Renderer::Gather::simd), scene(scene_of(make_cornell())) {
        scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);
        scene.width_px = scene.height_px = 320;
        renderer.set_refinement(true);
        show(renderer, scene);
    }
    Ran frame() {
        renderer.begin_frame(scene, monotonic_ns());
        return passes_run(renderer.finish_frame(true)->report);
    }
    // Result: pictures that came of it.
    int refine_to_the_end(const Ran& passes) {
        int pictures = 0;
        for (int steps = 0; !renderer.refined(scene) && steps < 1000; ++steps) {
            if (!renderer.refine(scene, [] { return false; })) continue;
            EXPECT_EQ(frame(), passes);
            ++pictures;
        }
        EXPECT_TRUE(renderer.refined(scene));
        return pictures;
    }

    Renderer renderer;
    Scene scene;
};

TEST_F(Refine, ComesNearerToTheTruth) {
    const TracedPoints traced = traced_points(scene, 10, 0.01);
    const double live = rms_of(traced, renderer.live_illuminance(scene, true));
    EXPECT_GT(refine_to_the_end({"gather", "composite"}), 1);
    const double refined = rms_of(traced, renderer.live_illuminance(scene, true));
    std::printf("rms of indirect light: live %.4f, refined %.4f\n", live, refined);
    EXPECT_LT(refined, live);
    EXPECT_LT(refined, 0.06);
    EXPECT_EQ(frame(), Ran{}) << "nothing is left";
    EXPECT_FALSE(renderer.refine(scene, [] { return false; }));
}

TEST_F(Refine, ALevelKeepsItAMovedLightUsesItAndTheCameraEndsIt) {
    refine_to_the_end({"gather", "composite"});
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].level_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), Ran{"composite"});
    scene.lights[0].position.x += 0.1;
    scene.lights[0].position_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), (Ran{"surfels", "solve", "direct", "gather", "composite"}));
    while (!renderer.settled()) EXPECT_EQ(frame(), (Ran{"solve", "gather", "composite"}));
    EXPECT_TRUE(renderer.refined(scene)) << "links do not depend on light";
    scene.camera.eye.x += 0.1;
    scene.camera_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), (Ran{"gbuffer", "gather-weights", "direct", "gather", "composite"}));
    EXPECT_FALSE(renderer.refined(scene));
}

TEST_F(Refine, StopsWhenItIsAsked) {
    int asked = 0;
    EXPECT_FALSE(renderer.refine(scene, [&] { return ++asked > 0; }));
    EXPECT_GT(asked, 0);
    EXPECT_EQ(frame(), Ran{});
    // Whoever asks for something now and then does not keep it from ending.
    for (int i = 0; i < 1000 && !renderer.refined(scene); ++i) {
        int calls = 0;
        if (renderer.refine(scene, [&] { return ++calls > 2; })) frame();
    }
    EXPECT_TRUE(renderer.refined(scene));
}

TEST_F(Refine, ACaptureOfAnOlderSceneDoesNoHarm) {
    Scene smaller = scene;
    Light second = scene.lights[0];
    second.id = 9;
    second.name = "second";
    scene.lights.push_back(second);
    scene.lights_rev = ++scene.scene_rev;
    show(renderer, scene);
    smaller.width_px = smaller.height_px = 64;
    ASSERT_TRUE(renderer.capture(smaller, View::beauty, 32, 32, false));
    refine_to_the_end({"gather", "composite"});
}

}  // namespace
}  // namespace gonio::test
