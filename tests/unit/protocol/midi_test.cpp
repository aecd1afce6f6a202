// MIDI by byte vectors: USB packets, raw streams, keys, boxes with 14-bit faders and every kind of endless encoder.
#include <gtest/gtest.h>

#include "protocol/surface/midi_surface.h"

namespace gonio {
namespace {

std::vector<MidiMessage> read(std::vector<std::uint8_t> bytes, std::size_t bad = 0) {
    std::vector<MidiMessage> messages;
    EXPECT_EQ(read_usb_midi(bytes, messages), bad);
    return messages;
}

TEST(UsbMidi, PacketsBecomeMessages) {
    // nanoKONTROL2, slider 3 at 120; pitch bend of channel 9; note on cable 2; program change; channel pressure.
    const auto messages = read({0x0B, 0xB0, 0x02, 0x78, 0x0E, 0xE8, 0x7F, 0x40, 0x29, 0x90,
                                0x68, 0x7F, 0x0C, 0xC3, 0x05, 0x00, 0x0D, 0xD0, 0x11, 0x00});
    const std::vector<MidiMessage> expected = {{0, 0xB0, {2, 0x78}},
                                               {0, 0xE8, {0x7F, 0x40}},
                                               {2, 0x90, {0x68, 0x7F}},
                                               {0, 0xC3, {5, 0}},
                                               {0, 0xD0, {0x11, 0}}};
    EXPECT_EQ(messages, expected);
    EXPECT_EQ(value_of(messages[1]), 0x40u << 7 | 0x7Fu);
}

TEST(UsbMidi, WhatIsNoChannelMessageIsSkippedAndNonsenseCounted) {
    EXPECT_TRUE(read({0x04, 0xF0, 0x00, 0x20, 0x07, 0x29, 0x02, 0xF7, 0x0F, 0xF8, 0, 0}).empty()) << "SysEx, clock";
    EXPECT_TRUE(read({0, 0, 0, 0, 0, 0, 0, 0}).empty()) << "padding";
    EXPECT_TRUE(read({0x0B, 0x90, 1, 2, 0x0B, 0xB0, 0x80, 1, 0x0B, 0xB0, 1, 0xFF, 0x01, 1, 2, 3}, 4).empty());
    EXPECT_EQ(read({0x0B, 0xB0, 0x02, 0x78, 0x0B, 0xB0}).size(), 1u) << "a cut packet at the end";
    EXPECT_TRUE(read({}).empty());
}

TEST(MidiStream, RunningStatusRealTimeAndSysEx) {
    MidiStream stream;
    std::vector<MidiMessage> messages;
    const std::uint8_t first[] = {0xB0, 7, 0xF8, 100, 7}, second[] = {101, 0xF0, 1, 2, 0xF7, 3, 0xE0, 1, 2, 0xC1, 9};
    EXPECT_EQ(stream.take(first, messages), 0u);
    EXPECT_EQ(stream.take(second, messages), 1u) << "data after a SysEx belongs to nothing";
    const std::vector<MidiMessage> expected = {
        {0, 0xB0, {7, 100}}, {0, 0xB0, {7, 101}}, {0, 0xE0, {1, 2}}, {0, 0xC1, {9, 0}}};
    EXPECT_EQ(messages, expected);
}

TEST(UsbMidi, MessagesAndSysExBecomePackets) {
    const std::uint8_t motor[] = {0xE3, 0x21, 0x40};
    EXPECT_EQ(usb_midi_packets(1, motor), (std::vector<std::uint8_t>{0x1E, 0xE3, 0x21, 0x40}));
    const std::uint8_t wake[] = {0xF0, 0, 0, 0x66, 0x14, 0, 0xF7};
    EXPECT_EQ(usb_midi_packets(0, wake), (std::vector<std::uint8_t>{4, 0xF0, 0, 0, 4, 0x66, 0x14, 0, 5, 0xF7, 0, 0}));
    const std::uint8_t even[] = {0xF0, 1, 0xF7};
    EXPECT_EQ(usb_midi_packets(0, even), (std::vector<std::uint8_t>{7, 0xF0, 1, 0xF7}));
}

MidiNews news_of(const std::vector<std::uint8_t>& bytes, std::vector<MidiMessage>* heard = nullptr) {
    MidiStream stream;
    std::vector<MidiMessage> messages;
    EXPECT_EQ(stream.take(bytes, messages), 0u);
    if (heard != nullptr) *heard = messages;
    return stream.take_news();
}

// MIDI Show Control 1.1: F0 7F device 02 format command number F7; lighting is 01, all types 7F, GO 01.
TEST(MidiSystem, AGoOfMidiShowControlIsACue) {
    using Cues = std::vector<std::string>;
    EXPECT_EQ(news_of({0xF0, 0x7F, 0x7F, 0x02, 0x01, 0x01, '2', 0xF7}).cues, Cues{"2"});
    EXPECT_EQ(news_of({0xF0, 0x7F, 0x7F, 0x02, 0x7F, 0x01, '1', '2', '.', '5', 0, '1', 0, '3', 0xF7}).cues,
              Cues{"12.5"})
        << "all types, list 1, path 3";
    EXPECT_EQ(news_of({0xF0, 0x7F, 0x7F, 0x02, 0x01, 0x01, 0xF7}).cues, Cues{"go"});
    const IgnoredKinds other_device = {{"sysex 7F 02 (MIDI Show Control, device 05, format 01, command 01)", 1}};
    const MidiNews other = news_of({0xF0, 0x7F, 0x05, 0x02, 0x01, 0x01, '2', 0xF7});
    EXPECT_TRUE(other.cues.empty());
    EXPECT_EQ(other.ignored, other_device);
    for (const std::vector<std::uint8_t>& none :
         std::vector<std::vector<std::uint8_t>>{{0xF0, 0x7F, 0x7F, 0x02, 0x10, 0x01, '2', 0xF7},            // sound
                                                {0xF0, 0x7F, 0x7F, 0x02, 0x01, 0x02, '2', 0xF7},            // STOP
                                                {0xF0, 0x7F, 0x7F, 0x02, 0x01, 0x01, '1', '.', '.', 0xF7},  // no number
                                                {0xF0, 0x7F, 0x7F, 0x02, 0x01, 0x01, '0', 0xF7},
                                                {0xF0, 0x7F, 0x7F, 0x02, 0xF7}}) {
        const MidiNews news = news_of(none);
        EXPECT_TRUE(news.cues.empty());
        EXPECT_EQ(news.ignored.size(), 1u);
    }
}

TEST(MidiSystem, WhatIsNotUnderstoodIsCountedByItsKind) {
    const MidiNews news = news_of({0xF0, 0x7F, 0x7F, 0x06, 0x02, 0xF7, 0xF0, 0x7F, 0x7F, 0x06, 0x01, 0xF7, 0xF8, 0xFE,
                                   0xF2, 0x01, 0x02, 0xF3, 0x05, 0xFA, 0xF0, 0x00, 0x20, 0x29, 0x02, 0xF7, 0xF0, 0x41,
                                   0x10, 0xF7, 0xF0, 0x7E, 0x7F, 0x06, 0x02, 0xF7, 0xF0, 0x01, 0x90, 60,   0});
    const IgnoredKinds expected = {{"sysex 7F 06 (MIDI Machine Control)", 2},
                                   {"song position", 1},
                                   {"song select", 1},
                                   {"start", 1},
                                   {"sysex 00 20 29 (of a manufacturer)", 1},
                                   {"sysex 41 (of a manufacturer)", 1},
                                   {"sysex 7E 06 (general information)", 1},
                                   {"sysex that does not end", 1}};
    EXPECT_EQ(news.ignored, expected);
    std::vector<std::uint8_t> many;
    for (int i = 1; i < 100; ++i) many.insert(many.end(), {0xF0, static_cast<std::uint8_t>(i), 0xF7});
    many.insert(many.end(), 1, 0xF0);
    many.insert(many.end(), 100'000, 0x11);
    many.push_back(0xF7);
    const MidiNews bounded = news_of(many);
    EXPECT_EQ(bounded.ignored.size(), kMaxIgnoredKinds);
    // 99 kinds, and the one of 100,000 bytes is of the manufacturer 11 like one of them.
    EXPECT_EQ(bounded.ignored.at("others"), 99u - (kMaxIgnoredKinds - 1) + 1);
}

// Worlde Easypad.12 (qlcplus PR 1520): its slider sends F0 7F 7F 04 01 00 vv F7.
TEST(MidiSystem, TheMasterVolumeIsAControl) {
    std::vector<MidiMessage> heard;
    EXPECT_TRUE(news_of({0xF0, 0x7F, 0x7F, 0x04, 0x01, 0x00, 0x40, 0xF7, 0xB0, 7, 1}, &heard).empty());
    ASSERT_EQ(heard.size(), 2u);
    EXPECT_EQ(heard[0], (MidiMessage{0, kVolume, {0x00, 0x40}}));
    EXPECT_EQ(midi_key_text(key_of(heard[0])), "volume *");
    EXPECT_EQ(parse_midi_keys("volume *")->front(), key_of(heard[0]));
    for (const char* bad : {"volume", "volume 1", "volume */7"}) EXPECT_FALSE(parse_midi_keys(bad)) << bad;
    const std::vector<MidiMessage> usb = [] {
        std::vector<MidiMessage> messages;
        MidiSystem system;
        read_usb_midi(std::vector<std::uint8_t>{0x14, 0xF0, 0x7F, 0x7F, 0x14, 0x04, 0x01, 0x03, 0x16, 0x40, 0xF7, 0},
                      messages, &system);
        return messages;
    }();
    EXPECT_EQ(usb, (std::vector<MidiMessage>{{1, kVolume, {0x03, 0x40}}}));
    EXPECT_EQ(midi_message(key_of(heard[0]), 0x40u << 7 | 3u),
              (std::vector<std::uint8_t>{0xF0, 0x7F, 0x7F, 0x04, 0x01, 0x03, 0x40, 0xF7}));
}

TEST(MidiKeys, TextBothWays) {
    const auto keys = parse_midi_keys("cc 1/0-2, bend 9, port 2: note */60");
    ASSERT_TRUE(keys);
    std::vector<std::string> texts;
    for (const MidiKey& key : *keys) texts.push_back(midi_key_text(key));
    EXPECT_EQ(texts, (std::vector<std::string>{"cc 1/0", "cc 1/1", "cc 1/2", "bend 9", "port 2: note */60"}));
    for (const char* bad :
         {"", "cc", "cc 1", "cc 17/0", "cc 1/128", "bend 1/2", "cc 1/7-3", "cc 1/0,", "cc 0/1", "fader 1"}) {
        const auto refused = parse_midi_keys(bad);
        ASSERT_FALSE(refused) << bad;
        EXPECT_EQ(refused.error().code, "bad_surface");
    }
}

SurfaceProfile profile_with(ControlSpec spec) {
    SurfaceProfile profile;
    profile.controls.push_back(std::move(spec));
    return profile;
}

ControlSpec control(const char* input, ControlKind kind, std::uint32_t steps = 127) {
    ControlSpec spec;
    spec.name = "one";
    spec.kind = kind;
    spec.steps = steps;
    spec.input = spec.output = parse_midi_keys(input)->front();
    return spec;
}

double value_of_message(MidiSurface& box, MidiMessage message, std::int64_t now_ns = 1) {
    std::vector<ControlEvent> events;
    EXPECT_TRUE(box.take(message, now_ns, events));
    return events.empty() ? -99 : events.back().value;
}

TEST(MidiSurface, APitchBendKeepsAll14Bits) {
    MidiSurface box(profile_with(control("bend 1", ControlKind::absolute, 16383)));
    EXPECT_EQ(value_of_message(box, {0, 0xE0, {0x7F, 0x7F}}), 1.0);
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, 0xE0, {1, 0}}), 1.0 / 16383);
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, 0xE0, {0, 0x40}}), 8192.0 / 16383);
}

