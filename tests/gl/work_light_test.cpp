// The work light: what it shades, what knows nothing of it, and what it costs.
#include <cmath>
#include <set>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/apply_view.h"
#include "server/scene/scene.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

constexpr int kUnlitSide = 64;

// A grey square of 4 m that faces the camera, which is 3 m away.
Scene grey_square(float reflectance, const glm::vec3& emissive_nit = glm::vec3(0.0f)) {
    Scene scene =
        scene_with({{quad({-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}), glm::vec3(reflectance), emissive_nit}},
                   isotropic(100.0), {0, 0, 1});
    scene.lights.clear();
    scene.camera = {{0, 0, 3}, {0, 0, 0}, 0.8};
    scene.width_px = scene.height_px = kUnlitSide;
    return scene;
}

struct Frame {
    int luma = 0;  // Y' of NV12 in the middle of the newest picture
    std::set<std::string> ran;
};
Frame frame_of(Renderer& renderer, const Scene& scene) {
    Frame last;
    for (bool settled = false, first = true; !settled; first = false) {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        if (done->nv12)
            last.luma = (*done->nv12)[static_cast<std::size_t>(kUnlitSide) * kUnlitSide / 2 + kUnlitSide / 2];
        for (const v1::PassReport& row : done->report.passes())
            if (first && row.state() == "ran") last.ran.insert(row.name());
        settled = done->report.settled();
    }
    return last;
}

// IEC 61966-2-1 of a grey below the shoulder, in BT.709's limited range.
double luma_of(double linear) {
    return 16.0 + 219.0 * (1.055 * std::pow(linear, 1.0 / 2.4) - 0.055);
}

struct WorkLight : testing::TestWithParam<Renderer::DirectLight> {};

TEST_P(WorkLight, ShadesByReflectanceAndCosineAtEveryExposure) {
    Renderer renderer(context(), GetParam());
    make_coarse(renderer);
    for (const float reflectance : {0.2f, 0.5f}) {
        Scene scene = grey_square(reflectance);
        EXPECT_NEAR(frame_of(renderer, scene).luma, luma_of(0.7 * static_cast<double>(reflectance)), 1.5);
        scene.exposure_ev100 = -3;
        scene.exposure_rev = ++scene.scene_rev;
        EXPECT_NEAR(frame_of(renderer, scene).luma, luma_of(0.7 * static_cast<double>(reflectance)), 1.5);
        scene.camera = {{3 * std::sin(1.0), 0, 3 * std::cos(1.0)}, {0, 0, 0}, 0.4};
        scene.camera_rev = ++scene.scene_rev;
        EXPECT_NEAR(frame_of(renderer, scene).luma, luma_of(0.7 * static_cast<double>(reflectance) * std::cos(1.0)),
                    2.0);
    }
}

TEST_P(WorkLight, IsNoLightOfTheScene) {
    Renderer renderer(context(), GetParam());
    make_coarse(renderer);
    Scene scene = grey_square(0.5f);
    EXPECT_GT(frame_of(renderer, scene).luma, 100);
    for (const View view : {View::beauty, View::illuminance, View::luminance}) {
        const auto raw = renderer.capture(scene, view, 8, 8, true);
        for (std::size_t i = 0; i < raw->values.size(); ++i)
            EXPECT_EQ(raw->values[i], i % 4 == 3 ? 1.0f : 0.0f) << view_name(view);
    }
    const auto direct = renderer.capture(scene, View::direct, 8, 8, false);
    EXPECT_LE(direct->rgba8[4 * (4 * 8 + 4)], 1);
    scene.view = View::direct;
    scene.view_rev = ++scene.scene_rev;
    EXPECT_LT(frame_of(renderer, scene).luma, 20) << "of direct light there is none";
}

// sRGB of 0.7 · 0.5 on a square that faces the camera: 0.627 of 255.
TEST_P(WorkLight, IsInStillsAtEveryExposureAndWhateverTheLiveView) {
    Renderer renderer(context(), GetParam());
    make_coarse(renderer);
    Scene scene = grey_square(0.5f);
    const auto code = [&] { return int{renderer.capture(scene, View::beauty, 8, 8, false)->rgba8[4 * (4 * 8 + 4)]}; };
    for (const double ev100 : {6.0, -3.0}) {
        scene.exposure_ev100 = ev100;
        EXPECT_NEAR(code(), 160, 2);
    }
    scene.view = View::illuminance;
    EXPECT_NEAR(code(), 160, 2);
    scene.work_light = false;
    EXPECT_LE(code(), 1) << "it is switched off";
}

// Where surfaces merely glow, up to 1 cd/m² as glTF's emissiveFactor says it alone, their glow is added as exposed:
// 1 cd/m² at EV 3 is 1/9.6 of white. Then nothing changes for a surface that lights a room.
TEST_P(WorkLight, ShowsWhatIsBesideAGlow) {
    Renderer renderer(context(), GetParam());
    make_coarse(renderer);
    Scene scene = grey_square(0.5f, glm::vec3(1.0f));
    scene.exposure_ev100 = 3.0;
    EXPECT_TRUE(work_light_on(scene));
    EXPECT_NEAR(frame_of(renderer, scene).luma, luma_of(0.7 * 0.5 + 1.0 / 9.6), 2.0);
    const auto still = renderer.capture(scene, View::beauty, 8, 8, false);
    EXPECT_NEAR(still->rgba8[4 * (4 * 8 + 4)], 255 * (1.055 * std::pow(0.7 * 0.5 + 1.0 / 9.6, 1 / 2.4) - 0.055), 2.0);
    Scene shining = grey_square(0.5f, glm::vec3(1.01f));
    EXPECT_FALSE(work_light_on(shining)) << "a surface lights the scene";
    EXPECT_NE(why_no_work_light(shining).find("surfaces of the scene give light"), std::string::npos);
    v1::Command on;
    on.mutable_set_view()->set_work_light(true);
    const auto applied = apply(shining, on, {});
    ASSERT_TRUE(applied);
    EXPECT_EQ(applied->warnings, std::vector<std::string>{why_no_work_light(shining)}) << "who switches it on is told";
}

TEST_P(WorkLight, ShowsTheBodiesOfLuminairesAlone) {
    auto asset = std::make_shared<SceneAsset>();
    asset->materials.emplace_back();
    asset->bounds = {glm::dvec3(-1.0), glm::dvec3(1.0)};
    asset->lights.push_back({.name = "spot", .profile = isotropic(100.0)});
    Scene scene = scene_of(asset);
    EXPECT_TRUE(work_light_on(scene));
    scene = grey_square(0.5f);
    scene.lights = scene_of(asset).lights;
    EXPECT_FALSE(work_light_on(scene)) << "they light the square";
}

TEST_P(WorkLight, CostsAComposite) {
    Renderer renderer(context(), GetParam());
    make_coarse(renderer);
    Scene scene = grey_square(0.5f);
    frame_of(renderer, scene);
    v1::Command off;
    off.mutable_set_view()->set_work_light(false);
    ASSERT_TRUE(apply(scene, off, {}));
    const Frame dark = frame_of(renderer, scene);
    EXPECT_LT(dark.luma, 20);
    std::set<std::string> picture = {"composite"};
    if (GetParam() == Renderer::DirectLight::gl) picture.insert("nv12");
    EXPECT_EQ(dark.ran, picture);
}

INSTANTIATE_TEST_SUITE_P(Ways, WorkLight, testing::Values(Renderer::DirectLight::rays, Renderer::DirectLight::gl));

}  // namespace
}  // namespace gonio::test
