// DMX values to what a fixture's beams do: expected values are from DIN SPEC 15800's rules and closed forms.
#include "server/exchange/gdtf_dmx.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_access.hpp>
#include <numbers>

#include "tests/unit/angles.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio {
namespace {

using gdtf::BeamState;
using gdtf::FixtureType;
using test::channel_text;
using test::mode_text;

FixtureType driven_type(const test::GdtfText& text) {
    auto type = gdtf::read_description(test::gdtf_text(text), {});
    EXPECT_TRUE(type) << type.error().text();
    return type ? *type : FixtureType{};
}

std::vector<BeamState> states_of(const FixtureType& type, std::vector<std::uint8_t> bytes) {
    const gdtf::Mode& mode = type.modes.at(0);
    return gdtf::beam_states(type, mode, gdtf::channel_values(type, mode, {{1, std::move(bytes)}}));
}

double physical_of(const FixtureType& type, std::size_t patched, std::vector<std::uint8_t> bytes) {
    return gdtf::channel_values(type, type.modes.at(0), {{1, std::move(bytes)}}).at(patched).physical;
}

// A head: base, yoke that pans, body that tilts, lens 0.2 m below the body's axis.
const char* const kHead =
    "<Geometry Name='Base'><Axis Name='Yoke' Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.3}{0,0,0,1}'>"
    "<Axis Name='Body'><Beam Name='Lens' LuminousFlux='1000' ColorTemperature='6504' "
    "Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.2}{0,0,0,1}'/></Axis></Axis></Geometry>";

FixtureType head() {
    return driven_type({.geometries = kHead,
                        .modes = mode_text("Base", channel_text("Yoke", "Pan", "1,2", "-270", "270") +
                                                       channel_text("Body", "Tilt", "3,4", "-135", "135") +
                                                       channel_text("Base", "Dimmer", "5"))});
}

TEST(GdtfDmx, SixteenBitsOverTheRange) {
    const FixtureType type = head();
    EXPECT_DOUBLE_EQ(physical_of(type, 0, {0, 0, 0, 0, 0}), -270.0);
    EXPECT_DOUBLE_EQ(physical_of(type, 0, {0x55, 0x55, 0, 0, 0}), -90.0);  // 21845
    EXPECT_DOUBLE_EQ(physical_of(type, 0, {255, 255, 0, 0, 0}), 270.0);
    EXPECT_NEAR(physical_of(type, 0, {128, 0, 0, 0, 0}), 0.0041, 5e-5) << "32768 is not the middle";
}

TEST(GdtfDmx, MostSignificantFirstWhereverItLies) {
    const FixtureType type = driven_type(
        {.geometries = "<Beam Name='A'/>", .modes = mode_text("A", channel_text("A", "Dimmer", "4,1", "0", "65535"))});
    EXPECT_DOUBLE_EQ(physical_of(type, 0, {2, 9, 9, 1}), 258.0);
}

TEST(GdtfDmx, ToMayBeLessThanFrom) {
    const FixtureType type = driven_type(
        {.geometries = "<Beam Name='A'/>", .modes = mode_text("A", channel_text("A", "Zoom", "1", "50", "5"))});
    EXPECT_DOUBLE_EQ(physical_of(type, 0, {0}), 50.0);
    EXPECT_DOUBLE_EQ(physical_of(type, 0, {255}), 5.0);
    EXPECT_NEAR(states_of(type, {51}).at(0).zoom_rad.value(), 41.0 * kDegree, 1e-12);
}

// direction = Rz(pan) Rx(tilt) (0, 0, -1).
TEST(GdtfDmx, PanAndTiltTurnTheBeam) {
    const FixtureType type = head();
    const gdtf::Mode& mode = type.modes.at(0);
    struct Row {
        double pan_deg, tilt_deg;
        glm::dvec3 direction;
    };
    for (const Row& row : {Row{0, 0, {0, 0, -1}}, Row{0, 90, {0, 1, 0}}, Row{90, 90, {-1, 0, 0}},
                           Row{0, 45, {0, std::sqrt(0.5), -std::sqrt(0.5)}}, Row{-90, 60, {0.8660, 0, -0.5}}}) {
        const auto states = gdtf::beam_states(type, mode, gdtf::default_values(type, mode),
                                              {.pan_rad = row.pan_deg * kDegree, .tilt_rad = row.tilt_deg * kDegree});
        const glm::dvec3 direction = states.at(0).fixture_from_beam * glm::dvec4(0, 0, -1, 0);
        EXPECT_NEAR(glm::length(direction - row.direction), 0.0, 1e-4) << row.pan_deg << " " << row.tilt_deg;
        // The lens is 0.2 m from the tilt axis, which hangs 0.3 m below the base.
        const glm::dvec3 lens = states[0].fixture_from_beam[3];
        EXPECT_NEAR(glm::length(lens - (glm::dvec3(0, 0, -0.3) + 0.2 * row.direction)), 0.0, 1e-4);
    }
    // The same by DMX: pan 21845 is -90°, tilt 59467 of 65535 nearly +110°.
    const auto states = states_of(type, {0x55, 0x55, 0xE8, 0x4B, 255});
    const double tilt = (-135.0 + 59467.0 / 65535.0 * 270.0) * kDegree;
    const glm::dvec3 direction = states.at(0).fixture_from_beam * glm::dvec4(0, 0, -1, 0);
    EXPECT_NEAR(glm::length(direction - glm::dvec3(std::sin(tilt), 0, -std::cos(tilt))), 0.0, 1e-9);
    const auto inverted = gdtf::beam_states(type, mode, gdtf::default_values(type, mode),
                                            {.invert_tilt = true, .pan_rad = 0.0, .tilt_rad = 90 * kDegree});
    EXPECT_NEAR((inverted.at(0).fixture_from_beam * glm::dvec4(0, 0, -1, 0)).y, -1.0, 1e-12);
}

TEST(GdtfDmx, DimmersMultiplyDownTheTree) {
    const FixtureType type = driven_type(
        {.geometries = "<Geometry Name='Body'><Geometry Name='Left'><Beam Name='A'/></Geometry><Beam Name='B'/>"
                       "</Geometry>",
         .modes = mode_text("Body", channel_text("Body", "Dimmer", "1") + channel_text("Left", "Dimmer", "2"))});
    const auto states = states_of(type, {51, 102});
    ASSERT_EQ(states.size(), 2u);
    EXPECT_NEAR(states[0].dimmer_ratio, 0.2 * 0.4, 1e-12);
    EXPECT_NEAR(states[1].dimmer_ratio, 0.2, 1e-12);
}

TEST(GdtfDmx, EmittersShareTheFlux) {
    const FixtureType type = driven_type(
        {.geometries = "<Beam Name='A'/>",
         .modes = mode_text("A", channel_text("A", "ColorAdd_R", "1") + channel_text("A", "ColorAdd_G", "2") +
                                     channel_text("A", "ColorAdd_B", "3"))});
    // The primaries of Rec.709 with their luminances: all three are white, red alone has 0.213 of the flux.
    const glm::dvec3 white = states_of(type, {255, 255, 255}).at(0).color;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(white[i], 1.0, 0.01);
    const glm::dvec3 red = states_of(type, {255, 0, 0}).at(0).color;
    EXPECT_NEAR(red.r, 1.0, 0.01);
    EXPECT_NEAR(red.g, 0.0, 0.01);
    EXPECT_NEAR(0.2126 * red.r + 0.7152 * red.g + 0.0722 * red.b, 0.213, 1e-3);
}

TEST(GdtfDmx, FiltersTakeAway) {
    const FixtureType type = driven_type(
        {.geometries = "<Beam Name='A' ColorTemperature='6504'/>",
         .modes =
             mode_text("A", channel_text("A", "ColorSub_C", "1") + channel_text("A", "ColorSub_M", "2") +
                                channel_text("A", "ColorSub_Y", "3") + channel_text("A", "CTO", "4", "6504", "3200"))});
    const glm::dvec3 open = states_of(type, {0, 0, 0, 0}).at(0).color;
    const glm::dvec3 red = states_of(type, {0, 255, 255, 0}).at(0).color;
    EXPECT_NEAR(red.r / open.r, 1.0, 0.02);
    EXPECT_NEAR(red.g, 0.0, 0.02);
    EXPECT_NEAR(red.b, 0.0, 0.02);
    const glm::dvec3 warm = states_of(type, {0, 0, 0, 255}).at(0).color;
    EXPECT_GT(warm.r, 1.5 * warm.b);
    EXPECT_NEAR(0.2126 * warm.r + 0.7152 * warm.g + 0.0722 * warm.b, 1.0, 1e-6) << "the flux stays";
}

TEST(GdtfDmx, WheelsGobosShutterAndStrobe) {
    const std::string wheel =
        "<DMXChannel Offset='1' Geometry='A'><LogicalChannel Attribute='Color1'><ChannelFunction Attribute='Color1' "
        "DMXFrom='0/1' Default='0/1' Wheel='Colours'><ChannelSet DMXFrom='0/1' WheelSlotIndex='1'/>"
        "<ChannelSet DMXFrom='128/1' WheelSlotIndex='2'/></ChannelFunction></LogicalChannel></DMXChannel>";
    const std::string gobo =
        "<DMXChannel Offset='2' Geometry='A'><LogicalChannel Attribute='Gobo2'><ChannelFunction Attribute='Gobo2' "
        "DMXFrom='0/1' Default='0/1' Wheel='Gobos'><ChannelSet DMXFrom='0/1' WheelSlotIndex='1'/>"
        "<ChannelSet DMXFrom='10/1' WheelSlotIndex='2'/></ChannelFunction></LogicalChannel></DMXChannel>";
    const std::string shutter =
        "<DMXChannel Offset='4' Geometry='A'><LogicalChannel Attribute='Shutter1'>"
        "<ChannelFunction Attribute='Shutter1' DMXFrom='0/1' Default='0/1' PhysicalFrom='0' PhysicalTo='0'/>"
        "<ChannelFunction Attribute='Shutter1Strobe' DMXFrom='50/1' Default='0/1' PhysicalFrom='1' PhysicalTo='25'/>"
        "<ChannelFunction Attribute='Shutter1' DMXFrom='200/1' Default='0/1' PhysicalFrom='1' PhysicalTo='1'/>"
        "</LogicalChannel></DMXChannel>";
    const FixtureType type = driven_type(
        {.geometries = "<Beam Name='A' ColorTemperature='6504'/>",
         .modes = mode_text("A", wheel + gobo + channel_text("A", "Gobo2Pos", "3", "-180", "180") + shutter),
         .wheels = "<Wheel Name='Colours'><Slot Name='Open'/><Slot Name='Red' Color='0.64,0.33,21.26'/></Wheel>"
                   "<Wheel Name='Gobos'><Slot Name='Open'/><Slot Name='Stars'/></Wheel>"});
    const BeamState closed = states_of(type, {0, 0, 0, 0}).at(0);
    EXPECT_FALSE(closed.shutter_open);
    EXPECT_NEAR(closed.color.g, closed.color.r, 0.08) << "6504 K of the Planckian locus";
    ASSERT_EQ(closed.gobos.size(), 1u);
    EXPECT_EQ(closed.gobos[0].slot, 0);
    const BeamState red = states_of(type, {130, 12, 255, 210}).at(0);
    EXPECT_TRUE(red.shutter_open);
    EXPECT_EQ(red.strobe_hz, 0.0);
    EXPECT_NEAR(red.color.g, 0.0, 1e-3);
    EXPECT_NEAR(red.color.r / closed.color.r, 1.0, 0.01);
    EXPECT_EQ(red.gobos.at(0).slot, 1);
    EXPECT_EQ(red.gobos[0].number, 2);
    EXPECT_NEAR(red.gobos[0].angle_rad, std::numbers::pi, 1e-12);
    const BeamState strobe = states_of(type, {0, 0, 0, 199}).at(0);
    EXPECT_TRUE(strobe.shutter_open);
    EXPECT_NEAR(strobe.strobe_hz, 25.0, 1e-12);
}

TEST(GdtfDmx, ModeMastersChooseTheFunction) {
    const std::string masters =
        "<DMXChannel Offset='1' Geometry='A'><LogicalChannel Attribute='Control1'><ChannelFunction "
        "Attribute='Control1' DMXFrom='0/1' Default='0/1'/></LogicalChannel></DMXChannel>";
    const std::string dependent =
        "<DMXChannel Offset='2' Geometry='A'><LogicalChannel Attribute='Zoom'>"
        "<ChannelFunction Attribute='Zoom' DMXFrom='0/1' Default='0/1' PhysicalFrom='5' PhysicalTo='50' "
        "ModeMaster='A_Control1' ModeFrom='0/1' ModeTo='127/1'/></LogicalChannel><LogicalChannel Attribute='Iris'>"
        "<ChannelFunction Attribute='Iris' DMXFrom='0/1' Default='0/1' ModeMaster='A_Control1.Control1.Control1 1' "
        "ModeFrom='128/1' ModeTo='255/1'/><ChannelFunction Attribute='IrisStrobe' DMXFrom='100/1' Default='0/1' "
        "ModeMaster='A_Control1' ModeFrom='128/1' ModeTo='255/1'/></LogicalChannel></DMXChannel>";
    const FixtureType type =
        driven_type({.geometries = "<Beam Name='A'/>", .modes = mode_text("A", masters + dependent)});
    const gdtf::Mode& mode = type.modes.at(0);
    const auto attribute = [&](std::uint8_t control, std::uint8_t value) {
        const auto values = gdtf::channel_values(type, mode, {{1, {control, value}}});
        return mode.channels[1].functions.at(static_cast<std::size_t>(values.at(1).function)).attribute;
    };
    EXPECT_EQ(attribute(0, 200), "Zoom");
    EXPECT_EQ(attribute(128, 50), "Iris");
    EXPECT_EQ(attribute(255, 100), "IrisStrobe");
    EXPECT_EQ(mode.channels[1].functions[0].to, 255u) << "the other mode's functions do not end it";
    EXPECT_EQ(mode.channels[1].functions[1].to, 99u);
}

TEST(GdtfDmx, ProfilesAreCubicsInPieces) {
    gdtf::DmxProfile profile{"", {{0.0, {0, 0, 1, 0}}, {0.5, {0.25, 1, 0, 0}}}, false};
    EXPECT_DOUBLE_EQ(gdtf::profile_output(profile, 0.4), 0.16);
    EXPECT_DOUBLE_EQ(gdtf::profile_output(profile, 0.75), 0.5);
    profile.points.erase(profile.points.begin());
    EXPECT_DOUBLE_EQ(gdtf::profile_output(profile, 0.4), 0.0) << "no piece begins so low";
    const gdtf::DmxProfile percent{"", {{0.0, {0, 0, 0.01, 0}}, {90.0, {81, 1, 0, 0}}}, true};
    EXPECT_DOUBLE_EQ(gdtf::profile_output(percent, 0.5), 0.25);
    const FixtureType type = driven_type(
        {.geometries = "<Beam Name='A'/>",
         .modes = mode_text("A", channel_text("A", "Dimmer", "1", "0", "1", "DMXProfile='Square'")),
         .physics = "<DMXProfiles><DMXProfile Name='Square'><Point DMXPercentage='0' CFC2='1'/></DMXProfile>"
                    "</DMXProfiles>"});
    EXPECT_NEAR(states_of(type, {51}).at(0).dimmer_ratio, 0.04, 1e-12);
}

TEST(GdtfDmx, VirtualChannelsAndShortDmxHaveDefaults) {
    const FixtureType type =
        driven_type({.geometries = "<Beam Name='A'/>",
                     .modes = mode_text("A",
                                        "<DMXChannel Offset='None' Geometry='A'><LogicalChannel Attribute='Dimmer'>"
                                        "<ChannelFunction Attribute='Dimmer' DMXFrom='0/1' Default='128/1'/>"
                                        "</LogicalChannel></DMXChannel>" +
                                            channel_text("A", "Zoom", "3", "10", "20"))});
    EXPECT_NEAR(physical_of(type, 0, {255, 255, 255}), 128.0 / 255.0, 1e-9);
    EXPECT_DOUBLE_EQ(physical_of(type, 1, {255, 255}), 10.0) << "its slot is not there";
    EXPECT_DOUBLE_EQ(physical_of(type, 1, {255, 255, 255}), 20.0);
}

TEST(GdtfDmx, WhatWasNeverFilledInDoesNothing) {
    const FixtureType type =
        driven_type({.geometries = "<Beam Name='A' ColorTemperature='6504'/>",
                     .modes = mode_text("A", channel_text("A", "Zoom", "1") + channel_text("A", "CTC", "2"))});
    const BeamState state = states_of(type, {255, 255}).at(0);
    EXPECT_FALSE(state.zoom_rad);
    EXPECT_NEAR(state.color.r, state.color.b, 0.08);
}

}  // namespace
}  // namespace gonio
