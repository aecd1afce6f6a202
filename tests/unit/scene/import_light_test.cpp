// What light imported fixtures give: beam types, photometric files, guessed beams, emitters, wheels and pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "ies/core/printed.h"
#include "ies/synthetic.h"
#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/exchange/import_parts.h"
#include "server/scene/apply.h"
#include "server/scene/console.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/scene/white.h"
#include "tests/unit/scene/chromaticity.h"
#include "tests/unit/scene/heard.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

using namespace test;

constexpr const char* kAddressed = "<Addresses><Address break='0'>1.1</Address></Addresses>";

std::string type_file(GdtfText text, std::vector<ZipFile> files = {}) {
    if (text.modes.empty()) text.modes = mode_text("Base", channel_text("Base", "Dimmer", "1"));
    files.push_back({"description.xml", gdtf_text(text)});
    return *write_zip(files);
}

std::string beam_text(const std::string& more) {
    return "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='10000' " + more + "/></Geometry>";
}

std::shared_ptr<SceneAsset> shown_spot(const std::string& gdtf, const std::string& more = kAddressed,
                                       std::vector<ZipFile> files = {}) {
    files.push_back({"Maker@Head.gdtf", gdtf});
    return imported(show_mvr(fixture("Spot", "{1,0,0}{0,1,0}{0,0,1}{0,0,3000}", more), files));
}

// Lux that a light alone gives a floor there, looking up.
double lux_below(const LightSeed& light, const glm::dvec3& place) {
    const glm::dvec3 away = place - light.position;
    const glm::dvec3 local = glm::inverse(light.world_from_light) * away;
    const double squared = glm::dot(away, away);
    return ies::intensity(light.profile->photometry.web, {local.x, local.y, local.z}).in(cd)*std::max(-away.y, 0.0) /
           std::pow(squared, 1.5);
}

Light spot_after(const std::shared_ptr<SceneAsset>& asset, const std::vector<std::uint8_t>& levels) {
    return heard(asset, levels).lights.at(0);
}

TEST(ImportLight, ARectangleLightsARectangle) {
    const auto check = [](const SceneAsset& scene) {
        const LightSeed& light = scene.lights.at(0);
        EXPECT_NEAR(lux_below(light, {0, 0, 0}), 10000 / 4.5, 25);
        EXPECT_NEAR(lux_below(light, {1.4, 0, 0}) / lux_below(light, {0, 0, 0}), 1.0, 0.02);
        EXPECT_EQ(lux_below(light, {0, 0, 1.4}), 0.0);
        EXPECT_EQ(lux_below(light, {1.55, 0, 0}), 0.0);
        EXPECT_FALSE(says(scene, "round"));
    };
    check(*shown_spot(type_file({.geometries = beam_text("BeamType='Rectangle' ThrowRatio='1' RectangleRatio='2'")})));
    if (const std::string file = shared_case_bytes("12-beam-types/Rectangle.mvr"); !file.empty())
        check(*imported(file));
}

// L = Φ/(πA) of a disc of BeamRadius, 0.05 m where the file has none.
TEST(ImportLight, WhatGlowsIsASurface) {
    for (const char* type : {"None", "Glow"}) {
        const auto scene = shown_spot(type_file({.geometries = beam_text("BeamType='" + std::string(type) + "'")}));
        const LightSeed& light = scene->lights.at(0);
        EXPECT_NEAR(light.profile->peak_cd, 10000 / std::numbers::pi, 1.0);
        EXPECT_EQ(light.profile->photometry.opening,
                  (ies::Opening{ies::OpeningShape::ellipse, 0.1 * m, 0.1 * m, 0.0 * m}));
        EXPECT_NEAR(lux_below(light, {3, 0, 0}), 10000 / std::numbers::pi / 18.0 * 0.5, 1.0);
        if (const std::string file = shared_case_bytes("12-beam-types/" + std::string(type) + ".mvr"); !file.empty()) {
            EXPECT_NEAR(imported(file)->lights.at(0).profile->peak_cd, 10000 / std::numbers::pi, 1.0);
        }
    }
}

