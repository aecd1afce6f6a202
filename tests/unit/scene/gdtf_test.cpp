// GDTF files: expected values are from DIN SPEC 15800, its reference library's behaviour, and the samples' own text.
#include "server/exchange/gdtf.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <numbers>

#include "server/exchange/axes.h"
#include "tests/shared_data.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio {
namespace {

using exchange::Outcome;
using gdtf::FixtureType;
using test::channel_text;
using test::gdtf_text;
using test::mode_text;

FixtureType type_of(const test::GdtfText& text, std::vector<std::string> entries = {}) {
    auto type = gdtf::read_description(gdtf_text(text), entries);
    EXPECT_TRUE(type) << type.error().text();
    return type ? *type : FixtureType{};
}

bool notes(const FixtureType& type, Outcome outcome, const std::string& what) {
    return type.report.count(outcome, what) > 0;
}

Result<FixtureType> sample(const std::filesystem::path& path) {
    auto archive = open_zip(test::bytes_of(path), gdtf::kGdtfLimits);
    if (!archive) return archive.error();
    return gdtf::read_gdtf(*archive);
}

TEST(Gdtf, PositionsAreRowsWithTheOriginInTheFourthColumn) {
    // A turn by 90° about Z that takes X to Y, written with U, V, W as rows: U = (0, 1, 0), V = (-1, 0, 0).
    const auto read = exchange::gdtf_matrix("{0,1,0,0.5}{-1,0,0,0.25}{0,0,1,-2}{0,0,0,1}");
    EXPECT_EQ(read.state, exchange::MatrixState::as_written);
    const glm::dvec4 x = read.matrix * glm::dvec4(1, 0, 0, 1);
    EXPECT_DOUBLE_EQ(x.x, 0.5);
    EXPECT_DOUBLE_EQ(x.y, 1.25);
    EXPECT_DOUBLE_EQ(x.z, -2.0);
    // Some exporters put the origin into the fourth row.
    const auto fourth_row = exchange::gdtf_matrix("{1,0,0,0}{0,1,0,0}{0,0,1,0}{0.1,0.2,0.3,1}");
    EXPECT_EQ(glm::dvec3(fourth_row.matrix[3]), glm::dvec3(0.1, 0.2, 0.3));
}

TEST(Gdtf, WhatIsNoPositionIsNamed) {
    const FixtureType type =
        type_of({.geometries = "<Geometry Name='A' Position='{nan,0,0,0}{0,1,0,0}{0,0,1,0}{0,0,0,1}'>"
                               "<Geometry Name='B' Position='{1,0,0,7}{1,0,0,8}{0,0,1,9}{0,0,0,1}'/>"
                               "<Geometry Name='C' Position=''/><Geometry Name='D' Position='{1,2'/></Geometry>",
                 .modes = mode_text("A", "")});
    ASSERT_EQ(type.modes.at(0).geometries.size(), 4u);
    EXPECT_EQ(type.modes[0].geometries[0].parent_from_geometry, glm::dmat4(1.0));
    EXPECT_EQ(glm::dvec3(type.modes[0].geometries[1].parent_from_geometry[3]), glm::dvec3(7, 8, 9));
    EXPECT_EQ(type.report.count(Outcome::defaulted, "a position is no matrix: there is no offset"), 2u);
    EXPECT_EQ(type.report.count(Outcome::guessed, "a position's axes span no space: it does not turn"), 1u);
}

// DIN SPEC 15800: floats have a decimal point. The defaults are those of its tables: 10,000 lm, 0.05 m, 0 to 1, break
// 1, offset 1; a model without a size keeps its own.
TEST(Gdtf, NumbersWithTextBehindThemAreNoneAndAreNamed) {
    const FixtureType type = type_of(
        {.geometries =
             "<Geometry Name='A'><Beam Name='Lens' LuminousFlux='10000,75' BeamRadius='0,07' BeamAngle='15 deg' "
             "FieldAngle=' 40.5 '/><GeometryReference Name='R' Geometry='C'><Break DMXBreak='2;' "
             "DMXOffset='0x5'/></GeometryReference></Geometry><Geometry Name='C'/>",
         .modes = mode_text("A", channel_text("A", "Pan", "1", "5,5", "5.5.5") + channel_text("A", "Tilt", "2;3") +
                                     channel_text("A", "Zoom", "4 5") +
                                     "<DMXChannel Offset='6' Geometry='A' DMXBreak='1,5'><LogicalChannel "
                                     "Attribute='Gobo1'><ChannelFunction Name='G' Attribute='Gobo1' DMXFrom='7,5/1' "
                                     "Default='255'><ChannelSet Name='S' DMXFrom='10/1' PhysicalFrom='1,5' "
                                     "PhysicalTo='2' WheelSlotIndex='3.'/></ChannelFunction></LogicalChannel>"
                                     "</DMXChannel>"),
         .wheels = "<Wheel Name='W'><Slot Name='Red' Color='0,64;0,33;21'/><Slot Name='More' Color='0.3,0.3,50,7'/>"
                   "</Wheel>",
         .physics = "<DMXProfiles><DMXProfile Name='P'><Point DMXPercentage='0,5' CFC1='1,5'/></DMXProfile>"
                    "</DMXProfiles>",
         .models = "<Model Name='M' Length='0,3' Width='0.3' Height='+0.25'/>"});
    const gdtf::Mode& mode = type.modes.at(0);
    const gdtf::Beam& beam = *mode.geometries.at(1).beam;
    EXPECT_EQ(beam.flux_lm.value, 10000.0);
    EXPECT_TRUE(beam.flux_lm.defaulted);
    EXPECT_EQ(beam.radius_m.value, 0.05);
    EXPECT_NEAR(beam.beam_angle_rad.value, 25.0 * std::numbers::pi / 180.0, 1e-12);
    EXPECT_NEAR(beam.field_angle_rad.value, 40.5 * std::numbers::pi / 180.0, 1e-12);
    EXPECT_EQ(type.models.at(0).size_m, glm::dvec3(0.0, 0.3, 0.25));
    const gdtf::ChannelFunction& pan = mode.channels.at(0).functions.at(0);
    EXPECT_EQ(pan.physical_from, 0.0);
    EXPECT_EQ(pan.physical_to, 1.0);
    EXPECT_TRUE(mode.channels.at(1).offsets.empty());
    EXPECT_TRUE(mode.channels.at(2).offsets.empty());
    EXPECT_EQ(mode.channels.at(3).dmx_break, 1);
    const gdtf::ChannelFunction& gobo = mode.channels[3].functions.at(0);
    EXPECT_EQ(gobo.from, 0u);
    EXPECT_EQ(gobo.default_value, 255u);
    EXPECT_FALSE(gobo.sets.at(0).physical);
    EXPECT_EQ(gobo.sets[0].slot, 0);
    EXPECT_FALSE(type.wheels.at(0).slots.at(0).color);
    EXPECT_FALSE(type.wheels[0].slots.at(1).color);
    EXPECT_EQ(type.profiles.at(0).points.at(0).cubic[1], 0.0);
    const std::string what = "a value is no number: its default stands";
    EXPECT_EQ(type.report.count(Outcome::defaulted, what), 13u);
    std::vector<std::string> named;
    for (const exchange::ImportNote& note : type.report.notes)
        if (note.what == what) named = note.names;
    EXPECT_EQ(named, (std::vector<std::string>{"P DMXPercentage=0,5", "P CFC1=1,5", "M Length=0,3",
                                               "Lens LuminousFlux=10000,75", "Lens BeamAngle=15 deg",
                                               "Lens BeamRadius=0,07", "R DMXBreak=2;", "R DMXOffset=0x5"}));
    const auto lines = exchange::report_lines(type.report);
    for (const char* line :
         {"defaulted: a value is no DMX value: its default stands: \"A_Gobo1.G DMXFrom=7,5/1\"",
          "left out: a channel's offset is no slot of a break: the channel is virtual: \"A_Tilt Offset=2;3\", "
          "\"A_Zoom Offset=4 5\"",
          "left out: a colour is none: \"W: Red Color=0,64;0,33;21\", \"W: More Color=0.3,0.3,50,7\""})
        EXPECT_EQ(std::count(lines.begin(), lines.end(), line), 1) << line;
}

TEST(Gdtf, ModesWalkFromTheirOwnGeometryAndExpandReferences) {
    const FixtureType type = type_of(
        {.geometries = "<Geometry Name='Cell'><Beam Name='Lens' LuminousFlux='500' BeamAngle='10'/></Geometry>"
                       "<Geometry Name='Bar'><GeometryReference Name='Cell 1' Geometry='Cell' "
                       "Position='{1,0,0,-1}{0,1,0,0}{0,0,1,0}{0,0,0,1}'><Break DMXOffset='4'/>"
                       "</GeometryReference><GeometryReference Name='Cell 2' Geometry='Cell'>"
                       "<Break DMXOffset='8'/></GeometryReference></Geometry>"
                       "<Geometry Name='Unused'/>",
         .modes = mode_text("Bar", channel_text("Bar", "Dimmer", "1") + channel_text("Lens", "Dimmer", "1,2"))});
    const gdtf::Mode& mode = type.modes.at(0);
    ASSERT_EQ(mode.geometries.size(), 5u);
    EXPECT_EQ(mode.geometries[1].name, "Cell 1");
    EXPECT_EQ(mode.geometries[1].source, "Cell");
    EXPECT_EQ(mode.geometries[1].parent_from_geometry[3].x, -1.0);
    EXPECT_EQ(mode.geometries[2].parent, 1);
    EXPECT_EQ(mode.geometries[2].reference, 1);
    EXPECT_EQ(mode.geometries[2].beam->flux_lm.value, 500.0);
    EXPECT_FALSE(mode.geometries[2].beam->flux_lm.defaulted);
    EXPECT_TRUE(mode.geometries[2].beam->field_angle_rad.defaulted);
    EXPECT_NEAR(mode.geometries[2].beam->beam_angle_rad.value, 10.0 * std::numbers::pi / 180.0, 1e-12);
    ASSERT_EQ(mode.patched.size(), 3u);
    EXPECT_EQ(mode.patched[1].slots, (std::vector<int>{4, 5}));
    EXPECT_EQ(mode.patched[2].slots, (std::vector<int>{8, 9}));
    EXPECT_EQ(mode.footprint.at(1), 9) << "the greatest offset, not the number of channels";
}

TEST(Gdtf, CyclesDepthAndUnknownNamesAreLeftOutByName) {
    std::string deep;
    for (int i = 0; i < 80; ++i) deep += "<Geometry Name='d" + std::to_string(i) + "'>";
    for (int i = 0; i < 80; ++i) deep += "</Geometry>";
    const FixtureType type =
        type_of({.geometries = "<Geometry Name='A'><GeometryReference Name='to B' Geometry='B'/>"
                               "<GeometryReference Name='to nobody' Geometry='Nobody'/></Geometry>"
                               "<Geometry Name='B'><GeometryReference Name='to A' Geometry='A'/></Geometry>" +
                               deep,
                 .modes = mode_text("A", channel_text("Nowhere", "Dimmer", "1")) + mode_text("d0", "") +
                          mode_text("gone", "")});
    EXPECT_EQ(type.modes.size(), 2u);
    EXPECT_EQ(type.modes[0].geometries.size(), 2u);
    EXPECT_EQ(type.modes[1].geometries.size(), static_cast<std::size_t>(gdtf::kMaxDepth));
    for (const char* what :
         {"a reference contains itself", "a reference names no top-level geometry", "a geometry lies too deep",
          "a channel's geometry is not in its mode", "a mode names no top-level geometry"})
        EXPECT_TRUE(notes(type, Outcome::left_out, what)) << what;
}

TEST(Gdtf, ReferencesThatMultiplyAreRefusedAtTheBound) {
    // 16 levels of 16 references each would be 16^16 geometries.
    std::string levels = "<Geometry Name='L16'/>";
    for (int level = 0; level < 16; ++level) {
        levels += "<Geometry Name='L" + std::to_string(level) + "'>";
        for (int i = 0; i < 16; ++i)
            levels += "<GeometryReference Name='r' Geometry='L" + std::to_string(level + 1) + "'/>";
        levels += "</Geometry>";
    }
    const auto type = gdtf::read_description(gdtf_text({.geometries = levels, .modes = mode_text("L0", "")}), {});
    ASSERT_FALSE(type);
    EXPECT_EQ(type.error().code, "too_large");
}

TEST(Gdtf, AGeometryReferredToOftenIsSearchedOnce) {
    // Searched anew each time these would be 10^10 elements.
    std::string many = "<Geometry Name='A'>";
    for (int i = 0; i < 10'000; ++i) many += "<GeometryReference Name='r' Geometry='Cell'/>";
    many += "</Geometry><Geometry Name='Cell'><Geometry Name='First'/>";
    for (int i = 0; i < 1'000'000; ++i) many += "<a/>";
    const FixtureType type =
        type_of({.geometries = many + "<Beam Name='Last'/></Geometry>", .modes = mode_text("A", "")});
    const auto& geometries = type.modes.at(0).geometries;
    ASSERT_EQ(geometries.size(), 1u + 10'000u * 3u);
    EXPECT_EQ(geometries[29'999].name, "First");
    EXPECT_EQ(geometries[30'000].name, "Last");
    EXPECT_EQ(geometries[30'000].parent, 29'998);
}

TEST(Gdtf, AReferenceHasAtMost512Breaks) {
    const auto text = [](int breaks) {
        std::string many = "<Beam Name='B'/><Geometry Name='A'>";
        for (int i = 0; i < 400; ++i) many += "<GeometryReference Name='r' Geometry='Cell'/>";
        many += "</Geometry><Geometry Name='Cell'><GeometryReference Name='q' Geometry='B'>";
        for (int i = 0; i < breaks; ++i) many += "<Break/>";
        return gdtf_text({.geometries = many + "</GeometryReference></Geometry>", .modes = mode_text("A", "")});
    };
    const auto most = gdtf::read_description(text(512), {});
    ASSERT_TRUE(most) << most.error().text();
    EXPECT_EQ(most->modes.at(0).geometries.size(), 1u + 400u * 2u);
    const auto refused = gdtf::read_description(text(513), {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
    EXPECT_EQ(refused.error().value, "q");
}

TEST(Gdtf, BoundsOfXmlHold) {
    std::string many(std::size_t{5'000'000}, '<');
    auto refused = gdtf::read_description(many, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
    for (const char* text : {"", "<GDTF/>", "<GDTF><FixtureType/></GDTF>", "<a", "not xml",
                             "<!DOCTYPE a [<!ENTITY x 'yyyy'>]><GDTF><FixtureType Name='&x;'/></GDTF>"}) {
        refused = gdtf::read_description(text, {});
        ASSERT_FALSE(refused) << text;
        EXPECT_EQ(refused.error().code, "bad_gdtf");
    }
    std::string elements = "<Geometry Name='A'>";
    for (int i = 0; i < 200'000; ++i) elements += "<Geometry/>";
    refused =
        gdtf::read_description(gdtf_text({.geometries = elements + "</Geometry>", .modes = mode_text("A", "")}), {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
}

TEST(Gdtf, DmxValuesAreMirroredOrShifted) {
    const auto value = [](const char* text, int bytes) { return gdtf::in_bytes(*gdtf::dmx_value(text), bytes); };
    EXPECT_EQ(value("255/1", 2), 65535u);
    EXPECT_EQ(value("255/1s", 2), 65280u);
    EXPECT_EQ(value("1/1", 3), 0x010101u);
    EXPECT_EQ(value("258/2", 3), 0x010201u);
    EXPECT_EQ(value("65535/2", 1), 255u);
    EXPECT_EQ(value("300/1", 1), 255u);
    EXPECT_EQ(value("7", 1), 7u);
    for (const char* text : {"", "None", "1/0", "1/9", "1/1x", "a/1", "1:1", "-1/1"})
        EXPECT_FALSE(gdtf::dmx_value(text)) << text;
}

TEST(Gdtf, FunctionsEndBelowTheNext) {
    const FixtureType type =
        type_of({.geometries = "<Geometry Name='A'/>",
                 .modes = mode_text(
                     "A",
                     "<DMXChannel Offset='1' Geometry='A' InitialFunction='A_Shutter1.Shutter1.Open'><LogicalChannel "
                     "Attribute='Shutter1'>"
                     "<ChannelFunction Name='Closed' Attribute='Shutter1' DMXFrom='0/1' Default='0/1'/>"
                     "<ChannelFunction Name='Strobe' Attribute='Shutter1Strobe' DMXFrom='64/1' Default='64/1'/>"
                     "<ChannelFunction Name='Open' Attribute='Shutter1' DMXFrom='192/1' Default='200/1'/>"
                     "</LogicalChannel></DMXChannel>")});
    const gdtf::Channel& channel = type.modes.at(0).channels.at(0);
    ASSERT_EQ(channel.functions.size(), 3u);
    EXPECT_EQ(channel.functions[0].to, 63u);
    EXPECT_EQ(channel.functions[1].to, 191u);
    EXPECT_EQ(channel.functions[2].to, 255u);
    EXPECT_EQ(channel.initial, 2);
}

// GDTF before 1.0 has Default at the DMXChannel; since then it is the function's, and the channel names that function.
TEST(Gdtf, AChannelsOwnDefaultCountsWhereFunctionsHaveNone) {
    const auto channel = [](const std::string& of_channel, const std::string& of_functions) {
        return "<DMXChannel Offset='1' Geometry='A' " + of_channel +
               "><LogicalChannel Attribute='Shutter1'><ChannelFunction Name='Closed' Attribute='Shutter1' "
               "DMXFrom='0/1' " +
               of_functions + "/><ChannelFunction Name='Open' Attribute='Shutter1' DMXFrom='128/1' " + of_functions +
               "/></LogicalChannel></DMXChannel>";
    };
    const auto start = [&](const std::string& of_channel, const std::string& of_functions, std::size_t noted) {
        const FixtureType type =
            type_of({.geometries = "<Geometry Name='A'/>", .modes = mode_text("A", channel(of_channel, of_functions))});
        EXPECT_EQ(type.report.count(Outcome::guessed, "a channel's own Default, of GDTF before 1.0, counts"), noted);
        const gdtf::Channel& read = type.modes.at(0).channels.at(0);
        return read.functions.at(static_cast<std::size_t>(read.initial)).default_value;
    };
    EXPECT_EQ(start("", "", 0), 0u);
    EXPECT_EQ(start("Default='200/1'", "", 1), 200u);
    EXPECT_EQ(start("Default='51400/2'", "", 1), 200u) << "0xC8C8";
    EXPECT_EQ(start("Default='200/1' InitialFunction='A_Shutter1.Shutter1.Closed'", "Default='7/1'", 0), 7u);
    EXPECT_EQ(start("Default='9/1' InitialFunction='A_Shutter1.Shutter1.Closed'", "", 1), 9u);
    EXPECT_EQ(start("Default='200,5/1'", "", 0), 0u) << "no value";
}

TEST(Gdtf, AChannelHasAtMost4096Functions) {
    const auto text = [](int functions) {
        std::string many = "<DMXChannel Offset='1' Geometry='A'><LogicalChannel Attribute='Dimmer'>";
        for (int i = 1; i < functions; ++i) many += "<ChannelFunction Attribute='Dimmer'/>";
        many += "<ChannelFunction Attribute='Strobe' DMXFrom='200/1'/></LogicalChannel></DMXChannel>";
        return gdtf_text({.geometries = "<Geometry Name='A'/>", .modes = mode_text("A", many)});
    };
    const auto most = gdtf::read_description(text(4096), {});
    ASSERT_TRUE(most) << most.error().text();
    const auto& functions = most->modes.at(0).channels.at(0).functions;
    ASSERT_EQ(functions.size(), 4096u);
    EXPECT_EQ(functions.front().to, 199u) << "those of one DMXFrom do not end each other";
    EXPECT_EQ(functions[4094].to, 199u);
    EXPECT_EQ(functions[4095].to, 255u);
    const auto refused = gdtf::read_description(text(4097), {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "too_large");
    EXPECT_EQ(refused.error().value, "A_Dimmer");
}

TEST(Gdtf, WheelsModelsAndPictures) {
    const FixtureType type =
        type_of({.geometries = "<Beam Name='A' Model='Body'/>",
                 .modes = mode_text("A", channel_text("A", "Gobo1", "1", "0", "1", "Wheel='Gobos'")),
                 .wheels = "<Wheel Name='Gobos'><Slot Name='Open' Color='0.3127,0.329,100'/>"
                           "<Slot Name='Stars' MediaFileName='Stars'/><Slot Name='Gone' MediaFileName='Gone'/></Wheel>",
                 .models = "<Model Name='Body' Length='0.4' Width='0.3' Height='0.2' PrimitiveType='Base' File='Body'/>"
                           "<Model Name='Gone' File='Gone'/>"},
                {"wheels/Stars.png", "models/3ds/Body.3ds", "models/gltf_low/Body.glb"});
    EXPECT_EQ(type.wheels.at(0).slots.at(1).picture, "wheels/Stars.png");
    EXPECT_EQ(type.wheels[0].slots[0].color->luminance_percent, 100.0);
    EXPECT_EQ(type.models.at(0).entry, "models/gltf_low/Body.glb");
    EXPECT_EQ(type.models[0].size_m, glm::dvec3(0.4, 0.3, 0.2));
    EXPECT_EQ(type.models[0].primitive, "Base");
    EXPECT_EQ(type.modes.at(0).geometries.at(0).model, 0);
    EXPECT_EQ(type.modes[0].channels.at(0).functions.at(0).wheel, 0);
    EXPECT_TRUE(notes(type, Outcome::left_out, "a wheel's picture is not in the archive"));
    EXPECT_TRUE(notes(type, Outcome::left_out, "a model's file is not in the archive"));
    EXPECT_TRUE(notes(type, Outcome::defaulted, "a beam has only default photometry"));
}

// What each sample holds. slots: break 1 of Element 1 and Element 2 for Pan, Tilt, Zoom, Focus1.
TEST(Gdtf, Samples) {
    const auto folder = test::shared_data("formats");
    if (!folder) GTEST_SKIP() << "the samples are not on this machine";
    const std::filesystem::path gdtf = *folder / "gdtf";
    const auto par = sample(gdtf / "BlenderDMX@LED_PAR_64_RGBW@v0.3.gdtf");
    ASSERT_TRUE(par) << par.error().text();
    EXPECT_EQ(par->name, "LED PAR 64 RGBW");
    EXPECT_EQ(par->modes.at(0).name, "Default");
    EXPECT_EQ(par->modes[0].footprint.at(1), 5);
    EXPECT_EQ(par->emitters.size(), 4u);
    EXPECT_EQ(par->models.at(2).entry, "models/gltf/Pixel.glb");
    const gdtf::Geometry& beam = par->modes[0].geometries.at(1);
    EXPECT_EQ(beam.parent_from_geometry[3].z, -0.134);
    EXPECT_EQ(beam.beam->flux_lm.value, 7000.0);
    EXPECT_NEAR(beam.beam->field_angle_rad.value, std::numbers::pi / 2, 1e-12);

    const std::string test = "Test@Channel_Layout_Test";
    for (const std::string& name :
         {test + "@v1_first_try.gdtf", test + "_v1-2@replicated_v1-1_channel_layout_test.gdtf"}) {
        const auto type = sample(gdtf / name);
        ASSERT_TRUE(type) << type.error().text();
        const gdtf::Mode& mode = type->modes.at(0);
        EXPECT_EQ(mode.channels.size(), 8u);
        EXPECT_EQ(mode.footprint, (std::map<int, int>{{1, 11}, {2, 9}})) << name;
        std::vector<std::vector<int>> slots;
        for (const gdtf::PatchedChannel& one : mode.patched) slots.push_back(one.slots);
        EXPECT_EQ(slots, (std::vector<std::vector<int>>{
                             {1}, {3}, {5}, {4}, {6}, {7}, {8}, {9}, {11}, {1, 2}, {4, 3, 5}, {6, 7}, {8, 9}}));
        EXPECT_EQ(type->report.count(Outcome::left_out), 0u);
        EXPECT_EQ(type->report.count(Outcome::guessed), 0u);
    }
    const auto clash = sample(gdtf / (test + "@v1_first_try.channel_clash.gdtf"));
    ASSERT_TRUE(clash);
    EXPECT_TRUE(notes(*clash, Outcome::guessed, "two channels share a slot: it drives both"));
    const auto missing = sample(gdtf / (test + "@v1_first_try.missing_break_in_geometry_reference.gdtf"));
    ASSERT_TRUE(missing);
    EXPECT_EQ(missing->report.count(Outcome::left_out, "a reference has no break for a channel"), 1u);
    EXPECT_EQ(missing->report.notes.back().names.at(0), "Element 2: AbstractElement_XYZ_Z");
    const auto empty = sample(gdtf / (test + "@v1_first_try.empty.gdtf"));
    ASSERT_FALSE(empty);
    EXPECT_FALSE(empty.error().message.empty());
}

}  // namespace
}  // namespace gonio
