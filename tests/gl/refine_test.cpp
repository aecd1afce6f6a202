// A picture that nobody touches gets better, at the price of a composite for each pass of the final gather: links of
// the pixels' own take the place of the surfels around them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

using Ran = std::set<std::string>;

// Which passes run, and what they leave alone: a small picture of few surfels tells it.
struct Refine : testing::Test {
    explicit Refine(int side_px = 96, bool coarse = true)
        : renderer(context(), Renderer::DirectLight::rays), scene(scene_of(builtin("cornell"))) {
        scene.camera.eye += glm::dvec3(0.013, 0.007, 0.0);
        scene.width_px = scene.height_px = side_px;
        if (coarse) make_coarse(renderer);
        renderer.set_refinement(true);
        show(renderer, scene);
    }
    Ran frame() {
        renderer.begin_frame(scene, monotonic_ns());
        const v1::FrameReport report = renderer.finish_frame(true)->report;
        samples = report.samples_per_pixel();
        return passes_run(report);
    }
    // Result: pictures of better indirect light that came of it, after one of edges and one of shadows for each
    // luminaire that has none.
    int refine_to_the_end() {
        int pictures = 0;
        for (int steps = 0; !renderer.refined(scene) && steps < 1000; ++steps) {
            if (!renderer.refine(scene, [] { return false; })) continue;
            const unsigned before = samples;
            const Ran ran = frame();
            if (samples > before) {
                EXPECT_EQ(ran, Ran{"composite"}) << "edges";
                EXPECT_EQ(pictures, 0);
                continue;
            }
            if (ran == Ran{"direct", "composite"}) {
                EXPECT_EQ(pictures, 0) << "shadows first";
                continue;
            }
            EXPECT_EQ(ran, Ran{"composite"});
            ++pictures;
        }
        EXPECT_TRUE(renderer.refined(scene));
        return pictures;
    }

    Renderer renderer;
    Scene scene;
    unsigned samples = 1;  // of edges in the newest picture
};

// How good the picture gets is told by a large one.
struct RefinedPicture : Refine {
    RefinedPicture() : Refine(320, false) {}
};

TEST_F(RefinedPicture, ComesNearerToTheTruth) {
    const TracedPoints traced = traced_points(scene, 28, 0.01);
    const double live = rms_of(traced, renderer.live_illuminance(scene, true));
    EXPECT_EQ(refine_to_the_end(), 2);
    const double refined = rms_of(traced, renderer.live_illuminance(scene, true));
    std::printf("rms of indirect light: live %.4f, refined %.4f\n", live, refined);
    EXPECT_LT(refined, live);
    EXPECT_LT(refined, 0.03);
    EXPECT_EQ(frame(), Ran{}) << "nothing is left";
    EXPECT_FALSE(renderer.refine(scene, [] { return false; }));
}

// Of many luminaires too, those beyond what layers there are for included.
TEST(ManyRefine, TheFinalGatherComesToItsEnd) {
    for (const std::size_t count : {24u, 70u}) {
        Scene scene = scene_of(builtin("cornell"));
        scene.width_px = scene.height_px = 64;
        repeat_light(scene, count, [](Light& light, std::size_t i) {
            const auto k = static_cast<double>(i);
            if (i > 0) light.position += glm::dvec3(0.02 * k - 0.5, -0.01 * k, 0.3 * std::sin(k));
        });
        Renderer renderer(context(), Renderer::DirectLight::rays);
        make_coarse(renderer);
        renderer.set_refinement(true);
        show(renderer, scene);
        v1::FrameReport report;
        for (int steps = 0; !renderer.refined(scene) && steps < 5000; ++steps) {
            if (!renderer.refine(scene, [] { return false; })) continue;
            renderer.begin_frame(scene, monotonic_ns());
            report = renderer.finish_frame(true)->report;
        }
        EXPECT_TRUE(renderer.refined(scene)) << count;
        EXPECT_EQ(report.refined_rounds(), 2u) << count;
        EXPECT_EQ(report.samples_per_pixel(), 16u) << count;
    }
}

