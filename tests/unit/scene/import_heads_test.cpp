// Heads of imported MVR shows on a console: shutter, zoom and gobo, and that pan and tilt swing them as GDTF's tree
// does.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "ies/core/printed.h"
#include "protocol/dmx/patch.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/exchange/import_parts.h"
#include "server/scene/apply.h"
#include "server/scene/console.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

using namespace test;

// A head with a shutter of three functions, a zoom that has half of its channel, and a wheel: closed from 0, open from
// 64, 1 to 10 Hz from 128; 10 to 50 degrees over 0 to 127; slot 1 open, slot 2 from 100 with a picture.
std::string wheel_gdtf() {
    const auto function = [](const std::string& attribute, const std::string& dmx, const std::string& from,
                             const std::string& to, const std::string& more = "/>") {
        return "<ChannelFunction Attribute='" + attribute + "' DMXFrom='" + dmx + "/1' Default='64/1' PhysicalFrom='" +
               from + "' PhysicalTo='" + to + "' Wheel='Gobos'" + more;
    };
    const auto channel = [](const std::string& offset, const std::string& attribute, const std::string& functions) {
        return "<DMXChannel DMXBreak='1' Offset='" + offset + "' Geometry='Base'><LogicalChannel Attribute='" +
               attribute + "'>" + functions + "</LogicalChannel></DMXChannel>";
    };
    const std::string text = gdtf_text(
        {.geometries = "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='10000' BeamAngle='25' FieldAngle='40'/>"
                       "</Geometry>",
         .modes = mode_text(
             "Base",
             channel("1", "Shutter1",
                     function("Shutter1", "0", "0", "0") + function("Shutter1", "64", "1", "1") +
                         function("Shutter1Strobe", "128", "1", "10")) +
                 channel("2", "Zoom", function("Zoom", "0", "10", "50") + function("NoFeature", "128", "0", "1")) +
                 channel("3", "Gobo1",
                         function("Gobo1", "0", "0", "1",
                                  "><ChannelSet DMXFrom='0/1' WheelSlotIndex='1'/><ChannelSet DMXFrom='100/1' "
                                  "WheelSlotIndex='2'/></ChannelFunction>")) +
                 channel_text("Base", "Gobo1Pos", "4,5", "-180", "180")),
         .wheels = "<Wheel Name='Gobos'><Slot Name='Open'/><Slot Name='Half' MediaFileName='half'/></Wheel>"});
    Image half{64, 64, {}};
    for (int i = 0; i < 64 * 64; ++i)
        for (const int value : {i % 64 < 32 ? 0 : 255, i % 64 < 32 ? 0 : 255, i % 64 < 32 ? 0 : 255, 255})
            half.rgba.push_back(static_cast<std::uint8_t>(value));
    const auto png = encode_rgba_png(half);
    return *write_zip(std::vector<ZipFile>{
        {"description.xml", text},
        {"wheels/half.png", std::string(reinterpret_cast<const char*>(png->data()), png->size())}});
}

