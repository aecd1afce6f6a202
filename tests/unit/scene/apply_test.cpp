// apply(): every command, what it changes, what it refuses, and that a refusal changes nothing.
#include "server/scene/apply.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/surface.pb.h"
#include "server/scene/limits.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

std::shared_ptr<const Profile> some_profile(const char* name) {
    auto profile = std::make_shared<Profile>();
    profile->name = name;
    profile->photometry.web = {
        ies::Goniometer::type_c, {0.0, std::numbers::pi}, {0.0, 2 * std::numbers::pi}, {100, 100, 100, 100}};
    profile->peak_cd = 100;
    return profile;
}

Scene some_scene() {
    auto asset = std::make_shared<SceneAsset>();
    asset->name = "some";
    asset->bounds = {{-1, -1, -1}, {1, 1, 1}};
    LightSeed light;
    light.profile = some_profile("one");
    for (const char* name : {"key", "fill"}) {
        light.name = name;
        asset->lights.push_back(light);
    }
    return scene_of(asset, 10);
}

Result<Applied> run(Scene& scene, const std::function<void(v1::Command&)>& fill, const Loaded& loaded = {}) {
    v1::Command command;
    fill(command);
    return apply(scene, command, loaded);
}

void expect_refused(Scene& scene, const std::function<void(v1::Command&)>& fill, const std::string& code,
                    const std::string& where) {
    const std::string before = full_state(scene).SerializeAsString();
    const auto result = run(scene, fill);
    ASSERT_FALSE(result) << where;
    EXPECT_EQ(result.error().code, code);
    EXPECT_EQ(result.error().where, where);
    EXPECT_EQ(full_state(scene).SerializeAsString(), before) << "a refused command changes nothing";
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Apply, EachCommandBumpsItsPartOnly) {
    Scene scene = some_scene();
    ASSERT_TRUE(run(scene, [](v1::Command& c) {
        c.mutable_set_light()->set_name("key");
        c.mutable_set_light()->set_level_ratio(0.25);
    }));
    EXPECT_EQ(scene.scene_rev, 11u);
    EXPECT_EQ(scene.lights[0].level_rev, 11u);
    EXPECT_EQ(scene.lights[0].position_rev, 10u);
    EXPECT_EQ(scene.lights[1].level_rev, 10u);
    EXPECT_EQ(scene.camera_rev, 10u);
    EXPECT_DOUBLE_EQ(scene.lights[0].level_ratio, 0.25);
    EXPECT_TRUE(scene.exposure_auto);
    ASSERT_TRUE(run(scene, [](v1::Command& c) { c.mutable_set_exposure()->set_ev100(3.0); }));
    EXPECT_FALSE(scene.exposure_auto) << "somebody set it";
    EXPECT_EQ(scene.exposure_rev, 12u);
}

TEST(Apply, TheSameValueKeepsTheRevision) {
    Scene scene = some_scene();
    const auto result = run(scene, [](v1::Command& c) {
        c.mutable_set_light()->set_name("key");
        c.mutable_set_light()->set_level_ratio(1.0);
    });
    ASSERT_TRUE(result);
    EXPECT_EQ(result->scene_rev, 10u);
}

TEST(Apply, TheSameAngleTurnsNothing) {
    Scene scene = some_scene();
    run(scene, [](v1::Command& c) {
        c.mutable_set_light()->set_name("key");
        for (const double v : {0.3, -0.2, 0.1}) c.mutable_set_light()->add_aim(v);
    });
    const glm::dquat before = scene.lights[0].world_from_light;
    const double tilt_rad = scene.lights[0].tilt_rad;
    const auto same = run(scene, [&](v1::Command& c) {
        c.mutable_set_light()->set_name("key");
        c.mutable_set_light()->set_tilt_rad(tilt_rad);
    });
    ASSERT_TRUE(same);
    EXPECT_EQ(same->scene_rev, 11u);
    EXPECT_EQ(scene.lights[0].world_from_light, before) << "to the last bit";
}

