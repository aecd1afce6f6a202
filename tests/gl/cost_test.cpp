// The cost table of docs/rendering.md, asserted through FrameReport on both built-in scenes, with one luminaire and
// with many.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/scene/strobe.h"
#include "tests/gl/body_scene.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

v1::Command command_of(const std::function<void(v1::Command&)>& fill) {
    v1::Command command;
    fill(command);
    return command;
}

struct Case {
    const char* scene;
    std::size_t lights;  // 0: many
};

class Cost : public testing::TestWithParam<Case> {
protected:
    using Ran = std::set<std::string>;
    Cost() : Cost(GetParam()) {}
    explicit Cost(const Case& which) : renderer(context(), direct_light()), scene(scene_of(asset(which.scene))) {
        scene.width_px = scene.height_px = 96;
        make_coarse(renderer);
        // Shadow maps of many luminaires take a software GL seconds.
        const std::size_t lights = which.lights != 0 ? which.lights : shadow_maps() ? 3 : 12;
        const glm::dvec3 home = scene.lights[0].position;
        for (std::size_t i = 1; i < lights; ++i) {
            const double turn = 2.4 * static_cast<double>(i), far = 0.05 * static_cast<double>(i);
            set(i == 1 ? "second" : "light " + std::to_string(i + 1), [&](v1::SetLight& add) {
                for (double x : {home.x + far * std::cos(turn), home.y - 0.5, home.z + far * std::sin(turn)})
                    add.add_position_m(x);
            });
        }
        if (lights == 1) scene.lights[0].profile = as_point(*builtin_profile("narrow_spot"));
        own = scene.lights[std::min<std::size_t>(lights, 2) - 1].name;
        settle();
    }
    static std::shared_ptr<const SceneAsset> asset(const std::string& name) {
        static std::map<std::string, std::shared_ptr<const SceneAsset>> made;
        if (!made[name] && name == "body") {
            const auto bare = of_points(**load_scene("cornell"));
            made[name] = with_box_body(*bare, 0.5 * (bare->bounds.min + bare->bounds.max), 0.6);
        }
        if (!made[name]) made[name] = of_points(**load_scene(name));
        return made[name];
    }

    // Changes a light, or adds it as a narrow spot that looks down.
    void set(const std::string& name, const std::function<void(v1::SetLight&)>& fill) {
        const bool known = std::any_of(scene.lights.begin(), scene.lights.end(),
                                       [&](const Light& light) { return light.name == name; });
        v1::Command command;
        Loaded loaded;
        v1::SetLight& light = known ? *command.mutable_set_light() : *command.mutable_add_light()->mutable_light();
        light.set_name(name);
        fill(light);
        if (!known) loaded.profile = as_point(*builtin_profile("narrow_spot"));
        if (light.has_profile()) loaded.profile = as_point(*builtin_profile(light.profile().name()));
        const auto applied = apply(scene, command, loaded);
        ASSERT_TRUE(applied) << applied.error().text();
    }
    void set(const std::function<void(v1::SetLight&)>& fill) { set(own, fill); }
    void set_all_levels(double ratio) {
        const std::vector<Light> lights = scene.lights;
        for (const Light& light : lights) set(light.name, [&](v1::SetLight& set) { set.set_level_ratio(ratio); });
    }
    void change(const std::function<void(v1::Command&)>& fill) { ASSERT_TRUE(apply(scene, command_of(fill), {})); }

    static bool shadow_maps() {
        return direct_light() == Renderer::DirectLight::gl ||
               (direct_light() == Renderer::DirectLight::automatic && !context().software());
    }
    // Several luminaires are shown at once while the camera moves.
    bool merges() const { return !shadow_maps() && scene.lights.size() > 1; }

