// What the channels of an imported fixture do to its light when a console speaks: GDTF's formulas, slot by slot.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "protocol/dmx/patch.h"
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

constexpr const char* kPatch = "<Addresses><Address break='0'>1.1</Address></Addresses>";
constexpr const char* kLamp =
    "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='1000' ColorTemperature='6000'/></Geometry>";

std::string gdtf_of(const std::string& channels, const std::string& geometries = kLamp) {
    const std::string text = gdtf_text({.geometries = geometries, .modes = mode_text("Base", channels)});
    return *write_zip(std::vector<ZipFile>{{"description.xml", text}});
}

std::shared_ptr<SceneAsset> imported_show(const std::string& gdtf) {
    const auto asset = imported(show_mvr(fixture("Spot", kHanging, kPatch), {{"Maker@Head.gdtf", gdtf}}));
    EXPECT_TRUE(asset->patch && check_patch(*asset->patch));
    return asset;
}

// Light is a sum of emitters, each with its share of all luminances: 21.3, 71.5, 7.2 and 100 percent, as the standard
// has them.
TEST(ImportChannels, EmittersAddUp) {
    const auto asset =
        imported_show(gdtf_of(channel_text("Base", "ColorAdd_R", "1") + channel_text("Base", "ColorAdd_G", "2") +
                              channel_text("Base", "ColorAdd_B", "3") + channel_text("Base", "ColorAdd_W", "4")));
    const double y[] = {21.3, 71.5, 7.2, 100.0};
    const auto color = [&](std::vector<std::uint8_t> levels) { return heard(asset, levels).lights.at(0).color; };
    for (const std::vector<std::uint8_t>& levels : {std::vector<std::uint8_t>{255, 0, 0, 0},
                                                    {0, 255, 0, 0},
                                                    {0, 0, 255, 0},
                                                    {0, 0, 0, 255},
                                                    {255, 255, 255, 0},
                                                    {255, 255, 255, 255},
                                                    {10, 200, 30, 77}}) {
        double wanted = 0.0;
        for (std::size_t i = 0; i < 4; ++i) wanted += levels[i] / 255.0 * y[i] / 200.0;
        EXPECT_NEAR(luminance(color(levels)), wanted, 0.006) << wanted;
    }
    const glm::dvec3 white = color({0, 0, 0, 255});
    EXPECT_NEAR(white.r, 0.5, 0.005);
    EXPECT_NEAR(white.b, 0.5, 0.005);
    EXPECT_NEAR(luminance(color({0, 0, 0, 0})), 0.0, 1e-12);
    EXPECT_FALSE(says(*asset, "ColorAdd"));
    EXPECT_EQ(row_of(*asset, "Spot", "red")->address(), 1u) << "the first row of a component is its own emitter's";
    EXPECT_EQ(row_of(*asset, "Spot", "blue")->address(), 3u);
}

TEST(ImportChannels, ASingleEmitterOfAnotherColorIsDriven) {
    const auto asset =
        imported_show(gdtf_of(channel_text("Base", "ColorAdd_C", "1") + channel_text("Base", "ColorAdd_M", "2")));
    const auto color = [&](std::vector<std::uint8_t> levels) { return heard(asset, levels).lights.at(0).color; };
    EXPECT_NEAR(luminance(color({255, 255})), 1.0, 0.01);
    EXPECT_GT(color({255, 0}).g, color({255, 0}).r) << "cyan";
    EXPECT_GT(color({0, 255}).r, color({0, 255}).g) << "magenta";
    EXPECT_NEAR(luminance(color({0, 0})), 0.0, 1e-12);
}

// Filters are factors: cyan and magenta leave blue.
TEST(ImportChannels, FiltersMultiply) {
    const auto asset =
        imported_show(gdtf_of(channel_text("Base", "ColorSub_C", "1") + channel_text("Base", "ColorSub_M", "2") +
                              channel_text("Base", "ColorSub_Y", "3")));
    EXPECT_EQ(scene_of(asset).lights.at(0).cct_k, 6000.0) << "the lamp's white is beside them";
    const auto share = [&](std::vector<std::uint8_t> levels) { return heard(asset, levels).lights.at(0).color; };
    EXPECT_NEAR(glm::length(share({0, 0, 0}) - glm::dvec3(1.0)), 0.0, 0.01);
    const glm::dvec3 c = share({255, 0, 0}), m = share({0, 255, 0}), half = share({128, 0, 0});
    EXPECT_LT(c.r, 0.05);
    EXPECT_NEAR(half.r, 1.0 - 128.0 / 255.0 * (1.0 - c.r), 0.005);
    const glm::dvec3 both = share({255, 255, 0});
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(both[k], c[k] * m[k], 0.01);
}

