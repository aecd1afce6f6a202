// The device side's small decisions and its files: replays, ways to a box, retries, shipped profiles; the CLI's words
// and table.
#include <gtest/gtest.h>

#include "client/cli/commands.h"
#include "client/cli/surfaces.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/surface.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"
#include "server/session/surface_input.h"
#include "server/surfaces/control_surfaces.h"
#include "server/surfaces/replay.h"
#include "server/surfaces/surface_profiles.h"

namespace gonio {
namespace {

TEST(Replay, LinesTimesAndRefusals) {
    const auto replay = read_replay("# a box\nmidi 0944:0117 nano KONTROL2\n0.5 B0 02 78\n\n1 B0 02 79 # on\n");
    ASSERT_TRUE(replay) << replay.error().text();
    EXPECT_EQ(replay->surface.identity, "0944:0117@replay");
    EXPECT_EQ(replay->surface.product, "nano KONTROL2");
    ASSERT_EQ(replay->lines.size(), 2u);
    EXPECT_EQ(replay->lines[0].at_ns, 500'000);
    EXPECT_EQ(replay->lines[1].bytes, (std::vector<std::uint8_t>{0xB0, 2, 0x79}));
    const auto hid = read_replay("hid 1209:0001 Box / 05 01 09 04\n");
    ASSERT_TRUE(hid);
    EXPECT_EQ(hid->surface.descriptor.size(), 4u);
    const auto where = [](const char* text) { return read_replay(text).error().where; };
    EXPECT_EQ(where("keyboard 1:2 x\n"), "line 1");
    EXPECT_EQ(where("midi 0944:0117 x\n1 B0 0\n"), "line 2");
    EXPECT_EQ(where("midi 0944:0117 x\n1\n"), "line 2");
    EXPECT_EQ(where("midi 0944:0117 x\n2 B0\n1 B0\n"), "line 3");
    EXPECT_EQ(where("midi 0944:0117 x\nnan B0\n"), "line 2");
    EXPECT_FALSE(read_replay(""));
}

TEST(Boxes, TheWaysToABox) {
    using Midi = SurfaceOptions::Midi;
    using Ways = std::vector<std::string>;
    EXPECT_EQ(transports_of(Midi::automatic, true), (Ways{"usb-midi", "alsa-midi"})) << "a fader box is ours";
    EXPECT_EQ(transports_of(Midi::automatic, false), (Ways{"alsa-midi", "usb-midi"})) << "others are shared";
    EXPECT_EQ(transports_of(Midi::usb, false), (Ways{"usb-midi"}));
    EXPECT_EQ(transports_of(Midi::alsa, true), (Ways{"alsa-midi"}));
}

TEST(Boxes, RetriesGrowFrom50MsToASecond) {
    Retry retry;
    std::vector<std::int64_t> waits_ms;
    for (int i = 0; i < 7; ++i) {
        retry.failed(0);
        waits_ms.push_back(retry.next_ns / 1'000'000);
    }
    EXPECT_EQ(waits_ms, (std::vector<std::int64_t>{50, 100, 200, 400, 800, 1000, 1000}));
}

TEST(Boxes, IdentityIsTheSerialNumberOrThePort) {
    EXPECT_EQ(surface_identity(0x944, 0x117, "SN 1", "1-2"), "0944:0117:SN 1");
    EXPECT_EQ(surface_identity(0x944, 0x117, "", "1-2.3"), "0944:0117@1-2.3");
    EXPECT_EQ(surface_identity(0x944, 0x117, "000000", "1-2"), "0944:0117@1-2") << "a number that all of them have";
    EXPECT_EQ(surface_identity(0x944, 0x117, "", ""), "0944:0117");
}

TEST(Boxes, ShippedProfilesAreCompiledIn) {
    const auto profiles = SurfaceProfiles::load({});
    ASSERT_TRUE(profiles) << profiles.error().text();
    EXPECT_EQ(profiles->find("0944:0117", "").name, "Korg nanoKONTROL2");
    EXPECT_EQ(profiles->find("1397:00b3", "").name, "Behringer X-Touch Mini");
    EXPECT_EQ(profiles->find("ffff:ffff", "no such box").name, "");
    const auto refused = SurfaceProfiles::load({{"1234:5678", "/nowhere/x.toml"}});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "not_found");
}

SurfaceUpdates::Heard heard(const char* device, const char* control, ControlKind kind, double value, double clicks,
                            unsigned presses, std::int64_t t_ns) {
    SurfaceUpdates::Heard result;
    result.input.device = device;
    result.input.control = control;
    result.input.kind = kind;
    result.input.value = value;
    result.input.clicks = clicks;
    result.input.presses = presses;
    result.event_ns = t_ns;
    return result;
}

TEST(SurfaceUpdates, TheNewestValueAllClicksAndTheFirstTime) {
    const std::pair<std::string, std::string> fader{"box", "fader"}, knob{"box", "knob"}, other{"other", "fader"};
    SurfaceUpdates updates, later, anew;
    updates.controls[fader] = heard("box", "fader", ControlKind::absolute, 0.25, 0, 0, 10);
    updates.controls[other] = heard("other", "fader", ControlKind::absolute, 0.5, 0, 0, 11);
    later.controls[fader] = heard("box", "fader", ControlKind::button, 0.75, 2, 1, 20);
    later.controls[knob] = heard("box", "knob", ControlKind::relative, 0, 3, 0, 21);
    updates.add(later);
    updates.add(later);
    EXPECT_EQ(updates.controls.at(fader).input.value, 0.75);
    EXPECT_EQ(updates.controls.at(fader).input.kind, ControlKind::button) << "as it is now";
    EXPECT_EQ(updates.controls.at(fader).input.presses, 2u);
    EXPECT_EQ(updates.controls.at(fader).event_ns, 10) << "of the first";
    EXPECT_EQ(updates.controls.at(knob).input.clicks, 6);
    anew.attached = {"box"};
    anew.controls[knob] = heard("box", "knob", ControlKind::relative, 0, 1, 0, 30);
    updates.add(anew);
    EXPECT_FALSE(updates.controls.contains(fader)) << "what the box said before it came anew is gone";
    EXPECT_EQ(updates.controls.at(knob).input.clicks, 1);
    EXPECT_TRUE(updates.controls.contains(other));
    EXPECT_EQ(updates.attached, std::vector<std::string>{"box"});
}

// A button saves a preset in the frame in which a fader moves: the preset has the fader's level.
// What MIDI says beside its channels: cues go on, the rest is told by its kind.
TEST(SurfaceConnections, TellWhatTheyDoNotUnderstand) {
    FoundSurface found;
    found.identity = "1234:0001@replay";
    found.transport = "replay";
    found.path = "replay midi";
    auto made = SurfaceConnection::make(found, {});
    ASSERT_TRUE(made);
    SurfaceConnection& box = **made;
    SurfaceUpdates updates;
    MidiNews news;
    news.cues = {"2", "go"};
    news.ignored = {{"sysex 7F 06 (MIDI Machine Control)", 2}};
    box.take_system(news, 1, updates);
    box.take_midi({}, 3, 1, updates);
    EXPECT_EQ(updates.cues, news.cues);
    v1::SurfaceDevice row;
    box.describe(row);
    EXPECT_EQ(row.events(), 2u);
    EXPECT_EQ(row.ignored(), 5u);
    ASSERT_EQ(row.not_understood_size(), 2);
    EXPECT_EQ(row.not_understood(0).kind(), "bytes of no message");
    EXPECT_EQ(row.not_understood(0).count(), 3u);
    EXPECT_EQ(row.not_understood(1).kind(), "sysex 7F 06 (MIDI Machine Control)");

    SurfaceUpdates waiting;
    for (int i = 0; i < 100; ++i) {
        SurfaceUpdates later;
        later.cues = {std::to_string(i)};
        waiting.add(std::move(later));
    }
    EXPECT_EQ(waiting.cues.size(), kMaxMidiCues);
    EXPECT_EQ(waiting.cues.back(), std::to_string(kMaxMidiCues - 1));

    v1::Surfaces surfaces;
    row.set_device("1234:0001@replay");
    row.set_state("live");
    *surfaces.add_devices() = row;
    EXPECT_NE(surfaces_table(surfaces).find("not understood: 2 x sysex 7F 06 (MIDI Machine Control)"),
              std::string::npos);
}

TEST(SurfaceInput, ASavedPresetHoldsWhatWasSetBefore) {
    auto asset = load_scene("cornell");
    ASSERT_TRUE(asset);
    SessionOutputs outputs;
    outputs.reply = [](std::uint32_t, v1::ServerMessage) {};
    outputs.state = [](v1::State, v1::StateChanged) {};
    outputs.picture = [](Picture) {};
    Queue<Work> queue{10};
    Loader loader;
    RenderSession session(std::make_unique<NullRenderer>(), scene_of(*asset), "null", queue, loader,
                          std::move(outputs));
    const auto level = [&](double ratio) {
        SurfaceAction action;
        action.kind = SurfaceAction::Kind::set;
        action.value.target = session.scene().lights[0].name;
        action.value.value = {ratio};
        return action;
    };
    SurfaceAction save;
    save.kind = SurfaceAction::Kind::save_preset;
    save.value.name = "look";
    const SurfaceAction actions[] = {level(0.25), save, level(0.75)};
    carry_out(session, actions);
    EXPECT_EQ(session.scene().lights[0].level_ratio, 0.75);
    EXPECT_EQ(session.scene().presets.at("look")->at(0).level_ratio, 0.25);
}

TEST(LearnWords, WhatIsLearned) {
    const auto words = [](std::vector<std::string> list) -> Result<LearnWords> {
        list.insert(list.begin(), "learn");
        const ReadWords read = read_command_line(list);
        if (read.fault) return *read.fault;
        return learn_request(read);
    };
    EXPECT_FALSE(words({})->row);
    const auto pan = words({"key", "pan", "--range", "-90,90", "--curve", "s", "--page", "2"});
    ASSERT_TRUE(pan) << pan.error().text();
    EXPECT_EQ(pan->row->target(), "key");
    EXPECT_NEAR(pan->row->low(), -1.5707963, 1e-6) << "degrees are people's";
    EXPECT_EQ(pan->row->page(), 2u);
    EXPECT_EQ(words({"master"})->row->property(), "master");
    const auto preset = words({"preset", "look 1", "--fade", "2"});
    EXPECT_EQ(preset->row->preset(), "look 1");
    EXPECT_EQ(preset->row->fade_s(), 2);
    EXPECT_EQ(words({"key", "brightness"}).error().code, "usage");
    EXPECT_EQ(words({"a", "b", "c"}).error().code, "usage");
    EXPECT_EQ(words({"key", "level", "--range", "1"}).error().code, "usage");
}

TEST(SurfacesTable, BoxesControlsAndWhatTheyDrive) {
    v1::Surfaces surfaces;
    v1::SurfaceDevice& box = *surfaces.add_devices();
    box.set_device("0944:0117@1-2");
    box.set_product("nanoKONTROL2");
    box.set_state("live");
    box.set_transport("usb-midi");
    v1::SurfaceControl& slider = *box.add_controls();
    slider.set_name("slider 1");
    slider.set_kind("absolute");
    slider.set_steps(127);
    slider.set_heard(true);
    slider.set_value(0.5);
    v1::SurfaceDevice& other = *surfaces.add_devices();
    other.set_device("1397:00bc:SN1");
    other.set_state("waiting");
    other.set_error("another program owns it; close that program");
    v1::SurfaceRow& row = *surfaces.add_rows();
    row.set_device("0944:0117");
    row.set_control("slider 1");
    row.set_target("key");
    row.set_property("pan");
    row.set_low(-1.5707963267948966);
    surfaces.set_latency_ms(12.5);
    const std::string text = surfaces_table(surfaces);
    EXPECT_NE(text.find("key pan, -90 to 270"), std::string::npos) << text;
    EXPECT_NE(text.find("0.5000"), std::string::npos) << text;
    EXPECT_NE(text.find("waiting, another program owns it"), std::string::npos) << text;
    EXPECT_NE(text.find("12.5 ms"), std::string::npos) << text;
    EXPECT_NE(surfaces_table({}).find("no fader box"), std::string::npos);
}

}  // namespace
}  // namespace gonio
