// Files of fader boxes: shipped profiles, maps, QLC+ input profiles, and the rows that they become.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/schema/surface.pb.h"
#include "protocol/surface/midi_surface.h"
#include "protocol/surface/qxi.h"
#include "protocol/surface/surface_map.h"
#include "protocol/surface/surface_toml.h"

namespace gonio {
namespace {

std::string content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

SurfaceProfile shipped(const char* name) {
    const auto profile =
        read_surface_profile(content(std::string(GONIO_SOURCE_DIR "/server/surfaces/profiles/") + name + ".toml"));
    EXPECT_TRUE(profile) << name << ": " << profile.error().text();
    return profile ? *profile : SurfaceProfile{};
}

// What the box's control says for a message, as "name value".
std::string says(const SurfaceProfile& profile, MidiMessage message) {
    MidiSurface box(profile);
    std::vector<ControlEvent> events;
    box.take(message, 1, events);
    if (events.empty()) return "";
    return box.controls()[events[0].control].name + (events[0].what == ControlEvent::What::touched ? " touched" : "");
}

TEST(ShippedProfiles, TheFactoryMapsOfTheGuide) {
    const SurfaceProfile korg = shipped("korg_nanokontrol2");
    EXPECT_EQ(korg.usb, (std::vector<std::string>{"0944:0117"}));
    EXPECT_EQ(says(korg, {0, 0xB0, {2, 0x78}}), "slider 3");
    EXPECT_EQ(says(korg, {0, 0xB0, {23, 1}}), "knob 8");
    EXPECT_EQ(says(korg, {0, 0xB0, {64, 127}}), "record 1");
    EXPECT_EQ(says(korg, {0, 0xB0, {41, 127}}), "play");
    const SurfaceProfile akai = shipped("akai_midimix");
    EXPECT_EQ(says(akai, {0, 0xB0, {49, 1}}), "fader 5");
    EXPECT_EQ(says(akai, {0, 0xB0, {62, 1}}), "master");
    EXPECT_EQ(says(akai, {0, 0xB0, {47, 1}}), "knob middle 5");
    EXPECT_EQ(says(akai, {0, 0x90, {22, 127}}), "mute 8");
    const SurfaceProfile novation = shipped("novation_launch_control_xl");
    EXPECT_EQ(says(novation, {0, 0xB8, {77, 1}}), "fader 1");
    EXPECT_EQ(says(novation, {0, 0x98, {60, 127}}), "focus 8");
    EXPECT_EQ(novation.hello.size(), 9u);
    const SurfaceProfile mini = shipped("behringer_xtouch_mini");
    EXPECT_EQ(says(mini, {0, 0xBA, {10, 1}}), "fader B");
    EXPECT_EQ(says(mini, {0, 0xBA, {18, 1}}), "encoder B 8");
    EXPECT_EQ(mini.repaint_s, 1);
    const SurfaceProfile mackie = shipped("mackie_control");
    EXPECT_EQ(says(mackie, {0, 0xE8, {0, 64}}), "master");
    EXPECT_EQ(says(mackie, {0, 0x90, {0x68, 127}}), "fader 1 touched");
    EXPECT_EQ(says(mackie, {0, 0xB0, {23, 0x41}}), "v-pot 8");
    EXPECT_EQ(mackie.controls[0].steps, 16383u);
    EXPECT_EQ(MidiSurface(mackie).show(8, 1), (std::vector<std::uint8_t>{0xE8, 0x7F, 0x7F}));
    for (const SurfaceProfile& profile : {korg, akai, novation, mini, mackie}) {
        EXPECT_FALSE(profile.rows.empty()) << profile.name << " drives something from the first moment";
        for (const v1::SurfaceRow& row : profile.rows) EXPECT_TRUE(check_surface_row(row, "")) << row.DebugString();
    }
}

TEST(BoxToml, RefusalsNameLineAndValue) {
    const auto refused = [](const std::string& text) {
        const auto profile = read_surface_profile(text);
        return profile ? std::string("taken")
                       : profile.error().code + " " + profile.error().where + " " + profile.error().value;
    };
    const std::string head = "name = \"x\"\n[[control]]\nname = \"f\"\n";
    EXPECT_EQ(refused(head + "inputs = \"cc 1/0\"\n"), "taken");
    EXPECT_EQ(refused(""), "bad_surface line 1 column 1 ") << "no name";
    EXPECT_EQ(refused(head + "inputs = \"cc 99/0\"\n"), "bad_surface line 4 column 10 cc 99/0");
    EXPECT_EQ(refused(head + "inputs = \"cc 1/0\"\nkind = \"slider\"\n"), "bad_surface line 5 column 8 slider");
    EXPECT_EQ(refused(head + "inputs = \"cc 1/0-7\"\ntouch = \"note 1/0\"\n"), "bad_surface line 5 column 9 1");
    EXPECT_EQ(refused(head + "inputs = \"cc 1/40\"\nbits = 14\n"), "bad_surface line 5 column 8 14");
    EXPECT_EQ(refused(head + "inputs = \"cc 1/0\"\ndrives = \"brightness #n\"\n"),
              "bad_surface line 5 column 10 property brightness");
    EXPECT_EQ(refused(head + "inputs = \"cc 1/0, cc 1/0\"\n"), "bad_surface line 4 column 10 cc 1/0");
    EXPECT_EQ(refused(head + "inputs = \"cc 1/1\"\nbits = 14\n[[control]]\nname = \"late\"\ninputs = \"cc 1/33\"\n"),
              "bad_surface line 8 column 10 cc 1/33")
        << "the other's fine half";
    EXPECT_EQ(refused(head + "inputs = \"cc 1/1\"\nbits = 10\n"), "bad_surface line 5 column 8 10");
    EXPECT_EQ(refused(head + "inputs = \"note 1/1\"\nbits = 14\n"), "bad_surface line 5 column 8 14");
    EXPECT_EQ(refused("name = \"a\"\nusb = [\"zzzz\"]\n"), "bad_surface line 2 column 8 zzzz");
    EXPECT_EQ(refused("name = \"a\"\nusb = [\"\u00fc\", 5]\n").substr(0, 27), "bad_surface line 2 column 8");
    EXPECT_EQ(refused("name = \"x\"\nhello = \"F0 80 F7\"\n"), "bad_surface line 2 column 9 'F0 80 F7'");
    EXPECT_EQ(refused("name = \"x\"\ncolour = 1\n"), "bad_surface line 2 column 1 colour");
}

constexpr const char* kMap = R"(default = false

[[control]]
box = "0944:0117"
control = "slider 1"
target = "the \"key\" light"
property = "pan"
range = [-90, 90]
curve = "s"
takeover = "jump"
smooth_s = 0.1
deadband = 0.01
page = 2

[[control]]
box = "*"
control = "play"
property = "preset"
preset = "look 1"
fade_s = 2.5

[[control]]
box = "*"
control = "stop"
property = "page"
to_page = 3

[[control]]
box = "*"
control = "knob 1"
target = "#1"
property = "profile"
step = -0.5
stride = 8
profiles = ["downlight", "flood"]
)";

TEST(SurfaceToml, EveryKeyIsRead) {
    const auto map = read_surfaces_toml(kMap);
    ASSERT_TRUE(map) << map.error().text();
    EXPECT_FALSE(map->with_default());
    ASSERT_EQ(map->rows_size(), 4);
    const v1::SurfaceRow &pan = map->rows(0), &play = map->rows(1), &stop = map->rows(2), &knob = map->rows(3);
    EXPECT_EQ(pan.device(), "0944:0117");
    EXPECT_EQ(pan.control(), "slider 1");
    EXPECT_EQ(pan.target(), "the \"key\" light");
    EXPECT_EQ(pan.property(), "pan");
    EXPECT_NEAR(pan.low(), -1.5707963, 1e-6);
    EXPECT_NEAR(pan.high(), 1.5707963, 1e-6);
    EXPECT_EQ(pan.curve(), "s");
    EXPECT_EQ(pan.takeover(), "jump");
    EXPECT_EQ(pan.smooth_s(), 0.1);
    EXPECT_EQ(pan.deadband_ratio(), 0.01);
    EXPECT_EQ(pan.page(), 2u);
    EXPECT_EQ(play.preset(), "look 1");
    EXPECT_EQ(play.fade_s(), 2.5);
    EXPECT_EQ(stop.property(), "page");
    EXPECT_EQ(stop.high(), 3);
    EXPECT_EQ(knob.step(), -0.5);
    EXPECT_EQ(knob.stride(), 8u);
    ASSERT_EQ(knob.profiles_size(), 2);
    EXPECT_EQ(knob.profiles(1), "flood");
}

TEST(SurfaceToml, RefusalsNameLineAndValue) {
    const auto refused = [](const std::string& row) {
        const auto map = read_surfaces_toml("[[control]]\n" + row);
        return map ? std::string("taken") : map.error().code + " " + map.error().where + " " + map.error().value;
    };
    EXPECT_EQ(refused("control = \"a\"\ntarget = \"b\"\nproperty = \"level\"\n"), "taken");
    EXPECT_EQ(refused("control = \"a\"\ntarget = \"b\"\nproperty = \"color\"\n"),
              "bad_surface line 4 column 12 property color");
    EXPECT_EQ(refused("control = \"a\"\ntarget = \"b\"\nproperty = \"x\"\n"), "bad_surface line 1 column 1 low");
    EXPECT_EQ(refused("control = \"a\"\nproperty = \"level\"\n"), "bad_surface line 1 column 1 target");
    EXPECT_EQ(refused("control = \"a\"\nproperty = \"master\"\nrange = [0]\n"),
              "bad_surface line 4 column 9 an array of 1");
    EXPECT_EQ(refused("control = \"a\"\nproperty = \"master\"\ncurve = \"log\"\n"),
              "bad_surface line 4 column 9 curve log");
    EXPECT_EQ(refused("control = \"\u00fc\"\ntarget = \"b\"\nproperty = \"pan\"\nrange = [-90, 1e9]\n").substr(0, 27),
              "bad_surface line 5 column 9");
    EXPECT_EQ(refused("control = \"a\" # \u00fc\nproperty = \"x\"; \n").substr(0, 23), "bad_surface line 3 colu");
    EXPECT_EQ(refused("control = \"a\"\nproperty = \"page\"\n"), "bad_surface line 1 column 1 step");
    EXPECT_EQ(refused("control = \"a\"\nproperty = \"preset\"\n"), "bad_surface line 1 column 1 preset");
    EXPECT_EQ(refused("colour = \"a\"\n"), "bad_surface line 2 column 1 colour");
}

TEST(SurfaceMap, OneRowForAControlAndAPage) {
    v1::MapControl change;
    change.mutable_row()->set_device("*");
    change.mutable_row()->set_control("fader 1");
    change.mutable_row()->set_property("master");
    v1::SetSurfaces rows = *mapped({}, change);
    change.mutable_row()->set_property("exposure");
    rows = *mapped(rows, change);
    ASSERT_EQ(rows.rows_size(), 1);
    EXPECT_EQ(rows.rows(0).property(), "exposure");
    change.mutable_row()->set_page(2);
    rows = *mapped(rows, change);
    EXPECT_EQ(rows.rows_size(), 2);
    change.set_remove(true);
    rows = *mapped(rows, change);
    EXPECT_EQ(rows.rows_size(), 1);
    const auto refused = mapped(rows, change);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "not_found");
}