TEST(ImportHeads, DmxDrivesShutterStrobeZoomAndGobo) {
    const std::string patch = "<Addresses><Address break='0'>1.1</Address></Addresses>";
    const auto asset = imported(show_mvr(fixture("Spot", kHanging, patch), {{"Maker@Head.gdtf", wheel_gdtf()}}));
    ASSERT_TRUE(asset->patch);
    ASSERT_TRUE(check_patch(*asset->patch)) << check_patch(*asset->patch).error().text();
    ASSERT_TRUE(asset->lights[0].profile->gobos);
    EXPECT_EQ(asset->lights[0].profile->gobos->at(1).name, "Half");
    const auto said = [&](std::vector<std::uint8_t> levels) {
        v1::Patch rows;
        *rows.mutable_rows() = asset->patch->rows();
        PatchReader reader(rows);
        DmxSource source;
        source.id = 1;
        std::ranges::copy(levels, source.levels.begin());
        source.rank.fill(100);
        std::map<std::string, double> values;
        for (const PropertyValue& value : reader.read({DmxProtocol::sacn, 1}, {{source}}))
            values[std::string(row_of(value.property).name)] = value.value[0];
        return values;
    };
    auto values = said({0, 0, 0, 0, 0});
    EXPECT_EQ(values.at("shutter"), 0);
    EXPECT_EQ(values.at("strobe"), 0);
    EXPECT_NEAR(values.at("zoom"), 10 * kDegree, 1e-9);
    EXPECT_EQ(values.at("gobo"), 1);
    EXPECT_NEAR(values.at("gobo-turn"), -180 * kDegree, 1e-9);
    values = said({64, 127, 99, 255, 255});
    EXPECT_EQ(values.at("shutter"), 1);
    EXPECT_EQ(values.at("strobe"), 0);
    EXPECT_NEAR(values.at("zoom"), 50 * kDegree, 1e-9);
    EXPECT_EQ(values.at("gobo"), 1);
    EXPECT_NEAR(values.at("gobo-turn"), 180 * kDegree, 1e-9);
    values = said({255, 128, 100, 0, 0});
    EXPECT_EQ(values.at("shutter"), 1);
    EXPECT_NEAR(values.at("strobe"), 10, 1e-9);
    EXPECT_FALSE(values.contains("zoom")) << "a value of no range leaves it";
    EXPECT_EQ(values.at("gobo"), 2);
    // physical = 1 + (191 - 128)/(255 - 128)·9
    EXPECT_NEAR(said({191, 0, 0, 0, 0}).at("strobe"), 1.0 + 63.0 / 127.0 * 9.0, 1e-6);
    // And the light shines with half of its flux.
    Scene scene = scene_of(asset);
    v1::Command command;
    command.mutable_set_light()->set_name("Spot");
    command.mutable_set_light()->set_gobo(2);
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_NEAR(scene.lights[0].shining()->flux_lm, 5000, 10);
}

// Universe 1 as one console sends it, in sACN; all slots are 0.
DmxUniverse universe_of_a_console() {
    DmxUniverse universe;
    DmxSource& source = universe.sources.emplace_back();
    source.id = 1;
    source.rank.fill(101);
    return universe;
}

// What the scene's patch makes of it.
void hear(Scene& scene, const DmxUniverse& universe) {
    PatchReader reader(patch_in_force(scene));
    const auto values = reader.read({DmxProtocol::sacn, 1}, universe);
    for (const auto& refused : apply_inputs(scene, commands_of(scene, values))) EXPECT_FALSE(refused);
}

// A rotation, Z up in mm as a Matrix of MVR, and as what it makes of the scene.
struct Hang {
    glm::dquat turn;
    std::string matrix() const {
        std::string text;
        for (int column = 0; column < 3; ++column) {
            const glm::dvec3 axis = glm::dmat3(turn)[column];
            text += printed("{%.17g,%.17g,%.17g}", axis.x, axis.y, axis.z);
        }
        return text + "{0,0,0}";
    }
    glm::dmat4 world_from_fixture() const {
        return glm::dmat4{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}} * glm::mat4_cast(turn);
    }
};

Hang hang_at(double yaw, double about_x) {
    return {glm::angleAxis(yaw, glm::dvec3(0, 0, 1)) * glm::angleAxis(about_x, glm::dvec3(1, 0, 0))};
}

// Where the lens of head_gdtf() aims, and where its C0 is, as GDTF's tree has it.
void expect_as_geometry(const glm::dquat& world_from_light, const Hang& hang, const gdtf::StateOptions& options) {
    const auto type = gdtf::read_gdtf(*open_zip(head_gdtf()));
    ASSERT_TRUE(type);
    const gdtf::Mode& mode = type->modes.at(0);
    const auto states = gdtf::beam_states(*type, mode, gdtf::default_values(*type, mode), options);
    const glm::dmat4 world_from_beam = hang.world_from_fixture() * states.at(0).fixture_from_beam;
    expect_near(aim_of(world_from_light), -glm::dvec3(world_from_beam[2]), 1e-6);
    expect_near(c0_of(world_from_light), glm::dvec3(world_from_beam[0]), 1e-6);
}

