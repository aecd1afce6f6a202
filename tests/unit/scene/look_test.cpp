// Tone curves, the white of the picture and exposures as cameras have them, against figures from elsewhere.
#include <gtest/gtest.h>

#include <cmath>

#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/apply_view.h"
#include "server/scene/scene.h"
#include "server/scene/white_balance.h"
#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

// Computed from the GLSL of three.js 0.187.
TEST(Tone, CurvesGoThroughKnownPoints) {
    const auto grey = [](const auto& curve, double x) { return curve(glm::dvec3(x)); };
    const auto agx = [](const glm::dvec3& x) { return glsl64::tone_agx(x); };
    const auto aces = [](const glm::dvec3& x) { return glsl64::tone_aces(x); };
    const auto neutral = [](const glm::dvec3& x) { return glsl64::tone_neutral(x); };
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(grey(agx, 0.18)[k], 0.2145, 5e-4);
        EXPECT_NEAR(grey(agx, 1.0)[k], 0.590, 1e-3);
        EXPECT_NEAR(grey(agx, 8.0)[k], 0.937, 1e-3);
        EXPECT_NEAR(grey(aces, 0.18)[k], 0.2131, 1e-4);
        EXPECT_NEAR(grey(aces, 1.0)[k], 0.763, 1e-3);
        EXPECT_NEAR(grey(aces, 8.0)[k], 0.985, 1e-3);
        // Khronos: x − 0.04 between 0.08 and 0.8, 6.25 x² off below, and 1 − 0.24² / (x − 0.04 − 0.52) beyond.
        EXPECT_NEAR(grey(neutral, 0.18)[k], 0.14, 1e-6);
        EXPECT_NEAR(grey(neutral, 0.04)[k], 0.01, 1e-6);
        EXPECT_NEAR(grey(neutral, 2.04)[k], 1.0 - 0.0576 / 1.48, 1e-6);
    }
    const glm::dvec3 red(4.0, 0.0, 0.0);
    EXPECT_NEAR(glm::distance(agx(red), {1.0, 0.370, 0.272}), 0.0, 2e-3);
    EXPECT_NEAR(glm::distance(aces(red), {1.0, 0.327, 0.092}), 0.0, 2e-3);
    // Of a red of 4 the peak becomes 1 − 0.0576/3.48; it is mixed with that grey by 1 − 1/(0.15 (4 − peak) + 1).
    const double peak = 1.0 - 0.0576 / 3.48, share = 1.0 / (0.15 * (4.0 - peak) + 1.0);
    EXPECT_NEAR(glm::distance(neutral(red), {peak, peak * (1 - share), peak * (1 - share)}), 0.0, 1e-6);
}

TEST(Tone, CurvesAreMonotoneAndBounded) {
    glm::dvec3 last(0.0);
    for (double x = 0.0; x < 60.0; x = x * 1.01 + 1e-4) {
        const glm::dvec3 shown(glsl64::tone_agx(glm::dvec3(x)).g, glsl64::tone_aces(glm::dvec3(x)).g,
                               glsl64::tone_neutral(glm::dvec3(x)).g);
        for (int k = 0; k < 3; ++k) {
            EXPECT_GE(shown[k], last[k] - 1e-9) << k << " " << x;
            EXPECT_LE(shown[k], 1.0);
        }
        last = shown;
    }
}

// The white that is named becomes neutral, at the luminance that it has; nothing changes by default.
TEST(WhiteBalance, TheWhiteBecomesNeutral) {
    EXPECT_EQ(white_balance(0.0, 0.01), glm::dmat3(1.0));
    // Linear Rec.709 of 2700 K, from xy 0.46000, 0.41097 by the matrix of IEC 61966-2-1.
    const double x = 0.46000 / 0.41097, z = (1 - 0.46000 - 0.41097) / 0.41097;
    const glm::dvec3 warm(3.2404542 * x - 1.5371385 - 0.4985314 * z, -0.9692660 * x + 1.8760108 + 0.0415560 * z,
                          0.0556434 * x - 0.2040259 + 1.0572252 * z);
    const glm::dvec3 shown = white_balance(2700, 0) * warm;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(shown[k], 1.0, 1e-3);
    // D65 in the white of 2700 K is blue, and greener with a magenta white.
    const glm::dvec3 blue = white_balance(2700, 0) * glm::dvec3(1.0);
    EXPECT_GT(blue.b, 1.5);
    EXPECT_LT(blue.r, 0.8);
    const glm::dvec3 green = white_balance(6500, -0.02) * glm::dvec3(1.0);
    EXPECT_GT(green.g, green.r);
    EXPECT_GT(green.g, green.b);
}