// Clients that sum in 32 bits: what misses an end of its range by rounding alone is that end; what is farther off is
// refused as ever (midimonster, MicroOsc issue 9).
TEST(Apply, RoundingBeyondAnEndIsThatEnd) {
    Scene scene = some_scene();
    const auto set = [&](const std::function<void(v1::SetLight&)>& fill) {
        return static_cast<bool>(run(scene, [&](v1::Command& c) {
            c.mutable_set_light()->set_name("key");
            fill(*c.mutable_set_light());
        }));
    };
    const auto key = [&]() -> const Light& { return scene.lights[0]; };  // a refusal puts others there
    float up = 0, down = 1;
    for (int i = 0; i < 10; ++i) up += 0.1F, down -= 0.1F;
    ASSERT_GT(up, 1.0F);
    ASSERT_LT(down, 0.0F);
    EXPECT_TRUE(set([&](v1::SetLight& l) { l.set_level_ratio(static_cast<double>(up)); }));
    EXPECT_EQ(key().level_ratio, 1.0);
    EXPECT_TRUE(set([&](v1::SetLight& l) { l.set_level_ratio(static_cast<double>(down)); }));
    EXPECT_EQ(key().level_ratio, 0.0);
    EXPECT_FALSE(set([](v1::SetLight& l) { l.set_level_ratio(1.0001); }));
    EXPECT_FALSE(set([](v1::SetLight& l) { l.set_level_ratio(-1e-4); }));
    EXPECT_FALSE(set([](v1::SetLight& l) { l.set_level_ratio(kNan); }));
    const double turns = 64 * std::numbers::pi;
    EXPECT_TRUE(set([&](v1::SetLight& l) { l.set_pan_rad(static_cast<double>(std::nextafter(float(turns), 1e9F))); }));
    EXPECT_EQ(key().pan_rad, turns);
    EXPECT_FALSE(set([&](v1::SetLight& l) { l.set_pan_rad(turns * 1.001); }));
    EXPECT_TRUE(set([](v1::SetLight& l) { l.set_tint_duv(static_cast<double>(-0.05F) - 1e-8); }));
    EXPECT_EQ(key().tint_duv, -0.05);
    EXPECT_TRUE(set([](v1::SetLight& l) { l.set_cct_k(15'000.01); }));
    EXPECT_EQ(key().cct_k, 15'000.0);
    EXPECT_TRUE(set([](v1::SetLight& l) { l.set_cct_k(-1e-7); }));
    EXPECT_EQ(key().cct_k, 0.0) << "none";
    EXPECT_FALSE(set([](v1::SetLight& l) { l.set_cct_k(999); }));
    EXPECT_TRUE(set([](v1::SetLight& l) {
        for (const double factor : {-1e-7, 0.5, 10'000.01}) l.add_color_rgb(factor);
    }));
    EXPECT_EQ(key().color, glm::dvec3(0, 0.5, 10'000));
    EXPECT_TRUE(run(scene, [&](v1::Command& c) { c.mutable_set_master()->set_ratio(static_cast<double>(up)); }));
    EXPECT_EQ(scene.master_ratio, 1.0);
}

TEST(Apply, RefusalsNameFieldAndValueAndChangeNothing) {
    Scene scene = some_scene();
    const auto light = [](const std::function<void(v1::SetLight&)>& fill) {
        return [fill](v1::Command& c) {
            c.mutable_set_light()->set_name("key");
            c.mutable_set_light()->set_level_ratio(0.5);  // valid, but must not be half-applied
            fill(*c.mutable_set_light());
        };
    };
    expect_refused(scene, light([](v1::SetLight& l) { l.set_level_ratio(1.5); }), "invalid_argument",
                   "set_light.level_ratio");
    expect_refused(scene, light([](v1::SetLight& l) { l.set_level_ratio(kNan); }), "invalid_argument",
                   "set_light.level_ratio");
    expect_refused(scene, light([](v1::SetLight& l) { l.add_position_m(1); }), "invalid_argument",
                   "set_light.position_m");
    expect_refused(scene, light([](v1::SetLight& l) {
                       for (double v : {0.0, kNan, 0.0}) l.add_position_m(v);
                   }),
                   "invalid_argument", "set_light.position_m");
    expect_refused(scene, light([](v1::SetLight& l) {
                       for (double v : {0.0, 0.0, 0.0}) l.add_aim(v);
                   }),
                   "invalid_argument", "set_light.aim");
    expect_refused(scene, light([](v1::SetLight& l) {
                       for (double v : {0.0, 1.0, 0.0}) l.add_aim(v);
                       l.set_pan_rad(1);
                   }),
                   "conflict", "set_light.aim");
    expect_refused(scene, light([](v1::SetLight& l) {
                       for (double v : {0.0, -1.0, 0.0}) l.add_color_rgb(v);
                   }),
                   "invalid_argument", "set_light.color_rgb");
    expect_refused(scene, light([](v1::SetLight& l) { l.set_name("nobody"); }), "not_found", "set_light.name");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_set_view()->set_view("pretty"); }, "invalid_argument", "set_view.view");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_set_technique()->set_technique("magic"); }, "invalid_argument",
        "set_technique.technique");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_set_technique()->set_samples(5000); }, "invalid_argument",
        "set_technique.samples");
    const auto many = run(scene, [](v1::Command& c) { c.mutable_set_technique()->set_samples(4294967295U); });
    EXPECT_EQ(many.error().value, "4294967295") << "all its digits";
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_set_camera()->set_fov_rad(0); }, "invalid_argument",
        "set_camera.fov_rad");
    expect_refused(
        scene,
        [](v1::Command& c) {
            for (double v : {1.0, 2.0, 3.0}) {
                c.mutable_set_camera()->add_eye_m(v);
                c.mutable_set_camera()->add_target_m(v);
            }
        },
        "invalid_argument", "set_camera.target_m");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_set_size()->set_width_px(800); }, "invalid_argument",
        "set_size.height_px");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_set_exposure()->set_ev100(99); }, "invalid_argument",
        "set_exposure.ev100");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_remove_light()->set_name("nobody"); }, "not_found", "remove_light.name");
    expect_refused(
        scene,
        [](v1::Command& c) {
            c.mutable_set_group()->set_name("g");
            c.mutable_set_group()->add_lights("nobody");
        },
        "not_found", "set_group.lights");
    expect_refused(
        scene, [](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name("key"); }, "already_exists",
        "add_light.light.name");
    expect_refused(
        scene, [](v1::Command&) {}, "unsupported", "command");
}

