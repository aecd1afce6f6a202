// From hands to values: soft takeover, curves, deadband, smoothing, clicks, buttons, pages; and what a box is shown.
#include <gtest/gtest.h>

#include <cmath>

#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_map.h"
#include "protocol/surface/surface_painter.h"
#include "protocol/surface/surface_reader.h"

namespace gonio {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

v1::SurfaceRow drives(const char* control, const char* target, const char* property) {
    v1::SurfaceRow row;
    row.set_device("*");
    row.set_control(control);
    row.set_target(target);
    row.set_property(property);
    return row;
}

// A scene of numbers: what the reader sets is there at once.
class Reader : public testing::Test {
protected:
    Reader() {
        values = {{"key/level", 0.5}, {"fill/level", 0.25}, {"key/pan", 0.0}, {"/orbit", 0.0}, {"/master", 1.0}};
    }
    static std::string key(const std::string& target, Property property) {
        return target + "/" + std::string(row_of(property).name);
    }
    void with(std::vector<v1::SurfaceRow> rows) {
        for (const v1::SurfaceRow& row : rows) {
            const auto checked = check_surface_row(row, "");
            ASSERT_TRUE(checked) << checked.error().text();
        }
        reader = SurfaceReader(rows, {"key", "fill"});
    }
    ValueNow now() {
        return [this](const std::string& target, Property property) -> std::optional<double> {
            const auto found = values.find(key(target, property));
            if (found == values.end()) return std::nullopt;
            return found->second;
        };
    }
    // Result: how many actions there were.
    std::size_t carry_out(const std::vector<SurfaceAction>& actions) {
        for (const SurfaceAction& action : actions)
            if (action.kind == SurfaceAction::Kind::set && !row_of(action.value.property).by_name)
                values[key(action.value.target, action.value.property)] = action.value.value[0];
        done.insert(done.end(), actions.begin(), actions.end());
        return actions.size();
    }
    std::size_t take(ControlInput input, std::int64_t at_ms) {
        input.device = "0944:0117@1-2";
        std::vector<SurfaceAction> actions;
        reader.take(input, at_ms * kMillisecond, now(), actions);
        return carry_out(actions);
    }
    // Of 14 bits unless said otherwise: then nothing is smoothed.
    std::size_t fader(double value, std::int64_t at_ms, std::uint32_t steps = 16383, bool motor = false) {
        ControlInput input;
        input.control = "fader";
        input.steps = steps;
        input.motor = motor;
        input.value = value;
        return take(input, at_ms);
    }
    std::size_t button(unsigned presses, double value = 0) {
        ControlInput input;
        input.control = "button";
        input.kind = ControlKind::button;
        input.presses = presses;
        input.value = value;
        return take(input, 0);
    }
    std::size_t knob(double clicks, std::int64_t at_ms = 0) {
        ControlInput input;
        input.control = "knob";
        input.kind = ControlKind::relative;
        input.clicks = clicks;
        return take(input, at_ms);
    }
    std::size_t step(std::int64_t at_ms) {
        std::vector<SurfaceAction> actions;
        reader.step(at_ms * kMillisecond, now(), actions);
        return carry_out(actions);
    }
    double level() { return values["key/level"]; }