// The web of lamp1.ies goes before flux and angles; what is missing or no photometry is named, and those count.
TEST(ImportLight, ThePhotometricFileOfABeamCounts) {
    const std::string flood = ies::synthetic_lm63("flood");
    const auto shown = [](const std::string& name, std::vector<ZipFile> files) {
        return shown_spot(type_file({.geometries = beam_text("BeamType='Spot' Photometric='" + name + "'")}, files));
    };
    for (const char* name : {"lamp1", "lamp1.ies", "LAMP1"}) {
        const auto scene = shown(name, {{"photometric/lamp1.ies", flood}});
        EXPECT_NEAR(scene->lights.at(0).profile->peak_cd, 2500.0, 1.0) << name;
        EXPECT_NE(std::ranges::find(scene->notes, "taken: photometric file of a beam: \"Type: photometric/lamp1.ies\""),
                  scene->notes.end());
        EXPECT_FALSE(says(*scene, "only default photometry"));
    }
    const auto broken = shown("lamp1", {{"photometric/lamp1.ies", "no photometry"}});
    EXPECT_NEAR(broken->lights.at(0).profile->peak_cd, 67143, 100);
    EXPECT_TRUE(says(*broken, "left out: a beam's photometric file cannot be read: its flux and angles count: "));
    const auto missing = shown("lamp2", {{"photometric/lamp1.ies", flood}});
    EXPECT_NEAR(missing->lights.at(0).profile->peak_cd, 67143, 100);
    EXPECT_TRUE(says(*missing,
                     "left out: a beam's photometric file is not in the archive: its flux and angles count: "
                     "\"Type: lamp2\""));
    if (const std::string file = shared_case_bytes("04-gdtf-photometric-resource/show.mvr"); !file.empty()) {
        EXPECT_NEAR(lux_below(imported(file)->lights.at(0), {0, 0, 0}), 1000.0, 1.0);
    }
}

TEST(ImportLight, ABeamOf360DegreesIsABulb) {
    const auto check = [](const SceneAsset& scene, double flux_lm) {
        for (const ies::Direction& to : {ies::Direction{0, 0, -1}, {1, 0, 0}, {0, 1, 1}, {0, 0, 1}})
            EXPECT_NEAR(ies::intensity(scene.lights.at(0).profile->photometry.web, to).in(cd),
                        flux_lm / (4.0 * std::numbers::pi), 0.1);
    };
    check(*shown_spot(type_file({.geometries = beam_text("BeamAngle='360' FieldAngle='360'")})), 10000);
    if (const std::string file = shared_case_bytes("public/beam-angle-360.mvr"); !file.empty())
        check(*imported(file), 5000);
}

TEST(ImportLight, AFixtureWithoutABeamHasAGuessedOne) {
    const std::string head =
        "<Geometry Name='Base'><Axis Name='Yoke' Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.5}"
        "{0,0,0,1}'><Axis Name='Head'/></Axis><Inventory Name='I'><Inventory Name='J'><Inventory "
        "Name='K'/></Inventory></Inventory></Geometry>";
    const auto scene = shown_spot(type_file({.geometries = head}));
    ASSERT_EQ(scene->lights.size(), 1u);
    const LightSeed& light = scene->lights[0];
    expect_near(light.position, {0, 2.5, 0}, 1e-9);
    expect_near(aim_of(light.world_from_light), {0, -1, 0}, 1e-9);
    EXPECT_NEAR(light.profile->flux_lm, 10000, 10);
    EXPECT_TRUE(says(*scene,
                     "guessed: a fixture's type has no beam: GDTF's default one, along -Z of its innermost "
                     "geometry: \"Spot\""));
    EXPECT_NE(row_of(*scene, "Spot", "level"), nullptr);
    const auto measured =
        shown_spot(type_file({.geometries = head}), kAddressed, {{"Maker@Head.ies", ies::synthetic_lm63("flood")}});
    EXPECT_NEAR(measured->lights.at(0).profile->peak_cd, 2500.0, 1.0);
    EXPECT_FALSE(says(*measured, "guessed: a fixture's type has no beam"));
    if (const std::string file = shared_case_bytes("public/capture_demo_show.mvr"); !file.empty()) {
        const auto capture = imported(file);
        EXPECT_EQ(capture->lights.size(), 76u);
        EXPECT_TRUE(says(*capture, "guessed: a fixture's type has no beam"));
    }
}