TEST(Apply, GroupsSetEveryMember) {
    Scene scene = some_scene();
    ASSERT_TRUE(run(scene, [](v1::Command& c) {
        c.mutable_set_group()->set_name("all");
        c.mutable_set_group()->add_lights("key");
        c.mutable_set_group()->add_lights("fill");
    }));
    ASSERT_TRUE(run(scene, [](v1::Command& c) {
        c.mutable_set_light()->set_name("all");
        c.mutable_set_light()->set_level_ratio(0.1);
    }));
    EXPECT_DOUBLE_EQ(scene.lights[0].level_ratio, 0.1);
    EXPECT_DOUBLE_EQ(scene.lights[1].level_ratio, 0.1);
    ASSERT_TRUE(run(scene, [](v1::Command& c) { c.mutable_remove_light()->set_name("fill"); }));
    EXPECT_EQ(scene.groups.at("all"), std::vector<std::string>{"key"});
}

TEST(Apply, OneLightTooManyIsRefused) {
    Scene scene = some_scene();
    for (std::size_t i = 2; i <= kMaxLights; ++i) {
        const auto result = run(
            scene, [&](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name("n" + std::to_string(i)); },
            {nullptr, some_profile("x")});
        EXPECT_EQ(result.ok(), i < kMaxLights) << i;
        if (!result) {
            EXPECT_EQ(result.error().code, "too_many_lights");
        }
    }
}

// Its paper's technique keeps all of them apart.
TEST(Apply, TheSeedTechniqueHasSixtyFourLights) {
    Scene scene = some_scene();
    const auto add = [&](int i) {
        return run(scene,
                   [&](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name("n" + std::to_string(i)); },
                   {nullptr, some_profile("x")});
    };
    const auto seed = [&] {
        return run(scene, [](v1::Command& c) { c.mutable_set_technique()->set_technique("seed"); });
    };
    while (scene.lights.size() < kMostLayers) ASSERT_TRUE(add(static_cast<int>(scene.lights.size())));
    ASSERT_TRUE(seed());
    const auto more = add(64);
    ASSERT_FALSE(more);
    EXPECT_EQ(more.error().code, "too_many_lights");
    EXPECT_EQ(scene.lights.size(), kMostLayers);
    ASSERT_TRUE(run(scene, [](v1::Command& c) { c.mutable_set_technique()->set_technique("default"); }));
    ASSERT_TRUE(add(64));
    const auto refused = seed();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_many_lights");
    EXPECT_EQ(scene.technique, Technique::standard);
}

TEST(Apply, LightsTimesPixelsAreBoundedForTheSeedTechnique) {
    Scene scene = some_scene();
    ASSERT_TRUE(run(scene, [](v1::Command& c) { c.mutable_set_technique()->set_technique("seed"); }));
    const auto size = [&](unsigned side) {
        return run(scene, [&](v1::Command& c) {
            c.mutable_set_size()->set_width_px(side);
            c.mutable_set_size()->set_height_px(side);
        });
    };
    ASSERT_TRUE(size(4096));  // two lights: 336 MB
    bool refused = false;
    for (int i = 0; i < 30 && !refused; ++i) {
        const auto added = run(
            scene, [&](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name("n" + std::to_string(i)); },
            {nullptr, some_profile("x")});
        refused = !added && added.error().code == "too_large";
    }
    EXPECT_TRUE(refused);
    EXPECT_LE(scene.lights.size() * 4096u * 4096u * kLayerBytesPerPixel, kMaxLayerBytes);
}