// A still of a narrow beam has its first bounce from where the beam falls, as the refined picture has it: links alone,
// of which few meet so small a spot, would make it grainy. (In a renderer of its own: what was refined is kept.)
TEST(Narrow, StillsAreTheRefinedPictures) {
    Scene scene = scene_of(builtin("cornell"));
    scene.lights.at(0).profile = cosine_power(20'000.0, 500.0);
    scene.width_px = scene.height_px = 96;
    Renderer renderer(context(), direct_light());
    renderer.set_surfels({0.06, 1000, 4000});
    renderer.set_links(transport::kMostLinks);
    const auto still = [&] { return renderer.capture(scene, View::indirect, 96, 96, true)->values; };
    const std::vector<float> before = still();
    renderer.set_refinement(true);
    show(renderer, scene);
    while (!renderer.refined(scene)) {
        if (!renderer.refine(scene, [] { return false; })) continue;
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
    }
    const std::vector<float> after = still();
    double squares = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < before.size(); ++i) {
        squares += static_cast<double>((before[i] - after[i]) * (before[i] - after[i]));
        sum += static_cast<double>(after[i]);
    }
    const double n = static_cast<double>(before.size());
    EXPECT_LT(std::sqrt(squares / n), 1e-3 * sum / n);
}

// Frames of another scene between the steps and tiles of a capture change nothing in its picture.
TEST(Narrow, ACaptureGoesOnWhileAnotherSceneIsShown) {
    Scene scene = scene_of(builtin("cornell")), other = scene_of(make_cornell());
    scene.lights.at(0).profile = cosine_power(20'000.0, 500.0);
    other.width_px = other.height_px = 32;
    const auto captured = [&](bool others) {
        Renderer renderer(context(), direct_light());
        make_coarse(renderer);
        const SceneAsset* awaited[] = {scene.asset.get(), other.asset.get()};
        renderer.set_awaited({std::begin(awaited), std::end(awaited)});
        const auto job = renderer.begin_capture(scene, View::indirect, 320, 320, true);
        bool done = false;
        for (int steps = 0; !done && steps < 100; ++steps) {
            done = renderer.continue_capture(*job);
            if (!others) continue;
            renderer.begin_frame(other, monotonic_ns());
            renderer.finish_frame(true);
        }
        EXPECT_TRUE(done);
        EXPECT_GT(job->columns() * job->rows(), 1);
        return job->picture->values;
    };
    const std::vector<float> alone = captured(false), among = captured(true);
    ASSERT_EQ(alone.size(), among.size());
    double most = 0.0, brightest = 0.0;
    for (std::size_t i = 0; i < alone.size(); ++i) {
        most = std::max(most, static_cast<double>(std::abs(alone[i] - among[i])));
        brightest = std::max(brightest, static_cast<double>(alone[i]));
    }
    EXPECT_LT(most, 1e-4 * brightest);
}

// A 6 degree beam on a floor, beside a black wall: what the wall has is one integral over the spot. There each point
// sees its own part of the spot from within what surfels resolve.
TEST(Narrow, BesideASpotTheWallHasTheIntegralOfIt) {
    constexpr double kReflectance = 0.5, kHeight_m = 3.0, kOff_m = 0.2;
    const auto profile = cosine_power(20'000.0, 500.0);
    Scene scene = scene_with({{quad({0, 0, 2}, {4, 0, 2}, {4, 0, -2}, {0, 0, -2}), glm::vec3(kReflectance)},
                              {quad({0, 0, 2}, {0, 0, -2}, {0, 3, -2}, {0, 3, 2}), glm::vec3(0.0f)}},
                             profile, {kOff_m, kHeight_m, 0.1});
    scene.camera.eye = {1.5, 0.6, 0.1};
    scene.camera.target = {0.0, 0.4, 0.1};
    scene.width_px = scene.height_px = 96;
    Renderer renderer(context(), direct_light());
    renderer.set_surfels({0.06, 1000, 4000});
    renderer.set_links(transport::kMostLinks);
    const glm::dquat light_from_world = glm::inverse(scene.lights[0].world_from_light);
    // Result: lux at a point of the wall.
    const auto expected = [&](const glm::dvec3& p) {
        constexpr double kSide_m = 1.2, kStep_m = 0.003;
        double sum = 0.0;
        for (double x = kStep_m / 2; x < kOff_m + kSide_m / 2; x += kStep_m) {
            for (double z = 0.1 + (kStep_m - kSide_m) / 2; z < 0.1 + kSide_m / 2; z += kStep_m) {
                const glm::dvec3 at(x, 0.0, z), from_light = at - glm::dvec3(kOff_m, kHeight_m, 0.1), d = p - at;
                const double r2 = glm::dot(from_light, from_light), d2 = glm::dot(d, d);
                const glm::dvec3 along = light_from_world * from_light / std::sqrt(r2);
                const double candela = ies::intensity(profile->photometry.web, {along.x, along.y, along.z}).in(cd);
                const double lux = candela * kHeight_m / std::sqrt(r2) / r2;
                sum += lux * d.y * x / (d2 * d2);
            }
        }
        return sum * kStep_m * kStep_m * kReflectance / std::numbers::pi;
    };
    renderer.set_refinement(true);
    show(renderer, scene);
    while (!renderer.refined(scene)) {
        if (!renderer.refine(scene, [] { return false; })) continue;
        renderer.begin_frame(scene, monotonic_ns());
        renderer.finish_frame(true);
    }
    const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, true);
    const PicturePoints seen = points_of(scene, *trace::make_world(scene)->geometry, 5);
    double squares = 0.0, off = 0.0, mean = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
        if (seen.points[i].normal.x < 0.5 || seen.points[i].position.y < 0.01) continue;
        const double is = expected(seen.points[i].position), by = static_cast<double>(shown[seen.pixels[i]].g) - is;
        squares += by * by, off += by, mean += is, ++count;
    }
    ASSERT_GT(count, 100);
    std::printf("wall beside a spot, %.1f lx: rms %.4f, bias %.4f\n", mean / count, std::sqrt(squares * count) / mean,
                off / mean);
    EXPECT_LT(std::sqrt(squares * count) / mean, 0.05);
    EXPECT_LT(std::abs(off) / mean, 0.01);
    for (const double y : {0.02, 0.05, 0.1, 0.2, 0.5, 1.5}) {
        const glm::dvec3 p(0.0, y, 0.16);
        const auto reading = renderer.meter(scene, p, {1, 0, 0}, Renderer::MeterQuality::interactive);
        const double lux = expected(p);
        std::printf("%.2f m: %.3f of %.3f lx\n", y, reading.indirect_lx(), lux);
        EXPECT_NEAR(reading.indirect_lx(), lux, 0.002 * lux) << y;
    }
}