    // Passes that turn light into a picture: one on the CPU, two by shaders.
    static Ran picture_of(Ran light = {}) {
        light.insert("composite");
        if (shadow_maps()) light.insert("nv12");
        return light;
    }
    // Passes that find the surfaces that the camera sees.
    static Ran surfaces() { return {"gbuffer", "gather-weights"}; }
    // The named passes of a light.
    static Ran of(const std::string& light, const std::vector<std::string>& names) {
        Ran ran;
        for (const std::string& name : names) ran.insert(name + ":" + light);
        return ran;
    }
    static Ran both(Ran a, const Ran& b) {
        a.insert(b.begin(), b.end());
        return a;
    }
    bool none_of_the_others(const Ran& ran) const {
        return std::none_of(ran.begin(), ran.end(), [&](const std::string& name) {
            return name.find(':') != std::string::npos && name.substr(name.find(':') + 1) != own;
        });
    }

    // Names of passes that ran, "name" or "name:light".
    Ran frame() {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        Ran ran;
        faces.clear();
        states.clear();
        for (const v1::PassReport& row : done->report.passes()) {
            const std::string name = row.name() + (row.has_light() ? ":" + row.light() : "");
            states[name] = row.state();
            if (row.state() == "ran") ran.insert(name);
            faces[name] = row.faces();
        }
        picture = done->nv12;
        settled = done->report.settled();
        EXPECT_EQ(settled, renderer.settled());
        EXPECT_EQ(done->report.scene_rev(), scene.scene_rev);
        return ran;
    }
    // Frames without a further change until the report says settled.
    void settle() {
        std::size_t frames = 0;
        do {
            frame();
            ASSERT_LE(++frames, scene.lights.size() + 2);
        } while (!settled);
    }
    // A frame after a change of light, and the next, in which every bounce is solved to the end.
    Ran moving_frame() {
        Ran ran = frame();
        EXPECT_FALSE(settled);
        const auto first_faces = faces;
        const auto first_states = states;
        EXPECT_EQ(frame(), picture_of(of(own, {"solve", "gather"})));
        EXPECT_TRUE(settled);
        faces = first_faces;
        states = first_states;
        return ran;
    }
    // A frame after a change that must not leave anything to follow.
    Ran only_frame() {
        Ran ran = frame();
        EXPECT_TRUE(settled);
        return ran;
    }

    Renderer renderer;
    Scene scene;
    std::string own;  // the light that changes
    std::map<std::string, unsigned> faces;
    std::map<std::string, std::string> states;
    std::shared_ptr<const std::vector<std::uint8_t>> picture;
    bool settled = false;
};
const auto kName = [](const auto& test) {
    return std::string(test.param.scene) + (test.param.lights == 1 ? "OfOne" : "OfMany");
};
// A suite for each scene: a renderer keeps the links of the scene before alone.
INSTANTIATE_TEST_SUITE_P(One, Cost, testing::Values(Case{"cornell", 1}), kName);
INSTANTIATE_TEST_SUITE_P(Many, Cost, testing::Values(Case{"cornell", 0}), kName);
INSTANTIATE_TEST_SUITE_P(Atrium, Cost, testing::Values(Case{"atrium", 1}), kName);

TEST_P(Cost, NothingChangedRunsNothing) {
    EXPECT_EQ(only_frame(), Ran{});
    EXPECT_EQ(picture, nullptr) << "no readback either";
}