TEST(Apply, StateChangeHoldsWhatChangedAndNoMore) {
    Scene scene = some_scene();
    const Scene before = scene;
    run(scene, [](v1::Command& c) {
        c.mutable_set_light()->set_name("fill");
        c.mutable_set_light()->set_level_ratio(0.3);
    });
    const v1::StateChanged change = state_change(before, scene);
    ASSERT_EQ(change.state().lights_size(), 1);
    EXPECT_EQ(change.state().lights(0).name(), "fill");
    EXPECT_FALSE(change.state().has_camera());
    EXPECT_FALSE(change.state().has_view());
    const Scene again = scene;
    run(scene, [](v1::Command& c) { c.mutable_remove_light()->set_name("key"); });
    EXPECT_EQ(state_change(again, scene).removed_lights(0), "key");
}

v1::Command renaming(const std::string& name, const std::string& new_name) {
    v1::Command command;
    command.mutable_rename_light()->set_name(name);
    command.mutable_rename_light()->set_new_name(new_name);
    return command;
}

TEST(Apply, WhatNamesALightFollowsItsNewName) {
    Scene scene = some_scene();
    run(scene, [](v1::Command& c) {
        c.mutable_set_group()->set_name("all");
        for (const char* light : {"fill", "key"}) c.mutable_set_group()->add_lights(light);
    });
    run(scene, [](v1::Command& c) { c.mutable_save_preset()->set_name("look"); });
    run(scene, [](v1::Command& c) { c.mutable_set_view()->set_light("key"); });
    run(scene, [](v1::Command& c) {
        v1::PatchRow& row = *c.mutable_set_patch()->add_rows();
        row.set_protocol("sacn");
        row.set_universe(1);
        row.set_address(1);
        row.set_target("key");
        row.set_property("level");
    });
    run(scene, [](v1::Command& c) {
        v1::SurfaceRow& row = *c.mutable_set_surfaces()->add_rows();
        row.set_device("*");
        row.set_control("slider 1");
        row.set_target("key");
        row.set_property("level");
    });
    const Scene before = scene;
    const auto renamed = apply(scene, renaming("key", "main"), {});
    ASSERT_TRUE(renamed) << renamed.error().text();
    EXPECT_TRUE(renamed->warnings.empty());
    EXPECT_EQ(scene.lights[0].name, "main");
    EXPECT_EQ(scene.lights[0].id, before.lights[0].id);
    EXPECT_EQ(scene.lights[0].level_rev, before.lights[0].level_rev) << "nothing is lit anew";
    EXPECT_EQ(scene.groups.at("all"), (std::vector<std::string>{"fill", "main"}));
    EXPECT_EQ(scene.presets.at("look")->at(0).name, "main");
    EXPECT_EQ(before.presets.at("look")->at(0).name, "key") << "copies of the scene keep theirs";
    EXPECT_EQ(scene.view_light, "main");
    EXPECT_EQ(scene.patch->rows(0).target(), "main");
    EXPECT_EQ(scene.surfaces->rows(0).target(), "main");

    const v1::StateChanged change = state_change(before, scene);
    ASSERT_EQ(change.state().lights_size(), 1) << "the renamed one";
    EXPECT_EQ(change.state().lights(0).name(), "main");
    EXPECT_EQ(change.removed_lights(0), "key");
    EXPECT_EQ(change.renamed_lights(0).name(), "key");
    EXPECT_EQ(change.renamed_lights(0).new_name(), "main");
    EXPECT_EQ(change.light_order(0), "main") << "in its place";
    EXPECT_EQ(change.light_order(1), "fill");
}

TEST(Apply, NamesThatALightCannotGet) {
    Scene scene = some_scene();
    run(scene, [](v1::Command& c) {
        c.mutable_set_group()->set_name("all");
        c.mutable_set_group()->add_lights("key");
    });
    const auto rename = [](const std::string& name, const std::string& new_name) {
        return [=](v1::Command& c) { c = renaming(name, new_name); };
    };
    expect_refused(scene, rename("nobody", "main"), "not_found", "rename_light.name");
    expect_refused(scene, rename("key", "fill"), "already_exists", "rename_light.new_name");
    expect_refused(scene, rename("key", "all"), "already_exists", "rename_light.new_name");
    expect_refused(scene, rename("key", ""), "invalid_argument", "rename_light.new_name");
    expect_refused(scene, rename("key", std::string(129, 'x')), "invalid_argument", "rename_light.new_name");
    expect_refused(scene, rename("key", "a\nb"), "invalid_argument", "rename_light.new_name");
    const auto same = run(scene, rename("key", "key"));
    ASSERT_TRUE(same);
    EXPECT_EQ(same->scene_rev, scene.scene_rev);
}