// What is no luminaire by its attributes and geometries stays dark, and the report says why.
TEST(ImportLight, WhatIsNoLuminaireStaysDark) {
    const auto shown = [](const std::string& geometries, const std::string& attribute) {
        return shown_spot(
            type_file({.geometries = geometries,
                       .modes = mode_text("Base", attribute.empty() ? "" : channel_text("Base", attribute, "1"))}));
    };
    const std::string plain = "<Geometry Name='Base'/>";
    struct Row {
        std::string geometries, attribute, why;
    };
    for (const Row& row :
         {Row{plain, "", "its type has no dimmer, shutter, colour or emitter"},
          Row{plain, "Pan", "its type has no dimmer, shutter, colour or emitter"},
          Row{plain, "Fog1", "it makes fog or haze"}, Row{plain, "Haze1", "it makes fog or haze"},
          Row{"<Geometry Name='Base'><MediaServerLayer Name='L'/></Geometry>", "Dimmer", "it is a media server"},
          Row{"<Geometry Name='Base'><Display Name='D' Texture='t'/></Geometry>", "Dimmer", "it is a display"},
          Row{"<Geometry Name='Base'><Laser Name='L'/></Geometry>", "Dimmer", "it is a laser"}}) {
        const auto scene = shown(row.geometries, row.attribute);
        EXPECT_TRUE(scene->lights.empty()) << row.why;
        EXPECT_TRUE(says(*scene, "left out: a fixture has no beam: " + row.why + ": \"Spot\"")) << row.attribute;
    }
    for (const char* attribute : {"Dimmer", "Dimmer1", "Shutter1", "ColorAdd_R", "Color1", "CTO", "Zoom", "Gobo1"})
        EXPECT_EQ(shown(plain, attribute)->lights.size(), 1u) << attribute;
}

std::string channels_text(const std::vector<std::string>& attributes) {
    std::string all;
    for (std::size_t i = 0; i < attributes.size(); ++i)
        all += channel_text("Base", attributes[i], std::to_string(i + 1));
    return all;
}

// The standard's colours of R, G, B, RY and GY: their sum is x 0.3635, y 0.4131, and at full the flux is the beam's.
TEST(ImportLight, SixEmittersMixByTheirColors) {
    const auto asset =
        shown_spot(type_file({.geometries = beam_text(""),
                              .modes = mode_text("Base", channels_text({"ColorAdd_R", "ColorAdd_G", "ColorAdd_B",
                                                                        "ColorAdd_RY", "ColorAdd_GY"}))}));
    const auto check = [](const glm::dvec3& color) {
        EXPECT_NEAR(luminance_of(color), 1.0, 0.01);
        const glm::dvec2 xy = xy_of(color);
        EXPECT_NEAR(xy.x, 0.3635, 1e-3);
        EXPECT_NEAR(xy.y, 0.4131, 1e-3);
    };
    check(scene_of(asset).lights.at(0).color);
    check(spot_after(asset, {255, 255, 255, 255, 255}).color);
    const auto uv = shown_spot(type_file(
        {.geometries = beam_text(""),
         .modes = mode_text("Base", channels_text({"ColorAdd_R", "ColorAdd_G", "ColorAdd_B", "ColorAdd_UV"}))}));
    EXPECT_NEAR(luminance_of(spot_after(uv, {0, 0, 0, 255}).color), 0.6 / 100.6, 2e-3) << "its own share, and no more";
    EXPECT_NEAR(luminance_of(spot_after(uv, {255, 255, 255, 255}).color), 1.0, 0.01);
}

TEST(ImportLight, ColorRgbDrivesWhereThereIsNoColorAdd) {
    const auto shown = [](const std::vector<std::string>& attributes) {
        return shown_spot(
            type_file({.geometries = beam_text(""), .modes = mode_text("Base", channels_text(attributes))}));
    };
    const auto rgb = shown({"ColorRGB_Red", "ColorRGB_Green", "ColorRGB_Blue"});
    expect_near(spot_after(rgb, {255, 255, 255}).color, {1, 1, 1}, 0.01);
    expect_near(spot_after(rgb, {0, 51, 0}).color, {0, 0.2, 0}, 0.01);
    EXPECT_FALSE(says(*rgb, "ColorRGB"));
    const auto both = shown({"ColorAdd_W", "ColorRGB_Red"});
    EXPECT_TRUE(says(*both, "drives nothing: \"Type ColorRGB_Red\""));
    expect_near(spot_after(both, {255, 0}).color, {1, 1, 1}, 0.01);
}