    SurfaceReader reader;
    std::map<std::string, double> values;
    std::vector<SurfaceAction> done;
};

TEST_F(Reader, AFaderIsPickedUpWhereItMeetsTheValue) {
    with({drives("fader", "key", "level")});
    EXPECT_EQ(fader(0.5, 0), 0u) << "the first value only says where it stands";
    EXPECT_EQ(fader(0.52, 1000), 1u) << "near the value";
    EXPECT_DOUBLE_EQ(level(), 0.52);
    EXPECT_EQ(fader(0.8, 2000), 1u) << "it has the value: any way is its own";
}

TEST_F(Reader, AFaderFarAwayDoesNothingUntilItCrosses) {
    with({drives("fader", "key", "level")});
    fader(0.0, 0);
    EXPECT_EQ(fader(0.2, 1000), 0u);
    EXPECT_EQ(fader(0.4, 2000), 0u);
    EXPECT_EQ(fader(0.7, 3000), 1u) << "past 0.5 in one step";
    EXPECT_DOUBLE_EQ(level(), 0.7);
}

TEST_F(Reader, AnotherHandTakesTheValueAwayUnlessTheFaderIsInFastMotion) {
    with({drives("fader", "key", "level")});
    fader(0.45, 0);
    fader(0.5, 1000);
    values["key/level"] = 0.1;
    EXPECT_EQ(fader(0.9, 1049), 1u) << "within 50 ms it is the same movement";
    values["key/level"] = 0.1;
    EXPECT_EQ(fader(0.95, 1100), 0u);
    EXPECT_DOUBLE_EQ(level(), 0.1);
    EXPECT_EQ(fader(0.05, 1200), 1u) << "and it crosses";
}

TEST_F(Reader, MotorFadersAndJumpNeedNoPickup) {
    with({drives("fader", "key", "level")});
    EXPECT_EQ(fader(0.9, 0, 16383, true), 1u);
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_takeover("jump");
    with({row});
    EXPECT_EQ(fader(0.1, 0), 1u);
    EXPECT_DOUBLE_EQ(level(), 0.1);
}

TEST_F(Reader, All14BitsArrive) {
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_takeover("jump");
    with({row});
    for (const int raw : {0, 1, 8191, 8192, 16382, 16383}) {
        fader(raw / 16383.0, raw);
        EXPECT_DOUBLE_EQ(level(), raw / 16383.0);
    }
}

TEST_F(Reader, TheDeadbandHidesNoiseButNeverTheEnds) {
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_takeover("jump");
    row.set_deadband_ratio(0.01);
    with({row});
    fader(0.5, 0);
    EXPECT_EQ(fader(0.505, 1), 0u);
    EXPECT_EQ(fader(0.495, 2), 0u);
    EXPECT_EQ(fader(0.52, 3), 1u);
    fader(0.995, 4);
    EXPECT_EQ(fader(1.0, 5), 1u);
}

TEST_F(Reader, SmoothingHides128StepsAndEndsOnTheValue) {
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_takeover("jump");
    with({row});
    values["key/level"] = 0.0;
    EXPECT_EQ(fader(1.0, 0, 127), 0u);
    EXPECT_TRUE(reader.moving());
    double last = 0, largest = 0;
    for (int at_ms = 1; at_ms <= 500 && reader.moving(); ++at_ms) {
        step(at_ms);
        largest = std::max(largest, level() - last);
        last = level();
        if (at_ms == 25) {
            EXPECT_NEAR(level(), 1 - std::exp(-1.0), 1e-6) << "a first-order lag of 25 ms";
        }
    }
    EXPECT_FALSE(reader.moving());
    EXPECT_DOUBLE_EQ(level(), 1.0);
    EXPECT_LT(largest, 0.05);
    // A movement in steps of 1/127 leaves in steps that are finer.
    values["key/level"] = 0.0;
    last = 0;
    std::vector<double> seen;
    for (int raw = 0; raw <= 10; ++raw) {
        fader(raw / 127.0, 1000 + raw * 16, 127);
        for (int i = 0; i < 4; ++i) {
            step(1000 + raw * 16 + i * 4);
            seen.push_back(level());
        }
    }
    for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_LT(seen[i] - seen[i - 1], 0.4 / 127);
}

TEST_F(Reader, AHandElsewhereEndsTheSmoothing) {
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_takeover("jump");
    row.set_smooth_s(1);
    with({row});
    fader(1.0, 0, 127);
    step(10);
    values["key/level"] = 0.2;
    step(200);
    EXPECT_FALSE(reader.moving());
    EXPECT_DOUBLE_EQ(level(), 0.2);
}

TEST_F(Reader, CurvesHaveTrueInverses) {
    for (const char* curve : {"linear", "square", "cube", "s"}) {
        EXPECT_DOUBLE_EQ(curve_of(curve, 0), 0) << curve;
        EXPECT_DOUBLE_EQ(curve_of(curve, 1), 1) << curve;
        for (double v = 0; v <= 1; v += 1.0 / 64) EXPECT_NEAR(position_of(curve, curve_of(curve, v)), v, 1e-9) << curve;
    }
    EXPECT_DOUBLE_EQ(curve_of("square", 0.5), 0.25);
    EXPECT_DOUBLE_EQ(curve_of("s", 0.5), 0.5);
}

TEST_F(Reader, ARangeMayRunBackwardsAndTheCurveIsUndoneForPickup) {
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_low(1);
    row.set_high(0);
    row.set_curve("square");
    with({row});
    const double at = std::sqrt(0.5);  // where the fader stands for 0.5
    fader(at + 0.01, 0);
    EXPECT_EQ(fader(at + 0.015, 1000), 1u);
    EXPECT_NEAR(level(), 1 - (at + 0.015) * (at + 0.015), 1e-12);
}

TEST_F(Reader, ClicksMoveFromWhereTheValueIs) {
    v1::SurfaceRow row = drives("knob", "key", "level");
    row.set_smooth_s(0);
    with({row});
    knob(3);
    EXPECT_DOUBLE_EQ(level(), 0.5 + 3.0 / 128);
    values["key/level"] = 0.9;
    knob(-1);
    EXPECT_DOUBLE_EQ(level(), 0.9 - 1.0 / 128);
    knob(1000);
    EXPECT_DOUBLE_EQ(level(), 1.0);
    row = drives("knob", "", "orbit");
    row.set_smooth_s(0);
    row.set_step(0.25);
    with({row});
    knob(3);
    EXPECT_NEAR(values["/orbit"], -std::numbers::pi / 2, 1e-12) << "round and round";
}

TEST_F(Reader, SmoothedClicksAddUp) {
    with({drives("knob", "key", "level")});
    for (int i = 0; i < 8; ++i) knob(1, i);
    for (int i = 10; i < 600; i += 16) step(i);
    EXPECT_DOUBLE_EQ(level(), 0.5 + 8.0 / 128);
}

TEST_F(Reader, ACentredControlIsASpeed) {
    v1::SurfaceRow row = drives("fader", "key", "level");
    row.set_mode("rate");
    row.set_step(0.2);
    with({row});
    fader(0.75, 0);  // half deflection: 0.1 a second
    step(500);
    EXPECT_NEAR(level(), 0.55, 1e-9);
    fader(0.5, 600);
    EXPECT_FALSE(reader.moving());
    fader(0.51, 700);
    EXPECT_FALSE(reader.moving()) << "the middle is not exact";
}

TEST_F(Reader, ButtonsToggleFlashAndSet) {
    with({drives("button", "key", "level")});
    button(1, 1);
    EXPECT_DOUBLE_EQ(level(), 1.0) << "0.5 is not on";
    button(0, 0);
    EXPECT_DOUBLE_EQ(level(), 1.0);
    button(1, 0);
    EXPECT_DOUBLE_EQ(level(), 0.0) << "pressed and let go since the last look";
    values["key/level"] = 0.3;
    v1::SurfaceRow row = drives("button", "key", "level");
    row.set_mode("flash");
    with({row});
    button(1, 1);
    EXPECT_DOUBLE_EQ(level(), 1.0);
    button(0, 0);
    EXPECT_DOUBLE_EQ(level(), 0.3);
    EXPECT_EQ(button(1, 0), 2u) << "a short press is not lost";
    row.set_mode("set");
    row.set_high(0.6);
    with({row});
    button(1, 1);
    EXPECT_DOUBLE_EQ(level(), 0.6);
}

TEST_F(Reader, AHeldFlashGoesBackWhereThePageTurnsAndWhereHandsLetGo) {
    values["key/level"] = 0.3;
    v1::SurfaceRow flash = drives("button", "#1", "level"), next = drives("fader", "", "page");
    flash.set_mode("flash");
    flash.set_stride(1);
    next.set_control("page");
    next.set_step(1);
    with({flash, next});
    button(1, 1);
    EXPECT_DOUBLE_EQ(level(), 1.0);
    ControlInput turn;
    turn.control = "page";
    turn.kind = ControlKind::button;
    turn.presses = 1;
    take(turn, 0);
    EXPECT_EQ(reader.page(), 2u);
    EXPECT_DOUBLE_EQ(values["key/level"], 0.3);
    with({flash});
    button(1, 1);
    std::vector<SurfaceAction> actions;
    reader.let_go(actions);
    ASSERT_EQ(actions.size(), 1u);
    EXPECT_DOUBLE_EQ(actions[0].value.value[0], 0.3);
    actions.clear();
    reader.let_go(actions);
    EXPECT_TRUE(actions.empty()) << "once";
}

TEST_F(Reader, ButtonsPlayCues) {
    v1::SurfaceRow row = drives("button", "", "cue");
    row.set_cue("go");
    with({row});
    button(1, 1);
    button(0, 0);
    ASSERT_EQ(done.size(), 1u) << "letting go does nothing";
    EXPECT_EQ(done[0].kind, SurfaceAction::Kind::cue);
    EXPECT_EQ(done[0].value.name, "go");
    EXPECT_EQ(button(2, 0), 2u) << "two presses: the guard decides";
    row.set_cue("12.5");
    with({row});
    button(1, 1);
    EXPECT_EQ(done.back().value.name, "12.5");
    EXPECT_EQ(reader.shown("x", "button", now(), "", "12.5"), 1.0) << "it is active";
    EXPECT_EQ(reader.shown("x", "button", now(), "", "12"), 0.0);
    for (const char* bad : {"", "halt", "0", "1.2345"}) {
        row.set_cue(bad);
        EXPECT_EQ(check_surface_row(row, "").error().where, "cue") << bad;
    }
    row = drives("fader", "key", "level");
    row.set_cue("go");
    EXPECT_EQ(check_surface_row(row, "").error().where, "cue");
}

TEST_F(Reader, PresetsAreRecalledAndSaved) {
    v1::SurfaceRow row = drives("button", "", "preset");
    row.set_preset("look 1");
    row.set_fade_s(2);
    with({row});
    button(1, 1);
    ASSERT_EQ(done.size(), 1u);
    EXPECT_EQ(done[0].kind, SurfaceAction::Kind::set);
    EXPECT_EQ(done[0].value.name, "look 1");
    EXPECT_DOUBLE_EQ(done[0].value.value[0], 2);
    EXPECT_EQ(reader.shown("x", "button", now(), "look 1"), 1.0);
    EXPECT_EQ(reader.shown("x", "button", now(), "look 2"), 0.0);
    row.set_mode("save");
    with({row});
    button(1, 1);
    EXPECT_EQ(done.back().kind, SurfaceAction::Kind::save_preset);
}

// Another map, or another box: a fader that had its value has it still, and what is new must be picked up.
TEST_F(Reader, ARowThatStaysKeepsItsHand) {
    with({drives("fader", "key", "level")});
    fader(0.5, 0);
    EXPECT_EQ(fader(0.51, 100), 1u) << "picked up";
    reader.change_rows(std::vector{drives("other", "fill", "level"), drives("fader", "key", "level")});
    EXPECT_EQ(fader(0.9, 1000), 1u) << "it goes on";
    EXPECT_DOUBLE_EQ(values["key/level"], 0.9);
    reader.change_rows(std::vector{drives("fader", "fill", "level")});
    EXPECT_EQ(fader(0.8, 2000), 0u) << "another target is picked up anew";
    EXPECT_DOUBLE_EQ(values["fill/level"], 0.25);
}

// Learned for a preset, a fader is a button that is pressed as it goes up over the middle.
TEST_F(Reader, AFaderRecallsAPreset) {
    v1::SurfaceRow row = drives("fader", "", "preset");
    row.set_preset("warm");
    with({row});
    EXPECT_EQ(fader(0.9, 0), 0u) << "where it stands says nothing";
    EXPECT_EQ(fader(0.2, 100), 0u);
    EXPECT_EQ(fader(0.6, 200), 1u);
    ASSERT_EQ(done.size(), 1u);
    EXPECT_EQ(done[0].value.name, "warm");
    EXPECT_EQ(fader(0.8, 300), 0u) << "once";
    EXPECT_EQ(fader(0.1, 400), 0u);
    EXPECT_EQ(fader(1.0, 500), 1u) << "and again";
}

TEST_F(Reader, ProfilesAreChosenByPositionOrByPressing) {
    v1::SurfaceRow row = drives("fader", "key", "profile");
    for (const char* name : {"downlight", "flood", "bulb"}) row.add_profiles(name);
    with({row});
    fader(0.0, 0);
    fader(0.2, 1);
    fader(0.5, 2);
    fader(1.0, 3);
    std::vector<std::string> names;
    for (const SurfaceAction& action : done) names.push_back(action.value.name);
    EXPECT_EQ(names, (std::vector<std::string>{"downlight", "flood", "bulb"}));
    row.set_control("button");
    with({row});
    for (int i = 0; i < 4; ++i) button(1, 1);
    EXPECT_EQ(done.back().value.name, "downlight") << "round";
}

TEST_F(Reader, PagesMoveWhatIsDrivenAndAskForANewPickup) {
    v1::SurfaceRow level_row = drives("fader", "#1", "level"), next = drives("button", "", "page");
    level_row.set_stride(1);
    next.set_step(1);
    with({level_row, next});
    fader(0.5, 0);
    fader(0.5, 1000);
    EXPECT_EQ(fader(0.6, 2000), 1u);
    button(1, 1);
    EXPECT_EQ(reader.page(), 2u);
    EXPECT_EQ(fader(0.61, 2020), 0u) << "the second light is at 0.25";
    EXPECT_EQ(fader(0.2, 4000), 1u);
    EXPECT_DOUBLE_EQ(values["fill/level"], 0.2);
    EXPECT_DOUBLE_EQ(level(), 0.6);
    button(1, 1);
    EXPECT_EQ(fader(0.9, 5000), 0u) << "there is no third light";
    v1::SurfaceRow here = drives("fader", "key", "level"), there = drives("fader", "fill", "level");
    here.set_page(1);
    there.set_page(2);
    with({here, there});
    EXPECT_DOUBLE_EQ(*reader.shown("x", "fader", now(), ""), 0.6);
    reader.turn_to(2);
    EXPECT_DOUBLE_EQ(*reader.shown("x", "fader", now(), ""), 0.2);
}

TEST_F(Reader, BoxesAreToldApart) {
    EXPECT_TRUE(means_box("*", "0944:0117@1-2"));
    EXPECT_TRUE(means_box("0944:0117", "0944:0117@1-2"));
    EXPECT_TRUE(means_box("0944:0117", "0944:0117:SN1"));
    EXPECT_TRUE(means_box("0944:0117:SN1", "0944:0117:SN1"));
    EXPECT_FALSE(means_box("0944:0117:SN1", "0944:0117:SN12"));
    EXPECT_FALSE(means_box("0944", "0944:0117:SN12"));
    EXPECT_FALSE(means_box("09e8:0031", "0944:0117:SN12"));
}

class Painter : public testing::Test {
protected:
    Painter() {
        ControlSpec motor, lamp, ring;
        motor.steps = 16383;
        motor.show = ShowKind::motor;
        motor.touch = MidiKey{};
        lamp.kind = ControlKind::button;
        lamp.show = ShowKind::lamp;
        ring.steps = 127;
        ring.show = ShowKind::value;
        controls = {motor, lamp, ring};
    }
    std::vector<std::size_t> due(std::int64_t at_ms) {
        std::vector<std::size_t> result;
        for (const auto& stroke : painter.due(controls, at_ms * kMillisecond, 64)) result.push_back(stroke.control);
        return result;
    }
    void heard(std::size_t control, ControlEvent::What what, double value, std::int64_t at_ms) {
        painter.heard(control, controls[control], {what, control, value}, at_ms * kMillisecond);
    }
    using Controls = std::vector<std::size_t>;
    std::vector<ControlSpec> controls;
    SurfacePainter painter;
};

TEST_F(Painter, SendsOnlyDifferencesAndNotTooOften) {
    painter.want(0, 0.5);
    painter.want(1, 1);
    EXPECT_EQ(due(1000), (Controls{0, 1}));
    EXPECT_EQ(due(1001), Controls{});
    painter.want(0, 0.500001);
    EXPECT_EQ(due(1100), Controls{}) << "less than one step";
    painter.want(0, 0.6);
    EXPECT_EQ(due(1101), (Controls{0}));
    painter.want(0, 0.7);
    EXPECT_EQ(due(1120), Controls{}) << "20 ms between two";
    EXPECT_EQ(painter.due_ns(controls, 1110 * kMillisecond), 1121 * kMillisecond);
    EXPECT_EQ(due(1121), (Controls{0}));
}

TEST_F(Painter, NeverFightsAHandOnATouchFader) {
    painter.want(0, 0.5);
    due(1000);
    heard(0, ControlEvent::What::touched, 1, 2000);
    heard(0, ControlEvent::What::moved, 0.8, 2010);
    painter.want(0, 0.2);
    EXPECT_EQ(due(5000), Controls{}) << "however long it is held";
    heard(0, ControlEvent::What::touched, 0, 6000);
    EXPECT_EQ(due(6001), (Controls{0}));
}

TEST_F(Painter, AMotorIsToldItsOwnPositionOrItSpringsBack) {
    painter.want(0, 0.5);
    due(1000);
    heard(0, ControlEvent::What::touched, 1, 2000);
    heard(0, ControlEvent::What::moved, 0.5, 2010);
    heard(0, ControlEvent::What::touched, 0, 2020);
    EXPECT_EQ(due(2030), (Controls{0})) << "though 0.5 was the last that it was sent";
    EXPECT_EQ(due(2100), Controls{});
}

TEST_F(Painter, WithoutTouchTheHandHasPeaceFor300Ms) {
    controls[0].touch.reset();
    painter.want(0, 0.5);
    due(1000);
    heard(0, ControlEvent::What::moved, 0.8, 2000);
    painter.want(0, 0.8);
    EXPECT_EQ(due(2299), Controls{});
    EXPECT_EQ(due(2300), (Controls{0}));
    painter.want(2, 0.5);
    due(2400);
    heard(2, ControlEvent::What::moved, 0.7, 3000);
    painter.want(2, 0.7);
    EXPECT_EQ(due(4000), Controls{}) << "a ring that the box moved itself shows it already";
}

TEST_F(Painter, EverythingAgainForANewBoxAndForForgetfulOnes) {
    painter.want(1, 1);
    due(1000);
    painter.repaint();
    EXPECT_EQ(due(1001), (Controls{1}));
    painter = SurfacePainter(1.0);
    painter.want(1, 1);
    EXPECT_EQ(due(1000), (Controls{1}));
    EXPECT_EQ(due(1999), Controls{});
    EXPECT_EQ(due(2000), (Controls{1}));
}

TEST_F(Painter, ABoundIsSharedFairly) {
    for (std::size_t i = 0; i < 3; ++i) painter.want(i, 1);
    EXPECT_EQ(painter.due(controls, 1000 * kMillisecond, 2).size(), 2u);
    const auto rest = painter.due(controls, 1000 * kMillisecond, 2);
    ASSERT_EQ(rest.size(), 1u);
    EXPECT_EQ(rest[0].control, 2u);
}

}  // namespace
}  // namespace gonio