// ISO 2720, as photographers have it: f/16 and 1/100 s at ISO 100.
TEST(CameraExposure, IsAnEv100) {
    EXPECT_NEAR(ev100_of(16, 0.01, 100), 14.6439, 1e-4);
    EXPECT_NEAR(ev100_of(5.6, 1.0 / 60, 400), 8.8777, 1e-4);
    EXPECT_DOUBLE_EQ(ev100_of(1, 1, 100), 0.0);
}

class SetLook : public testing::Test {
protected:
    Result<Applied> set(const std::function<void(v1::Command&)>& fill) {
        v1::Command command;
        fill(command);
        return apply(scene, command, {});
    }
    void expect_refused(const std::string& code, const std::string& where,
                        const std::function<void(v1::Command&)>& fill) {
        const Scene before = scene;
        const auto done = set(fill);
        ASSERT_FALSE(done) << where;
        EXPECT_EQ(done.error().code, code) << where;
        EXPECT_EQ(done.error().where, where);
        EXPECT_EQ(scene.scene_rev, before.scene_rev);
        EXPECT_EQ(scene.look, before.look);
    }
    Scene scene = scene_of(make_cornell());
};

TEST_F(SetLook, TakesWhatItNamesAndRefusesTheRest) {
    ASSERT_TRUE(set([](auto& c) { c.mutable_set_look()->set_tone("agx"); }));
    ASSERT_TRUE(set([](auto& c) { c.mutable_set_look()->set_white_k(3200); }));
    EXPECT_EQ(scene.look, (Look{Tone::agx, 3200.0, 0.0}));
    EXPECT_EQ(scene.look_rev, scene.scene_rev);
    expect_refused("invalid_argument", "set_look.tone", [](auto& c) { c.mutable_set_look()->set_tone("filmic"); });
    expect_refused("invalid_argument", "set_look.white_k", [](auto& c) { c.mutable_set_look()->set_white_k(999); });
    expect_refused("invalid_argument", "set_look.white_k", [](auto& c) { c.mutable_set_look()->set_white_k(NAN); });
    expect_refused("invalid_argument", "set_look.white_duv",
                   [](auto& c) { c.mutable_set_look()->set_white_duv(0.06); });
    ASSERT_TRUE(set([](auto& c) { c.mutable_set_look()->set_white_k(0); }));
    EXPECT_EQ(scene.look.white_k, 0.0);
}

TEST_F(SetLook, ExposureOfACamera) {
    const auto camera = [](v1::Command& c, double aperture, double shutter_s, double iso) {
        c.mutable_set_exposure()->set_aperture(aperture);
        c.mutable_set_exposure()->set_shutter_s(shutter_s);
        c.mutable_set_exposure()->set_iso(iso);
    };
    ASSERT_TRUE(set([&](auto& c) { camera(c, 5.6, 1.0 / 60, 400); }));
    EXPECT_NEAR(scene.exposure_ev100, 8.8777, 1e-4);
    EXPECT_FALSE(scene.exposure_auto);
    expect_refused("invalid_argument", "set_exposure.aperture", [&](auto& c) { camera(c, 0.0, 1, 100); });
    expect_refused("invalid_argument", "set_exposure.shutter_s", [&](auto& c) { camera(c, 1, -1, 100); });
    expect_refused("invalid_argument", "set_exposure.iso", [&](auto& c) { camera(c, 1, 1, INFINITY); });
    expect_refused("invalid_argument", "set_exposure.shutter_s", [&](auto& c) { camera(c, 128, 1e-6, 1); });
    expect_refused("invalid_argument", "set_exposure.iso", [&](auto& c) {
        c.mutable_set_exposure()->set_aperture(4);
        c.mutable_set_exposure()->set_shutter_s(1);
    });
    expect_refused("invalid_argument", "set_exposure.aperture", [](auto& c) {
        c.mutable_set_exposure()->set_aperture(0);  // what was typed is told before what is missing
    });
    expect_refused("conflict", "set_exposure.ev100", [&](auto& c) {
        camera(c, 4, 1, 100);
        c.mutable_set_exposure()->set_ev100(5);
    });
}

}  // namespace
}  // namespace gonio