// "A Dimmer on the body dims every Beam below, and factors multiply": the master of a bar and its cells.
TEST(ImportChannels, DimmersOneBelowTheOtherMultiply) {
    const std::string bar =
        "<Geometry Name='Base'><Geometry Name='Cell'><Beam Name='Lens' LuminousFlux='1000'/></Geometry></Geometry>";
    const auto asset =
        imported_show(gdtf_of(channel_text("Base", "Dimmer", "1") + channel_text("Cell", "Dimmer", "2"), bar));
    const auto level = [&](std::uint8_t all, std::uint8_t cell) {
        return heard(asset, {all, cell}).lights.at(0).level_ratio;
    };
    EXPECT_NEAR(level(255, 255), 1.0, 1e-9);
    EXPECT_NEAR(level(0, 255), 0.0, 1e-9);
    EXPECT_NEAR(level(128, 64), 128.0 / 255.0 * 64.0 / 255.0, 1e-9);
}

// A colour temperature takes the place of the lamp's own, at the same lux.
TEST(ImportChannels, TemperaturesAreTheLamps) {
    for (const char* attribute : {"CTO", "CTC", "CTB"}) {
        const auto asset = imported_show(gdtf_of(channel_text("Base", attribute, "1", "6500", "2700")));
        const auto weight = [](const Light& light) { return light.color * white_factors(light.cct_k, 0.0); };
        const glm::dvec3 home = weight(scene_of(asset).lights.at(0));
        EXPECT_NEAR(glm::length(home - white_factors(6500, 0.0)), 0.0, 1e-9) << "its default";
        const Light warm = heard(asset, {255}).lights.at(0);
        EXPECT_NEAR(warm.cct_k, 2700, 1e-6);
        EXPECT_NEAR(glm::length(weight(warm) - white_factors(2700, 0.0)), 0.0, 1e-9);
        EXPECT_NEAR(luminance(weight(warm)), 1.0, 1e-3);
        EXPECT_NEAR(heard(asset, {51}).lights.at(0).cct_k, 6500 - 0.2 * 3800, 1e-6);
        const auto unfilled =
            imported_show(gdtf_of(channel_text("Base", attribute, "1") + channel_text("Base", "Dimmer", "2")));
        EXPECT_TRUE(says(*unfilled, "the colour temperatures of a fixture type were never filled in"));
        EXPECT_EQ(heard(unfilled, {255, 255}).lights.at(0).cct_k, 6000.0) << "the lamp's own";
    }
}

TEST(ImportChannels, WhatDrivesNothingIsNamed) {
    const auto asset =
        imported_show(gdtf_of(channel_text("Base", "Dimmer", "1") + channel_text("Base", "Shutter1", "2") +
                              channel_text("Base", "Shutter2", "3") + channel_text("Base", "Gobo2", "4") +
                              channel_text("Base", "Gobo2Pos", "5") + channel_text("Base", "Iris", "6") +
                              channel_text("Base", "ColorAdd_W", "") + channel_text("Base", "ColorSub_R", "8")));
    for (const char* attribute : {"Shutter2", "Gobo2", "Gobo2Pos", "Iris"})
        EXPECT_TRUE(says(*asset, std::string("\"Type ") + attribute + "\"")) << attribute;
    for (const char* attribute : {"Dimmer", "Shutter1", "ColorAdd_W", "ColorSub_R"})
        EXPECT_FALSE(says(*asset, std::string("\"Type ") + attribute + "\"")) << attribute;
}

std::string head_of(const std::string& pan, const std::string& yoke = "", const std::string& lens = "",
                    const std::string& tilt = channel_text("Body", "Tilt", "3,4", "-135", "135")) {
    const auto place = [](const std::string& matrix) { return matrix.empty() ? "" : " Position='" + matrix + "'"; };
    return gdtf_of(pan + tilt, "<Geometry Name='Base'><Axis Name='Yoke'" + place(yoke) +
                                   "><Axis Name='Body'><Beam Name='Lens' LuminousFlux='1000'" + place(lens) +
                                   "/></Axis></Axis></Geometry>");
}

std::string channel_of(const std::string& offset, const std::string& more, const std::string& functions) {
    return "<DMXChannel DMXBreak='1' Offset='" + offset + "' Geometry='Yoke' " + more +
           "><LogicalChannel Attribute='Pan'>" + functions + "</LogicalChannel></DMXChannel>";
}

std::string function_text(const std::string& attribute, const std::string& from, const std::string& low,
                          const std::string& high) {
    return "<ChannelFunction Attribute='" + attribute + "' DMXFrom='" + from + "' Default='0/1' PhysicalFrom='" + low +
           "' PhysicalTo='" + high + "'/>";
}