TEST_P(Cost, LevelColourMasterExposureRunTheCompositeOnly) {
    const Ran composite = picture_of();
    set([](v1::SetLight& light) { light.set_level_ratio(0.5); });
    EXPECT_EQ(only_frame(), composite);
    EXPECT_NE(picture, nullptr);
    set([](v1::SetLight& light) {
        light.add_color_rgb(1);
        light.add_color_rgb(0.2);
        light.add_color_rgb(0.1);
    });
    EXPECT_EQ(only_frame(), composite);
    set([](v1::SetLight& light) { light.set_tint_duv(0.01); });
    EXPECT_EQ(only_frame(), composite);
    set([](v1::SetLight& light) { light.set_cct_k(3200); });
    EXPECT_EQ(only_frame(), composite);
    set([](v1::SetLight& light) { light.set_gel("L204"); });
    EXPECT_EQ(only_frame(), composite);
    set([](v1::SetLight& light) { light.set_shutter_ratio(0.5); });
    EXPECT_EQ(only_frame(), composite);
    set([](v1::SetLight& light) { light.set_strobe_hz(10); });
    EXPECT_EQ(only_frame(), composite);
    ASSERT_TRUE(set_flashes(scene, 0.06));
    EXPECT_EQ(only_frame(), composite) << "it goes out";
    EXPECT_EQ(only_frame(), Ran{}) << "it stays out";
    ASSERT_TRUE(set_flashes(scene, 0.11));
    EXPECT_EQ(only_frame(), composite) << "it is on again";
    set([](v1::SetLight& light) { light.set_strobe_hz(0); });
    EXPECT_EQ(only_frame(), composite);
    change([](v1::Command& c) { c.mutable_set_master()->set_ratio(0.7); });
    EXPECT_EQ(only_frame(), composite);
    change([](v1::Command& c) { c.mutable_set_exposure()->set_ev100(7.3); });
    EXPECT_EQ(only_frame(), composite);
    change([](v1::Command& c) { c.mutable_set_look()->set_tone("agx"), c.mutable_set_look()->set_white_k(4000); });
    EXPECT_EQ(only_frame(), composite);
    set_all_levels(0.25);
    EXPECT_EQ(only_frame(), composite) << "all luminaires at once";
    set([](v1::SetLight& light) { light.set_level_ratio(0.0); });
    EXPECT_EQ(only_frame(), composite);
}

TEST_P(Cost, AZoomRunsWhatAProfileRuns) {
    set([](v1::SetLight& light) { light.set_zoom_rad(0.35); });
    Ran ran = moving_frame();
    if (shadow_maps()) ran.erase("shadow:" + own);  // faces newly reached
    const Ran expected = picture_of(of(own, {"surfels", "solve", "direct", "gather"}));
    EXPECT_EQ(ran, expected);
    set([](v1::SetLight& light) { light.set_zoom_rad(0.3); });
    EXPECT_EQ(moving_frame(), expected) << "a narrower beam reaches no other face";
}

TEST_P(Cost, TheSameValueAgainRunsNothing) {
    set([](v1::SetLight& light) { light.set_level_ratio(1.0); });
    EXPECT_EQ(only_frame(), Ran{});
}

TEST_P(Cost, AimRunsTheLightsOwnPassesAndOnlyFacesNewlyReached) {
    // The narrow spot looks down: only the floor's face and its neighbours are made.
    set([](v1::SetLight& light) { light.set_tilt_rad(0.1); });
    const Ran ran = moving_frame();
    EXPECT_EQ(ran, picture_of(of(own, {"surfels", "solve", "direct", "gather"})));
    EXPECT_FALSE(ran.contains("shadow:" + own)) << "no face was newly reached";
    if (!shadow_maps()) return;
    set([](v1::SetLight& light) { light.set_tilt_rad(2.9); });  // turned up: the ceiling's face is new
    EXPECT_TRUE(frame().contains("shadow:" + own));
    EXPECT_GE(faces["shadow:" + own], 1u);
    EXPECT_LE(faces["shadow:" + own], 5u) << "the floor's face was there already";
    set([](v1::SetLight& light) { light.set_tilt_rad(0.1); });  // back again: all faces are still valid
    EXPECT_FALSE(frame().contains("shadow:" + own));
}

TEST_P(Cost, ProfileRunsTheLightsOwnPasses) {
    set([](v1::SetLight& light) { light.mutable_profile()->set_name("downlight"); });
    const Ran ran = moving_frame();
    for (const char* name : {"surfels:", "solve:", "direct:", "gather:"}) EXPECT_TRUE(ran.contains(name + own)) << name;
    EXPECT_TRUE(ran.contains("composite"));
    EXPECT_FALSE(ran.contains("gbuffer"));
    EXPECT_TRUE(none_of_the_others(ran));
}

