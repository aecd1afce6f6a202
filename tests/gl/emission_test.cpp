// Emissive surfaces as sources of light: the picture against the reference, and what their light costs.
#include <cmath>
#include <set>
#include <string>

#include "server/scene/scene.h"
#include "tests/gl/picture_points.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

constexpr float kPanelNit = 5000.0f;

// A closed room with a block, a luminous panel of 0.8 m × 0.8 m below the ceiling and a luminaire.
Scene lit_by_a_panel() {
    const double x = 2.0, y = 3.0, z = 2.0;
    std::vector<Piece> pieces = {
        {quad({-x, 0, z}, {x, 0, z}, {x, 0, -z}, {-x, 0, -z}), glm::vec3(0.5f)},
        {quad({-x, y, -z}, {x, y, -z}, {x, y, z}, {-x, y, z}), glm::vec3(0.7f)},
        {quad({-x, 0, -z}, {x, 0, -z}, {x, y, -z}, {-x, y, -z}), glm::vec3(0.6f)},
        {quad({x, 0, z}, {-x, 0, z}, {-x, y, z}, {x, y, z}), glm::vec3(0.6f)},
        {quad({-x, 0, z}, {-x, 0, -z}, {-x, y, -z}, {-x, y, z}), glm::vec3(0.7f, 0.2f, 0.2f)},
        {quad({x, 0, -z}, {x, 0, z}, {x, y, z}, {x, y, -z}), glm::vec3(0.2f, 0.6f, 0.2f)},
        {quad({-0.7, 0.8, 0.4}, {0.7, 0.8, 0.4}, {0.7, 0.8, -0.4}, {-0.7, 0.8, -0.4}), glm::vec3(0.5f)},
        {quad({-0.7, 0, 0.4}, {0.7, 0, 0.4}, {0.7, 0.8, 0.4}, {-0.7, 0.8, 0.4}), glm::vec3(0.5f)}};
    pieces.push_back({quad({-0.4, 2.9, -0.4}, {0.4, 2.9, -0.4}, {0.4, 2.9, 0.4}, {-0.4, 2.9, 0.4}), glm::vec3(0.0f),
                      glm::vec3(kPanelNit)});
    Scene scene = scene_with(std::move(pieces), isotropic(20.0), {1.2, 1.8, 0.8});
    scene.camera.eye = {0.3, 1.6, 1.9};
    scene.camera.target = {0.0, 1.3, -1.0};
    scene.camera.fov_rad = 1.3;
    scene.width_px = scene.height_px = 160;
    return scene;
}

// The same asset each time: a renderer takes the surfels and links of the one before.
const Scene& panel_room() {
    static const Scene scene = lit_by_a_panel();
    return scene;
}

class Emission : public testing::TestWithParam<Renderer::DirectLight> {
protected:
    using Ran = std::set<std::string>;
    Ran frame() {
        renderer.begin_frame(scene, 0);
        const auto done = renderer.finish_frame(true);
        settled = done->report.settled();
        Ran ran;
        for (const v1::PassReport& row : done->report.passes()) {
            if (row.state() == "ran") ran.insert(row.name());
        }
        return ran;
    }
    void settle() {
        int frames = 0;
        do {
            frame();
            ASSERT_LT(++frames, 5);
        } while (!settled);
    }
    void refine() {
        while (!renderer.refined(scene)) renderer.refine(scene, [] { return false; });
        frame();
    }
    Emission() { renderer.set_refinement(true); }
    Renderer renderer{context(), GetParam()};
    Scene scene = panel_room();
    bool settled = false;
};
INSTANTIATE_TEST_SUITE_P(Shading, Emission, testing::Values(Renderer::DirectLight::gl, Renderer::DirectLight::rays),
                         [](const auto& test) { return test.param == Renderer::DirectLight::gl ? "gl" : "simd"; });

TEST_P(Emission, LightsThePictureAsTheReferenceSays) {
    static const TracedPoints traced = traced_points(scene, 20, 0.01);
    ASSERT_GT(traced.points.size(), 50u);
    for (const bool at_rest : {false, true}) {
        if (at_rest)
            refine();
        else
            settle();
        double squares[2] = {}, sum[2] = {}, off[2] = {};
        for (const int indirect : {0, 1}) {
            const std::vector<glm::vec3> shown = renderer.live_illuminance(scene, indirect != 0);
            for (std::size_t i = 0; i < traced.points.size(); ++i) {
                const double truth = (indirect != 0 ? traced.truth[i].indirect_lx : traced.truth[i].direct_lx).g,
                             here = static_cast<double>(shown[traced.pixels[i]].g);
                squares[indirect] += std::pow(here - truth, 2.0);
                off[indirect] += here - truth;
                sum[indirect] += truth;
            }
        }
        for (const int indirect : {0, 1}) {
            const auto n = static_cast<double>(traced.points.size());
            const double mean = sum[indirect] / n, rms = std::sqrt(squares[indirect] / n) / mean;
            std::printf("%s, %s: rms %.4f, bias %.4f of %.1f lx\n", at_rest ? "at rest" : "at once",
                        indirect != 0 ? "indirect" : "direct", rms, off[indirect] / sum[indirect], mean);
            EXPECT_LT(rms, indirect != 0 ? 0.03 : 0.04) << "penumbrae are blurred over the spacing of surfels";
            EXPECT_LT(std::abs(off[indirect] / sum[indirect]), 0.01);
        }
    }
}

