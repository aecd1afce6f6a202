// Zoom and gobo of a light: the web that they make of its profile, and what a light has to do with it.
#include "server/scene/shaped_profile.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "ies/quantities.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/exchange/beam_web.h"
#include "server/scene/apply.h"
#include "server/scene/light_tables.h"
#include "server/scene/preset.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/scene/strobe.h"
#include "tests/unit/angles.h"

namespace gonio {
namespace {

gdtf::Beam beam_of(double beam_deg, double field_deg, gdtf::BeamType type = gdtf::BeamType::wash) {
    gdtf::Beam beam;
    beam.flux_lm = {10'000, false};
    beam.beam_angle_rad = {beam_deg * kDegree, false};
    beam.field_angle_rad = {field_deg * kDegree, false};
    beam.type = {type, false};
    return beam;
}

std::shared_ptr<Profile> profile_of(ies::PhotometricWeb web, Gobos gobos = {}) {
    auto profile = std::make_shared<Profile>();
    profile->name = "head";
    profile->photometry.web = std::move(web);
    profile->peak_cd = ies::peak_intensity(profile->photometry.web).in(cd);
    profile->flux_lm = ies::total_flux(profile->photometry.web).in(lm);
    if (!gobos.empty()) profile->gobos = std::make_shared<const Gobos>(std::move(gobos));
    return profile;
}

double at(const ies::PhotometricWeb& web, double v_deg, double h_deg) {
    return ies::intensity_at(web, Angle::degrees(v_deg), Angle::degrees(h_deg)).in(cd);
}

// Its right half lets light through.
Gobo half_plane(int size_px = 256) {
    Gobo gobo{"half", size_px, {}};
    for (int y = 0; y < size_px; ++y)
        for (int x = 0; x < size_px; ++x) gobo.transmission.push_back(2 * x < size_px ? 0 : 65535);
    return gobo;
}

Scene scene_with(const std::shared_ptr<const Profile>& profile) {
    auto asset = std::make_shared<SceneAsset>();
    LightSeed light;
    light.name = "key";
    light.profile = profile;
    asset->lights.push_back(light);
    asset->bounds = {{-1, -1, -1}, {1, 1, 1}};
    return scene_of(asset, 10);
}

Result<Applied> set(Scene& scene, const std::function<void(v1::SetLight&)>& fill) {
    v1::Command command;
    command.mutable_set_light()->set_name("key");
    fill(*command.mutable_set_light());
    return apply(scene, command, {});
}

// GDTF's own formula at the zoomed angle (the guide's: I0 from the flux, the ratio of field to beam stays).
TEST(ShapedProfile, ZoomIsTheBeamOfThatAngle) {
    for (const auto& beam : {beam_of(25, 40), beam_of(25, 50), beam_of(40, 40), beam_of(25, 25, gdtf::BeamType::spot)})
        for (const double zoom_deg : {6.0, 15.0, 33.3, 60.0}) {
            const auto expected = gdtf::beam_web(beam, Angle::degrees(zoom_deg)),
                       zoomed = zoomed_web(gdtf::beam_web(beam, std::nullopt), Angle::degrees(zoom_deg));
            const double peak = ies::peak_intensity(expected).in(cd);
            EXPECT_NEAR(ies::peak_intensity(zoomed).in(cd) / peak, 1.0, 1e-3) << zoom_deg;
            EXPECT_NEAR(ies::total_flux(zoomed).in(lm), 10'000, 1.0);
            EXPECT_NEAR(ies::plane_beams(zoomed, Angle::degrees(0)).beam.outermost->degrees(), zoom_deg, 0.01);
            for (const double share : {0.3, 0.45, 0.7})
                EXPECT_NEAR(at(zoomed, share * zoom_deg, 33), at(expected, share * zoom_deg, 33), 2e-3 * peak);
        }
}

// A picture in the web hides where half the peak is: at the open beam's own angle the zoom changes nothing.
TEST(ShapedProfile, AWebBehindItsOwnPictureZoomsByTheOpenBeam) {
    const auto open = gdtf::beam_web(beam_of(25, 40), std::nullopt);
    auto profile = profile_of(gobo_web(open, half_plane(), Angle::degrees(45)));
    profile->open_width_rad = beam_width(open);
    EXPECT_NEAR(profile->open_width_rad, 25 * kDegree, 0.1 * kDegree);
    const auto zoomed = shaped_profile(profile, {.zoom_rad = profile->open_width_rad});
    ASSERT_NE(zoomed, nullptr);
    for (const double v : {0.0, 3.0, 8.0, 12.0})
        for (const double h : {0.0, 45.0, 200.0})
            EXPECT_NEAR(at(zoomed->photometry.web, v, h), at(profile->photometry.web, v, h), 1e-4 * profile->peak_cd);
}

TEST(ShapedProfile, AMeasuredWebKeepsItsFluxAndNothingGetsBehind) {
    ies::PhotometricWeb web{
        ies::Goniometer::type_c, {}, {0, 90 * kDegree, 180 * kDegree, 270 * kDegree, 360 * kDegree}, {}};
    for (int v = 0; v <= 90; ++v) web.v_rad.push_back(v * kDegree);
    for (std::size_t h = 0; h < 5; ++h)
        for (int v = 0; v <= 90; ++v)
            web.candela.push_back(static_cast<float>((h % 2 == 0 ? 900 : 700) * std::pow(std::cos(v * kDegree), 3)));
    const double flux = ies::total_flux(web).in(lm);
    for (const double zoom_deg : {20.0, 74.9, 140.0}) {
        const auto zoomed = zoomed_web(web, Angle::degrees(zoom_deg));
        EXPECT_NEAR(ies::total_flux(zoomed).in(lm) / flux, 1.0, 1e-6);
        EXPECT_NEAR(ies::plane_beams(zoomed, Angle::degrees(0)).beam.outermost->degrees(), zoom_deg, 0.1);
        EXPECT_NEAR(at(zoomed, 5, 90) / at(zoomed, 5, 0), 7.0 / 9.0, 1e-3) << "each plane alike";
        EXPECT_EQ(at(zoomed, 90.5, 0), 0.0);
    }
    const auto dark = ies::PhotometricWeb{ies::Goniometer::type_c, {0, 1}, {0, 2 * std::numbers::pi}, {0, 0, 0, 0}};
    EXPECT_EQ(zoomed_web(dark, Angle::degrees(30)), dark);
}

// Half of the axial beam is held back: half of the flux, and the open beam's candela on the other half.
TEST(ShapedProfile, AHalfPlaneLightsOneHalf) {
    const auto open = gdtf::beam_web(beam_of(25, 40), std::nullopt);
    const auto cut = gobo_web(open, half_plane(), Angle::degrees(0));
    EXPECT_NEAR(ies::total_flux(cut).in(lm) / 10'000, 0.5, 1e-3);
    for (const double v : {3.0, 8.0, 12.5, 20.0, 24.0})
        for (const double h : {0.0, 30.0, 75.0, 290.0, 340.0}) {
            EXPECT_NEAR(at(cut, v, h), at(open, v, h), 0.01 * at(open, v, h)) << v << " " << h;
            EXPECT_EQ(at(cut, v, 180 - h), 0.0) << v << " " << h;
        }
    const auto turned = gobo_web(open, half_plane(), Angle::degrees(90));  // C90 is lit, as roll turns C0
    EXPECT_NEAR(at(turned, 8, 90), at(open, 8, 90), 0.01 * at(open, 8, 90));
    EXPECT_EQ(at(turned, 8, 270), 0.0);
    EXPECT_NEAR(ies::total_flux(turned).in(lm) / 10'000, 0.5, 1e-3);
}

// A picture with its upper half at a quarter, and the row of its top alone open: up is C90, and the edge is where a
// tenth of the peak is: by the tangent half of the picture is at atan(tan(20°)/2) = 10.31°.
TEST(ShapedProfile, APictureStandsUprightAndFillsTheField) {
    Gobo gobo{"rows", 64, std::vector<std::uint16_t>(64 * 64, 0)};
    for (int i = 0; i < 64 * 16; ++i) gobo.transmission[static_cast<std::size_t>(i)] = 65535;  // y > 0.5
    const auto open = gdtf::beam_web(beam_of(25, 40), std::nullopt), cut = gobo_web(open, gobo, Angle::degrees(0));
    EXPECT_EQ(at(cut, 9.9, 90), 0.0);
    EXPECT_NEAR(at(cut, 10.8, 90), at(open, 10.8, 90), 0.01 * at(open, 10.8, 90));
    for (const double v : {0.0, 5.0, 15.0}) EXPECT_EQ(at(cut, v, 270), 0.0);
    EXPECT_EQ(at(cut, 15, 0), 0.0);
    EXPECT_NEAR(at(cut, 30, 90), at(open, 30, 90), 1e-3 * at(open, 30, 90)) << "beyond the picture as at its border";
}

TEST(ShapedProfile, WebsAndTablesHaveEvenStepsThatLightingTakesWhole) {
    const auto profile = profile_of(gdtf::beam_web(beam_of(25, 40), std::nullopt), {half_plane()});
    for (const double zoom_deg : {4.0, 25.0, 60.0}) {
        const auto began = std::chrono::steady_clock::now();
        const auto shaped = shaped_profile(profile, {zoom_deg * kDegree, 1, 0.0});
        const auto made = std::chrono::steady_clock::now();
        EXPECT_TRUE(tables_of(*shaped).uniform) << zoom_deg;
        EXPECT_EQ(tables_of(*shaped).thinned, "");
        const auto ms = [](auto from, auto to) { return std::chrono::duration<double, std::milli>(to - from).count(); };
        RecordProperty("web_ms_" + std::to_string(static_cast<int>(zoom_deg)), std::to_string(ms(began, made)));
        std::printf("[ %2.0f deg  ] web %.1f ms, tables %.1f ms\n", zoom_deg, ms(began, made),
                    ms(made, std::chrono::steady_clock::now()));
        EXPECT_EQ(shaped_profile(profile, {zoom_deg * kDegree, 1, 0.0}), shaped) << "kept";
    }
}

TEST(ShapedProfile, ALightShinesWithWhatItsValuesSay) {
    const auto profile = profile_of(gdtf::beam_web(beam_of(25, 40), std::nullopt), {Gobo{"open", 0, {}}, half_plane()});
    Scene scene = scene_with(profile);
    const auto light = [&]() -> const Light& { return scene.lights[0]; };
    EXPECT_EQ(light().shining(), profile);
    const Revision before = light().profile_rev;
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_zoom_rad(50 * kDegree); }));
    EXPECT_GT(light().profile_rev, before);
    EXPECT_NEAR(light().shining()->peak_cd,
                ies::peak_intensity(gdtf::beam_web(beam_of(25, 40), Angle::degrees(50))).in(cd),
                1e-3 * light().shining()->peak_cd);
    EXPECT_EQ(light().profile, profile) << "its own";
    const auto zoomed = light().shining();
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_gobo(1); }));
    EXPECT_EQ(light().shining(), zoomed) << "an open slot";
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_gobo(2), set.set_gobo_rad(0.3); }));
    EXPECT_NEAR(light().shining()->flux_lm, 5'000, 10);
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_gobo(3); }));
    EXPECT_EQ(light().shining(), zoomed) << "the wheel has no such slot";
    const auto refused = set(scene, [](v1::SetLight& set) { set.set_gobo(256); });
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().where, "set_light.gobo");
    EXPECT_EQ(light().gobo, 3);
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_gobo(2); }));
    EXPECT_FALSE(set(scene, [](v1::SetLight& set) { set.set_zoom_rad(0.001); }));
    const v1::State state = full_state(scene);
    ASSERT_EQ(state.lights(0).gobos_size(), 2);
    EXPECT_EQ(state.lights(0).gobos(1), "half");
    EXPECT_EQ(state.lights(0).gobo(), 2);
    EXPECT_NEAR(state.lights(0).flux_lm(), 5'000, 10) << "half of it passes";
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_gobo(0), set.set_zoom_rad(0); }));
    EXPECT_EQ(light().shining(), profile);
}