TEST_P(Cost, PositionRunsReachedFacesOfThatLightOnly) {
    const glm::dvec3 home = scene.lights[scene.lights.size() > 1 ? 1 : 0].position;
    set([&](v1::SetLight& light) {
        for (double x : {home.x, home.y - 0.1, home.z}) light.add_position_m(x);
    });
    const Ran ran = moving_frame();
    Ran expected = picture_of(of(own, {"surfels", "solve", "direct", "gather"}));
    if (shadow_maps()) expected.insert("shadow:" + own);
    EXPECT_EQ(ran, expected);
    EXPECT_EQ(states["shadow:" + own], shadow_maps() ? "ran" : "culled") << "rays stand for the shadow map on the CPU";
    EXPECT_EQ(states["rsm:" + own], "culled") << "the luminaire's own rays stand for the map where nobody looks at it";
    EXPECT_LT(faces["shadow:" + own], 6u) << "a narrow spot does not reach all faces";
}

// Luminaires that come to rest together are solved to the end one a frame.
TEST_P(Cost, TheSolveAtRestIsOfOneLuminaireAFrame) {
    if (!merges()) GTEST_SKIP();
    Ran solves;
    for (std::size_t i = 0; i < 2; ++i) {
        set(scene.lights[i].name, [&](v1::SetLight& light) { light.set_tilt_rad(0.2); });
        solves.insert("solve:" + scene.lights[i].name);
    }
    const auto solves_of = [&](const Ran& ran) {
        Ran some;
        std::copy_if(ran.begin(), ran.end(), std::inserter(some, some.end()),
                     [](const std::string& name) { return name.starts_with("solve:"); });
        return some;
    };
    EXPECT_EQ(solves_of(frame()), solves);
    Ran rested;
    for (int i = 0; i < 2; ++i) {
        EXPECT_FALSE(settled);
        const Ran ran = solves_of(frame());
        EXPECT_EQ(ran.size(), 1u);
        rested.insert(ran.begin(), ran.end());
    }
    EXPECT_EQ(rested, solves);
    EXPECT_TRUE(settled);
}

// One luminaire: its own passes. Several: passes of all at once, and when the camera rests their own, one luminaire a
// frame, until a level runs the composite only again.
TEST_P(Cost, CameraRunsNoLightMap) {
    const auto move = [&](double by) {
        change([&](v1::Command& c) {
            for (double x : {scene.camera.eye.x + by, scene.camera.eye.y, scene.camera.eye.z})
                c.mutable_set_camera()->add_eye_m(x);
        });
    };
    if (!merges()) {
        move(0.1);
        Ran all = picture_of(surfaces());
        for (const Light& light : scene.lights) all = both(all, of(light.name, {"direct", "gather"}));
        EXPECT_EQ(only_frame(), all);
        return;
    }
    for (int step = 0; step < 2; ++step) {
        move(0.1);
        EXPECT_EQ(frame(), picture_of(both(surfaces(), {"direct", "gather"})));
        EXPECT_FALSE(settled);
        EXPECT_NE(picture, nullptr);
    }
    std::set<std::string> refilled;
    for (std::size_t i = 1; i <= scene.lights.size(); ++i) {
        const Ran ran = frame();
        const bool last = i == scene.lights.size();
        ASSERT_EQ(settled, last) << i;
        EXPECT_EQ(ran.size(), last ? 3u : 2u) << "surfels and what they exchange stand still";
        EXPECT_EQ(ran.contains("composite"), last);
        EXPECT_EQ(picture != nullptr, last);
        for (const Light& light : scene.lights) {
            if (!ran.contains("gather:" + light.name)) continue;
            EXPECT_TRUE(ran.contains("direct:" + light.name));
            refilled.insert(light.name);
        }
    }
    EXPECT_EQ(refilled.size(), scene.lights.size());
    EXPECT_EQ(only_frame(), Ran{});
    set([](v1::SetLight& light) { light.set_level_ratio(0.5); });
    EXPECT_EQ(only_frame(), picture_of());
}

