// Palettes and scales of the false-colour views, and what set_view makes of their settings.
#include "server/scene/false_color.h"

#include <gtest/gtest.h>

#include <cmath>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/palette.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/shown_scene.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

// CIE 1976 L* of an sRGB colour, components 0..255 (IEC 61966-2-1, CIE 15).
double lightness(const std::array<float, 3>& color) {
    const auto linear = [](double encoded) {
        const double x = encoded / 255.0;
        return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    };
    const auto at = [&](std::size_t k) { return linear(static_cast<double>(color[k])); };
    const double y = 0.2126 * at(0) + 0.7152 * at(1) + 0.0722 * at(2);
    return y > std::pow(6.0 / 29.0, 3) ? 116.0 * std::cbrt(y) - 16.0 : y * std::pow(29.0 / 3.0, 3);
}

TEST(Palette, LightnessAscendsWhereItIsPromised) {
    for (const char* name : {"viridis", "gray", "classic"}) {
        const Palette& palette = *find_palette(name);
        for (int i = 1; i < 256; ++i)
            ASSERT_GT(lightness(color_at(palette, static_cast<float>(i) / 255.0f)),
                      lightness(color_at(palette, static_cast<float>(i - 1) / 255.0f)))
                << name << " " << i;
    }
    // Evenly: each tenth of viridis is 4 to 11 of L* above the one before, of its 77 in all.
    for (int i = 1; i <= 10; ++i) {
        const Palette& viridis = *find_palette("viridis");
        const auto at = [&](int tenth) { return lightness(color_at(viridis, static_cast<float>(tenth) / 10.0f)); };
        const double step = at(i) - at(i - 1);
        EXPECT_GT(step, 4.0) << i;
        EXPECT_LT(step, 11.0) << i;
    }
    for (int i = 1; i < 128; ++i) {
        const auto at = [&](int from_middle) {
            return lightness(color_at(difference_palette(), 0.5f + static_cast<float>(from_middle) / 256.0f));
        };
        EXPECT_LT(at(i), at(i - 1));
        EXPECT_LT(at(-i), at(1 - i));
    }
}

TEST(Palette, WhatLiesBeyondHasAColourOfItsOwn) {
    std::vector<const Palette*> all = {&difference_palette()};
    for (const Palette& palette : palettes()) all.push_back(&palette);
    for (const Palette* palette : all) {
        for (const Rgb8& mark : {palette->under, palette->over, kBelowMark}) {
            for (int i = 0; i < 256; ++i) {
                // The ends of gray are black and white themselves.
                const auto color = color_at(*palette, static_cast<float>(i) / 255.0f);
                double off = 0.0;
                for (std::size_t k = 0; k < 3; ++k)
                    off = std::max(off, std::abs(static_cast<double>(color[k]) - mark[k]));
                EXPECT_GT(off, 20.0) << palette->name << " " << i;
            }
        }
        EXPECT_NE(palettes_module().find("\"" + std::string(palette->name) + "\": {"), std::string::npos);
    }
    EXPECT_NE(palettes_module().find("under: [0,0,0], over: [255,255,255], colors: [[68,1,84],"), std::string::npos);
}

TEST(FalseColor, TicksAreTheBordersOrRoundFigures) {
    using Ticks = std::vector<double>;
    const auto near = [](const Ticks& found, const Ticks& expected) {
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-9 * std::abs(expected[i]));
    };
    near(ticks_of({0, 1000, false, 4}), {0, 250, 500, 750, 1000});
    near(ticks_of({1, 16, true, 4}), {1, 2, 4, 8, 16});
    near(ticks_of({0, 1000, false, 0}), {0, 100, 200, 300, 400, 500, 600, 700, 800, 900, 1000});
    near(ticks_of({-500, 500, false, 0}), {-500, -400, -300, -200, -100, 0, 100, 200, 300, 400, 500});
    near(ticks_of({1, 1e4, true, 0}), {1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000});
    near(ticks_of({1e-6, 1e9, true, 0}),
         {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1, 10, 100, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9});
    near(ticks_of({300, 340, true, 0}), {300, 305, 310, 315, 320, 325, 330, 335, 340});
    FalseColor settings;
    settings.steps = 4;
    settings.logarithmic = false;
    settings.range_low = 0;
    settings.range_high = 1000;
    settings.below = 300;
    near(isolux_levels(settings, false), {250, 300, 500, 750});
    near(isolux_levels(settings, true), {-250, 0, 250});
    settings.levels = {100, 200, 5000};
    near(isolux_levels(settings, false), {100, 200, 300, 5000});
    near(isolux_levels(settings, true), {-250, 0, 250});
    settings = {};
    near(isolux_levels(settings, false), {1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000});
    settings.range_low = 1e-6, settings.range_high = 1e9;
    EXPECT_LE(isolux_levels(settings, false).size(), kMostLevels);
}