// Emitters beyond Rec.709 whose sum is D65, of real LEDs' kind: white stays white, dimmed too, and each has its own
// luminance. Luminances solve the sum of XYZ of (0.70, 0.30), (0.17, 0.70) and (0.15, 0.03) for D65.
TEST(ImportLight, WhiteOfWideEmittersStaysWhite) {
    const glm::dmat3 emitters(0.70 / 0.30, 1.0, 0.0, 0.17 / 0.70, 1.0, 0.13 / 0.70, 0.15 / 0.03, 1.0, 0.82 / 0.03);
    const glm::dvec3 d65(0.3127 / 0.3290, 1.0, (1 - 0.3127 - 0.3290) / 0.3290);
    const glm::dvec3 y = glm::inverse(emitters) * d65 * 100.0;
    const auto emitter = [](const char* name, double x, double at_y, double percent) {
        return printed("<Emitter Name='%s' Color='%.6f,%.6f,%.6f'/>", name, x, at_y, percent);
    };
    const auto channel = [](const char* attribute, const char* slot, const char* name) {
        return channel_text("Base", attribute, slot, "0", "1", "Emitter='" + std::string(name) + "'");
    };
    const auto asset = shown_spot(
        type_file({.geometries = beam_text(""),
                   .modes = mode_text("Base", channel("ColorAdd_R", "1", "r") + channel("ColorAdd_G", "2", "g") +
                                                  channel("ColorAdd_B", "3", "b")),
                   .physics = "<Emitters>" + emitter("r", 0.70, 0.30, y.r) + emitter("g", 0.17, 0.70, y.g) +
                              emitter("b", 0.15, 0.03, y.b) + "</Emitters>"}));
    expect_near(scene_of(asset).lights.at(0).color, {1, 1, 1}, 2e-3);
    expect_near(spot_after(asset, {255, 255, 255}).color, {1, 1, 1}, 0.01);
    expect_near(spot_after(asset, {51, 51, 51}).color, glm::dvec3(0.2), 0.002);
    for (int i = 0; i < 3; ++i) {
        std::vector<std::uint8_t> levels(3, 0);
        levels[static_cast<std::size_t>(i)] = 255;
        EXPECT_NEAR(luminance_of(spot_after(asset, levels).color), y[i] / 100.0, 0.03) << i;
    }
}

// A measured spectrum goes before the colour, that before the wavelength: a line at 520 nm is (0.0743, 0.8338), one at
// 600 nm (0.6270, 0.3725), as CIE 15 has the locus.
TEST(ImportLight, SpectraGoBeforeColorsAndThoseBeforeWavelengths) {
    const auto color_of = [](const std::string& emitter, const char* attribute = "ColorAdd_G") {
        const auto type = gdtf::read_description(
            gdtf_text({.geometries = beam_text(""),
                       .modes = mode_text("Base", channel_text("Base", attribute, "1", "0", "1", "Emitter='E'")),
                       .physics = "<Emitters>" + emitter + "</Emitters>"}),
            {});
        EXPECT_TRUE(type);
        return gdtf::color_of_function(*type, type->modes.at(0).channels.at(0).functions.at(0));
    };
    const auto line = [](double nm, const char* more = "") {
        return printed(
            "<Measurement Physical='100' %s><MeasurementPoint WaveLength='%g' Energy='0'/><MeasurementPoint "
            "WaveLength='%g' Energy='1'/><MeasurementPoint WaveLength='%g' Energy='0'/></Measurement>",
            more, nm - 1, nm, nm + 1);
    };
    const auto expect = [](const gdtf::Color& color, double x, double y, double percent) {
        EXPECT_NEAR(color.x, x, 3e-3);
        EXPECT_NEAR(color.y, y, 3e-3);
        EXPECT_NEAR(color.luminance_percent, percent, 1e-6);
    };
    expect(color_of("<Emitter Name='E' Color='0.3,0.6,40' DominantWaveLength='600'>" + line(520) + "</Emitter>"),
           0.0743, 0.8338, 40);
    expect(color_of("<Emitter Name='E' Color='0.3,0.6,40' DominantWaveLength='600'/>"), 0.3, 0.6, 40);
    expect(color_of("<Emitter Name='E' DominantWaveLength='600'/>"), 0.6270, 0.3725, 71.5);
    expect(color_of("<Emitter Name='E'/>", "ColorAdd_R"), 0.64, 0.33, 21.3);
    std::string equal = "<Measurement Physical='100'>";
    for (int nm = 380; nm <= 780; nm += 5) equal += printed("<MeasurementPoint WaveLength='%d' Energy='1'/>", nm);
    expect(color_of("<Emitter Name='E'>" + equal + "</Measurement></Emitter>"), 1 / 3.0, 1 / 3.0, 71.5);
    expect(color_of("<Emitter Name='E'>" + line(600, "LuminousIntensity='30'") + "</Emitter><Emitter Name='F'>" +
                    line(520, "LuminousIntensity='90'") + "</Emitter>"),
           0.6270, 0.3725, 25);
}