// What a console says as pan and tilt turns the light as GDTF's geometry would, C0 with it, however the fixture is
// mounted.
TEST(ImportHeads, HeadsSwingAsTheirGeometryDoes) {
    const auto type = gdtf::read_gdtf(*open_zip(head_gdtf()));
    ASSERT_TRUE(type);
    for (const double yaw : {0.0, 0.6, -2.2})
        for (const double about_x : {0.0, 0.4, std::numbers::pi / 2, std::numbers::pi})
            for (const bool inverted : {false, true}) {
                const Hang hang = hang_at(yaw, about_x);
                const auto axes = exchange::head_axes(
                    exchange::head_directions(*type, type->modes.at(0), inverted, false), 3, hang.world_from_fixture());
                ASSERT_TRUE(axes) << yaw << about_x << inverted;
                for (const double pan : {-3.0, 0.2, 1.1})
                    for (const double tilt : {-1.5, -0.3, 0.0, 0.9})
                        expect_as_geometry(axes->world_from_mount *
                                               orientation_of({axes->pan_offset_rad + axes->pan_sign * pan,
                                                               axes->tilt_offset_rad + axes->tilt_sign * tilt, 0.0}),
                                           hang, {inverted, false, pan, tilt});
            }
}

// However the show leaves a head, its console turns it as GDTF's tree says, and a gobo with it.
TEST(ImportHeads, AConsoleTurnsWhatTheShowHasTurned) {
    const auto address = [](int slot) {
        return printed("<Addresses><Address break='0'>1.%d</Address></Addresses>", slot);
    };
    const auto commands = [](double pan, double tilt) {
        return printed(
            "<CustomCommands><CustomCommand>Yoke_Pan.Pan.Pan 1,f %g</CustomCommand>"
            "<CustomCommand>Body_Tilt.Tilt.Tilt 1,f %g</CustomCommand></CustomCommands>",
            pan, tilt);
    };
    struct Case {
        Hang hang;
        std::string more;
        double pan_deg, tilt_deg;  // at first; a focus point: where it leaves them
        bool focused = false;
    };
    const std::vector<Case> cases = {
        {hang_at(0.5, 0.0), "", 0, 0},
        {hang_at(0.5, 0.0), commands(20, 0), 20, 0},
        {hang_at(-2.0, 0.0), commands(20, -40), 20, -40},
        {hang_at(1.0, std::numbers::pi), commands(-130, 70), -130, 70},
        {hang_at(0.3, 1.2), commands(200, -100), 200, -100},
        {hang_at(0.3, 0.7), "<Focus>f</Focus>", 0, 0, true},
        {hang_at(0.3, 0.7), "<Focus>f</Focus>" + commands(170, 20), 0, 0, true},
    };
    std::string fixtures =
        "<FocusPoint name='F' uuid='f'><Matrix>{1,0,0}{0,1,0}{0,0,1}{4000,2000,500}</Matrix></FocusPoint>";
    for (std::size_t i = 0; i < cases.size(); ++i)
        fixtures += fixture(printed("head %zu", i), cases[i].hang.matrix(),
                            cases[i].more + address(1 + 10 * static_cast<int>(i)));
    const auto asset = imported(show_mvr(fixtures, {{"Maker@Head.gdtf", head_gdtf()}}));
    Scene scene = scene_of(asset);
    ASSERT_EQ(scene.lights.size(), cases.size());
    DmxUniverse universe = universe_of_a_console();
    DmxSource& source = universe.sources.front();
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Light& light = scene.lights[i];
        if (!cases[i].focused)
            expect_as_geometry(light.world_from_light, cases[i].hang,
                               {false, false, cases[i].pan_deg * kDegree, cases[i].tilt_deg * kDegree});
        else
            expect_near(aim_of(light.world_from_light), glm::normalize(glm::dvec3(4, 0.5, -2) - light.position), 1e-9);
        for (std::size_t slot = 0; slot < 4; ++slot) source.levels[10 * i + slot] = slot < 2 ? 0x55 : 0x33;
    }
    hear(scene, universe);
    for (std::size_t i = 0; i < cases.size(); ++i)  // 0x5555: -90°; 0x3333, a fifth: -81°
        expect_as_geometry(scene.lights[i].world_from_light, cases[i].hang,
                           {false, false, -90 * kDegree, -81 * kDegree});
}