TEST(FalseColor, ColoursStandForValues) {
    FalseColor settings;
    settings.logarithmic = false;
    settings.range_low = 100;
    settings.range_high = 500;
    settings.palette = "viridis";
    const auto bytes = [](const layouts::FalseColorBlock& block, float value) {
        const glm::vec3 color = glm::round(false_color(block, value) * 255.0f);
        return std::array{int(color.r), int(color.g), int(color.b)};
    };
    layouts::FalseColorBlock block = color_block(settings, false);
    EXPECT_EQ(bytes(block, 100.0f), (std::array{0x44, 0x01, 0x54})) << "viridis begins with #440154";
    EXPECT_EQ(bytes(block, 500.0f), (std::array{0xfd, 0xe7, 0x25}));
    EXPECT_EQ(bytes(block, 99.0f), (std::array{0, 0, 0}));
    EXPECT_EQ(bytes(block, 501.0f), (std::array{255, 255, 255}));
    settings.steps = 4;
    block = color_block(settings, false);
    EXPECT_EQ(bytes(block, 200.0f), bytes(block, 299.0f)) << "one step";
    EXPECT_NE(bytes(block, 300.5f), bytes(block, 299.5f)) << "the next";
    settings.below = 250;
    block = color_block(settings, false);
    EXPECT_EQ(bytes(block, 249.0f), (std::array<int, 3>{kBelowMark[0], kBelowMark[1], kBelowMark[2]}));
    EXPECT_NE(bytes(block, 251.0f), bytes(block, 249.0f));
    block = color_block(settings, true);
    EXPECT_EQ(bytes(block, -1000.0f), (std::array{0, 220, 255})) << "a difference has no threshold";
}

class SetView : public testing::Test {
protected:
    Result<Applied> set(const std::function<void(v1::SetView&)>& fill) {
        v1::Command command;
        fill(*command.mutable_set_view());
        return apply(scene, command, {});
    }
    void expect_refused(const std::string& code, const std::string& where,
                        const std::function<void(v1::SetView&)>& fill) {
        const Revision before = scene.scene_rev;
        const auto done = set(fill);
        ASSERT_FALSE(done) << where;
        EXPECT_EQ(done.error().code, code);
        EXPECT_EQ(done.error().where, where);
        EXPECT_EQ(scene.scene_rev, before);
    }
    Scene scene = scene_of(make_cornell());
};

TEST_F(SetView, EachViewHasSettingsOfItsOwn) {
    ASSERT_TRUE(set([](auto& s) {
        s.set_view("illuminance");
        s.set_scale("linear");
        s.set_range_low(0);
        s.set_range_high(1000);
        s.set_steps(10);
    }));
    ASSERT_TRUE(set([](auto& s) { s.set_view("luminance"), s.set_palette("gray"); }));
    const v1::State state = full_state(scene);
    EXPECT_EQ(state.illuminance().scale(), "linear");
    EXPECT_EQ(state.illuminance().range_high(), 1000);
    EXPECT_EQ(state.illuminance().palette(), "classic");
    EXPECT_EQ(state.illuminance().ticks_size(), 11);
    EXPECT_EQ(state.luminance().scale(), "log");
    EXPECT_EQ(state.luminance().range_low(), 0.1);
    EXPECT_EQ(state.luminance().palette(), "gray");
    EXPECT_EQ(state.luminance().ticks_size(), 13);
}