// Slot 2 at 100 is the wheel's red, at 0 it is open: white. Y 21 lets 21 percent pass.
TEST(ImportLight, AWheelOfColorsIsDriven) {
    const auto check = [](const std::shared_ptr<SceneAsset>& asset) {
        expect_near(spot_after(asset, {255, 0}).color, {1, 1, 1}, 1e-3);
        const glm::dvec3 red = spot_after(asset, {255, 100}).color;
        EXPECT_NEAR(luminance_of(red), 0.21, 0.003);
        EXPECT_LT(red.g + red.b, 0.02 * red.r);
        EXPECT_GT(spot_after(asset, {255, 200}).color.b, 0.5) << "blue";
        EXPECT_EQ(spot_after(asset, {255, 100}).cct_k, 6000.0);
        EXPECT_FALSE(says(*asset, "Color1"));
    };
    const std::string wheel =
        "<DMXChannel DMXBreak='1' Offset='2' Geometry='Base'><LogicalChannel Attribute='Color1'><ChannelFunction "
        "Attribute='Color1' DMXFrom='0/1' Wheel='W'><ChannelSet DMXFrom='0/1' WheelSlotIndex='1'/><ChannelSet "
        "DMXFrom='50/1' WheelSlotIndex='2'/><ChannelSet DMXFrom='150/1' WheelSlotIndex='3'/></ChannelFunction>"
        "</LogicalChannel></DMXChannel>";
    const std::string slots =
        "<Wheel Name='W'><Slot Name='Open'/><Slot Name='Red' Color='0.64,0.33,21'/><Slot "
        "Name='Blue' Color='0.15,0.06,7'/></Wheel>";
    check(shown_spot(type_file({.geometries = beam_text(""),
                                .modes = mode_text("Base", channel_text("Base", "Dimmer", "1") + wheel),
                                .wheels = slots})));
    if (const std::string file = shared_case_bytes("05-colour-wheel-dmx/show.mvr"); !file.empty())
        check(imported(file));
    // Behind filters they multiply.
    const auto both = shown_spot(type_file({.geometries = beam_text(""),
                                            .modes = mode_text("Base", channel_text("Base", "ColorSub_C", "1") + wheel),
                                            .wheels = slots}));
    EXPECT_NEAR(spot_after(both, {255, 100}).color.r, 0.0, 0.01) << "red behind cyan";
    EXPECT_NEAR(luminance_of(spot_after(both, {0, 100}).color), 0.21, 0.003);
}