// A function ends one below the next one's DMXFrom: beyond it pan stays as it is.
TEST(ImportChannels, PanEndsWhereItsFunctionDoes) {
    const auto asset = imported_show(head_of(channel_of(
        "1", "", function_text("Pan", "0/1", "-180", "180") + function_text("PanRotate", "128/1", "-100", "100"))));
    EXPECT_TRUE(says(*asset, "drives nothing: \"Type PanRotate\""));
    const v1::PatchRow* pan = row_of(*asset, "Spot", "pan");
    ASSERT_NE(pan, nullptr);
    ASSERT_EQ(pan->ranges_size(), 1);
    EXPECT_EQ(pan->ranges(0).to(), 127u);
    EXPECT_NEAR(std::abs(pan->ranges(0).high() - pan->ranges(0).low()), 2.0 * std::numbers::pi, 1e-9);
    const double home = scene_of(asset).lights.at(0).pan_rad;
    EXPECT_NEAR(heard(asset, {200, 0, 128, 0}).lights.at(0).pan_rad, home, 1e-9) << "PanRotate";
    const auto two = imported_show(head_of(
        channel_of("1,2", "", function_text("Pan", "0/2", "-270", "0") + function_text("Pan", "32768/2", "0", "90"))));
    const v1::PatchRow* both = row_of(*two, "Spot", "pan");
    ASSERT_NE(both, nullptr);
    EXPECT_EQ(both->bits(), 16u);
    ASSERT_EQ(both->ranges_size(), 2);
    EXPECT_EQ(both->ranges(0).to(), 32767u);
    EXPECT_NEAR(both->ranges(1).high() - both->ranges(0).low(), 2.0 * std::numbers::pi, 1e-9);
}

// A file may write functions in any order, let them overlap, begin with a constant one, or hold any numbers: rows are
// such as a patch takes, so that what is saved comes back.
TEST(ImportChannels, RowsAreSuchAsAPatchTakes) {
    const auto odd = [](const std::string& pan) { return imported_show(head_of(channel_of("1,2", "", pan))); };
    for (const std::string& pan :
         {function_text("Pan", "128/1", "0", "90") + function_text("Pan", "0/1", "-90", "0"),
          function_text("Pan", "0/2", "-270", "270") + function_text("Pan", "0/2", "-180", "180"),
          function_text("Pan", "0/2", "-1e308", "1e308")})
        EXPECT_TRUE(check_patch(*odd(pan)->patch));
    const auto other_way = odd(function_text("Pan", "128/1", "0", "90") + function_text("Pan", "0/1", "-90", "0"));
    const v1::PatchRow* turned = row_of(*other_way, "Spot", "pan");
    ASSERT_NE(turned, nullptr);
    ASSERT_EQ(turned->ranges_size(), 2);
    EXPECT_EQ(turned->ranges(0).from(), 0u);
    const auto channel = [](const std::string& offset, const std::string& attribute, const std::string& functions) {
        return "<DMXChannel DMXBreak='1' Offset='" + offset + "' Geometry='Base'><LogicalChannel Attribute='" +
               attribute + "'>" + functions + "</LogicalChannel></DMXChannel>";
    };
    const auto lamp = imported_show(gdtf_of(
        channel("1", "Dimmer", function_text("Dimmer", "0/1", "0", "0") + function_text("Dimmer", "10/1", "0", "1")) +
        channel("2", "CTC", function_text("CTC", "0/1", "0", "0") + function_text("CTC", "10/1", "8000", "2700")) +
        channel("3", "Zoom", function_text("Zoom", "0/1", "0", "0") + function_text("Zoom", "10/1", "10", "50")) +
        channel("4", "ColorAdd_W", function_text("ColorAdd_W", "0/1", "-1e308", "1e308"))));
    const Light light = heard(lamp, {255, 255, 255, 255}).lights.at(0);
    EXPECT_NEAR(light.level_ratio, 1.0, 1e-9);
    EXPECT_NEAR(light.cct_k, 2700, 1e-6);
    EXPECT_NEAR(light.zoom_rad, 50.0 * kDegree, 1e-6);
    EXPECT_TRUE(std::isfinite(light.color.r));
    EXPECT_NEAR(heard(lamp, {5, 0, 0, 0}).lights.at(0).level_ratio, 0.0, 1e-9);
}