// While it moves a shadow narrower than four pixels may be lost; at rest each pixel has a ray of its own.
TEST_F(RefinedPicture, ShadowsAreThoseOfEachPixel) {
    const auto picture =
        renderer.capture(scene, View::direct, scene.width_px, scene.height_px, true, trace::kAllBounces, 1);
    const auto wrong = [&] {
        const std::vector<glm::vec3> live = renderer.live_illuminance(scene, false);
        int count = 0;
        for (int y = 0; y < scene.height_px; ++y)
            for (int x = 0; x < scene.width_px; ++x) {
                const auto dark = [&](int px, int py) {
                    const int row = scene.height_px - 1 - std::clamp(py, 0, scene.height_px - 1);
                    const int column = std::clamp(px, 0, scene.width_px - 1);
                    return picture->values[4 * static_cast<std::size_t>(row * scene.width_px + column) + 1] == 0.0f;
                };
                // A pixel at a shadow's edge may be partly lit.
                const bool own = dark(x, y), edge = dark(x - 1, y) != own || dark(x + 1, y) != own ||
                                                    dark(x, y - 1) != own || dark(x, y + 1) != own;
                const auto at = static_cast<std::size_t>(y * scene.width_px + x);
                count += !edge && (live[at].g == 0.0f) != own ? 1 : 0;
            }
        return count;
    };
    const int moving = wrong();
    std::printf("pixels wrongly lit or dark while it moves: %d of %d\n", moving, scene.width_px * scene.height_px);
    EXPECT_GT(moving, 0);
    EXPECT_LT(moving, 3 * scene.width_px * scene.height_px / 1000);
    refine_to_the_end();
    EXPECT_LE(wrong(), moving / 5) << "of edges that two rasterisers draw";
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].level_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), Ran{"composite"});
    EXPECT_LE(wrong(), moving / 5) << "of edges that two rasterisers draw";
}

