// The exposure that is metered against closed forms, and when the automatic one moves.
#include "server/trace/exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <numbers>

#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/auto_exposure.h"
#include "tests/scenes/bench_scenes.h"
#include "tests/scenes/scenes.h"
#include "tests/unit/server/changing_scene.h"

namespace gonio::test {
namespace {

// In a diffuse sphere all is of one luminance: rho/pi · flux / (4 pi R²) / (1 - rho).
TEST(Exposure, OfADiffuseSphere) {
    constexpr double radius = 2.0, rho = 0.5;
    for (const double candela : {0.1, 100.0, 1e6}) {
        Scene scene =
            scene_with({{inward_sphere(radius, 128), glm::vec3(rho)}}, isotropic(candela), glm::dvec3(0, 0, 0));
        scene.camera = {{0.3, 0.1, 0.0}, {1.0, 0.2, 0.1}, 1.2};
        const double nit = rho / std::numbers::pi * candela / (radius * radius) / (1.0 - rho);
        const auto ev100 = trace::metered_ev100(scene);
        ASSERT_TRUE(ev100);
        EXPECT_NEAR(*ev100, std::log2(nit / 0.48), 0.15) << candela << " cd: noise has a bright half";
        EXPECT_EQ(trace::metered_ev100(scene), ev100) << "again";
        scene.lights[0].level_ratio = 0.25;
        EXPECT_NEAR(*trace::metered_ev100(scene), *ev100 - 2.0, 0.01);
        scene.width_px = 4096, scene.height_px = 16;
        EXPECT_NEAR(*trace::metered_ev100(scene), *ev100 - 2.0, 0.05);
        scene.lights[0].level_ratio = 0.0;
        EXPECT_FALSE(trace::metered_ev100(scene)) << "dark";
        scene.lights.clear();
        EXPECT_FALSE(trace::metered_ev100(scene));
    }
}

// There the illuminance is candela / R² / (1 - rho), 20 lx, and the luminance rho/pi of it, 3.2 cd/m².
TEST(Exposure, ARangeHasRoomForTheSphere) {
    constexpr double radius = 2.0, rho = 0.5;
    Scene scene = scene_with({{inward_sphere(radius, 128), glm::vec3(rho)}}, isotropic(40.0), glm::dvec3(0, 0, 0));
    scene.camera = {{0.3, 0.1, 0.0}, {1.0, 0.2, 0.1}, 1.2};
    EXPECT_EQ(trace::metered_range(scene, View::illuminance), 50.0);
    EXPECT_EQ(trace::metered_range(scene, View::luminance), 5.0);
    scene.lights[0].level_ratio = 0.001;
    EXPECT_NEAR(*trace::metered_range(scene, View::illuminance), 0.05, 1e-12);
    scene.lights[0].level_ratio = 0.0;
    EXPECT_FALSE(trace::metered_range(scene, View::illuminance)) << "dark";
}

// From starlight on snow (0.002 lx, 0.0006 cd/m²) to the sun on it (100,000 lx, 30,000 cd/m²), and not beyond.
TEST(Exposure, FromStarlightToTheSun) {
    Piece floor{quad({-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}), glm::vec3(0.0f)};
    const auto of = [&](double nit) {
        floor.emissive_nit = glm::vec3(static_cast<float>(nit));
        Scene scene = scene_with({floor}, isotropic(1.0), {0, 1, 0});
        scene.lights[0].level_ratio = 0.0;
        scene.camera = {{0, 3, 0.1}, {0, 0, 0}, 0.7};
        return *trace::metered_ev100(scene);
    };
    EXPECT_NEAR(of(0.0006), -9.6, 0.05);
    EXPECT_NEAR(of(30000.0), 15.9, 0.05);
    EXPECT_EQ(of(1e-6), -10.0);
    EXPECT_EQ(of(1e9), 24.0);
}

// A lamp in the picture and a dark surround do not count: of 18 % grey a quarter is lit, and a hundredth is a lamp.
TEST(Exposure, NeitherALampNorTheDarkCount) {
    const auto square = [](double side, double y) {
        return quad({-side, y, side}, {side, y, side}, {side, y, -side}, {-side, y, -side});
    };
    std::vector<Piece> pieces = {{square(100, 0), glm::vec3(0.0f), glm::vec3(1e-4f)},
                                 {square(1.0, 0.001), glm::vec3(0.0f), glm::vec3(50.0f)}};
    const double half = std::tan(0.35) * 3.0;  // of the picture's side at the floor
    const auto metered = [&] {
        Scene scene = scene_with(pieces, isotropic(1.0), {0, 1, 0});
        scene.lights[0].level_ratio = 0.0;
        scene.camera = {{0, 3, 0.0001}, {0, 0, 0}, 0.7};
        return *trace::metered_ev100(scene);
    };
    const double bright = metered();
    EXPECT_NEAR(bright, std::log2(50.0 / 0.48), 0.1) << "it fills " << 1.0 / half << " of the side";
    pieces.push_back({square(0.1, 0.002), glm::vec3(0.0f), glm::vec3(1e6f)});
    EXPECT_NEAR(metered(), bright, 0.1) << "a lamp";
}

// A screen of 100 cd/m² in a seventh of the picture, in a room of 1 cd/m²: the mean of the bright half would show it at
// six times white. Now its brightest parts are 1.3 of it. Void around the room counts for nothing.
TEST(Exposure, HighlightsKeepTheirDetail) {
    const auto square = [](double side, double y) {
        return quad({-side, y, side}, {side, y, side}, {side, y, -side}, {-side, y, -side});
    };
    const double half = std::tan(0.35) * 3.0;  // of the picture's side at the floor
    const auto metered = [&](double room_side) {
        Scene scene = scene_with({{square(room_side, 0), glm::vec3(0.0f), glm::vec3(1.0f)},
                                  {square(0.38 * half, 0.001), glm::vec3(0.0f), glm::vec3(100.0f)}},
                                 isotropic(1.0), {0, 1, 0});
        scene.lights[0].level_ratio = 0.0;
        scene.camera = {{0, 3, 0.0001}, {0, 0, 0}, 0.7};
        return *trace::metered_ev100(scene);
    };
    EXPECT_NEAR(metered(100.0), std::log2(100.0 / 1.56), 0.05);
    EXPECT_NEAR(metered(0.9 * half), std::log2(100.0 / 1.56), 0.05) << "with void around";
}

TEST(Exposure, TheBuiltInScenesHaveTheirOwn) {
    for (const auto& asset : {make_cornell(), make_atrium(), make_corridor(), make_stage(2)}) {
        const auto ev100 = trace::metered_ev100(scene_of(asset));
        ASSERT_TRUE(ev100);
        EXPECT_NEAR(*ev100, *asset->exposure_ev100, 1.0) << asset->name;
    }
}

class Automatic : public ChangingScene {
protected:
    void SetUp() override {
        asset = make_cornell();
        scene = scene_of(asset, 7);
        scene.exposure_ev100 = 5.0;
        exposure.emplace(
            scene, loader, [] {},
            [this](const Scene&) {
                ++metered;
                return answer;
            });
    }
    void move(double x) {
        change([&](v1::Command& c) {
            c.mutable_set_light()->set_name(scene.lights[0].name);
            for (const double at : {x, 2.0, 0.0}) c.mutable_set_light()->add_position_m(at);
        });
    }
    // A turn so many seconds after the start, and what was asked for in it is answered.
    void turn(double s) {
        const int before = metered.load();
        exposure->tend(scene, static_cast<std::int64_t>(s * 1e9));
        std::promise<void> idle;
        ASSERT_TRUE(loader.submit([&] { idle.set_value(); }));
        idle.get_future().wait();
        if (metered.load() != before) exposure->tend(scene, static_cast<std::int64_t>(s * 1e9));
        const auto ev100 = exposure->step(static_cast<std::int64_t>(s * 1e9));
        if (!ev100) return;
        change([&](v1::Command& c) {
            c.mutable_set_exposure()->set_ev100(*ev100);
            c.mutable_set_exposure()->set_automatic(true);
        });
    }
    std::shared_ptr<const SceneAsset> asset;
    Loader loader;
    std::atomic<int> metered = 0;
    std::optional<double> answer = 5.0;
    std::optional<AutoExposure> exposure;
};

TEST_F(Automatic, MetersWhatRestsAndFollowsBigChangesOnly) {
    for (const double s : {0.0, 2.0, 4.0}) turn(s);
    EXPECT_EQ(metered, 0) << "nothing changed";
    move(0.5);
    turn(5.0);
    turn(5.9);
    move(0.4);
    turn(6.0);
    turn(6.9);
    EXPECT_EQ(metered, 0) << "it moves";
    answer = 3.1;
    turn(7.1);
    EXPECT_EQ(metered, 1);
    EXPECT_FALSE(exposure->gliding());
    EXPECT_EQ(scene.exposure_ev100, 5.0) << "less than two stops";
    move(0.1);
    answer = 1.0;
    turn(8.0);
    turn(9.1);
    EXPECT_EQ(metered, 2);
    EXPECT_TRUE(exposure->gliding());
    double last = 5.0;
    for (double s = 9.2; s < 10.2; s += 0.1) {
        turn(s);
        EXPECT_LE(scene.exposure_ev100, last);
        EXPECT_LT(last - scene.exposure_ev100, 0.8) << "smoothly";
        last = scene.exposure_ev100;
    }
    EXPECT_FALSE(exposure->gliding());
    EXPECT_EQ(scene.exposure_ev100, 1.0);
    EXPECT_TRUE(scene.exposure_auto);
    for (const double s : {11.0, 13.0}) turn(s);
    EXPECT_EQ(metered, 2) << "its own changes are none";
}

TEST_F(Automatic, LevelsAreSeenAsTheyAreRidden) {
    answer = 1.0;
    dim(0.1);
    for (const double s : {1.0, 2.1, 4.0}) turn(s);
    dim(0.0);
    for (const double s : {5.0, 6.1, 7.0}) turn(s);
    EXPECT_EQ(metered, 0);
    EXPECT_EQ(scene.exposure_ev100, 5.0);
    // All is out: what comes on then is metered.
    answer.reset();
    move(0.3);
    for (const double s : {8.0, 9.1, 9.5}) turn(s);
    EXPECT_EQ(metered, 1);
    EXPECT_EQ(scene.exposure_ev100, 5.0) << "the dark has no exposure";
    answer = 2.5;
    dim(0.5);
    for (const double s : {10.0, 11.1, 13.0}) turn(s);
    EXPECT_EQ(metered, 2);
    EXPECT_EQ(scene.exposure_ev100, 2.5);
    dim(0.01);
    for (const double s : {14.0, 15.1, 16.0}) turn(s);
    EXPECT_EQ(metered, 2) << "once";
}

// The frame that the first light comes on with is exposed for it, and as it fades in the exposure follows: 100 times
// the light is 6.64 stops.
TEST_F(Automatic, LightThatComesIntoTheDarkIsExposedAtOnce) {
    dim(0.0);
    answer.reset();
    move(0.3);
    for (const double s : {1.0, 2.1, 2.5}) turn(s);
    ASSERT_EQ(metered, 1) << "it is dark";
    EXPECT_FALSE(exposure->first_light(scene, 3'000'000'000));
    answer = -2.5;
    dim(0.01);
    EXPECT_EQ(exposure->first_light(scene, 3'100'000'000), -2.5);
    EXPECT_EQ(metered, 2);
    dim(1.0);
    const auto risen = exposure->first_light(scene, 3'200'000'000);
    ASSERT_TRUE(risen);
    EXPECT_NEAR(*risen, -2.5 + std::log2(100.0), 1e-9);
    EXPECT_EQ(metered, 2) << "by its levels alone";
    EXPECT_FALSE(exposure->first_light(scene, 3'300'000'000)) << "nothing changed";
    dim(0.5);
    EXPECT_FALSE(exposure->first_light(scene, 5'000'000'000)) << "from then on levels are seen as they are ridden";
}

// A metering takes a while: what it found of a scene that was replaced meanwhile is nothing to the next one.
TEST_F(Automatic, OfAnotherSceneNothingIsTaken) {
    move(0.5);
    turn(0.0);
    answer = 1.0;
    exposure->tend(scene, 2'000'000'000);
    std::promise<void> idle;
    ASSERT_TRUE(loader.submit([&] { idle.set_value(); }));
    idle.get_future().wait();
    ASSERT_EQ(metered, 1) << "and its answer waits";
    Scene next = scene_of(make_atrium(), scene.scene_rev + 1);
    next.exposure_ev100 = 6.0;
    scene = next;
    turn(2.1);
    EXPECT_FALSE(exposure->gliding());
    turn(3.0);
    EXPECT_EQ(scene.exposure_ev100, 6.0);
    // And it goes on with the new one.
    move(0.1);
    turn(4.0);
    turn(5.1);
    EXPECT_EQ(metered, 2);
    EXPECT_TRUE(exposure->gliding());
}

TEST_F(Automatic, EndsWhereSomebodySetsIt) {
    move(0.1);
    answer = 1.0;
    turn(1.0);
    turn(2.1);
    turn(2.5);
    EXPECT_TRUE(exposure->gliding());
    change([](v1::Command& c) { c.mutable_set_exposure()->set_ev100(4.5); });
    EXPECT_FALSE(scene.exposure_auto);
    turn(2.6);
    EXPECT_FALSE(exposure->gliding());
    EXPECT_EQ(scene.exposure_ev100, 4.5);
    move(0.2);
    for (const double s : {3.0, 4.1, 6.0}) turn(s);
    EXPECT_EQ(metered, 1);
    EXPECT_EQ(scene.exposure_ev100, 4.5);
    // Switched on it is metered at once, and follows however little it is.
    answer = 4.0;
    change([](v1::Command& c) { c.mutable_set_exposure()->set_automatic(true); });
    exposure->ask();
    EXPECT_EQ(scene.exposure_ev100, 4.5);
    turn(6.1);
    EXPECT_EQ(metered, 2);
    turn(7.2);
    EXPECT_EQ(scene.exposure_ev100, 4.0);
}

TEST_F(Automatic, ASceneThatIsLoadedIsMeteredBefore) {
    Loaded loaded;
    loaded.asset = std::make_shared<const SceneAsset>([&] {
        SceneAsset bare = *asset;
        bare.exposure_ev100.reset();
        return bare;
    }());
    loaded.exposure_ev100 = 9.5;
    v1::Command load;
    load.mutable_load_scene()->set_file("hall.glb");
    ASSERT_TRUE(apply(scene, load, loaded));
    EXPECT_EQ(scene.exposure_ev100, 9.5);
    EXPECT_TRUE(scene.exposure_auto);
    for (const double s : {1.0, 3.0}) turn(s);
    EXPECT_EQ(metered, 0);
}

}  // namespace
}  // namespace gonio::test
