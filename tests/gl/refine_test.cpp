// A picture that nobody touches gets better, without light that was not there, and at the price of its own passes only.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/trace/reference.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

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
        if (done->nv12) picture = *done->nv12;
        return passes_run(done->report);
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
    std::vector<std::uint8_t> picture;  // the newest
};

// The path tracer's one bounce at 256 pixels, against what the picture shows there.
TEST_F(Refine, ComesNearerToTheTruth) {
    const TracedPoints traced = traced_points(scene, 10, 0.01);
    const auto error = [&] {
        const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, true);
        double squares = 0.0, mean = 0.0;
        for (std::size_t i = 0; i < traced.points.size(); ++i) {
            const double off =
                trace::luminance(glm::dvec3(shown[traced.pixels[i]])) - trace::luminance(traced.truth[i].indirect_lx);
            squares += off * off - traced.truth[i].indirect_error_lx * traced.truth[i].indirect_error_lx;
            mean += trace::luminance(traced.truth[i].indirect_lx);
        }
        const auto count = static_cast<double>(traced.points.size());
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

// In 8-bit luma: the mean over the picture, and what one pixel in a thousand exceeds.
struct Step {
    double mean = 0.0;
    int most = 0;
};
Step step_between(const std::vector<std::uint8_t>& before, const std::vector<std::uint8_t>& after, std::size_t pixels) {
    Step step;
    std::vector<int> changes;
    for (std::size_t i = 0; i < pixels; ++i) {
        changes.push_back(std::abs(before[i] - after[i]));
        step.mean += changes.back() / static_cast<double>(pixels);
    }
    const auto at = changes.begin() + static_cast<std::ptrdiff_t>(pixels * 999 / 1000);
    std::nth_element(changes.begin(), at, changes.end());
    step.most = *at;
    return step;
}

// From one shown picture to the next the light changes by little: no step is more than 0.4 of all that refinement
// changes. The first round shown at once would be nine tenths of it.
TEST_F(Refine, DoesNotPop) {
    const auto pixels = static_cast<std::size_t>(scene.width_px * scene.height_px);
    std::vector<std::vector<std::uint8_t>> shown = {picture};
    while (!renderer.refined(scene)) {
        if (!renderer.refine(scene, [] { return false; })) continue;
        frame();
        shown.push_back(picture);
    }
    const Step whole = step_between(shown.front(), shown.back(), pixels);
    std::printf("refinement: %.2f, %d of 255; steps:", whole.mean, whole.most);
    for (std::size_t i = 1; i < shown.size(); ++i) {
        const Step step = step_between(shown[i - 1], shown[i], pixels);
        std::printf(" %.2f, %d;", step.mean, step.most);
        EXPECT_LT(step.mean, 0.4 * whole.mean) << i;
        EXPECT_LT(step.most, 0.4 * whole.most) << i;
        EXPECT_LT(step.mean, 0.6) << i;
    }
    std::printf("\n");
    EXPECT_GT(whole.mean, 1.5) << "else there is nothing to fade";
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

// Whoever asks for something now and then, such as a status page, neither waits for a band nor keeps it from ending.
TEST_F(Refine, EndsAlthoughItIsInterruptedAgainAndAgain) {
    const std::vector<glm::vec3> live = renderer.live_illuminance(scene, true);
    // The whole picture is a band at first. Seven of eight calls are stopped, while VPLs are cast or later.
    renderer.set_refinement(4);
    int stopped = 0, calls = 0, whole = 0;
    while (calls < 1000 && !renderer.refined(scene)) {
        int asked = 0;
        const int last = calls % 8 == 0 ? 1 << 30 : 2 + calls * 97 % std::max(whole / 2, 1);
        const bool better = renderer.refine(scene, [&] { return ++asked >= last; });
        if (calls++ == 0) whole = asked;
        if (asked >= last) {
            ++stopped;
            EXPECT_FALSE(better);
        }
        if (better) frame();
    }
    EXPECT_TRUE(renderer.refined(scene));
    EXPECT_GE(stopped, 5) << calls;
    // What was given up has left nothing behind: every pixel is lit about as before.
    double before = 0.0, after = 0.0;
    const std::vector<glm::vec3> now = renderer.live_illuminance(scene, true);
    for (std::size_t i = 0; i < live.size(); ++i) {
        before += trace::luminance(glm::dvec3(live[i]));
        after += trace::luminance(glm::dvec3(now[i]));
        EXPECT_EQ(now[i] == glm::vec3(0.0f), live[i] == glm::vec3(0.0f)) << i;
    }
    EXPECT_NEAR(after / before, 1.0, 0.03);
}

}  // namespace
}  // namespace gonio::test