TEST_F(SetView, BadSettingsAreRefused) {
    expect_refused("invalid_argument", "set_view.view", [](auto& s) { s.set_steps(5); });
    ASSERT_TRUE(set([](auto& s) { s.set_view("illuminance"); }));
    expect_refused("invalid_argument", "set_view.scale", [](auto& s) { s.set_scale("cubic"); });
    expect_refused("invalid_argument", "set_view.range_low", [](auto& s) { s.set_range_low(0), s.set_range_high(9); });
    expect_refused("invalid_argument", "set_view.range_low", [](auto& s) { s.set_range_low(-1); });
    expect_refused("invalid_argument", "set_view.range_high", [](auto& s) { s.set_range_high(NAN); });
    expect_refused("invalid_argument", "set_view.range_high", [](auto& s) { s.set_range_high(1); });
    expect_refused("invalid_argument", "set_view.steps", [](auto& s) { s.set_steps(1); });
    expect_refused("invalid_argument", "set_view.steps", [](auto& s) { s.set_steps(28); });
    expect_refused("invalid_argument", "set_view.palette", [](auto& s) { s.set_palette("difference"); });
    expect_refused("invalid_argument", "set_view.below", [](auto& s) { s.set_below(-5); });
    expect_refused("invalid_argument", "set_view.compare_range", [](auto& s) { s.set_compare_range(0); });
    expect_refused("not_found", "set_view.only", [](auto& s) { s.set_only("nobody"); });
    expect_refused("not_found", "set_view.compare", [](auto& s) { s.set_compare("nothing"); });
}

// In whatever order they are typed; without any the scale has them again.
TEST_F(SetView, LevelsAreGiven) {
    const auto levels = [](const std::vector<double>& values) {
        return [values](v1::SetView& s) {
            s.set_view("illuminance");
            s.mutable_levels();
            for (const double value : values) s.mutable_levels()->add_values(value);
        };
    };
    ASSERT_TRUE(set(levels({500, 100, 200, 100})));
    EXPECT_EQ(scene.false_color[0].levels, (std::vector<double>{100, 200, 500}));
    EXPECT_TRUE(scene.false_color[0].isolux) << "whoever gives levels wants to see them";
    EXPECT_TRUE(scene.false_color[1].levels.empty()) << "each view has its own";
    const v1::State state = full_state(scene);
    EXPECT_EQ(state.illuminance().levels_size(), 3);
    EXPECT_EQ(state.illuminance().levels(2), 500);
    const layouts::FalseColorBlock block = color_block(scene.false_color[0], false);
    EXPECT_EQ(levels_reached(block, 199.0f), 1);
    EXPECT_EQ(levels_reached(block, 200.0f), 2);
    ASSERT_TRUE(set([&](auto& s) { levels({50})(s), s.set_isolux(false); }));
    EXPECT_FALSE(scene.false_color[0].isolux) << "unless it says otherwise";
    const std::vector<double> most(16, 7.0), more(17, 7.0);
    ASSERT_TRUE(set(levels(most)));
    expect_refused("too_large", "set_view.levels", levels(more));
    for (const double bad : {0.0, -1.0, 2e9, static_cast<double>(NAN)})
        expect_refused("invalid_argument", "set_view.levels", levels({100, bad}));
    ASSERT_TRUE(set(levels({})));
    EXPECT_TRUE(scene.false_color[0].levels.empty());
    EXPECT_GT(isolux_levels(scene.false_color[0], false).size(), 3u);
}