TEST(ImportLight, TheLampsTemperatureIsTheLights) {
    const auto asset = shown_spot(type_file({.geometries = beam_text("ColorTemperature='3200'")}));
    EXPECT_EQ(asset->lights.at(0).cct_k, 3200.0);
    expect_near(asset->lights[0].color, {1, 1, 1}, 1e-9);
    const auto candle = shown_spot(type_file({.geometries = beam_text("ColorTemperature='1800'")}));
    EXPECT_EQ(candle->lights.at(0).cct_k, 1800.0);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(candle->lights[0].color[i], 1.0, 1e-9) << "it has no blue";
    const std::string file = shared_case_bytes("18-beam-colour-temperature/show.mvr");
    if (file.empty()) GTEST_SKIP() << "the public cases are not on this machine";
    const auto both = imported(file);
    ASSERT_EQ(both->lights.size(), 2u);
    EXPECT_EQ(both->lights[0].cct_k, 3200.0);
    EXPECT_EQ(both->lights[1].cct_k, 6500.0);
}

// A picture of the show, half of it open.
TEST(ImportLight, TheShowsOwnGoboIsProjected) {
    const std::string file = shared_case_bytes("14-mvr-fixture-gobo/show.mvr");
    if (file.empty()) GTEST_SKIP() << "the public cases are not on this machine";
    const auto scene = imported(file);
    ASSERT_EQ(scene->lights.size(), 1u);
    EXPECT_NEAR(scene->lights[0].profile->flux_lm / 10000, 0.5, 0.05) << "half of the picture is dark";
    EXPECT_FALSE(says(*scene, "Gobo"));
    const auto missing = shown_spot(type_file({.geometries = beam_text("")}), "<Gobo rotation='45'>none.png</Gobo>");
    EXPECT_TRUE(says(*missing, "left out: a fixture's gobo is not in the archive: \"Spot Gobo=none.png\""));
    EXPECT_NEAR(missing->lights.at(0).profile->flux_lm, 10000, 10);
    const auto broken = shown_spot(type_file({.geometries = beam_text("")}), "<Gobo rotation='x'>a.png</Gobo>",
                                   {{"a.png", "no picture"}});
    EXPECT_TRUE(says(*broken, "left out: a gobo's picture cannot be read: "));
    EXPECT_NEAR(broken->lights.at(0).profile->flux_lm, 10000, 10);
}

// Each attribute drives the light or is named.
TEST(ImportLight, AttributesThatDriveNothingAreNamed) {
    const std::string file = shared_case_bytes("17-colour-attributes/show.mvr");
    if (file.empty()) GTEST_SKIP() << "the public cases are not on this machine";
    const auto scene = imported(file);
    for (const char* attribute : {"HSB_Hue", "HSB_Saturation", "Iris", "Frost1", "Prism1", "Focus1", "Blade1A"})
        EXPECT_TRUE(says(*scene, "\"Hsb " + std::string(attribute) + "\"")) << attribute;
    expect_near(spot_after(scene, {255, 0, 0, 255, 0, 0}).color, {1.0, 0.0, 0.0}, 0.01);
    expect_near(spot_after(scene, {255, 0, 0, 255, 255, 255}).color, {1.0, 1.0, 1.0}, 0.01);
}

// Models, pictures, wheels and profiles that are not there: the fixture is, and each is named.
TEST(ImportLight, AFixtureStaysWhateverItsFileLacks) {
    const auto scene = shown_spot(
        type_file({.geometries = "<Geometry Name='Base' Model='M'><Beam Name='Lens' Model='Other' LuminousFlux='10000' "
                                 "Photometric='gone'/></Geometry>",
                   .modes = mode_text("Base", channel_text("Base", "Dimmer", "1", "0", "1", "DMXProfile='None such'") +
                                                  channel_text("Base", "Gobo1", "2", "0", "1", "Wheel='G'") +
                                                  channel_text("Base", "Color1", "3", "0", "1", "Wheel='None such'")),
                   .wheels = "<Wheel Name='G'><Slot Name='A' MediaFileName='gone'/></Wheel>",
                   .models = "<Model Name='M' File='gone'/>"}));
    ASSERT_EQ(scene->lights.size(), 1u);
    EXPECT_NEAR(spot_after(scene, {51}).level_ratio, 0.2, 1e-9);
    for (const char* what : {"a model's file is not in the archive", "a wheel's picture is not in the archive",
                             "a function names no wheel", "a function names no DMX profile: it is linear",
                             "a geometry names no model", "a beam's photometric file is not in the archive"})
        EXPECT_TRUE(says(*scene, what)) << what;
}

}  // namespace
}  // namespace gonio