TEST_F(Refine, ALevelKeepsItAMovedLightAndTheCameraEndIt) {
    refine_to_the_end();
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].level_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), Ran{"composite"});
    EXPECT_TRUE(renderer.refined(scene));
    scene.lights[0].position.x += 0.1;
    scene.lights[0].position_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), (Ran{"surfels", "solve", "direct", "gather", "composite"}));
    while (!renderer.settled()) EXPECT_EQ(frame(), (Ran{"solve", "gather", "composite"}));
    EXPECT_FALSE(renderer.refined(scene));
    refine_to_the_end();
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
    refine_to_the_end();
}

// One of two moves: the other keeps what it has, and the picture follows in each frame.
TEST_F(Refine, OneThatMovesTakesNothingFromTheOther) {
    Light second = scene.lights[0];
    second.id = 9;
    second.name = "second";
    second.position.x += 0.3;
    scene.lights.push_back(second);
    scene.lights_rev = ++scene.scene_rev;
    show(renderer, scene);
    refine_to_the_end();
    const auto both = renderer.live_illuminance(scene, true);
    for (const double step : {0.1, -0.1}) {
        scene.lights[1].position.x += step;
        scene.lights[1].position_rev = ++scene.scene_rev;
        EXPECT_EQ(frame(), (Ran{"surfels", "solve", "direct", "gather", "composite"}));
    }
    while (!renderer.settled()) frame();
    EXPECT_EQ(refine_to_the_end(), 2);
    const auto again = renderer.live_illuminance(scene, true);
    double difference = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < both.size(); ++i) {
        difference += static_cast<double>(std::abs(both[i].g - again[i].g));
        sum += static_cast<double>(both[i].g);
    }
    EXPECT_LT(difference / sum, 1e-3) << "it came back to where it was";
}

// Interleaved links are no pattern: on a wall far from everything pixels a tile apart differ by the noise of a thousand
// links and no more.
TEST_F(RefinedPicture, NeighboursAgree) {
    refine_to_the_end();
    const auto lux = renderer.live_illuminance(scene, true);
    const int width = scene.width_px;
    double worst = 0.0, squares = 0.0;
    for (int y = 205; y < 225; ++y) {  // of the back wall
        for (int x = 120; x < 200; ++x) {
            const auto at = [&](int u, int v) {
                return static_cast<double>(lux[static_cast<std::size_t>(v * width + u)].g);
            };
            const double mean = (at(x - 4, y) + at(x + 4, y) + at(x, y - 4) + at(x, y + 4)) / 4.0;
            const double off = std::abs(at(x, y) - mean) / mean;
            worst = std::max(worst, off);
            squares += off * off;
        }
    }
    EXPECT_LT(worst, 0.05);
    EXPECT_LT(std::sqrt(squares / (20.0 * 80.0)), 0.01);
}

}  // namespace
}  // namespace gonio::test