TEST_P(Emission, CostsNothingUntilTheCameraMoves) {
    settle();
    EXPECT_EQ(frame(), Ran{});
    const Ran picture = GetParam() == Renderer::DirectLight::gl ? Ran{"composite", "nv12"} : Ran{"composite"};
    scene.lights[0].level_ratio = 0.5;
    scene.lights[0].level_rev = ++scene.scene_rev;
    EXPECT_EQ(frame(), picture);
    scene.lights[0].position.x -= 0.1;
    scene.lights[0].position_rev = ++scene.scene_rev;
    Ran moved = frame();
    EXPECT_TRUE(moved.contains("solve"));
    EXPECT_FALSE(moved.contains("gather-emitted"));
    settle();
    scene.camera.eye.x += 0.1;
    scene.camera_rev = ++scene.scene_rev;
    EXPECT_TRUE(frame().contains("gather-emitted"));
    EXPECT_EQ(frame(), Ran{});
}

// The seed technique has none of it, whatever was shown before.
TEST_P(Emission, SeedHasNoneOfIt) {
    scene.lights[0].level_ratio = 0.0;
    scene.lights[0].level_rev = ++scene.scene_rev;
    settle();
    scene.technique = Technique::seed;
    scene.samples = 16;
    scene.technique_rev = ++scene.scene_rev;
    frame();
    for (const bool indirect : {false, true}) {
        for (const glm::vec3& lx : renderer.live_illuminance(scene, indirect)) ASSERT_EQ(lx, glm::vec3(0.0f));
    }
}

// Light of luminaires that were summed does not stay when all that remain have layers.
TEST_P(Emission, SummedLightGoesWithItsLuminaires) {
    renderer.set_layer_bytes(2 * (160 * 160 * 28 + 20'000 * 72));
    const Light one = scene.lights[0];
    for (int i = 0; i < 8; ++i) {
        scene.lights.push_back(one);
        scene.lights.back().id = scene.next_light_id++;
        scene.lights.back().name += std::to_string(i);
    }
    scene.lights_rev = ++scene.scene_rev;
    settle();
    for (const View view : {View::luminance, View::beauty}) {
        scene.view = view;
        scene.view_rev = ++scene.scene_rev;
        settle();
    }
    scene.lights.resize(1);
    scene.lights_rev = ++scene.scene_rev;
    scene.view = View::luminance;
    scene.view_rev = scene.scene_rev;
    settle();
    Renderer fresh(context(), GetParam());
    show(fresh, scene);
    for (const bool indirect : {false, true}) {
        const auto shown = renderer.live_illuminance(scene, indirect), wanted = fresh.live_illuminance(scene, indirect);
        double off = 0.0, sum = 0.0;
        for (std::size_t i = 0; i < shown.size(); ++i) {
            off += static_cast<double>(std::abs(shown[i].g - wanted[i].g));
            sum += static_cast<double>(wanted[i].g);
        }
        EXPECT_LT(off, 0.01 * sum);
    }
}

// What a picture shows of the panel itself, and of a room that nothing else lights.
TEST_P(Emission, AloneInTheRoom) {
    scene.lights.clear();
    const auto picture = renderer.capture(scene, View::luminance, 64, 64, true);
    float brightest = 0.0f, dimmest = 1e9f;
    for (std::size_t i = 0; i < picture->values.size(); i += 4) {
        brightest = std::max(brightest, picture->values[i]);
        dimmest = std::min(dimmest, picture->values[i]);
    }
    EXPECT_FLOAT_EQ(brightest, kPanelNit);
    EXPECT_GT(dimmest, 1.0f) << "every surface is lit";
    settle();
    EXPECT_EQ(frame(), Ran{});
}

TEST_P(Emission, AMeterCountsItByBounces) {
    const glm::dvec3 point(1.2, 0.0, 1.2), up(0, 1, 0);
    const auto reading = [&](int bounces) {
        return renderer.meter(scene, point, up, Renderer::MeterQuality::interactive, bounces);
    };
    for (const int bounces : {0, 1, trace::kAllBounces}) {
        trace::Settings settings;
        settings.bounces = bounces;
        settings.noise = 0.002;
        const trace::MeterPoint at[] = {{point, up}};
        const auto truth = trace::measure(*trace::make_world(scene), at, settings).front();
        const auto luminance = [](const glm::dvec3& rgb) { return glm::dot(rgb, glm::dvec3(0.2126, 0.7152, 0.0722)); };
        EXPECT_NEAR(reading(bounces).direct_lx(), luminance(truth.direct_lx), 0.01 * luminance(truth.direct_lx));
        EXPECT_NEAR(reading(bounces).indirect_lx(), luminance(truth.indirect_lx),
                    0.03 * luminance(truth.indirect_lx) + 1e-9)
            << bounces;
    }
}

}  // namespace
}  // namespace gonio::test