// Levels of pixels need no states of all the others: the square of their number would be beyond the test's time.
TEST(ImportChannels, ManyPixelsAreReadAtOnce) {
    std::string cells, channels;
    for (int i = 0; i < 300; ++i) {
        const std::string name = "C" + std::to_string(i);
        cells += "<Geometry Name='" + name + "'><Beam Name='B" + std::to_string(i) + "' LuminousFlux='10'/></Geometry>";
        channels += "<DMXChannel DMXBreak='1' Offset='" + std::to_string(i + 1) + "' Geometry='" + name +
                    "'><LogicalChannel Attribute='Dimmer'>" + function_text("Dimmer", "0/1", "0", "0.5") +
                    function_text("Dimmer", "128/1", "0.5", "1") + "</LogicalChannel></DMXChannel>";
    }
    const auto asset = imported_show(gdtf_of(channels, "<Geometry Name='Base'>" + cells + "</Geometry>"));
    EXPECT_EQ(asset->patch->rows_size(), 300);
}

// Whichever function is active while nobody speaks, pan and tilt are the tree's.
TEST(ImportChannels, PanMayBeAsleepAtHome) {
    const std::string functions =
        function_text("NoFeature", "0/2", "0", "1") + function_text("Pan", "256/2", "-270", "270");
    const auto asset = imported_show(head_of(channel_of("1,2", "", functions)));
    EXPECT_NE(row_of(*asset, "Spot", "pan"), nullptr);
    EXPECT_NE(row_of(*asset, "Spot", "tilt"), nullptr);
    EXPECT_FALSE(says(*asset, "no tilt below a pan"));
}

// Heads that hang turned within their fixture, whose lens is set at an angle, that pan alone: aim and C0 as the tree
// has them. Rotations of GDTF's matrices: rows, Z up.
TEST(ImportChannels, HeadsOfOtherKindsTurnAsTheirTree) {
    const std::string pan = channel_text("Yoke", "Pan", "1,2", "-270", "270");
    const std::string wall = "{1,0,0,0}{0,0,-1,0}{0,1,0,-0.3}{0,0,0,1}";
    const std::string set_back = "{1,0,0,0}{0,0.984807753,-0.173648178,0}{0,0.173648178,0.984807753,0}{0,0,0,1}";
    for (const std::string& bytes : {head_of(pan, wall), head_of(pan, "", set_back), head_of(pan, wall, set_back),
                                     head_of(pan, "", set_back, ""), head_of(pan, wall, set_back, "")}) {
        const auto asset = imported_show(bytes);
        ASSERT_NE(row_of(*asset, "Spot", "pan"), nullptr);
        const auto type = gdtf::read_gdtf(*open_zip(bytes));
        ASSERT_TRUE(type);
        const gdtf::Mode& mode = type->modes.at(0);
        const bool has_tilt = row_of(*asset, "Spot", "tilt") != nullptr;
        for (const std::vector<std::uint8_t>& levels :
             {std::vector<std::uint8_t>{0x80, 0, 0x80, 0}, {0x20, 0x11, 0xC0, 0x22}, {0xF0, 1, 0x10, 2}}) {
            const Scene scene = heard(asset, levels);
            const auto states = gdtf::beam_states(*type, mode, gdtf::channel_values(*type, mode, {{1, levels}}),
                                                  {false, false, {}, {}});
            const glm::dmat4 world_from_beam =
                glm::dmat4{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}} * states.at(0).fixture_from_beam;
            const glm::dquat& turn = scene.lights.at(0).world_from_light;
            expect_near(aim_of(turn), -glm::dvec3(world_from_beam[2]), 1e-5);
            expect_near(c0_of(turn), glm::dvec3(world_from_beam[0]), 1e-5);
        }
        EXPECT_EQ(has_tilt, bytes != head_of(pan, "", set_back, "") && bytes != head_of(pan, wall, set_back, ""));
    }
}

// What is active only where another channel lets it be is driven as at that channel's default, and said.
TEST(ImportChannels, ModeMastersAreNamed) {
    const auto functions = [](const std::string& more) {
        return "<ChannelFunction Attribute='Zoom' DMXFrom='0/1' Default='0/1' PhysicalFrom='10' PhysicalTo='50' " +
               more + "/>";
    };
    const std::string master =
        "<DMXChannel DMXBreak='1' Offset='1' Geometry='Base'><LogicalChannel Attribute='Control1'>"
        "<ChannelFunction Attribute='Control1' DMXFrom='0/1' Default='0/1'/></LogicalChannel>"
        "</DMXChannel>";
    const std::string zoom = "<DMXChannel DMXBreak='1' Offset='2' Geometry='Base'><LogicalChannel Attribute='Zoom'>" +
                             functions("ModeMaster='Base_Control1' ModeFrom='0/1' ModeTo='127/1'") +
                             "</LogicalChannel></DMXChannel>";
    const auto asset = imported_show(gdtf_of(master + zoom));
    EXPECT_TRUE(says(*asset, "what depends on another channel is driven as at that channel's default: \"Type Zoom\""));
}

}  // namespace
}  // namespace gonio