constexpr const char* kQxi = R"(<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE InputProfile>
<InputProfile xmlns="http://www.qlcplus.org/InputProfile">
 <Creator><Name>x</Name></Creator>
 <Manufacturer>Behringer</Manufacturer>
 <Model>BCF2000</Model>
 <Channel Number="513"><Name>Fader 1</Name><Type>Slider</Type></Channel>
 <Channel Number="4609"><Name>Fader 2</Name><Type>Slider</Type></Channel>
 <Channel Number="16"><Name>Knob</Name><Type>Knob</Type><Movement Sensitivity="20">Relative</Movement></Channel>
 <Channel Number="144"><Name>Key</Name><Type>Button</Type><Feedback LowerValue="2" UpperValue="32"/></Channel>
 <Channel Number="175"><Name>Next</Name><Type>Next Page</Type></Channel>
 <Channel Number="530"><Name>Beat</Name><Type>Button</Type></Channel>
</InputProfile>)";

TEST(Qxi, MessagesKindsAndFeedbackInFullResolution) {
    const auto profile = read_qxi(kQxi);
    ASSERT_TRUE(profile) << profile.error().text();
    EXPECT_EQ(profile->name, "Behringer BCF2000");
    ASSERT_EQ(profile->controls.size(), 5u);
    EXPECT_EQ(midi_key_text(*profile->controls[1].input), "bend 2");
    EXPECT_EQ(profile->controls[1].steps, 16383u) << "QLC+ itself keeps 8 bits of these";
    EXPECT_EQ(profile->controls[1].show, ShowKind::motor);
    EXPECT_EQ(profile->controls[2].kind, ControlKind::relative);
    EXPECT_EQ(midi_key_text(*profile->controls[3].input), "note 1/16");
    EXPECT_EQ(profile->controls[3].on, 16);
    EXPECT_EQ(profile->controls[3].off, 1);
    ASSERT_EQ(profile->rows.size(), 3u);
    EXPECT_EQ(profile->rows[1].target(), "#2");
    EXPECT_EQ(profile->rows[2].property(), "page");
}