TEST(Apply, APresetForgetsTheLightWhoseNameIsTaken) {
    Scene scene = some_scene();
    run(scene, [](v1::Command& c) { c.mutable_save_preset()->set_name("look"); });
    run(scene, [](v1::Command& c) { c.mutable_remove_light()->set_name("fill"); });
    const auto renamed = apply(scene, renaming("key", "fill"), {});
    ASSERT_TRUE(renamed);
    ASSERT_EQ(renamed->warnings.size(), 1u);
    EXPECT_EQ(renamed->warnings[0], "preset 'look' kept another light 'fill', which it forgets");
    ASSERT_EQ(scene.presets.at("look")->size(), 1u);
    EXPECT_EQ(scene.presets.at("look")->at(0).name, "fill");
}

TEST(Orientation, ZeroAndItsAxes) {
    const auto near = [](const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 1e-12; };
    const glm::dquat zero = orientation_of({});
    EXPECT_TRUE(near(aim_of(zero), {0, -1, 0}));
    EXPECT_TRUE(near(c0_of(zero), {1, 0, 0}));
    EXPECT_TRUE(near(zero * glm::dvec3(0, 1, 0), {0, 0, -1})) << "C90";
    EXPECT_TRUE(near(aim_of(orientation_of({0, std::numbers::pi / 2, 0})), {0, 0, -1})) << "tilt +90 aims -Z";
    EXPECT_TRUE(near(c0_of(orientation_of({0, 0, std::numbers::pi / 2})), {0, 0, -1})) << "roll adds to C";
}

TEST(Orientation, AnglesRoundTrip) {
    for (double pan : {-2.5, 0.0, 1.0}) {
        for (double tilt : {0.2, 1.5, 3.0}) {
            for (double roll : {-3.0, 0.0, 0.4}) {
                const PanTiltRoll angles = angles_of(orientation_of({pan, tilt, roll}));
                EXPECT_NEAR(angles.pan_rad, pan, 1e-9);
                EXPECT_NEAR(angles.tilt_rad, tilt, 1e-9);
                EXPECT_NEAR(angles.roll_rad, roll, 1e-9);
            }
        }
    }
}

TEST(Orientation, AimTakesC0FromWorldX) {
    for (const glm::dvec3& aim : {glm::dvec3{0.2, -1, 0.3}, {0, -1, 0}, {0, 0, 5}, {1, 0, 0}, {-1, 1e-9, 0}}) {
        const glm::dquat q = orientation_aiming(aim);
        const glm::dvec3 a = glm::normalize(aim), c0 = c0_of(q);
        EXPECT_LT(glm::length(aim_of(q) - a), 1e-9);
        EXPECT_NEAR(glm::dot(c0, a), 0.0, 1e-9);
        const glm::dvec3 reference = std::abs(a.x) > 1 - 1e-6 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
        EXPECT_GT(glm::dot(c0, reference), 0.0);
        EXPECT_NEAR(glm::dot(glm::cross(reference, a), c0), 0.0, 1e-9)
            << "C0 lies in the plane of the reference and the aim";
    }
}

// Each command brings its own copy of what it read.
TEST(Apply, LightsShareEqualProfiles) {
    Scene scene = some_scene();
    const auto with = [](const char* name) { return Loaded{.profile = some_profile(name)}; };
    const auto add = [](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name("new"); };
    ASSERT_TRUE(run(scene, add, with("two")));
    const auto set = [](v1::Command& c) { c.mutable_set_light()->set_name("key"); };
    ASSERT_TRUE(run(scene, set, with("two")));
    EXPECT_EQ(scene.lights[0].profile, scene.lights[2].profile);
    EXPECT_NE(scene.lights[0].profile, scene.lights[1].profile);
    const Revision before = scene.lights[1].profile_rev;
    ASSERT_TRUE(run(
        scene, [](v1::Command& c) { c.mutable_set_light()->set_name("fill"); }, with("one")));
    EXPECT_EQ(scene.lights[1].profile_rev, before) << "it has this one";
    auto brighter = std::make_shared<Profile>(*some_profile("two"));
    brighter->photometry.web.candela[3] = 101;
    ASSERT_TRUE(run(scene, set, {.profile = brighter}));
    EXPECT_EQ(scene.lights[0].profile, brighter);
}

}  // namespace
}  // namespace gonio