// From the show's patch to the light: a universe's slots aim it as the geometry of its GDTF says.
TEST(ImportHeads, AConsoleSwingsTheHeads) {
    const std::string hanging = "<Addresses><Address break='0'>1.1</Address></Addresses>",
                      standing = "<Addresses><Address break='0'>1.11</Address></Addresses>",
                      on_its_side = "<Addresses><Address break='0'>1.21</Address></Addresses>";
    const auto asset = imported(show_mvr(fixture("Hung", kHanging, hanging) +
                                             fixture("Stood", "{1,0,0}{0,-1,0}{0,0,-1}{0,0,0}", standing) +
                                             fixture("Side", "{0,0,-1}{0,1,0}{1,0,0}{0,0,0}", on_its_side),
                                         {{"Maker@Head.gdtf", head_gdtf()}}));
    ASSERT_TRUE(asset->patch);
    ASSERT_TRUE(check_patch(*asset->patch)) << check_patch(*asset->patch).error().text();
    Scene scene = scene_of(asset);
    DmxUniverse universe = universe_of_a_console();
    DmxSource& source = universe.sources.front();
    for (const std::size_t first : {0u, 10u, 20u}) {
        source.levels[first] = source.levels[first + 1] = 0x55;  // 21845: pan -90°
        source.levels[first + 2] = 0xD5;                         // 54741 of 65535: tilt 90.53°
        source.levels[first + 3] = 0xD5;
        source.levels[first + 4] = 51;  // a fifth
    }
    hear(scene, universe);
    const double tilt = (-135.0 + 54741.0 / 65535.0 * 270.0) * kDegree;
    // Rz(-90°) Rx(t) (0,0,-1) = (sin t, 0, -cos t) in GDTF's axes: (sin t, -cos t, 0) in the scene's.
    expect_near(aim_of(scene.lights.at(0).world_from_light), {std::sin(tilt), -std::cos(tilt), 0}, 1e-6);
    // Turned by 180° about X it is (sin t, cos t, 0).
    expect_near(aim_of(scene.lights.at(1).world_from_light), {std::sin(tilt), std::cos(tilt), 0}, 1e-6);
    // Turned by 90° about GDTF's Y, X goes to -Z and Z to X: (-cos t, -sin t, 0).
    expect_near(aim_of(scene.lights.at(2).world_from_light), {-std::cos(tilt), -std::sin(tilt), 0}, 1e-6);
    for (const Light& light : scene.lights) EXPECT_NEAR(light.level_ratio, 0.2, 1e-9);
    // Whatever it aims at, its angles about its own axes bring it there again; a copy turns about the vertical.
    const auto command = [&](auto fill) {
        v1::Command made;
        fill(made);
        const auto applied = apply(scene, made, {});
        EXPECT_TRUE(applied) << applied.error().text();
    };
    command([](v1::Command& made) {
        made.mutable_set_light()->set_name("Side");
        for (const double value : {0.3, -0.5, 0.7}) made.mutable_set_light()->add_aim(value);
    });
    const Light aimed = scene.lights.at(2);
    command([&](v1::Command& made) {
        made.mutable_set_light()->set_name("Side");
        made.mutable_set_light()->set_pan_rad(aimed.pan_rad + 1.0);
    });
    command([&](v1::Command& made) {
        made.mutable_set_light()->set_name("Side");
        made.mutable_set_light()->set_pan_rad(aimed.pan_rad);
    });
    expect_near(aim_of(scene.lights.at(2).world_from_light), glm::normalize(glm::dvec3(0.3, -0.5, 0.7)), 1e-9);
    command([](v1::Command& made) {
        made.mutable_add_light()->set_like("Side");
        made.mutable_add_light()->mutable_light()->set_name("copy");
        made.mutable_add_light()->mutable_light()->set_tilt_rad(0.0);
    });
    expect_near(aim_of(scene.lights.back().world_from_light), {0, -1, 0}, 1e-9);
}

}  // namespace
}  // namespace gonio