// A box of 7 bits reaches both ends, and one of 14 bits keeps them all.
TEST(MidiSurface, TheMasterVolumeHas7Or14Bits) {
    MidiSurface box{SurfaceProfile{}};
    EXPECT_EQ(value_of_message(box, {0, kVolume, {0, 0x7F}}), 1.0);
    EXPECT_EQ(value_of_message(box, {0, kVolume, {0, 0}}), 0.0);
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, kVolume, {0, 64}}), 64.0 / 127);
    ASSERT_EQ(box.controls().size(), 1u);
    EXPECT_EQ(box.controls()[0].name, "volume *");
    EXPECT_EQ(box.controls()[0].steps, 127u);
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, kVolume, {1, 64}}), (64 * 128 + 1) / 16383.0);
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, kVolume, {0, 65}}), 65 * 128 / 16383.0) << "it has 14 bits";
    EXPECT_EQ(value_of_message(box, {0, kVolume, {0x7F, 0x7F}}), 1.0);
}

TEST(MidiSurface, AControllerPairWaitsForItsFineHalf) {
    ControlSpec spec = control("cc 1/7", ControlKind::absolute, 16383);
    spec.pair = true;
    MidiSurface box(profile_with(spec));
    std::vector<ControlEvent> events;
    box.take({0, 0xB0, {7, 0x40}}, 1000, events);
    EXPECT_TRUE(events.empty()) << "the fine half may follow";
    EXPECT_EQ(box.due_ns(), 1000 + MidiSurface::kPairWait_ns);
    box.take({0, 0xB0, {39, 0x03}}, 2000, events);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_DOUBLE_EQ(events[0].value, (0x40 * 128 + 3) / 16383.0);
    box.take({0, 0xB0, {39, 0x04}}, 3000, events);
    ASSERT_EQ(events.size(), 2u) << "a fine half alone is a movement";
    EXPECT_DOUBLE_EQ(events[1].value, (0x40 * 128 + 4) / 16383.0);
    box.take({0, 0xB0, {7, 0x41}}, 4000, events);
    box.tick(4000 + MidiSurface::kPairWait_ns - 1, events);
    EXPECT_EQ(events.size(), 2u);
    box.tick(4000 + MidiSurface::kPairWait_ns, events);
    ASSERT_EQ(events.size(), 3u) << "a box that sends no fine halves";
    EXPECT_DOUBLE_EQ(events[2].value, 0x41 * 128 / 16383.0);
    EXPECT_EQ(box.due_ns(), 0);
}