// Until the luminaires' own layers are there a level runs the passes of all at once, and never starves them; a
// luminaire at level 0 comes last.
TEST_P(Cost, ALevelWhileLayersAreRefilled) {
    if (!merges()) GTEST_SKIP();
    set([](v1::SetLight& light) { light.set_level_ratio(0.0); });
    change([](v1::Command& c) {
        for (double x : {0.1, 2.0, 7.0}) c.mutable_set_camera()->add_eye_m(x);
    });
    frame();
    const std::string other = scene.lights[0].name;
    for (std::size_t i = 1; i <= scene.lights.size(); ++i) {
        ASSERT_FALSE(settled);
        set(other, [&](v1::SetLight& light) { light.set_level_ratio(1.0 - 0.01 * static_cast<double>(i)); });
        const Ran ran = frame();
        const bool last = i == scene.lights.size();
        EXPECT_EQ(ran.contains("merge"), !last);
        EXPECT_EQ(ran.contains("gather"), !last);
        EXPECT_EQ(ran.contains("gather:" + own), last);
        EXPECT_FALSE(ran.contains("gbuffer"));
        EXPECT_NE(picture, nullptr);
    }
    EXPECT_TRUE(settled);
}

TEST_P(Cost, ViewModeRunsTheCompositeAndWhatWasCulledWhileItMoved) {
    change([](v1::Command& c) { c.mutable_set_view()->set_view("direct"); });
    EXPECT_EQ(only_frame(), picture_of());
    EXPECT_EQ(states["gather:" + own], "culled");
    set([](v1::SetLight& light) { light.set_tilt_rad(0.2); });
    EXPECT_EQ(only_frame(), picture_of({"direct:" + own})) << "the bounce is culled while nobody sees it";
    change([](v1::Command& c) { c.mutable_set_view()->set_view("beauty"); });
    EXPECT_EQ(only_frame(), picture_of(of(own, {"surfels", "solve", "gather"}))) << "it rests: solved to the end";
    change([](v1::Command& c) { c.mutable_set_view()->set_view("indirect"); });
    EXPECT_EQ(only_frame(), picture_of());
}

// A scene that is loaded: everything once, then nothing. Several luminaires are first lit as one, as when the camera
// moves.
TEST_P(Cost, ALoadedSceneRunsEverythingOnce) {
    auto asset = std::make_shared<SceneAsset>(*scene.asset);
    asset->lights.clear();
    for (const Light& light : scene.lights)
        asset->lights.push_back(
            {light.name, light.position, light.world_from_light, light.profile, 1.0, 1.0, light.color});
    Loaded loaded;
    loaded.asset = asset;
    ASSERT_TRUE(apply(scene, command_of([](v1::Command& c) { c.mutable_load_scene()->set_file("again"); }), loaded));
    scene.width_px = scene.height_px = 96;  // the scene's own are the default
    std::map<std::string, int> times;
    std::size_t frames = 0;
    do {
        for (const std::string& name : frame()) ++times[name];
        ASSERT_LE(++frames, scene.lights.size() + 3);
    } while (!settled);
    Ran all = both(surfaces(), picture_of());
    std::vector<std::string> own_passes = {"surfels", "solve", "direct", "gather"};
    if (shadow_maps()) own_passes.emplace_back("shadow");
    for (const Light& light : scene.lights) all = both(all, of(light.name, own_passes));
    if (merges()) all = both(all, {"merge", "solve", "direct", "gather"});
    Ran seen;
    for (const auto& [name, count] : times) {
        seen.insert(name);
        // What lights all at once, or the only luminaire, is solved to the end after the first picture.
        const bool own_pass = name.find(':') != std::string::npos;
        const bool solved =
            name.starts_with("solve") || name.starts_with("gather") || name == "composite" || name == "nv12";
        const int of_each = 1 + static_cast<int>(scene.lights.size());  // one luminaire's solve at rest a frame
        const int most = !solved || name == "gather-weights" ? 1
                         : own_pass                          ? (merges() ? 1 : 2)
                         : merges()                          ? 3
                                                             : of_each;
        EXPECT_GE(count, 1) << name;
        EXPECT_LE(count, most) << name;
    }
    EXPECT_EQ(seen, all);
    EXPECT_EQ(only_frame(), Ran{});
}

