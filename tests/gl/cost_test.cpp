// The cost table of docs/rendering.md, asserted through FrameReport on the cornell scene with two lights.
#include <map>
#include <set>

#include "server/assets/assets.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

v1::Command command_of(const std::function<void(v1::Command&)>& fill) {
    v1::Command command;
    fill(command);
    return command;
}

class Cost : public testing::Test {
protected:
    using Ran = std::set<std::string>;
    Cost() : renderer(context(), gather()), scene(scene_of(make_cornell())) {
        scene.width_px = scene.height_px = 160;
        set([](v1::SetLight& add) {
            add.set_name("second");
            for (double x : {-1.0, 2.0, 1.0}) add.add_position_m(x);
        });
        frame();
    }
    void set(const std::function<void(v1::SetLight&)>& fill) {
        v1::Command command;
        Loaded loaded;
        if (scene.lights.size() < 2) {
            loaded.profile = *builtin_profile("narrow_spot");
            fill(*command.mutable_add_light()->mutable_light());
        } else {
            command.mutable_set_light()->set_name("second");
            fill(*command.mutable_set_light());
            if (command.set_light().has_profile())
                loaded.profile = *builtin_profile(command.set_light().profile().name());
        }
        const auto applied = apply(scene, command, loaded);
        ASSERT_TRUE(applied) << applied.error().text();
    }
    void change(const std::function<void(v1::Command&)>& fill) { ASSERT_TRUE(apply(scene, command_of(fill), {})); }

    bool shadow_maps() const {
        return gather() == Renderer::Gather::gl || (gather() == Renderer::Gather::automatic && !context().software());
    }

    // Passes that turn light into a picture: one on the CPU, two by shaders.
    Ran picture_of(Ran light = {}) const {
        light.insert("composite");
        if (shadow_maps()) light.insert("nv12");
        return light;
    }

    // Names of passes that ran, "name" or "name:light".
    std::set<std::string> frame() {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        std::set<std::string> ran;
        faces.clear();
        states.clear();
        for (const v1::PassReport& row : done->report.passes()) {
            const std::string name = row.name() + (row.has_light() ? ":" + row.light() : "");
            states[name] = row.state();
            if (row.state() == "ran") ran.insert(name);
            faces[name] = row.faces();
        }
        picture = done->nv12;
        EXPECT_TRUE(done->report.settled());
        EXPECT_EQ(done->report.scene_rev(), scene.scene_rev);
        return ran;
    }

    Renderer renderer;
    Scene scene;
    std::map<std::string, unsigned> faces;
    std::map<std::string, std::string> states;
    std::shared_ptr<const std::vector<std::uint8_t>> picture;
};

TEST_F(Cost, NothingChangedRunsNothing) {
    EXPECT_EQ(frame(), Ran{});
    EXPECT_EQ(picture, nullptr) << "no readback either";
}

TEST_F(Cost, LevelColourMasterExposureRunTheCompositeOnly) {
    const Ran composite = picture_of();
    set([](v1::SetLight& light) { light.set_level_ratio(0.5); });
    EXPECT_EQ(frame(), composite);
    set([](v1::SetLight& light) {
        light.add_color_rgb(1);
        light.add_color_rgb(0.2);
        light.add_color_rgb(0.1);
    });
    EXPECT_EQ(frame(), composite);
    change([](v1::Command& c) { c.mutable_set_master()->set_ratio(0.7); });
    EXPECT_EQ(frame(), composite);
    change([](v1::Command& c) { c.mutable_set_exposure()->set_ev100(4.0); });
    EXPECT_EQ(frame(), composite);
}

TEST_F(Cost, TheSameValueAgainRunsNothing) {
    set([](v1::SetLight& light) { light.set_level_ratio(1.0); });
    EXPECT_EQ(frame(), Ran{});
}

TEST_F(Cost, AimRunsTheLightsOwnPassesAndOnlyFacesNewlyReached) {
    // The narrow spot looks down: only the floor's face and its neighbours are made.
    set([](v1::SetLight& light) { light.set_tilt_rad(0.1); });
    const Ran ran = frame();
    for (const char* name : {"vpl:second", "occlusion:second", "direct:second", "gather:second", "composite"})
        EXPECT_TRUE(ran.contains(name)) << name;
    for (const char* name : {"gbuffer", "mask:luminaire", "vpl:luminaire", "direct:luminaire", "gather:luminaire",
                             "shadow:luminaire", "rsm:luminaire"}) {
        EXPECT_FALSE(ran.contains(name)) << name;
    }
    EXPECT_FALSE(ran.contains("shadow:second")) << "no face was newly reached";
    if (!shadow_maps()) return;
    set([](v1::SetLight& light) { light.set_tilt_rad(2.9); });  // turned up: the ceiling's face is new
    EXPECT_TRUE(frame().contains("shadow:second"));
    EXPECT_GE(faces["shadow:second"], 1u);
    EXPECT_LE(faces["shadow:second"], 5u) << "the floor's face was there already";
    set([](v1::SetLight& light) { light.set_tilt_rad(0.1); });  // back again: all faces are still valid
    EXPECT_FALSE(frame().contains("shadow:second"));
}

