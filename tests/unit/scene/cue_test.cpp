// The list of cues and what plays it, with a clock of its own: the expected values are those of fades by hand.
#include "server/scene/cue.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/cue_player.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "tests/unit/second.h"

namespace gonio {
namespace {

TEST(CueNumbers, AreExactThousandths) {
    EXPECT_EQ(parse_cue_number("1"), 1000u);
    EXPECT_EQ(parse_cue_number("0.001"), 1u);
    EXPECT_EQ(parse_cue_number("9999.999"), 9'999'999u);
    EXPECT_EQ(parse_cue_number("7.250"), 7250u);
    EXPECT_EQ(parse_cue_number(".5"), 500u);
    EXPECT_EQ(parse_cue_number("12."), 12'000u);
    for (const char* bad :
         {"", ".", "0", "0.000", "10000", "1.0001", "-1", "+1", "1e3", "1,5", " 1", "1 ", "1.2.3", "a"})
        EXPECT_FALSE(parse_cue_number(bad)) << bad;
    EXPECT_EQ(print_cue_number(7250), "7.25");
    EXPECT_EQ(print_cue_number(1), "0.001");
    EXPECT_EQ(print_cue_number(12'000), "12");
    EXPECT_EQ(print_cue_number(0), "");
}

class Cues : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        scene = scene_of(*asset);
        light_name = scene.lights[0].name;
    }
    Light& light(std::size_t i = 0) { return scene.lights[i]; }
    double level() { return light().level_ratio; }
    static std::int64_t ns(double at_s) { return std::llround(at_s * kSecond); }

    std::string apply_now(const v1::Command& command) {
        const auto applied = apply(scene, command, {});
        return applied ? "ok" : applied.error().code + " " + applied.error().where;
    }
    void set_level(double to, const std::string& name = "") {
        v1::Command command;
        command.mutable_set_light()->set_name(name.empty() ? light_name : name);
        command.mutable_set_light()->set_level_ratio(to);
        ASSERT_EQ(apply_now(command), "ok");
    }
    v1::CueEdit edit(const std::string& number, double up_s = 5, double down_s = 5) {
        v1::CueEdit cue;
        cue.set_number(number);
        cue.set_up_s(up_s);
        cue.set_down_s(down_s);
        return cue;
    }
    std::string add(const v1::CueEdit& cue) {
        v1::Command command;
        *command.mutable_add_cue() = cue;
        return apply_now(command);
    }
    // A cue of that level of the first light; the scene is then as it was.
    void add_level(const v1::CueEdit& cue, double to) {
        const double before = level();
        set_level(to);
        ASSERT_EQ(add(cue), "ok");
        set_level(before);
    }
    std::string play(const v1::Command& command, double at_s) {
        const auto refused = player.run(scene, command, ns(at_s));
        return refused ? refused->code : "ok";
    }
    std::string go(double at_s) {
        v1::Command command;
        command.mutable_cue_go();
        return play(command, at_s);
    }
    std::string stop(double at_s) {
        v1::Command command;
        command.mutable_cue_stop();
        return play(command, at_s);
    }
    std::string back(double at_s) {
        v1::Command command;
        command.mutable_cue_back();
        return play(command, at_s);
    }
    std::string go_to(const std::string& number, double at_s, std::optional<double> time_s = {}) {
        v1::Command command;
        command.mutable_cue_goto()->set_number(number);
        if (time_s) command.mutable_cue_goto()->set_time_s(*time_s);
        return play(command, at_s);
    }
    double level_at(double at_s) {
        player.advance(scene, ns(at_s));
        return level();
    }
    std::string active() { return print_cue_number(scene.cue_active); }
    std::string next() { return print_cue_number(scene.cue_next); }

    Scene scene;
    std::string light_name;
    CuePlayer player;
};

TEST_F(Cues, SortByNumber) {
    for (const char* number : {"10", "2", "1.11", "1.1", "0.5", "9999.999", "2.5"}) ASSERT_EQ(add(edit(number)), "ok");
    std::string order;
    const v1::State state = full_state(scene);
    for (const v1::Cue& cue : state.cues().cues()) order += cue.number() + " ";
    EXPECT_EQ(order, "0.5 1.1 1.11 2 2.5 10 9999.999 ");
    EXPECT_EQ(next(), "0.5");
}

TEST_F(Cues, EveryRefusalNamesCodeAndField) {
    ASSERT_EQ(add(edit("1")), "ok");
    EXPECT_EQ(add(edit("1")), "already_exists add_cue.number");
    EXPECT_EQ(add(edit("0")), "invalid_argument add_cue.number");
    EXPECT_EQ(add(edit("2", -1)), "invalid_argument add_cue.up_s");
    EXPECT_EQ(add(edit("2", 5, 3601)), "invalid_argument add_cue.down_s");
    v1::CueEdit both = edit("2");
    both.set_follow_s(1);
    both.set_hang_s(1);
    EXPECT_EQ(add(both), "conflict add_cue.hang_s");
    v1::CueEdit timed = edit("2");
    timed.set_timecode("25:00:00:00");
    EXPECT_EQ(add(timed), "invalid_argument add_cue.timecode");
    v1::CueEdit preset = edit("2");
    preset.set_preset("none");
    EXPECT_EQ(add(preset), "not_found add_cue.preset");
    v1::CueEdit label = edit("2");
    label.set_label(std::string(129, 'x'));
    EXPECT_EQ(add(label), "invalid_argument add_cue.label");
    v1::Command command;
    *command.mutable_set_cue() = edit("3");
    EXPECT_EQ(apply_now(command), "not_found set_cue.number");
    *command.mutable_set_cue() = edit("1");
    command.mutable_set_cue()->set_manual(true);
    command.mutable_set_cue()->set_hang_s(1);
    EXPECT_EQ(apply_now(command), "conflict set_cue.manual");
    command.mutable_remove_cue()->set_number("3");
    EXPECT_EQ(apply_now(command), "not_found remove_cue.number");
    command.mutable_set_cue_options()->set_guard_s(6);
    EXPECT_EQ(apply_now(command), "invalid_argument set_cue_options.guard_s");
    command.mutable_set_cue_options()->Clear();
    command.mutable_set_cue_options()->set_timecode("ltc");
    EXPECT_EQ(apply_now(command), "invalid_argument set_cue_options.timecode");
    EXPECT_EQ(go_to("3", 0), "not_found");
    EXPECT_EQ(go_to("1", 0, -1), "invalid_argument");
    EXPECT_EQ(back(0), "not_found");
    EXPECT_EQ(scene.cues->size(), 1u);
    EXPECT_EQ(active(), "");
}

TEST_F(Cues, AThousandAndNoMore) {
    for (int i = 1; i <= 1000; ++i) ASSERT_EQ(add(edit(std::to_string(i))), "ok");
    EXPECT_EQ(add(edit("1000.5")), "too_many_cues add_cue.number");
}

TEST_F(Cues, SettingFollowEndsHangAndManualEndsBoth) {
    v1::CueEdit cue = edit("1");
    cue.set_hang_s(3);
    ASSERT_EQ(add(cue), "ok");
    v1::Command command;
    command.mutable_set_cue()->set_number("1");
    command.mutable_set_cue()->set_follow_s(2);
    ASSERT_EQ(apply_now(command), "ok");
    EXPECT_EQ(find_cue(scene, 1000)->follow_s, 2.0);
    EXPECT_FALSE(find_cue(scene, 1000)->hang_s);
    command.mutable_set_cue()->clear_follow_s();
    command.mutable_set_cue()->set_manual(true);
    ASSERT_EQ(apply_now(command), "ok");
    EXPECT_FALSE(find_cue(scene, 1000)->follow_s);
    EXPECT_EQ(find_cue(scene, 1000)->up_s, 5.0) << "what the command does not say stays";
}

// Level 0 to 1 in 4 s; at 1 s GO to 0 in 2 s: 0.25, 0.125, 0.
TEST_F(Cues, AGoDuringAFadeStartsFromWhereItIs) {
    set_level(0);
    add_level(edit("1", 4, 4), 1);
    add_level(edit("2", 2, 2), 0);
    ASSERT_EQ(go(0), "ok");
    EXPECT_DOUBLE_EQ(level_at(0.5), 0.125);
    ASSERT_EQ(go(1), "ok");
    EXPECT_DOUBLE_EQ(level(), 0.25);
    EXPECT_NEAR(level_at(2), 0.125, 1e-12);
    EXPECT_GT(level_at(2.999), 0);
    EXPECT_EQ(level_at(3), 0);
    EXPECT_FALSE(player.fading());
    EXPECT_FALSE(player.running(ns(3)));
}

// Frames come when they like: where the fade is at a GO is told by the clock, not by the last frame.
TEST_F(Cues, FramesDoNotMatter) {
    set_level(0);
    add_level(edit("1", 4, 4), 1);
    add_level(edit("2", 2, 2), 0);
    ASSERT_EQ(go(0), "ok");
    ASSERT_EQ(go(1), "ok");
    EXPECT_NEAR(level_at(2), 0.125, 1e-12);
}

TEST_F(Cues, TimeUpIsOfLevelsThatRiseAndTimeDownOfThoseThatFall) {
    v1::Command twice;
    twice.mutable_add_light()->mutable_light()->set_name("b");
    twice.mutable_add_light()->set_like(light_name);
    ASSERT_EQ(apply_now(twice), "ok");
    set_level(0);
    set_level(1, "b");
    set_level(1);
    set_level(0, "b");
    v1::CueEdit cue = edit("1", 4, 2);
    cue.set_delay_up_s(1);
    cue.set_delay_down_s(2);
    ASSERT_EQ(add(cue), "ok");
    set_level(0);
    set_level(1, "b");
    ASSERT_EQ(go(0), "ok");
    EXPECT_DOUBLE_EQ(level_at(1), 0);
    EXPECT_DOUBLE_EQ(level_at(2), 0.25);
    EXPECT_DOUBLE_EQ(light(1).level_ratio, 1) << "its delay is over just now";
    EXPECT_DOUBLE_EQ(level_at(3), 0.5);
    EXPECT_DOUBLE_EQ(light(1).level_ratio, 0.5);
    EXPECT_DOUBLE_EQ(level_at(4), 0.75);
    EXPECT_DOUBLE_EQ(light(1).level_ratio, 0);
    EXPECT_DOUBLE_EQ(level_at(5), 1);
    EXPECT_FALSE(player.running(ns(5)));
}

// What has the same target goes on in its own time: colour 4 s, while the level turns round in 1 s.
TEST_F(Cues, WhatHasNoNewTargetEndsInItsOwnTime) {
    const auto colour = [&](double red) {
        v1::Command command;
        command.mutable_set_light()->set_name(light_name);
        for (const double one : {red, 1.0, 1.0}) command.mutable_set_light()->add_color_rgb(one);
        ASSERT_EQ(apply_now(command), "ok");
    };
    colour(0);
    set_level(1);
    ASSERT_EQ(add(edit("1", 4, 4)), "ok");
    set_level(0.5);
    ASSERT_EQ(add(edit("2", 1, 1)), "ok");
    colour(1);
    set_level(0);
    ASSERT_EQ(go(0), "ok");
    ASSERT_EQ(go(1), "ok");
    level_at(2);
    EXPECT_DOUBLE_EQ(level(), 0.5) << "from 0.25 in 1 s";
    EXPECT_DOUBLE_EQ(light().color.x, 0.5) << "half of 4 s";
    level_at(4);
    EXPECT_DOUBLE_EQ(light().color.x, 0);
}

// Cue 5 s with hang 2 starts the next at 7 s, with follow 2 at 2 s.
TEST_F(Cues, FollowCountsFromGoAndHangFromCompletion) {
    for (const bool follow : {true, false}) {
        SetUp();
        player = CuePlayer();
        set_level(0);
        v1::CueEdit first = edit("1", 5, 5);
        follow ? first.set_follow_s(2) : first.set_hang_s(2);
        add_level(first, 1);
        add_level(edit("2", 10, 10), 0);
        const double due = follow ? 2 : 7;
        ASSERT_EQ(go(0), "ok");
        EXPECT_EQ(player.next_ns(), ns(due));
        level_at(due - 0.001);
        EXPECT_EQ(active(), "1");
        // The frame is late; the cue is not.
        level_at(due + 1);
        EXPECT_EQ(active(), "2");
        EXPECT_EQ(next(), "");
        EXPECT_NEAR(level(), follow ? 0.4 * 0.9 : 0.9, 1e-12) << "1 s of 10 s down from where it was";
        EXPECT_FALSE(player.next_ns());
    }
}

TEST_F(Cues, ManyCuesFollowWithinOneFrame) {
    set_level(0);
    for (int i = 1; i <= 20; ++i) {
        v1::CueEdit cue = edit(std::to_string(i), 0, 0);
        cue.set_follow_s(0.1);
        add_level(cue, i / 20.0);
    }
    ASSERT_EQ(go(0), "ok");
    EXPECT_DOUBLE_EQ(level(), 0.05);
    EXPECT_DOUBLE_EQ(level_at(1.05), 0.55) << "the eleventh began at 1.0 s";
    EXPECT_DOUBLE_EQ(level_at(60), 1);
    EXPECT_EQ(active(), "20");
}

TEST_F(Cues, AStopHoldsAGoGoesOn) {
    set_level(0);
    v1::CueEdit first = edit("1", 4, 4);
    first.set_follow_s(8);
    add_level(first, 1);
    add_level(edit("2", 0, 0), 0);
    ASSERT_EQ(go(0), "ok");
    ASSERT_EQ(stop(1), "ok");
    EXPECT_DOUBLE_EQ(level_at(50), 0.25);
    EXPECT_TRUE(player.playback(scene, ns(50)).held());
    EXPECT_DOUBLE_EQ(player.playback(scene, ns(50)).progress_ratio(), 0.25);
    EXPECT_FALSE(player.next_ns()) << "its follow waits too";
    ASSERT_EQ(go(51), "ok");
    EXPECT_EQ(active(), "1") << "it went on, no other began";
    EXPECT_NEAR(level_at(52), 0.5, 1e-9);
    EXPECT_DOUBLE_EQ(level_at(54), 1);
    EXPECT_EQ(player.next_ns(), ns(58));
}

TEST_F(Cues, ASecondStopGoesBackInTheBackTime) {
    set_level(0);
    add_level(edit("1", 0, 0), 0.5);
    add_level(edit("2", 4, 4), 1);
    v1::Command options;
    options.mutable_set_cue_options()->set_back_s(2);
    ASSERT_EQ(apply_now(options), "ok");
    ASSERT_EQ(go(0), "ok");
    ASSERT_EQ(go(1), "ok");
    ASSERT_EQ(stop(3), "ok");
    EXPECT_DOUBLE_EQ(level(), 0.75);
    ASSERT_EQ(stop(4), "ok");
    EXPECT_EQ(active(), "1");
    EXPECT_EQ(next(), "2");
    EXPECT_DOUBLE_EQ(level_at(5), 0.625);
    EXPECT_DOUBLE_EQ(level_at(6), 0.5);
    EXPECT_EQ(stop(7), "ok") << "nothing runs";
    EXPECT_FALSE(player.playback(scene, ns(7)).held());
    EXPECT_EQ(active(), "1") << "and nothing changes";
}

TEST_F(Cues, BackGoesToTheOneBeforeAndRunsNoFollow) {
    set_level(0);
    v1::CueEdit first = edit("1", 5, 5);
    first.set_follow_s(1);
    add_level(first, 0.5);
    add_level(edit("2", 0, 0), 1);
    ASSERT_EQ(go_to("2", 0), "ok");
    ASSERT_EQ(back(1), "ok");
    EXPECT_DOUBLE_EQ(level_at(1.5), 0.75) << "half of the 1 s of BACK";
    EXPECT_DOUBLE_EQ(level_at(10), 0.5);
    EXPECT_EQ(active(), "1");
    EXPECT_EQ(next(), "2");
    EXPECT_EQ(back(11), "not_found") << "it is the first one";
}

TEST_F(Cues, ASecondGoWithinTheGuardIsRefused) {
    for (const char* number : {"1", "2", "3"}) ASSERT_EQ(add(edit(number)), "ok");
    ASSERT_EQ(go(10), "ok");
    EXPECT_EQ(go(10.199), "too_soon");
    EXPECT_EQ(active(), "1");
    const auto refused = player.run(
        scene,
        [] {
            v1::Command command;
            command.mutable_cue_go();
            return command;
        }(),
        ns(10.1));
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->where, "cue_go");
    EXPECT_NE(refused->message.find("0.2 s"), std::string::npos) << refused->message;
    EXPECT_EQ(go(10.2), "ok") << "a refused GO does not count";
    EXPECT_EQ(active(), "2");
    v1::Command options;
    options.mutable_set_cue_options()->set_guard_s(0);
    ASSERT_EQ(apply_now(options), "ok");
    EXPECT_EQ(go(10.201), "ok");
    EXPECT_EQ(go(11), "not_found") << "there is no next one";
}

TEST_F(Cues, GotoWithATimeOfZeroIsThereAtOnce) {
    set_level(0);
    v1::CueEdit slow = edit("7", 100, 100);
    slow.set_delay_up_s(50);
    add_level(slow, 1);
    ASSERT_EQ(go_to("7", 0, 0.0), "ok");
    EXPECT_EQ(level(), 1);
    EXPECT_FALSE(player.running(ns(0)));
    EXPECT_DOUBLE_EQ(player.playback(scene, 0).progress_ratio(), 1);
}

TEST_F(Cues, ManySkippedCuesLeaveNothingBehind) {
    set_level(0);
    for (int i = 1; i <= 50; ++i) add_level(edit(std::to_string(i), i, i), i / 50.0);
    ASSERT_EQ(go(0), "ok");
    ASSERT_EQ(go_to("50", 0.5), "ok");
    EXPECT_EQ(active(), "50");
    EXPECT_EQ(next(), "");
    EXPECT_DOUBLE_EQ(level_at(60), 1) << "its own time, 50 s, and not that of those before";
}

TEST_F(Cues, AssertBringsTheActiveCueAboutAgain) {
    set_level(0.2);
    ASSERT_EQ(add(edit("1", 2, 2)), "ok");
    ASSERT_EQ(add(edit("2", 2, 2)), "ok");
    ASSERT_EQ(go(0), "ok");
    set_level(1);
    v1::Command again;
    again.mutable_cue_assert();
    ASSERT_EQ(play(again, 5), "ok");
    EXPECT_DOUBLE_EQ(level_at(6), 0.6);
    EXPECT_DOUBLE_EQ(level_at(7), 0.2);
    EXPECT_EQ(next(), "2") << "the pointer stays";
}

TEST_F(Cues, WhatAnotherHandMovesLeavesTheFadeUntilTheNextCue) {
    set_level(0);
    add_level(edit("1", 4, 4), 1);
    add_level(edit("2", 4, 4), 0);
    ASSERT_EQ(go(0), "ok");
    level_at(1);
    set_level(0.8);
    EXPECT_DOUBLE_EQ(level_at(2), 0.8);
    EXPECT_FALSE(player.fading());
    ASSERT_EQ(go(3), "ok");
    EXPECT_DOUBLE_EQ(level_at(5), 0.4) << "from where the hand left it";
}

TEST_F(Cues, ACueThatIsRemovedWhileItRunsEndsItsFadeAndFollowsNoMore) {
    set_level(0);
    v1::CueEdit first = edit("1", 4, 4);
    first.set_follow_s(2);
    add_level(first, 1);
    add_level(edit("2", 0, 0), 0);
    add_level(edit("3", 0, 0), 0.5);
    ASSERT_EQ(go(0), "ok");
    v1::Command remove;
    remove.mutable_remove_cue()->set_number("1");
    ASSERT_EQ(apply_now(remove), "ok");
    EXPECT_DOUBLE_EQ(level_at(3), 0.75);
    EXPECT_DOUBLE_EQ(level_at(10), 1);
    EXPECT_EQ(next(), "2");
    remove.mutable_remove_cue()->set_number("2");
    ASSERT_EQ(apply_now(remove), "ok");
    EXPECT_EQ(next(), "3") << "the next one after it";
    ASSERT_EQ(go(11), "ok");
    EXPECT_DOUBLE_EQ(level(), 0.5);
}

TEST_F(Cues, ASceneThatIsLoadedWhileACueRunsEndsIt) {
    set_level(0);
    v1::CueEdit first = edit("1", 4, 4);
    first.set_follow_s(2);
    add_level(first, 1);
    add_level(edit("2", 0, 0), 0.5);
    ASSERT_EQ(go(0), "ok");
    ASSERT_EQ(stop(1), "ok");
    v1::Command load;
    load.mutable_load_scene()->set_file("cornell");
    Loaded loaded;
    loaded.asset = scene.asset;
    ASSERT_TRUE(apply(scene, load, loaded));
    EXPECT_EQ(level_at(2), 1) << "as the file has it";
    EXPECT_EQ(level_at(10), 1);
    EXPECT_EQ(active(), "");
    EXPECT_EQ(next(), "1") << "the list stays, and begins anew";
    ASSERT_EQ(go(11), "ok");
    EXPECT_FALSE(player.playback(scene, ns(11)).held());
}

TEST_F(Cues, ARenamedLightStaysInItsCueAndInItsFade) {
    set_level(0);
    add_level(edit("1", 4, 4), 1);
    add_level(edit("2", 4, 4), 0);
    ASSERT_EQ(go(0), "ok");
    level_at(1);
    v1::Command rename;
    rename.mutable_rename_light()->set_name(light_name);
    rename.mutable_rename_light()->set_new_name("new");
    ASSERT_EQ(apply_now(rename), "ok");
    EXPECT_DOUBLE_EQ(level_at(2), 0.5);
    ASSERT_EQ(go(4), "ok");
    EXPECT_DOUBLE_EQ(level_at(6), 0.5);
    EXPECT_EQ((*find_cue(scene, 1000)->content)[0].name, "new");
}

TEST_F(Cues, ALightThatIsRemovedLeavesAndOneThatIsUnknownStays) {
    v1::Command twice;
    twice.mutable_add_light()->mutable_light()->set_name("b");
    twice.mutable_add_light()->set_like(light_name);
    set_level(0);
    add_level(edit("1", 4, 4), 1);
    ASSERT_EQ(apply_now(twice), "ok");
    set_level(0.3, "b");
    ASSERT_EQ(go(0), "ok");
    level_at(1);
    EXPECT_DOUBLE_EQ(light(1).level_ratio, 0.3);
    v1::Command remove;
    remove.mutable_remove_light()->set_name(light_name);
    ASSERT_EQ(apply_now(remove), "ok");
    player.advance(scene, ns(2));
    EXPECT_FALSE(player.fading());
    EXPECT_EQ(scene.lights.size(), 1u);
}

TEST_F(Cues, APresetsContentIsTakenOnce) {
    v1::Command save;
    save.mutable_save_preset()->set_name("look");
    set_level(0.4);
    ASSERT_EQ(apply_now(save), "ok");
    v1::CueEdit cue = edit("1", 0, 0);
    cue.set_preset("look");
    ASSERT_EQ(add(cue), "ok");
    set_level(0.9);
    ASSERT_EQ(apply_now(save), "ok");
    ASSERT_EQ(go(0), "ok");
    EXPECT_DOUBLE_EQ(level(), 0.4);
    v1::Command again;
    again.mutable_set_cue()->set_number("1");
    again.mutable_set_cue()->set_preset("look");
    ASSERT_EQ(apply_now(again), "ok");
    ASSERT_EQ(go_to("1", 1), "ok");
    EXPECT_DOUBLE_EQ(level(), 0.9);
    set_level(0.1);
    again.mutable_set_cue()->clear_preset();
    again.mutable_set_cue()->set_record(true);
    ASSERT_EQ(apply_now(again), "ok");
    EXPECT_DOUBLE_EQ((*find_cue(scene, 1000)->content)[0].level_ratio, 0.1);
}

// The cue that grew out of another is there as far as it had come.
TEST_F(Cues, AJumpOfTimeCodeIsInTheMiddleOfAFade) {
    set_level(1);
    add_level(edit("1", 0, 0), 0);
    add_level(edit("2", 4, 4), 1);
    player.jump(scene, 1000, 2000, ns(99), ns(100));
    EXPECT_DOUBLE_EQ(level(), 0.25);
    EXPECT_EQ(active(), "2");
    EXPECT_DOUBLE_EQ(level_at(101), 0.5);
    player.jump(scene, 0, 1000, ns(90), ns(102));
    EXPECT_DOUBLE_EQ(level(), 0);
    EXPECT_FALSE(player.fading());
}

TEST_F(Cues, ProgressAndCountdown) {
    set_level(0);
    v1::CueEdit first = edit("1", 4, 2);
    first.set_hang_s(3);
    add_level(first, 1);
    ASSERT_EQ(add(edit("2")), "ok");
    ASSERT_EQ(go(10), "ok");
    const v1::CuePlayback playback = player.playback(scene, ns(11));
    EXPECT_EQ(playback.active(), "1");
    EXPECT_EQ(playback.next(), "2");
    EXPECT_TRUE(playback.running());
    EXPECT_DOUBLE_EQ(playback.progress_ratio(), 0.25);
    EXPECT_DOUBLE_EQ(playback.remaining_s(), 3);
    EXPECT_DOUBLE_EQ(playback.next_in_s(), 6);
}

}  // namespace
}  // namespace gonio