// What nobody touches gets better by gathers alone, and a solve where a narrow beam's first bounce is there; and ends.
TEST_P(Cost, RefinementRunsGatherAndComposite) {
    renderer.set_refinement(true);
    frame();
    int pictures = 0, directs = 0;
    for (int steps = 0; !renderer.refined(scene) && steps < 1000; ++steps) {
        if (!renderer.refine(scene, [] { return false; })) continue;
        // Of several luminaires all at once, and then one by one.
        do {
            for (const std::string& name : frame()) {
                directs += name.starts_with("direct") ? 1 : 0;
                EXPECT_TRUE(name.starts_with("gather") || name.starts_with("solve") || name.starts_with("direct") ||
                            name == "composite" || name == "nv12")
                    << name;
            }
        } while (!settled);
        ++pictures;
    }
    // With a shadow ray from each pixel, once for each luminaire.
    EXPECT_EQ(directs, static_cast<int>(scene.lights.size()));
    EXPECT_TRUE(renderer.refined(scene));
    EXPECT_GT(pictures, 1);
    EXPECT_EQ(only_frame(), Ran{});
}

TEST_P(Cost, ACaptureAndAMeterLeaveTheLivePassesClean) {
    ASSERT_TRUE(renderer.capture(scene, View::illuminance, 64, 48, true));
    renderer.meter(scene, {0, 0.01, 1.5}, {0, 1, 0}, Renderer::MeterQuality::rsm);
    EXPECT_EQ(only_frame(), Ran{});
}

// Whatever was ridden, moved and looked at before: what is kept from picture to picture does not show.
TEST_P(Cost, SameInputsGiveTheSameBytes) {
    const double ev = scene.exposure_ev100;
    change([&](v1::Command& c) { c.mutable_set_exposure()->set_ev100(ev + 0.3); });
    only_frame();
    const auto first = picture;
    const auto same = [&](const char* after) {
        only_frame();
        ASSERT_NE(picture, nullptr) << after;
        EXPECT_TRUE(*first == *picture) << after;
    };
    set([](v1::SetLight& light) { light.set_tilt_rad(0.7); });
    moving_frame();
    set([](v1::SetLight& light) { light.set_tilt_rad(0.0); });
    moving_frame();
    EXPECT_TRUE(*first == *picture) << "aim";
    // Long enough for luminaires to be kept in sums, taken out and put back.
    for (int i = 0; i < 80; ++i) {
        const std::string name = scene.lights[static_cast<std::size_t>(i / 3 * 5) % scene.lights.size()].name;
        set(name, [&](v1::SetLight& light) { light.set_level_ratio(0.1 + 0.01 * (i % 17)); });
        only_frame();
    }
    set_all_levels(1.0);
    same("levels");
    for (int i = 0; i < 4; ++i) {
        set([&](v1::SetLight& light) { light.set_level_ratio(0.2 * i); });
        only_frame();
    }
    set([](v1::SetLight& light) { light.set_level_ratio(1.0); });
    same("one level");
    const glm::dvec3 eye = scene.camera.eye;
    for (const double x : {eye.x + 0.2, eye.x}) {
        change([&](v1::Command& c) {
            for (double part : {x, eye.y, eye.z}) c.mutable_set_camera()->add_eye_m(part);
        });
        frame();
    }
    while (!settled) frame();
    EXPECT_TRUE(*first == *picture) << "camera";
    Renderer fresh(context(), direct_light());
    make_coarse(fresh);
    do {
        fresh.begin_frame(scene, monotonic_ns());
        if (const auto shown = fresh.finish_frame(true)->nv12) picture = shown;
    } while (!fresh.settled());
    EXPECT_TRUE(*first == *picture) << "nothing at all";
}