TEST_F(Cost, ProfileRunsTheLightsOwnPasses) {
    set([](v1::SetLight& light) { light.mutable_profile()->set_name("downlight"); });
    const Ran ran = frame();
    for (const char* name : {"vpl:second", "occlusion:second", "direct:second", "gather:second", "composite"})
        EXPECT_TRUE(ran.contains(name)) << name;
    for (const char* name : {"gbuffer", "mask:luminaire", "vpl:luminaire", "direct:luminaire", "gather:luminaire"})
        EXPECT_FALSE(ran.contains(name)) << name;
}

TEST_F(Cost, PositionRunsReachedFacesOfThatLightOnly) {
    set([](v1::SetLight& light) {
        for (double x : {-1.0, 2.1, 1.0}) light.add_position_m(x);
    });
    const Ran ran = frame();
    Ran expected = picture_of({"vpl:second", "occlusion:second", "direct:second", "gather:second"});
    if (shadow_maps()) expected.insert("shadow:second");
    EXPECT_EQ(ran, expected);
    EXPECT_EQ(states["shadow:second"], shadow_maps() ? "ran" : "culled") << "rays stand for the shadow map on the CPU";
    EXPECT_EQ(states["rsm:second"], "culled") << "the luminaire's own rays stand for the map where nobody looks at it";
    EXPECT_LT(faces["shadow:second"], 6u) << "a narrow spot does not reach all faces";
}

TEST_F(Cost, CameraRunsNoLightMap) {
    change([](v1::Command& c) {
        for (double x : {0.1, 2.0, 7.0}) c.mutable_set_camera()->add_eye_m(x);
    });
    Ran expected = picture_of({"direct:luminaire", "occlusion:luminaire", "gather:luminaire", "direct:second",
                               "occlusion:second", "gather:second"});
    expected.insert("gbuffer");
    if (shadow_maps()) expected.insert("gbuffer-readback");
    EXPECT_EQ(frame(), expected);
}

TEST_F(Cost, ViewModeRunsTheCompositeAndWhatWasCulledWhileItMoved) {
    change([](v1::Command& c) { c.mutable_set_view()->set_view("direct"); });
    EXPECT_EQ(frame(), picture_of());
    EXPECT_EQ(states["gather:second"], "culled");
    set([](v1::SetLight& light) { light.set_tilt_rad(0.2); });
    EXPECT_EQ(frame(), picture_of({"direct:second"})) << "the bounce is culled while nobody sees it";
    change([](v1::Command& c) { c.mutable_set_view()->set_view("beauty"); });
    EXPECT_EQ(frame(), picture_of({"vpl:second", "occlusion:second", "gather:second"}));
}

TEST_F(Cost, ACaptureAndAMeterLeaveTheLivePassesClean) {
    ASSERT_TRUE(renderer.capture(scene, View::illuminance, 64, 48, true));
    renderer.meter(scene, {0, 0.01, 1.5}, {0, 1, 0}, Renderer::MeterQuality::rsm);
    EXPECT_EQ(frame(), Ran{});
}

TEST_F(Cost, SameInputsGiveTheSameBytes) {
    change([](v1::Command& c) { c.mutable_set_exposure()->set_ev100(4.5); });
    frame();
    const auto first = picture;
    set([](v1::SetLight& light) { light.set_tilt_rad(0.7); });
    frame();
    set([](v1::SetLight& light) { light.set_tilt_rad(0.0); });
    frame();
    EXPECT_EQ(*first, *picture);
}

TEST_F(Cost, TheSeedTechniqueRecomputesEverything) {
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
    EXPECT_EQ(states["vpl:second"], "absent");
}

TEST_F(Cost, ASceneWithoutLightsSaysAbsent) {
    change([](v1::Command& c) { c.mutable_remove_light()->set_name("second"); });
    change([](v1::Command& c) { c.mutable_remove_light()->set_name("luminaire"); });
    frame();
    EXPECT_EQ(states["shadow"], "absent");
    EXPECT_EQ(states["gather"], "absent");
    EXPECT_NE(picture, nullptr);
}

}  // namespace
}  // namespace gonio::test