TEST_F(SetView, AutomaticEndsWithATypedRange) {
    ASSERT_TRUE(set([](auto& s) { s.set_view("illuminance"), s.set_range_auto(true); }));
    EXPECT_TRUE(scene.false_color[0].range_auto);
    ASSERT_TRUE(set([](auto& s) { s.set_range_high(200), s.set_range_auto(true); }));
    EXPECT_DOUBLE_EQ(scene.false_color[0].range_low, 0.02) << "four decades";
    ASSERT_TRUE(set([](auto& s) { s.set_scale("linear"); }));
    EXPECT_EQ(scene.false_color[0].range_low, 0.0);
    ASSERT_TRUE(set([](auto& s) { s.set_range_high(300); }));
    EXPECT_FALSE(scene.false_color[0].range_auto);
}

TEST_F(SetView, WhatIsNamedFollowsAndGoes) {
    const std::string name = scene.lights[0].name;
    v1::Command command;
    command.mutable_save_preset()->set_name("A");
    ASSERT_TRUE(apply(scene, command, {}));
    ASSERT_TRUE(set([&](auto& s) { s.set_view("illuminance"), s.set_only(name), s.set_compare("A"); }));
    command.mutable_rename_light()->set_name(name);
    command.mutable_rename_light()->set_new_name("other");
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_EQ(scene.view_only, "other");
    command.mutable_remove_light()->set_name("other");
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_EQ(scene.view_only, "");
    command.mutable_remove_preset()->set_name("A");
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_EQ(scene.view_compare, "");
}

// The weights of the lights that are rendered: now less then. A light that has moved is there twice.
TEST_F(SetView, ADifferenceIsOfLightsNowAndThen) {
    const std::string name = scene.lights[0].name;
    v1::Command command;
    command.mutable_save_preset()->set_name("A");
    ASSERT_TRUE(apply(scene, command, {}));
    ASSERT_TRUE(set([](auto& s) { s.set_view("illuminance"), s.set_compare("A"); }));
    const glm::dvec3 then = own_weight(scene.lights[0]);
    const auto light = [&](const std::function<void(v1::SetLight&)>& fill) {
        command.mutable_set_light()->set_name(name);
        fill(*command.mutable_set_light());
        ASSERT_TRUE(apply(scene, command, {}));
    };
    light([](auto& l) { l.set_level_ratio(0.25); });
    EXPECT_FALSE(shown_scene(scene, View::beauty));
    std::optional<Scene> shown = shown_scene(scene, View::illuminance);
    ASSERT_EQ(shown->lights.size(), 1u);
    EXPECT_NEAR(own_weight(shown->lights[0]).g, -0.75 * then.g, 1e-12 * then.g);
    EXPECT_TRUE(shown->emission_hidden);
    EXPECT_FALSE(shown_scene(*shown, View::illuminance)) << "once is enough";
    light([](auto& l) { l.set_cct_k(2700.0), l.set_tint_duv(0.01), l.set_gel("L201"); });
    shown = shown_scene(scene, View::illuminance);
    ASSERT_EQ(shown->lights.size(), 1u);
    EXPECT_NEAR(glm::distance(own_weight(shown->lights[0]), own_weight(scene.lights[0]) - then), 0.0, 1e-12 * then.g)
        << "white and gel count once";
    light([](auto& l) { l.set_cct_k(0.0), l.set_tint_duv(0.0), l.set_gel(""); });
    light([](auto& l) { l.set_tilt_rad(0.5); });
    shown = shown_scene(scene, View::illuminance);
    ASSERT_EQ(shown->lights.size(), 2u);
    EXPECT_NEAR(own_weight(shown->lights[0]).g, 0.25 * then.g, 1e-12 * then.g);
    EXPECT_NEAR(own_weight(shown->lights[1]).g, -then.g, 1e-12 * then.g);
    EXPECT_NE(shown->lights[0].id, shown->lights[1].id);
    command.mutable_remove_light()->set_name(name);
    ASSERT_TRUE(apply(scene, command, {}));
    shown = shown_scene(scene, View::illuminance);
    ASSERT_EQ(shown->lights.size(), 1u) << "what is gone was there";
    EXPECT_NEAR(own_weight(shown->lights[0]).g, -then.g, 1e-12 * then.g);
}

}  // namespace
}  // namespace gonio
