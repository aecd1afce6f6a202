// A picture that nobody touches gets better, without light that was not there, and at the price of its own passes only.
#include <cmath>

#include <set>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/trace/reference.h"
#include "server/trace/world.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

using Ran = std::set<std::string>;

struct Refine : testing::Test {
    Refine() : renderer(context(), Renderer::Gather::simd), scene(scene_of(make_cornell())) {
        scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);
        scene.width_px = scene.height_px = 160;
        renderer.set_refinement(3);
        frame();
    }
    Ran frame() {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        Ran ran;
        for (const v1::PassReport& row : done->report.passes()) {
            if (row.state() == "ran") ran.insert(row.name());
        }
        return ran;
    }
    // Result: pictures that came of it.
    int refine_to_the_end() {
        int pictures = 0;
        for (int steps = 0; !renderer.refined(scene) && steps < 1000; ++steps) {
            if (!renderer.refine(scene, [] { return false; })) continue;
            EXPECT_EQ(frame(), (Ran{"refine", "composite"}));
            ++pictures;
        }
        EXPECT_TRUE(renderer.refined(scene));
        return pictures;
    }

    Renderer renderer;
    Scene scene;
};

// The path tracer's one bounce at 256 pixels, against what the picture shows there.
TEST_F(Refine, ComesNearerToTheTruth) {
    const auto world = trace::make_world(scene);
    const auto [points, pixels] = points_of(scene, *world->geometry, 10);
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.01;
    const std::vector<trace::Reading> truth = trace::measure(*world, points, settings);
    const auto error = [&, &points = points, &pixels = pixels] {
        const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, true);
        double squares = 0.0, mean = 0.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double off = trace::luminance(glm::dvec3(shown[pixels[i]])) - trace::luminance(truth[i].indirect_lx);
            squares += off * off - truth[i].indirect_error_lx * truth[i].indirect_error_lx;
            mean += trace::luminance(truth[i].indirect_lx);
        }
        const auto count = static_cast<double>(points.size());
        return std::sqrt(std::max(squares, 0.0) / count) / (mean / count);
    };
    const double live = error();
    refine_to_the_end();
    const double refined = error();
    EXPECT_LT(refined, 0.6 * live) << "live " << live;
    EXPECT_LT(refined, 0.12);  // the picture's pixels are large: the windows of 4 of them see far
}

TEST_F(Refine, RunsItsOwnPassesAndEnds) {
    EXPECT_EQ(refine_to_the_end(), 3 + 3) << "three rounds, the first in four steps";
    EXPECT_EQ(frame(), Ran{}) << "nothing is left";
    EXPECT_FALSE(renderer.refine(scene, [] { return false; }));
}

TEST_F(Refine, ALevelKeepsItAndAMoveEndsIt) {
    refine_to_the_end();
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].level_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), Ran{"composite"});
    EXPECT_TRUE(renderer.refined(scene));
    scene.lights[0].position.x += 0.1;
    scene.lights[0].position_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), (Ran{"vpl", "occlusion", "direct", "gather", "composite"}));
    EXPECT_FALSE(renderer.refined(scene));
}

// Two luminaires share the rounds; what one of them does must not reach the other's light.
TEST_F(Refine, LuminairesComeAndGo) {
    Light second = scene.lights[0];
    second.id = 7;
    second.name = "second";
    second.position.x += 0.5;
    scene.lights.push_back(second);
    scene.lights_rev = ++scene.scene_rev;
    EXPECT_FALSE(renderer.refine(scene, [] { return true; }));  // before a frame has shown it: no harm
    do frame();
    while (!renderer.settled());
    refine_to_the_end();
    const auto light_of_second = [&] {
        Scene only = scene;
        only.lights[0].level_ratio = 0.0;
        only.lights[0].level_rev = ++scene.scene_rev;
        only.scene_rev = scene.scene_rev;
        return renderer.live_illuminance(only, true);
    };
    const std::vector<glm::vec3> before = light_of_second();
    // The first moves and is refined: the second stays as it is, to the bit.
    scene.lights[0].position.x += 0.1;
    scene.lights[0].position_rev = ++scene.scene_rev;
    frame();
    for (int i = 0; i < 1000 && !renderer.refined(scene); ++i) {
        if (renderer.refine(scene, [] { return false; })) frame();
        EXPECT_EQ(light_of_second(), before);
    }
    EXPECT_TRUE(renderer.refined(scene));
    // One less: more rounds for the other, and an end.
    scene.lights.erase(scene.lights.begin() + 1);
    scene.lights_rev = ++scene.scene_rev;
    frame();
    for (int i = 0; i < 1000 && !renderer.refined(scene); ++i) {
        if (renderer.refine(scene, [] { return false; })) frame();
    }
    EXPECT_TRUE(renderer.refined(scene));
}

TEST_F(Refine, ACaptureOfAnOlderSceneDoesNoHarm) {
    const Scene old = scene;
    Light second = scene.lights[0];
    second.id = 9;
    second.name = "second";
    scene.lights.push_back(second);
    scene.lights_rev = ++scene.scene_rev;
    do frame();
    while (!renderer.settled());
    Scene smaller = old;
    smaller.width_px = smaller.height_px = 64;
    ASSERT_TRUE(renderer.capture(smaller, View::beauty, 32, 32, false));
    for (int i = 0; i < 1000 && !renderer.refined(scene); ++i) {
        if (!renderer.refine(scene, [] { return false; })) continue;
        EXPECT_EQ(frame(), (Ran{"refine", "composite"}));
    }
    EXPECT_TRUE(renderer.refined(scene));
}

TEST_F(Refine, StopsWhenItIsAsked) {
    int asked = 0;
    EXPECT_FALSE(renderer.refine(scene, [&] { return ++asked > 0; }));
    EXPECT_GT(asked, 0);
    EXPECT_EQ(frame(), Ran{});
}

}  // namespace
}  // namespace gonio::test