TEST(ShapedProfile, AFadeTurnsNoWheelThroughWhatLiesBetween) {
    const LightRow *gobo = light_row_of(Property::gobo), *zoom = light_row_of(Property::zoom);
    EXPECT_EQ(between(*gobo, {1, 0, 0}, {5, 0, 0}, 0.3)[0], 5);
    EXPECT_EQ(between(*gobo, {1, 0, 0}, {5, 0, 0}, 0.0)[0], 1);
    EXPECT_DOUBLE_EQ(between(*zoom, {0.2, 0, 0}, {0.6, 0, 0}, 0.5)[0], 0.4);
    EXPECT_DOUBLE_EQ(between(*zoom, {0, 0, 0}, {0.6, 0, 0}, 0.5)[0], 0.6) << "from the profile's own at once";
}

// 10 Hz: on from 0 to 50 ms, out to 100 ms. Level × shutter × that.
TEST(Strobe, FlashesByTheClockAndTheShutterTakesItsShare) {
    Scene scene = scene_with(profile_of(gdtf::beam_web(beam_of(25, 40), std::nullopt)));
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_shutter_ratio(0.25), set.set_level_ratio(0.5); }));
    EXPECT_DOUBLE_EQ(light_weight(scene, scene.lights[0]).g, 0.125);
    EXPECT_FALSE(any_strobe(scene));
    EXPECT_FALSE(set_flashes(scene, 0.07)) << "nothing strobes";
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_strobe_hz(10); }));
    EXPECT_TRUE(any_strobe(scene));
    const Revision rev = scene.scene_rev;
    EXPECT_FALSE(set_flashes(scene, 3.02));
    EXPECT_DOUBLE_EQ(light_weight(scene, scene.lights[0]).g, 0.125);
    EXPECT_TRUE(set_flashes(scene, 3.07));
    EXPECT_DOUBLE_EQ(light_weight(scene, scene.lights[0]).g, 0.0);
    EXPECT_FALSE(set_flashes(scene, 3.08)) << "still out";
    EXPECT_EQ(scene.scene_rev, rev) << "nobody changed it";
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_strobe_hz(0); }));
    EXPECT_DOUBLE_EQ(light_weight(scene, scene.lights[0]).g, 0.125) << "it ends lit";
    EXPECT_FALSE(any_strobe(scene));
    ASSERT_TRUE(set(scene, [](v1::SetLight& set) { set.set_strobe_hz(10), set.set_shutter_ratio(0); }));
    EXPECT_FALSE(any_strobe(scene)) << "a closed shutter shows nothing of it";
}

}  // namespace
}  // namespace gonio
