// Runs inside the virtual machine of run.py, as root: it is the boxes; the input code runs beside it as a plain user
// under the shipped udev rules.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/usb/gadget.h"
#include "tests/usb/user.h"

namespace gonio::test {
namespace {

constexpr const char* kBox = "1397:00bc:SN0042";

// A vendor's own reports: what its bytes mean stands in the table of the input code.
ByteVector vendor_descriptor(std::uint8_t bytes, std::uint8_t out_bytes = 1) {
    return {0x05, 0x0C, 0x09, 0x01, 0xA1,  0x01, 0x06, 0x00, 0xFF, 0x09, 0x01,      0x15, 0x00, 0x26, 0xFF,
            0x00, 0x75, 0x08, 0x95, bytes, 0x81, 0x02, 0x09, 0x02, 0x95, out_bytes, 0x91, 0x02, 0xC0};
}

Gadget& gadget() {
    static Gadget one;
    return one;
}

TEST(Guest, AHidBoxUnderTheShippedRuleTellsItsWheels) {
    User user;
    UhidDevice shuttle("Contour Design ShuttlePRO v2", "", 0x0b33, 0x0030, vendor_descriptor(5));
    const std::string identity = "0b33:0030";
    ASSERT_TRUE(user.device_is(identity, "hid", "live")) << user.error(identity, "hid");
    shuttle.report({0, 10, 0, 0, 0});
    EXPECT_TRUE(user.heard("shuttle", 0.5));
    for (std::uint8_t i = 11; i <= 60; ++i) shuttle.report({0, i, 0, 0, 0});
    EXPECT_TRUE(user.heard("jog", 50)) << "not one click is lost: " << user.last("jog");
    shuttle.report({7, 60, 0, 1, 0});
    EXPECT_TRUE(user.heard("shuttle", 1.0));
    EXPECT_TRUE(user.heard("button 1", 1));
}

// (A PowerMate has no hidraw node on Linux: the kernel's own driver for it comes first.)
TEST(Guest, AHidBoxIsShownItsLamp) {
    User user;
    UhidDevice keys("X-keys XK-24", "", 0x05f3, 0x0405, vendor_descriptor(6, 35));
    ASSERT_TRUE(user.device_is("05f3:0405", "hid", "live")) << user.error("05f3:0405", "hid");
    keys.report({0, 0, 1, 0, 0, 0});
    EXPECT_TRUE(user.heard("button 1", 1));
    user.show("05f3:0405", "button 8", 1.0);
    const ByteVector lamp = {181, 9, 1};
    for (int i = 0; i < 30; ++i) {  // the others are dark, and told so
        const ByteVector report = keys.output();
        if (std::search(report.begin(), report.end(), lamp.begin(), lamp.end()) != report.end()) return;
    }
    ADD_FAILURE() << "the lamp was not lit";
}

TEST(Guest, ABoxWithoutARuleIsNamedWithItsReason) {
    User user;
    UhidDevice stranger("Unlisted box", "SN1", 0x1209, 0x0001,
                        {0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x09, 0x36, 0x15, 0x00,
                         0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02, 0xC0});
    ASSERT_TRUE(user.device_is("1209:0001:SN1", "hid", "waiting"));
    EXPECT_EQ(user.error("1209:0001:SN1", "hid"),
              "there is no permission to use it; docs/faders.md has the udev rules");
}

TEST(Guest, AMotorBoxIn14BitsWithItsLampsAndMotors) {
    gadget().plug();
    User user;
    ASSERT_TRUE(user.device_is(kBox, "usb-midi", "live")) << user.error(kBox, "usb-midi");
    ASSERT_TRUE(user.device_is(kBox, "hid", "live")) << user.error(kBox, "hid");
    const ByteVector wake = {0xF0, 0x00, 0x00, 0x66, 0x14, 0x00, 0xF7};
    ByteVector got = gadget().midi_until(wake);
    EXPECT_NE(std::search(got.begin(), got.end(), wake.begin(), wake.end()), got.end()) << "the message that wakes it";
    for (const int raw : {0, 1, 8191, 12345, 16382, 16383}) {
        gadget().send_midi({0xE0, static_cast<std::uint8_t>(raw & 127), static_cast<std::uint8_t>(raw >> 7)});
        EXPECT_TRUE(user.heard("fader 1", raw / 16383.0)) << raw << " " << user.last("fader 1");
    }
    gadget().send_midi({0xB0, 16, 0x43});
    EXPECT_TRUE(user.heard("v-pot 1", -3));

    user.show(kBox, "fader 2", 0.25);
    const ByteVector motor = {0xE1, 0x00, 0x20};
    got = gadget().midi_until(motor);
    EXPECT_NE(std::search(got.begin(), got.end(), motor.begin(), motor.end()), got.end());
    user.show(kBox, "mute 3", 1);
    const ByteVector lamp = {0x90, 18, 127};
    got = gadget().midi_until(lamp);
    EXPECT_NE(std::search(got.begin(), got.end(), lamp.begin(), lamp.end()), got.end());

    ByteVector report(19);
    report[0] = 1;
    report[1] = 0xFF;
    report[2] = 0x01;
    gadget().send_report(report);
    EXPECT_TRUE(user.heard("slider 1", 511.0 / 1023)) << user.last("slider 1");
    user.show(kBox, "button 2", 1);
    EXPECT_EQ(gadget().output_report(), (ByteVector{2, 2, 0}));
}

TEST(Guest, AFaderInTheHandIsNotMoved) {
    User user;
    ASSERT_TRUE(user.device_is(kBox, "usb-midi", "live")) << user.error(kBox, "usb-midi");
    gadget().send_midi({0x90, 0x68, 0x7F, 0xE0, 0x00, 0x40});
    ASSERT_TRUE(user.heard("fader 1", 8192.0 / 16383));
    gadget().midi_within(200);
    user.show(kBox, "fader 1", 0.75);
    const ByteVector moved = gadget().midi_within(1000);
    EXPECT_EQ(std::find(moved.begin(), moved.end(), 0xE0), moved.end());
    gadget().send_midi({0x90, 0x68, 0x00});
    const ByteVector after = gadget().midi_until({0xE0, 0x7F, 0x5F});
    EXPECT_NE(std::find(after.begin(), after.end(), 0xE0), after.end());
}

// For a second it is sent again; then it is given up and the box painted anew.
TEST(Guest, WhatIsNotSentReachesTheBoxLater) {
    User user;
    ASSERT_TRUE(user.device_is(kBox, "usb-midi", "live")) << user.error(kBox, "usb-midi");
    const auto lit = [](const ByteVector& got, std::uint8_t note) {
        const ByteVector lamp = {0x90, note, 127};
        return std::search(got.begin(), got.end(), lamp.begin(), lamp.end()) != got.end();
    };
    gadget().midi_within(500);
    user.fail_output(true);
    user.show(kBox, "mute 2", 1);
    EXPECT_FALSE(lit(gadget().midi_within(300), 17));
    user.fail_output(false);
    EXPECT_TRUE(lit(gadget().midi_until({0x90, 17, 127}), 17));
    gadget().midi_within(200);
    user.fail_output(true);
    user.show(kBox, "mute 4", 1);
    EXPECT_FALSE(lit(gadget().midi_within(1500), 19));
    user.fail_output(false);
    const ByteVector anew = gadget().midi_within(1000);
    EXPECT_TRUE(lit(anew, 17)) << "all that it showed";
    EXPECT_TRUE(lit(anew, 19));
}

TEST(Guest, ASecondProgramIsRefusedWithAClearSentence) {
    User first;
    ASSERT_TRUE(first.device_is(kBox, "usb-midi", "live")) << first.error(kBox, "usb-midi");
    User second;
    ASSERT_TRUE(second.device_is(kBox, "usb-midi", "waiting"));
    EXPECT_EQ(second.error(kBox, "usb-midi"), "another program owns it; close that program");
    gadget().send_midi({0xE2, 0x7F, 0x7F});
    EXPECT_TRUE(first.heard("fader 3", 1.0)) << "the first goes on";
}

// The host's side of the box is a sound card too: the second way to it.
TEST(Guest, TheSameBoxAsARawPortOfAlsa) {
    for (int card = 0; card < 4; ++card) {
        std::ifstream file("/proc/asound/card" + std::to_string(card) + "/usbid");
        std::string id;
        if (std::getline(file, id) && id == "1397:00bc")
            chmod(("/dev/snd/midiC" + std::to_string(card) + "D0").c_str(), 0666);
    }
    User user(true);
    ASSERT_TRUE(user.device_is(kBox, "alsa-midi", "live")) << user.error(kBox, "alsa-midi");
    gadget().send_midi({0xE4, 0x34, 0x12});
    EXPECT_TRUE(user.heard("fader 5", (0x12 * 128 + 0x34) / 16383.0)) << user.last("fader 5");
    gadget().midi_within(200);
    user.show(kBox, "fader 6", 1.0);
    const ByteVector motor = {0xE5, 0x7F, 0x7F};
    const ByteVector got = gadget().midi_until(motor);
    EXPECT_NE(std::search(got.begin(), got.end(), motor.begin(), motor.end()), got.end());
    gadget().unplug();
    EXPECT_TRUE(user.device_is(kBox, "alsa-midi", "gone")) << user.error(kBox, "alsa-midi");
    gadget().plug();
}

TEST(Guest, PulledWhileItSpeaksPluggedAgainAndShownEverything) {
    User user;
    ASSERT_TRUE(user.device_is(kBox, "usb-midi", "live")) << user.error(kBox, "usb-midi");
    user.show(kBox, "mute 1", 1);
    const ByteVector lamp = {0x90, 16, 127};
    gadget().midi_until(lamp);
    for (int round = 0; round < 3; ++round) {
        for (int i = 0; i < 50; ++i) gadget().send_midi({0xE0, static_cast<std::uint8_t>(i), 0x10});
        gadget().unplug();
        EXPECT_TRUE(user.device_is(kBox, "usb-midi", "gone")) << "round " << round;
        EXPECT_TRUE(user.device_is(kBox, "hid", "gone")) << "round " << round;
        EXPECT_EQ(user.error(kBox, "usb-midi"), "it was unplugged");
        gadget().plug();
        ASSERT_TRUE(user.device_is(kBox, "usb-midi", "live"))
            << "round " << round << " " << user.error(kBox, "usb-midi");
        const ByteVector got = gadget().midi_until(lamp);
        EXPECT_NE(std::search(got.begin(), got.end(), lamp.begin(), lamp.end()), got.end()) << "round " << round;
        gadget().send_midi({0xE0, 0x05, static_cast<std::uint8_t>(round + 1)});
        EXPECT_TRUE(user.heard("fader 1", ((round + 1) * 128 + 5) / 16383.0)) << user.last("fader 1");
    }
    gadget().unplug();
    EXPECT_TRUE(user.device_is(kBox, "usb-midi", "gone"));
}

// The last test: afterwards nobody tells of plugging any more.
TEST(Guest, WithoutUdevdARescanFindsTheBox) {
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        std::ifstream file(entry.path() / "comm");
        std::string name;
        if (std::getline(file, name) && name == "systemd-udevd") kill(std::stoi(entry.path().filename()), SIGKILL);
    }
    User user;
    user.listen(300);
    gadget().plug();
    // Nobody sets the rights of the nodes either.
    const bool waits = user.device_is(kBox, "usb-midi", "waiting");
    EXPECT_TRUE(waits);
    EXPECT_NE(user.error(kBox, "usb-midi").find("no permission"), std::string::npos) << user.error(kBox, "usb-midi");
    for (const auto& entry : std::filesystem::recursive_directory_iterator("/dev/bus/usb"))
        if (entry.is_character_file()) chmod(entry.path().c_str(), 0666);
    ASSERT_TRUE(user.device_is(kBox, "usb-midi", "live")) << user.error(kBox, "usb-midi");
    gadget().send_midi({0xE0, 0x01, 0x00});
    EXPECT_TRUE(user.heard("fader 1", 1 / 16383.0));
    gadget().unplug();
    EXPECT_TRUE(user.device_is(kBox, "usb-midi", "gone"));
}

}  // namespace
}  // namespace gonio::test