TEST(MidiSurface, EveryCodeOfClicks) {
    const auto clicks = [](RelativeCode code, std::uint8_t value) {
        ControlSpec spec = control("cc 1/16", ControlKind::relative);
        spec.code = code;
        MidiSurface box(profile_with(spec));
        return value_of_message(box, {0, 0xB0, {16, value}});
    };
    EXPECT_EQ(clicks(RelativeCode::sign_bit, 0x03), 3) << "Mackie: bit 6 is the sign";
    EXPECT_EQ(clicks(RelativeCode::sign_bit, 0x42), -2);
    EXPECT_EQ(clicks(RelativeCode::twos_complement, 0x7F), -1);
    EXPECT_EQ(clicks(RelativeCode::twos_complement, 0x02), 2);
    EXPECT_EQ(clicks(RelativeCode::offset_64, 0x3E), -2);
    EXPECT_EQ(clicks(RelativeCode::offset_64, 0x41), 1);
}

TEST(MidiSurface, TouchLampsRingsAndMotors) {
    ControlSpec spec = control("bend 2", ControlKind::absolute, 16383);
    spec.touch = parse_midi_keys("note 1/105")->front();
    spec.show = ShowKind::motor;
    MidiSurface box(profile_with(spec));
    std::vector<ControlEvent> events;
    box.take({0, 0x90, {105, 127}}, 1, events);
    box.take({0, 0x90, {105, 0}}, 2, events);
    ASSERT_EQ(events.size(), 2u);
    EXPECT_EQ(events[0].what, ControlEvent::What::touched);
    EXPECT_EQ(events[0].value, 1);
    EXPECT_EQ(events[1].value, 0);
    EXPECT_EQ(box.show(0, 0.5), (std::vector<std::uint8_t>{0xE1, 0x00, 0x40}));
    EXPECT_EQ(box.show(0, 1.0), (std::vector<std::uint8_t>{0xE1, 0x7F, 0x7F}));

    spec = control("note 1/16", ControlKind::button, 0);
    spec.show = ShowKind::lamp;
    EXPECT_EQ(MidiSurface(profile_with(spec)).show(0, 1), (std::vector<std::uint8_t>{0x90, 16, 127}));
    EXPECT_EQ(MidiSurface(profile_with(spec)).show(0, 0), (std::vector<std::uint8_t>{0x90, 16, 0}));
    spec = control("cc 1/16", ControlKind::relative);
    spec.output = parse_midi_keys("cc 1/48")->front();
    spec.show = ShowKind::ring_mcu;
    EXPECT_EQ(MidiSurface(profile_with(spec)).show(0, 1), (std::vector<std::uint8_t>{0xB0, 48, 0x2B}));
}

TEST(MidiSurface, UnknownMessagesBecomeControlsUpToABound) {
    MidiSurface box({});
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, 0xB4, {10, 127}}), 1.0);
    EXPECT_EQ(box.controls()[0].name, "cc 5/10");
    EXPECT_DOUBLE_EQ(value_of_message(box, {0, 0x80, {60, 64}}), 0.0) << "a note-off is a button let go";
    EXPECT_EQ(box.controls()[1].kind, ControlKind::button);
    std::vector<ControlEvent> events;
    for (unsigned channel = 0; channel < 8; ++channel)
        for (unsigned n = 0; n < 128; ++n)
            box.take({0, static_cast<std::uint8_t>(0xB0 | channel), {static_cast<std::uint8_t>(n), 1}}, 1, events);
    EXPECT_EQ(box.controls().size(), kMaxSurfaceControls);
    EXPECT_FALSE(box.take({1, 0xB0, {0, 1}}, 1, events));
}

}  // namespace
}  // namespace gonio
