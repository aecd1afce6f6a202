// The words of a command line -> messages.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/view.pb.h"
#include "protocol/schema/words.h"
#include "tests/unit/split.h"

namespace gonio {
namespace {

Result<v1::Command> command_of(const std::string& line) {
    return command_from_words(split(line));
}

ReadWords read_after(const char* command, std::vector<std::string> words) {
    words.insert(words.begin(), command);
    return read_words(words, {scene_commands()});
}

Result<v1::MeterQuery> meter_from_words(const std::vector<std::string>& words) {
    const ReadWords read = read_after("meter", words);
    if (read.fault) return *read.fault;
    return read.message.meter();
}

struct CaptureWords {
    std::string file;
    v1::CaptureQuery query;
};
Result<CaptureWords> capture_from_words(const std::vector<std::string>& words) {
    const ReadWords read = read_after("capture", words);
    if (read.fault) return *read.fault;
    return CaptureWords{read.names.front(), read.message.capture()};
}

TEST(CliWords, ANumberThatMeansAPercentageIsNotPassedOn) {
    const auto refused = [](const std::string& line) {
        const auto command = command_of(line);
        return command ? std::string("taken") : command.error().text();
    };
    for (const char* line : {"set light key --level 50", "set master 100", "set light key --shutter 2"})
        EXPECT_NE(refused(line).find("%?"), std::string::npos) << line << ": " << refused(line);
    EXPECT_NE(refused("set light key --level 50").find("Did you mean 50%?"), std::string::npos);
    for (const char* line : {"set light key --level 50%", "set light key --level 1", "set light key --level 1.5",
                             "set light key --level 101", "set light key --level -50", "set light key --zoom 50"})
        EXPECT_EQ(refused(line), "taken") << line << ": what else is wrong the server says";
}

// CSS Color 4: names and #rrggbb are sRGB. Its 128 of 255 is 0.21586 of the light (IEC 61966-2-1).
TEST(CliWords, ColoursHaveNames) {
    const auto rgb = [](const std::string& color) {
        const auto command = command_of("set light key --color " + color);
        EXPECT_TRUE(command) << color;
        const auto& numbers = command->set_light().color_rgb();
        return std::vector<double>(numbers.begin(), numbers.end());
    };
    const auto near = [](const std::vector<double>& a, const std::vector<double>& b) {
        return a.size() == 3 && std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) < 2e-5;
    };
    EXPECT_TRUE(near(rgb("red"), {1, 0, 0}));
    EXPECT_TRUE(near(rgb("Gray"), {0.215861, 0.215861, 0.215861}));
    EXPECT_TRUE(near(rgb("#808080"), {0.215861, 0.215861, 0.215861}));
    EXPECT_TRUE(near(rgb("#f80"), rgb("#FF8800")));
    EXPECT_TRUE(near(rgb("#000a00"), {0, 0.0030353, 0})) << "the straight part: 10 / 255 / 12.92";
    EXPECT_TRUE(near(rgb("yellowgreen"), rgb("#9acd32")));
    EXPECT_TRUE(near(rgb("aliceblue"), rgb("#f0f8ff")));
    EXPECT_TRUE(near(rgb("1,0.5,0"), {1, 0.5, 0}));
    for (const char* bad : {"reddish", "#12345", "#1234567", "#gg0000", "", "#"}) {
        const std::vector<std::string> words = {"set", "light", "key", "--color", bad};
        const auto command = command_from_words(words);
        ASSERT_FALSE(command) << bad;
        EXPECT_EQ(command.error().where, "--color");
    }
}

TEST(CliWords, EveryChange) {
    auto command = command_of(
        "set light key --position 1,-2,3.5 --pan 90 --tilt -45 --roll 180 --level 0.25 --color 1,0.5,0 --tint -0.01 "
        "--cct 3200 --gel L201 --profile narrow");
    ASSERT_TRUE(command) << command.error().text();
    const v1::SetLight& light = command->set_light();
    EXPECT_EQ(light.name(), "key");
    ASSERT_EQ(light.position_m_size(), 3);
    EXPECT_DOUBLE_EQ(light.position_m(1), -2);
    EXPECT_NEAR(light.pan_rad(), std::numbers::pi / 2, 1e-15);
    EXPECT_NEAR(light.tilt_rad(), -std::numbers::pi / 4, 1e-15);
    EXPECT_NEAR(light.roll_rad(), std::numbers::pi, 1e-15);
    EXPECT_DOUBLE_EQ(light.level_ratio(), 0.25);
    EXPECT_DOUBLE_EQ(light.color_rgb(1), 0.5);
    EXPECT_DOUBLE_EQ(light.tint_duv(), -0.01);
    EXPECT_DOUBLE_EQ(light.cct_k(), 3200);
    EXPECT_EQ(light.gel(), "L201");
    EXPECT_EQ(light.profile().name(), "narrow");
    EXPECT_EQ(light.aim_size(), 0);

    command = command_of("set light key --aim=-1,0,0");
    ASSERT_TRUE(command);
    EXPECT_DOUBLE_EQ(command->set_light().aim(0), -1);
    EXPECT_FALSE(command->set_light().has_pan_rad());

    command = command_of("set camera --eye 0,1,5 --target 0,1,0 --fov 60");
    ASSERT_TRUE(command);
    EXPECT_NEAR(command->set_camera().fov_rad(), std::numbers::pi / 3, 1e-15);
    EXPECT_EQ(command_of("load scene a.mvr --universe-offset -3")->load_scene().universe_offset(), -3);
    EXPECT_TRUE(command_of("load scene a.mvr --merge")->load_scene().merge());
    EXPECT_FALSE(command_of("load scene a.mvr --merge")->load_scene().dry_run());
    EXPECT_TRUE(command_of("load scene a.mvr --merge --dry-run")->load_scene().dry_run());
    EXPECT_EQ(command_of("set technique seed --samples 400")->set_technique().samples(), 400u);
    EXPECT_EQ(command_of("set technique default")->set_technique().technique(), "default");
    EXPECT_EQ(command_of("set view indirect --gain 4 --light key")->set_view().gain(), 4.0);
    command = command_of(
        "set view illuminance --range 0:1000 --scale linear --steps 10 --palette viridis --isolux on --below 500 "
        "--only key --compare A --compare-range 200");
    ASSERT_TRUE(command);
    const v1::SetView& view = command->set_view();
    EXPECT_TRUE(view.has_range_low());
    EXPECT_EQ(view.range_low(), 0);
    EXPECT_EQ(view.range_high(), 1000);
    EXPECT_FALSE(view.has_range_auto());
    EXPECT_EQ(view.scale() + " " + view.palette() + " " + view.only() + " " + view.compare(), "linear viridis key A");
    EXPECT_EQ(view.steps(), 10u);
    EXPECT_TRUE(view.isolux());
    EXPECT_EQ(view.below(), 500);
    EXPECT_EQ(view.compare_range(), 200);
    EXPECT_TRUE(command_of("set view illuminance --range auto")->set_view().range_auto());
    EXPECT_FALSE(command_of("set view illuminance --range auto")->set_view().has_range_low());
    EXPECT_FALSE(command_of("set view illuminance --isolux off")->set_view().isolux());
    EXPECT_TRUE(command_of("set view illuminance --isolux off")->set_view().has_isolux());
    command = command_of("set view illuminance --levels 100,200.5,500");
    ASSERT_TRUE(command);
    const auto& levels = command->set_view().levels().values();
    EXPECT_EQ(std::vector<double>(levels.begin(), levels.end()), (std::vector<double>{100, 200.5, 500}));
    command = command_of("set view illuminance --levels auto");
    EXPECT_TRUE(command->set_view().has_levels());
    EXPECT_EQ(command->set_view().levels().values_size(), 0);
    EXPECT_EQ(command_of("set view illuminance --levels 100;200").error().where, "--levels");
    EXPECT_EQ(command_of("set view illuminance --range 5").error().where, "--range");
    EXPECT_EQ(command_of("set view illuminance --isolux maybe").error().where, "--isolux");
    command = command_of("set exposure --aperture 5.6 --shutter 1/60 --iso 400");
    EXPECT_EQ(command->set_exposure().aperture(), 5.6);
    EXPECT_DOUBLE_EQ(command->set_exposure().shutter_s(), 1.0 / 60.0);
    EXPECT_EQ(command->set_exposure().iso(), 400);
    EXPECT_FALSE(command->set_exposure().has_ev100());
    command = command_of("set look --tone agx --white 4000 --tint -0.01");
    EXPECT_EQ(command->set_look().tone(), "agx");
    EXPECT_EQ(command->set_look().white_k(), 4000);
    EXPECT_EQ(command->set_look().white_duv(), -0.01);
    EXPECT_EQ(command_of("set exposure -2.5")->set_exposure().ev100(), -2.5);
    EXPECT_EQ(command_of("set master 0.5")->set_master().ratio(), 0.5);
    EXPECT_EQ(command_of("set size 640x480")->set_size().height_px(), 480u);
    EXPECT_EQ(command_of("load scene atrium")->load_scene().file(), "atrium");
    EXPECT_FALSE(command_of("load scene atrium")->load_scene().has_scale());
    EXPECT_EQ(command_of("load scene room.glb --scale 0.01")->load_scene().scale(), 0.01);
    EXPECT_EQ(command_of("add light new --profile flood --position 0,3,0")->add_light().light().profile().name(),
              "flood");
    EXPECT_EQ(command_of("remove light new")->remove_light().name(), "new");
    EXPECT_EQ(command_of("recess light downlight")->recess_light().name(), "downlight");
    EXPECT_EQ(command_of("rename light old new")->rename_light().name(), "old");
    EXPECT_EQ(command_of("rename light old new")->rename_light().new_name(), "new");
    EXPECT_EQ(command_of("group wash a b c")->set_group().lights_size(), 3);
    EXPECT_EQ(command_of("group wash")->set_group().lights_size(), 0);
}

TEST(CliWords, SetIsUnderstoodInAJob) {
    EXPECT_EQ(command_of("exposure 8")->set_exposure().ev100(), 8.0);
    EXPECT_FALSE(command_of("exposure 8")->set_exposure().has_automatic());
    EXPECT_TRUE(command_of("set exposure auto")->set_exposure().automatic());
    EXPECT_FALSE(command_of("set exposure auto")->set_exposure().has_ev100());
    EXPECT_EQ(command_of("light key --level 1")->set_light().name(), "key");
}

TEST(CliWords, WhatIsANumberIsPassedOn) {
    const auto command = command_of("set light key --position nan,inf,1e999 --level -7");
    ASSERT_TRUE(command);
    EXPECT_TRUE(std::isnan(command->set_light().position_m(0)));
    EXPECT_TRUE(std::isinf(command->set_light().position_m(1)));
    EXPECT_TRUE(std::isinf(command->set_light().position_m(2)));
    EXPECT_DOUBLE_EQ(command->set_light().level_ratio(), -7);
    EXPECT_EQ(command_of("set light key --position 1,2")->set_light().position_m_size(), 2);  // the server refuses it
    EXPECT_TRUE(std::isnan(command_of("set exposure nan")->set_exposure().ev100()));
}

// A luminaire may be called "-5 dB" (28-odd-names).
TEST(CliWords, ANameThatBeginsWithADashStandsAfterTwo) {
    const ReadWords read = read_after("set", {"light", "-5 dB", "--level", "0.5"});
    ASSERT_TRUE(read.fault);
    EXPECT_NE(read.fault->message.find("-- '-5 dB'"), std::string::npos) << read.fault->message;
    const ReadWords good = read_after("set", {"light", "--level", "0.5", "--", "-5 dB"});
    ASSERT_FALSE(good.fault);
    EXPECT_EQ(good.message.command().set_light().name(), "-5 dB");
    const ReadWords option = read_after("set", {"light", "key", "--shine", "1"});
    EXPECT_EQ(option.fault->message.find("begins with a dash"), std::string::npos);
}

TEST(CliWords, UsageErrorsNameTheWord) {
    struct Case {
        const char* line;
        const char* where;
        const char* value;
    };
    const Case cases[] = {
        {"set light", "", ""},
        {"set", "set", ""},
        {"set sun 5", "set", "sun"},
        {"fly", "set", "fly"},
        {"set light key --level", "--level", ""},
        {"set light key --level high", "--level", "high"},
        {"set light key --position 1,2,x", "--position", "1,2,x"},
        {"set light key --position 1,,2", "--position", "1,,2"},
        {"set light key --shine 1", "--shine", ""},
        {"set light key other", "", "other"},
        {"set exposure", "", ""},
        {"set exposure bright", "exposure", "bright"},
        {"set exposure 1.5x", "exposure", "1.5x"},
        {"set size 640", "size", "640"},
        {"set size 640x", "size", "640x"},
        {"set size 0x0", "size", "0x0"},
        {"set size 640x0", "size", "640x0"},
        {"set technique seed --samples -4", "--samples", "-4"},
        {"set technique seed --samples 1.5", "--samples", "1.5"},
        {"load scene a.mvr --universe-offset 1.5", "--universe-offset", "1.5"},
        {"load scene a.mvr --universe-offset 2147483648", "--universe-offset", "2147483648"},
        {"load file x", "load", "file"},
        {"set work-light maybe", "work-light", "maybe"},
        {"set lights", "", ""},
        {"remove camera", "remove", "camera"},
        {"group", "", ""},
    };
    for (const Case& expected : cases) {
        const auto command = command_of(expected.line);
        ASSERT_FALSE(command) << expected.line;
        EXPECT_EQ(command.error().code, "usage") << expected.line;
        EXPECT_EQ(command.error().where, expected.where) << expected.line;
        EXPECT_EQ(command.error().value, expected.value) << expected.line;
    }
    EXPECT_FALSE(command_of(""));
}

TEST(CliWords, MetersAndCaptures) {
    const auto meter = meter_from_words(
        split("--point 0,-1,2 --normal 0,1,0 --quality reference --bounces all --noise 0.002 --openings --u 4,0,0 "
              "--v=0,0,-6 --count 16x9"));
    ASSERT_TRUE(meter) << meter.error().text();
    EXPECT_DOUBLE_EQ(meter->point_m(1), -1);
    EXPECT_EQ(meter->quality(), "reference");
    EXPECT_EQ(meter->bounces(), "all");
    EXPECT_DOUBLE_EQ(meter->noise_ratio(), 0.002);
    EXPECT_TRUE(meter->openings());
    EXPECT_DOUBLE_EQ(meter->v_m(2), -6);
    ASSERT_EQ(meter->count_size(), 2);
    EXPECT_EQ(meter->count(0), 16u);
    EXPECT_EQ(meter->count(1), 9u);
    const auto plain = meter_from_words(split("--point 0,0,0 --normal 0,1,0"));
    ASSERT_TRUE(plain);
    EXPECT_FALSE(plain->has_noise_ratio());
    EXPECT_FALSE(plain->openings());
    EXPECT_EQ(plain->count_size(), 0);

    const auto capture = capture_from_words(
        split("out/a.JPEG --view indirect --quality reference --bounces 3 --noise 0.02 --openings --size 640x480 "
              "--max-seconds 60 --denoise --samples-per-pixel 4"));
    ASSERT_TRUE(capture) << capture.error().text();
    EXPECT_EQ(capture_from_words(split("a.png --size 0x0")).error().where, "--size") << "no default";
    EXPECT_EQ(capture->file, "out/a.JPEG");
    EXPECT_EQ(capture->query.format(), "jpg");
    EXPECT_EQ(capture->query.view(), "indirect");
    EXPECT_EQ(capture->query.bounces(), "3");
    EXPECT_DOUBLE_EQ(capture->query.noise_ratio(), 0.02);
    EXPECT_DOUBLE_EQ(capture->query.max_seconds(), 60.0);
    EXPECT_TRUE(capture->query.denoise());
    EXPECT_EQ(capture->query.samples_per_pixel(), 4u);
    EXPECT_TRUE(capture->query.openings());
    EXPECT_EQ(capture->query.height_px(), 480u);
}

// One sentence, whatever the word.
TEST(CliWords, SamplesPerPixelAreFromOneTo64) {
    for (const std::string word : {"-1", "0", "65", "2.5", "4294967297", "many"}) {
        const auto capture = capture_from_words({"a.png", "--samples-per-pixel", word});
        ASSERT_FALSE(capture) << word;
        EXPECT_EQ(capture.error().where, "--samples-per-pixel") << word;
        EXPECT_EQ(capture.error().value, word);
        EXPECT_EQ(capture.error().message, "This must be a whole number from 1 to 64.") << word;
    }
    EXPECT_TRUE(capture_from_words({"a.png", "--samples-per-pixel", "64"}));
}

TEST(CliWords, UsageErrorsOfMetersAndCaptures) {
    struct Case {
        const char* line;
        const char* where;
        const char* value;
    };
    const Case meters[] = {
        {"--normal 0,1,0", "--point", ""},
        {"--point 0,0,0", "--normal", ""},
        {"--point 0,0,x --normal 0,1,0", "--point", "0,0,x"},
        {"--point 0,0,0 --normal 0,1,0 --noise low", "--noise", "low"},
        {"--point 0,0,0 --normal 0,1,0 --count 3", "--count", "3"},
        {"--point 0,0,0 --normal 0,1,0 --count 3x-1", "--count", "3x-1"},
        {"--point 0,0,0 --normal 0,1,0 --openings=yes", "--openings", "yes"},
        {"--point 0,0,0 --normal 0,1,0 word", "", "word"},
    };
    for (const Case& expected : meters) {
        const auto query = meter_from_words(split(expected.line));
        ASSERT_FALSE(query) << expected.line;
        EXPECT_EQ(query.error().code, "usage") << expected.line;
        EXPECT_EQ(query.error().where, expected.where) << expected.line;
        EXPECT_EQ(query.error().value, expected.value) << expected.line;
    }
    const Case captures[] = {
        {"--view beauty", "", ""},    {"a.gif", "capture", "a.gif"},     {"png", "capture", "png"},
        {"a.png b.png", "", "b.png"}, {"a.png --size 5", "--size", "5"}, {"a.png --noise x", "--noise", "x"},
    };
    for (const Case& expected : captures) {
        const auto capture = capture_from_words(split(expected.line));
        ASSERT_FALSE(capture) << expected.line;
        EXPECT_EQ(capture.error().code, "usage") << expected.line;
        EXPECT_EQ(capture.error().where, expected.where) << expected.line;
        EXPECT_EQ(capture.error().value, expected.value) << expected.line;
    }
}

TEST(CliWords, AfterTwoDashesEverythingIsAName) {
    EXPECT_EQ(command_of("remove light -- --odd")->remove_light().name(), "--odd");
}

TEST(CliWords, ProfileFilesAreUploaded) {
    const auto path = std::filesystem::temp_directory_path() / "gonio_words_test.ies";
    const std::string content("IESNA:LM-63-2002\r\n\0\xff", 20);
    std::ofstream(path, std::ios::binary) << content;
    auto command = command_of("set light key --profile " + path.string());
    ASSERT_TRUE(command);
    const auto attached = attach_profile_file(*command);
    ASSERT_TRUE(attached && *attached);
    EXPECT_EQ(command->set_light().profile().name(), "gonio_words_test.ies");
    EXPECT_EQ(command->set_light().profile().photometry(), content);
    std::filesystem::resize_file(path, 3u << 20);
    command = command_of("add light key --profile " + path.string());
    ASSERT_TRUE(*attach_profile_file(*command));
    EXPECT_EQ(command->add_light().light().profile().photometry().size(), (1u << 20) + 1);  // enough to be refused
    std::filesystem::remove(path);
    command = command_of("set light key --profile downlight");
    EXPECT_FALSE(*attach_profile_file(*command));
    EXPECT_EQ(command->set_light().profile().name(), "downlight");
}

TEST(CliWords, ViewsAreSavedRecalledAndRemoved) {
    EXPECT_EQ(command_of("view recall door")->recall_view().name(), "door");
    EXPECT_EQ(command_of("view remove door")->remove_view().name(), "door");
    EXPECT_EQ(command_of("view save door")->save_view().eye_m_size(), 0);
    const auto save = command_of("view save door --eye 1,2,3 --fov 60");
    ASSERT_TRUE(save) << save.error().text();
    EXPECT_EQ(save->save_view().eye_m(2), 3);
    EXPECT_NEAR(save->save_view().fov_rad(), std::numbers::pi / 3, 1e-15);
    for (const char* wrong : {"view", "view save", "view recall door --fade 1", "view save door --eye one"})
        EXPECT_FALSE(command_of(wrong)) << wrong;
}

TEST(CliWords, GridsAndObserversAreAddedAndRemoved) {
    const auto add = command_of(
        "grid add desk --corner -1,0.75,1 --u 2,0,0 --v 0,0,-1.6 --quantity vertical --direction 0,0,1 --spacing up "
        "--count 4x3 --margin 0.1 --factor 80% --target mine --target-em 300 --target-u0 40% --target-ez 50");
    ASSERT_TRUE(add) << add.error().text();
    const v1::Grid& grid = add->set_grid().grid();
    EXPECT_EQ(grid.name(), "desk");
    EXPECT_EQ(grid.corner_m(0), -1);
    EXPECT_EQ(grid.u_m(0), 2);
    EXPECT_EQ(grid.v_m(2), -1.6);
    EXPECT_EQ(grid.quantity(), "vertical");
    EXPECT_EQ(grid.direction(2), 1);
    EXPECT_EQ(grid.spacing(), "up");
    ASSERT_EQ(grid.count_size(), 2);
    EXPECT_EQ(grid.count(1), 3u);
    EXPECT_EQ(grid.margin_m(), 0.1);
    EXPECT_DOUBLE_EQ(grid.maintenance_factor(), 0.8);
    EXPECT_EQ(grid.target().name(), "mine");
    EXPECT_EQ(grid.target().em_lx(), 300);
    EXPECT_DOUBLE_EQ(grid.target().u0_ratio(), 0.4);
    EXPECT_EQ(grid.target().ez_lx(), 50);
    EXPECT_FALSE(command_of("grid add desk --corner 0,0,0 --u 1,0,0 --v 0,0,1")->set_grid().grid().has_target());
    EXPECT_EQ(command_of("grid add d --corner 0,0,0 --u 1,0,0 --quantity camera --view door")->set_grid().grid().view(),
              "door");
    EXPECT_EQ(command_of("grid remove desk")->remove_grid().name(), "desk");
    const auto seat = command_of("observer add seat --eye 0,1.2,1 --direction 0,0,-1 --target t --target-ugr 19");
    ASSERT_TRUE(seat) << seat.error().text();
    EXPECT_EQ(seat->set_observer().observer().eye_m(1), 1.2);
    EXPECT_EQ(seat->set_observer().observer().direction(2), -1);
    EXPECT_EQ(seat->set_observer().observer().target().ugr(), 19);
    EXPECT_EQ(command_of("observer remove seat")->remove_observer().name(), "seat");
    for (const char* wrong : {"grid", "grid add", "grid add desk --u 1,0,0", "observer add seat --eye 0,0,0"})
        EXPECT_FALSE(command_of(wrong)) << wrong;
}

TEST(CliWords, PresetsAreSavedRecalledAndRemoved) {
    EXPECT_EQ(command_of("preset save look")->save_preset().name(), "look");
    EXPECT_EQ(command_of("preset remove look")->remove_preset().name(), "look");
    const auto recall = command_of("preset recall look --fade 2.5");
    ASSERT_TRUE(recall) << recall.error().text();
    EXPECT_EQ(recall->recall_preset().name(), "look");
    EXPECT_DOUBLE_EQ(recall->recall_preset().fade_s(), 2.5);
    EXPECT_DOUBLE_EQ(command_of("preset recall look")->recall_preset().fade_s(), 0);
    for (const char* wrong : {"preset", "preset blend look", "preset save", "preset save look --fade 1",
                              "preset recall look --fade soon"}) {
        const auto refused = command_of(wrong);
        ASSERT_FALSE(refused) << wrong;
        EXPECT_EQ(refused.error().code, "usage") << wrong;
    }
}

}  // namespace
}  // namespace gonio