// What needs one scene only.
class CostOfTwo : public Cost {
protected:
    CostOfTwo() : Cost(Case{"cornell", 2}) {}
};
INSTANTIATE_TEST_SUITE_P(Cornell, CostOfTwo, testing::Values(Case{}));

// Two luminaires, the first of which has a body in view.
class CostOfBodies : public Cost {
protected:
    CostOfBodies() : Cost(Case{"body", 2}) {}
    void turn(std::size_t light, double tilt_rad) {
        set(scene.lights[light].name, [&](v1::SetLight& set) { set.set_tilt_rad(tilt_rad); });
    }
};
INSTANTIATE_TEST_SUITE_P(Cornell, CostOfBodies, testing::Values(Case{}));

TEST_P(CostOfBodies, WhatMovesNoBodyCostsWhatItDoesWithoutOne) {
    EXPECT_EQ(only_frame(), Ran{});
    set(scene.lights[0].name, [](v1::SetLight& light) { light.set_level_ratio(0.5); });
    EXPECT_EQ(only_frame(), picture_of());
    turn(1, 0.1);
    EXPECT_EQ(moving_frame(), picture_of(of(own, {"surfels", "solve", "direct", "gather"})));
    change([](v1::Command& c) { c.mutable_set_exposure()->set_ev100(7.3); });
    EXPECT_EQ(only_frame(), picture_of());
}

TEST_P(CostOfBodies, ItsAimRunsWhatTheCameraRuns) {
    const std::string first = scene.lights[0].name;
    turn(0, 0.1);
    Ran expected = picture_of(surfaces());
    if (merges()) {
        expected = both(expected, {"surfels:" + first, "merge", "direct", "solve", "gather"});
    } else {
        expected.insert({"surfels:" + first, "solve:" + first});
        for (const Light& light : scene.lights) expected = both(expected, of(light.name, {"direct", "gather"}));
    }
    EXPECT_EQ(frame(), expected);
    EXPECT_FALSE(settled);
    while (!settled) EXPECT_FALSE(frame().contains("gbuffer")) << "it rests";
    EXPECT_EQ(only_frame(), Ran{});
    set(first, [](v1::SetLight& light) { light.set_level_ratio(0.5); });
    EXPECT_EQ(only_frame(), picture_of());
}

TEST_P(CostOfBodies, OutOfViewItCostsNothing) {
    change([&](v1::Command& c) {
        const glm::dvec3 away = 2.0 * scene.camera.eye - scene.camera.target;
        for (double x : {away.x, away.y, away.z}) c.mutable_set_camera()->add_target_m(x);
    });
    settle();
    own = scene.lights[0].name;
    turn(0, 0.1);
    EXPECT_EQ(moving_frame(), picture_of(of(own, {"surfels", "solve", "direct", "gather"})));
}

TEST_P(CostOfTwo, TheSeedTechniqueRecomputesEverything) {
    change([](v1::Command& c) {
        c.mutable_set_technique()->set_technique("seed");
        c.mutable_set_technique()->set_samples(16);
    });
    frame();
    set([](v1::SetLight& light) { light.set_level_ratio(0.9); });
    const Ran ran = frame();
    for (const char* name : {"gbuffer", "shadow:luminaire", "rsm:second", "mask:luminaire", "gather:luminaire",
                             "direct:second", "composite"}) {
        EXPECT_TRUE(ran.contains(name)) << name;
    }
    EXPECT_EQ(states["solve:second"], "absent");
}

TEST_P(CostOfTwo, ASceneWithoutLightsSaysAbsent) {
    change([](v1::Command& c) { c.mutable_remove_light()->set_name("second"); });
    change([](v1::Command& c) { c.mutable_remove_light()->set_name("luminaire"); });
    frame();
    EXPECT_EQ(states["shadow"], "absent");
    EXPECT_EQ(states["gather"], "absent");
    EXPECT_NE(picture, nullptr);
}

}  // namespace
}  // namespace gonio::test