TEST(Qxi, RefusalsSayWhy) {
    EXPECT_EQ(read_qxi("no XML").error().code, "bad_surface");
    EXPECT_EQ(read_qxi("<Fixture/>").error().value, "Fixture");
    EXPECT_EQ(read_qxi("<InputProfile><Type>OSC</Type></InputProfile>").error().code, "unsupported");
    EXPECT_EQ(read_qxi("<InputProfile><Channel Number='70000'/></InputProfile>").error().value, "70000");
    EXPECT_EQ(read_qxi("<InputProfile/>").error().code, "bad_surface");
}

// Every input profile that QLC+ ships.
TEST(Qxi, TheProfilesOfQlcPlus) {
    const std::filesystem::path folder = "/usr/share/qlcplus/inputprofiles";
    if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "qlcplus-data is not installed";
    std::size_t files = 0, controls = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".qxi") continue;
        const auto profile = read_qxi(content(entry.path()));
        if (!profile && profile.error().code == "unsupported") continue;
        ASSERT_TRUE(profile) << entry.path() << ": " << profile.error().text();
        ++files;
        controls += profile->controls.size();
        for (const v1::SurfaceRow& row : profile->rows) EXPECT_TRUE(check_surface_row(row, "")) << entry.path();
    }
    EXPECT_GE(files, 20u);
    EXPECT_GE(controls, 2000u);
}

}  // namespace
}  // namespace gonio
