// What is kept of a scene between two runs: every property comes back, and what cannot is said.
#include "server/show/saved_show.h"

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/cue.h"
#include "server/scene/light_values.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

class SavedShow : public testing::Test {
protected:
    void SetUp() override {
        auto loaded = load_scene("cornell");
        ASSERT_TRUE(loaded);
        // Two lights of the file, the second with a multiplier of its own.
        auto copy = std::make_shared<SceneAsset>(**loaded);
        copy->lights.push_back(copy->lights[0]);
        copy->lights[1].name = "second";
        copy->lights[1].multiplier = 2.5;
        asset = copy;
        scene = scene_of(asset, 7);
        first = scene.lights[0].name;
    }
    void run(const v1::Command& command, const std::string& photometry = "", const std::string& profile_name = "") {
        Loaded loaded;
        if (!photometry.empty()) {
            auto profile = make_profile(profile_name, photometry);
            ASSERT_TRUE(profile) << profile.error().text();
            loaded.profile = *profile;
        }
        const auto applied = apply(scene, command, loaded);
        ASSERT_TRUE(applied) << applied.error().text();
    }
    static std::string web(double candela) {
        const std::string cd = print_number(candela);
        return "IESNA:LM-63-2002\n[TEST] x\n[TESTLAB] x\n[ISSUEDATE] x\n[MANUFAC] x\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 "
               "0\n1 1 "
               "10\n0 90 180\n0\n" +
               cd + " " + cd + " 1\n";
    }
    v1::Command light(const std::string& name, double seed, bool add = false) {
        v1::Command command;
        v1::SetLight& set = add ? *command.mutable_add_light()->mutable_light() : *command.mutable_set_light();
        set.set_name(name);
        set.set_gel(seed > 2 ? "L204" : "L201");
        for (const LightRow& light_row : light_rows()) {         // another share of its range for each number
            if (light_row.property == Property::gobo) continue;  // these profiles have no wheel
            const PropertyRow& row = row_of(light_row.property);
            Numbers numbers{};
            double share = 0.3 + seed / 10 + 0.01 * static_cast<double>(&light_row - light_rows().data());
            for (double& number : numbers) number = row.least + (row.most - row.least) * (share -= 0.1);
            write_numbers(set, row.field, light_row, numbers);
        }
        return command;
    }
    // Everything that a show has, none of it as it is by default.
    void make_show() {
        run(light(first, 1.5), web(100), "mine.ies");
        run(light("spot", 3, true), web(300), "spot.ies");
        v1::Command command;
        command.mutable_save_preset()->set_name("dim");
        run(command);
        run(light("wash", 4, true), web(100), "mine.ies");  // the same photometry once more
        run(light(first, 2.5));
        command.mutable_save_preset()->set_name("bright");
        run(command);
        command.mutable_recall_preset()->set_name("dim");
        run(command);
        run(light(first, 2));
        command.Clear();
        v1::CueEdit& first_cue = *command.mutable_add_cue();
        first_cue.set_number("1.5");
        first_cue.set_label("Sunset");
        first_cue.set_up_s(3);
        first_cue.set_down_s(4);
        first_cue.set_delay_up_s(0.5);
        first_cue.set_delay_down_s(1.5);
        first_cue.set_hang_s(2);
        first_cue.set_timecode("01:02:03:04");
        run(command);
        command.mutable_add_cue()->Clear();
        command.mutable_add_cue()->set_number("2");
        command.mutable_add_cue()->set_preset("bright");
        command.mutable_add_cue()->set_follow_s(0.25);
        run(command);
        command.mutable_add_cue()->Clear();
        command.mutable_add_cue()->set_number("10");
        run(command);
        command.mutable_cue_goto()->set_number("1.5");
        run(command);
        command.mutable_set_cue_options()->set_guard_s(0.5);
        command.mutable_set_cue_options()->set_back_s(2);
        command.mutable_set_cue_options()->set_freewheel_s(1.5);
        command.mutable_set_cue_options()->set_timecode("artnet");
        command.mutable_set_cue_options()->set_next("10");
        run(command);
        run(light(first, 2));
        command.Clear();
        command.mutable_set_group()->set_name("all");
        command.mutable_set_group()->add_lights("wash");
        command.mutable_set_group()->add_lights(first);
        run(command);
        command.mutable_set_view()->set_view("indirect");
        command.mutable_set_view()->set_gain(4);
        command.mutable_set_view()->set_light("spot");
        run(command);
        v1::SetView& lux = *command.mutable_set_view();
        lux.set_view("illuminance");
        lux.set_scale("linear");
        lux.set_range_low(0);
        lux.set_range_high(750);
        lux.set_steps(15);
        lux.set_palette("viridis");
        lux.set_isolux(true);
        lux.set_below(300);
        for (const double level : {500.0, 75.5, 100.0}) lux.mutable_levels()->add_values(level);
        lux.set_compare_range(120);
        lux.set_only("wash");
        lux.set_compare("bright");
        run(command);
        command.Clear();
        command.mutable_set_view()->set_view("luminance");
        command.mutable_set_view()->set_range_auto(true);
        run(command);
        command.Clear();
        command.mutable_set_view()->set_view("indirect");
        run(command);
        command.mutable_set_look()->set_tone("agx");
        command.mutable_set_look()->set_white_k(4000);
        command.mutable_set_look()->set_white_duv(-0.01);
        run(command);
        command.mutable_set_exposure()->set_ev100(3.25);
        run(command);
        command.mutable_set_master()->set_ratio(0.75);
        run(command);
        command.mutable_set_technique()->set_technique("seed");
        command.mutable_set_technique()->set_samples(123);
        run(command);
        command.mutable_set_size()->set_width_px(320);
        command.mutable_set_size()->set_height_px(240);
        run(command);
        command.mutable_set_camera()->set_fov_rad(1.25);
        for (const double x : {1.0, 2.0, 3.0}) command.mutable_set_camera()->add_eye_m(x);
        for (const double x : {0.1, 0.2, 0.3}) command.mutable_set_camera()->add_target_m(x);
        run(command);
        command.mutable_save_view()->set_name("door");
        run(command);
        command.mutable_save_view()->set_name("above");
        for (const double x : {4.0, 5.0, 6.0}) command.mutable_save_view()->add_eye_m(x);
        run(command);
        v1::PatchRow& row = *command.mutable_set_patch()->add_rows();
        row.set_protocol("sacn");
        row.set_universe(3);
        row.set_address(17);
        row.set_target(first);
        row.set_property("pan");
        row.set_bits(16);
        run(command);
        v1::SurfaceRow& fader = *command.mutable_set_surfaces()->add_rows();
        fader.set_device("*");
        fader.set_control("slider 1");
        fader.set_target(first);
        fader.set_property("level");
        command.mutable_set_surfaces()->set_with_default(true);
        run(command);
    }
    // Through the text, as over a restart. Result: the scene that comes back.
    RestoredShow back(std::shared_ptr<const SceneAsset> from = nullptr, bool same_scene = true) {
        saved::Show show = show_of(scene, texts);
        auto read = read_show(write_show(show));
        EXPECT_TRUE(read) << read.error().text();
        EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equivalent(*read, show));
        return restore_show(*read, from ? from : asset, same_scene);
    }
    template <typename AnyLight>
    static void expect_same(const AnyLight& a, const AnyLight& b) {
        SCOPED_TRACE(a.name);
        EXPECT_EQ(a.name, b.name);
        for (const LightRow& light_row : light_rows())
            EXPECT_EQ(numbers_of(a, light_row), numbers_of(b, light_row)) << row_of(light_row.property).name;
        EXPECT_NEAR(glm::length(aim_of(a.world_from_light) - aim_of(b.world_from_light)), 0, 1e-12);
        EXPECT_NEAR(glm::length(c0_of(a.world_from_light) - c0_of(b.world_from_light)), 0, 1e-12);
        EXPECT_EQ(a.gel, b.gel);
        EXPECT_EQ(a.profile->name, b.profile->name);
        EXPECT_EQ(a.profile->uploaded, b.profile->uploaded);
        EXPECT_EQ(a.profile->peak_cd, b.profile->peak_cd);
        EXPECT_EQ(a.profile->photometry.web.candela, b.profile->photometry.web.candela);
        EXPECT_EQ(a.profile->photometry.web.v_rad, b.profile->photometry.web.v_rad);
    }
    static void expect_same_scene(const Scene& a, const Scene& b) {
        ASSERT_EQ(a.lights.size(), b.lights.size());
        for (std::size_t i = 0; i < a.lights.size(); ++i) {
            expect_same(a.lights[i], b.lights[i]);
            EXPECT_EQ(a.lights[i].multiplier, b.lights[i].multiplier);
        }
        EXPECT_EQ(a.groups, b.groups);
        EXPECT_EQ(a.recalled, b.recalled);
        ASSERT_EQ(a.presets.size(), b.presets.size());
        for (const auto& [name, preset] : a.presets) {
            ASSERT_TRUE(b.presets.contains(name));
            const Preset& other = *b.presets.at(name);
            ASSERT_EQ(preset->size(), other.size());
            for (std::size_t i = 0; i < other.size(); ++i) expect_same((*preset)[i], other[i]);
        }
        EXPECT_EQ(a.cue_options, b.cue_options);
        EXPECT_EQ(a.cue_active, b.cue_active);
        EXPECT_EQ(a.cue_next, b.cue_next);
        ASSERT_EQ(a.cues != nullptr, b.cues != nullptr);
        ASSERT_EQ(full_state(a).cues().SerializeAsString(), full_state(b).cues().SerializeAsString());
        for (std::size_t i = 0; a.cues && i < a.cues->size(); ++i) {
            const Preset &content = *(*a.cues)[i]->content, &other = *(*b.cues)[i]->content;
            ASSERT_EQ(content.size(), other.size());
            for (std::size_t j = 0; j < other.size(); ++j) expect_same(content[j], other[j]);
        }
        EXPECT_EQ(a.view, b.view);
        EXPECT_EQ(a.view_gain, b.view_gain);
        EXPECT_EQ(a.view_light, b.view_light);
        EXPECT_EQ(a.false_color, b.false_color);
        EXPECT_EQ(a.view_only, b.view_only);
        EXPECT_EQ(a.view_compare, b.view_compare);
        EXPECT_EQ(a.look, b.look);
        EXPECT_EQ(a.exposure_ev100, b.exposure_ev100);
        EXPECT_EQ(a.exposure_auto, b.exposure_auto);
        EXPECT_EQ(a.master_ratio, b.master_ratio);
        EXPECT_EQ(a.technique, b.technique);
        EXPECT_EQ(a.samples, b.samples);
        EXPECT_EQ(a.width_px, b.width_px);
        EXPECT_EQ(a.height_px, b.height_px);
        EXPECT_EQ(a.camera.eye, b.camera.eye);
        EXPECT_EQ(a.camera.target, b.camera.target);
        EXPECT_EQ(a.camera.fov_rad, b.camera.fov_rad);
        ASSERT_EQ(a.saved_views.size(), b.saved_views.size());
        for (const auto& [name, view] : a.saved_views) {
            ASSERT_TRUE(b.saved_views.contains(name));
            EXPECT_EQ(view.eye, b.saved_views.at(name).eye);
            EXPECT_EQ(view.target, b.saved_views.at(name).target);
            EXPECT_EQ(view.fov_rad, b.saved_views.at(name).fov_rad);
        }
        ASSERT_EQ(a.patch != nullptr, b.patch != nullptr);
        if (a.patch) {
            EXPECT_EQ(a.patch->SerializeAsString(), b.patch->SerializeAsString());
        }
        ASSERT_EQ(a.surfaces != nullptr, b.surfaces != nullptr);
        if (a.surfaces) {
            EXPECT_EQ(a.surfaces->SerializeAsString(), b.surfaces->SerializeAsString());
        }
    }
    std::shared_ptr<const SceneAsset> asset;
    Scene scene;
    std::string first;
    ProfileTexts texts;
};

TEST_F(SavedShow, EveryPropertyComesBack) {
    make_show();
    const RestoredShow restored = back();
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    expect_same_scene(scene, restored.scene);
    EXPECT_EQ(restored.scene.asset, asset);
    EXPECT_EQ(restored.scene.lights[1].profile, asset->lights[1].profile) << "the file's own, not a copy";
    // The same photometry under the same name stands in the file once.
    EXPECT_EQ(show_of(scene, texts).profiles_size(), 2);
}

// Of a scene whose file brings a patch somebody chose the default one.
TEST_F(SavedShow, TheDefaultPatchComesBackWhereTheFileHasAnother) {
    auto copy = std::make_shared<SceneAsset>(*asset);
    auto patch = std::make_shared<v1::SetPatch>();
    v1::PatchRow& row = *patch->add_rows();
    row.set_protocol("sacn");
    row.set_universe(1);
    row.set_address(7);
    row.set_target(first);
    row.set_property("level");
    copy->patch = patch;
    asset = copy;
    scene = scene_of(asset, 7);
    const auto restored = [&] { return restore_show(show_of(scene, texts), asset, true).scene.patch; };
    ASSERT_NE(scene.patch, nullptr);
    EXPECT_EQ(restored()->rows_size(), 1) << "the file's";
    v1::Command command;
    command.mutable_set_patch()->set_use_default(true);
    run(command);
    ASSERT_EQ(scene.patch, nullptr);
    EXPECT_EQ(restored(), nullptr);
}

TEST_F(SavedShow, AnUntouchedSceneComesBackAsItIs) {
    const RestoredShow restored = back();
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    expect_same_scene(scene, restored.scene);
    EXPECT_EQ(show_of(scene, texts).profiles_size(), 0) << "the scene file has them";
}

TEST_F(SavedShow, LightsThatWereRemovedStayAwayAndTheirNamesMayBeTaken) {
    v1::Command remove;
    remove.mutable_remove_light()->set_name(first);
    run(remove);
    expect_same_scene(scene, back().scene);
    remove.mutable_remove_light()->set_name("second");
    run(remove);
    expect_same_scene(scene, back().scene);
    run(light("second", 1, true), web(50), "other");
    run(light(first, 2, true), web(60), "other too");
    ASSERT_EQ(scene.lights[0].name, "second");
    ASSERT_EQ(scene.lights[0].multiplier, 1.0) << "not the file's light any more";
    expect_same_scene(scene, back().scene);
}

// The second has a multiplier of the file's, which no command can give.
TEST_F(SavedShow, RenamedLightsStayThoseOfTheFile) {
    const auto rename = [&](const std::string& name, const std::string& new_name) {
        v1::Command command;
        command.mutable_rename_light()->set_name(name);
        command.mutable_rename_light()->set_new_name(new_name);
        run(command);
    };
    v1::Command save;
    save.mutable_save_preset()->set_name("look");
    run(save);
    rename(first, "x");
    rename("second", first);
    rename("x", "second");
    ASSERT_EQ(scene.lights[1].name, first);
    expect_same_scene(scene, back().scene);
    EXPECT_EQ(back().warnings, std::vector<std::string>{});
    EXPECT_EQ(back().scene.lights[1].multiplier, 2.5);
    EXPECT_EQ(back().scene.lights[1].profile, asset->lights[1].profile) << "not a copy of it";
    v1::Command remove;
    remove.mutable_remove_light()->set_name("second");
    run(remove);
    rename(first, "second");
    run(light(first, 2, true), web(60), "other");
    EXPECT_EQ(back().warnings, std::vector<std::string>{});
    expect_same_scene(scene, back().scene);
}

// Fourteen lights at 4096x4096 are more than the seed technique may take; twelve are not.
TEST_F(SavedShow, ASizeThatOnlyTheRemainingLightsAllowComesBack) {
    auto many = std::make_shared<SceneAsset>(*asset);
    while (many->lights.size() < 14) {
        many->lights.push_back(many->lights[0]);
        many->lights.back().name = "n" + std::to_string(many->lights.size());
    }
    asset = many;
    scene = scene_of(asset, 7);
    v1::Command technique, size, remove;
    technique.mutable_set_technique()->set_technique("seed");
    run(technique);
    size.mutable_set_size()->set_width_px(4096);
    size.mutable_set_size()->set_height_px(4096);
    const auto refused = apply(scene, size, {});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("exceeds 4 GiB"), std::string::npos) << refused.error().text();
    for (const char* name : {"n5", "n6"}) {
        remove.mutable_remove_light()->set_name(name);
        run(remove);
    }
    run(size);
    const RestoredShow restored = back();
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    expect_same_scene(scene, restored.scene);
}

TEST_F(SavedShow, APresetOfMoreLightsThanTheSizeAllowsComesBackWhole) {
    for (int i = 2; i < 14; ++i) run(light("n" + std::to_string(i), i / 2.0, true), web(100), "mine.ies");
    v1::Command save, remove, size, technique;
    save.mutable_save_preset()->set_name("all");
    run(save);
    for (int i = 2; i < 13; ++i) {
        remove.mutable_remove_light()->set_name("n" + std::to_string(i));
        run(remove);
    }
    size.mutable_set_size()->set_width_px(4096);
    size.mutable_set_size()->set_height_px(4096);
    run(size);
    technique.mutable_set_technique()->set_technique("seed");
    run(technique);
    ASSERT_EQ(scene.presets.at("all")->size(), 14u);
    const RestoredShow restored = back();
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    expect_same_scene(scene, restored.scene);
}

TEST_F(SavedShow, RevisionsGoOn) {
    saved::Show show = show_of(scene, texts);
    show.set_complete(true);
    EXPECT_EQ(revision_after(show), scene.scene_rev + 1);
    show.set_complete(false);
    EXPECT_EQ(revision_after(show), scene.scene_rev + kUnsavedRevisions);
    EXPECT_GE(restore_show(show, asset, true).scene.scene_rev, scene.scene_rev + kUnsavedRevisions);
}

// However large the number in the file is, changes get revisions of their own.
TEST_F(SavedShow, RevisionsBeginAnewBeforeTheyEnd) {
    saved::Show show = show_of(scene, texts);
    for (const bool complete : {false, true}) {
        show.set_complete(complete);
        show.set_scene_rev(kMaxSavedRevision - 1);
        EXPECT_GE(revision_after(show), kMaxSavedRevision);
        for (const Revision last : {kMaxSavedRevision, UINT32_MAX - kUnsavedRevisions, UINT32_MAX - 1, UINT32_MAX}) {
            show.set_scene_rev(last);
            EXPECT_EQ(revision_after(show), 1u) << last;
            scene = restore_show(show, asset, true).scene;
            const Revision before = scene.scene_rev;
            run(light(first, 1.5));
            EXPECT_EQ(scene.scene_rev, before + 1) << last;
        }
    }
}

// Files of the names of what is no file do not stand in for it.
TEST_F(SavedShow, NamesOfBuiltInScenesAndUploadsAreNoFiles) {
    namespace fs = std::filesystem;
    const fs::path before = fs::current_path(), folder = fs::path(testing::TempDir()) / "gonio-saved-names";
    fs::remove_all(folder);
    fs::create_directories(folder);
    fs::current_path(folder);
    for (const char* name : {"cornell", "atrium", "upload:room.gltf", "room.gltf"}) std::ofstream(name) << "x";
    const auto saved_name = [&](const std::string& name) {
        auto named = std::make_shared<SceneAsset>(*asset);
        named->name = name;
        const saved::Show show = show_of(scene_of(named), texts);
        EXPECT_TRUE(is_scene_of(show, name)) << name;
        return show.scene();
    };
    for (const char* name : {"cornell", "atrium", "upload:room.gltf"}) EXPECT_EQ(saved_name(name), name);
    EXPECT_EQ(saved_name("room.gltf"), fs::canonical("room.gltf").string());
    EXPECT_EQ(saved_name("./cornell"), fs::canonical("cornell").string());
    fs::current_path(before);
    fs::remove_all(folder);
}

TEST_F(SavedShow, WhatCannotComeBackIsAWarningAndTheRestComesBack) {
    make_show();
    // The file has lost its second light and gained another one.
    auto edited = std::make_shared<SceneAsset>(*asset);
    edited->lights[1].name = "third";
    RestoredShow restored = back(edited);
    ASSERT_EQ(restored.warnings.size(), 5u) << "of the show, of each preset and of two cues with contents of their own";
    for (const std::string& warning : restored.warnings)
        EXPECT_NE(warning.find("second"), std::string::npos) << warning;
    std::vector<std::string> names;
    for (const Light& one : restored.scene.lights) names.push_back(one.name);
    EXPECT_EQ(names, (std::vector<std::string>{first, "third", "spot", "wash"}));
    EXPECT_EQ(restored.scene.master_ratio, 0.75);
    EXPECT_EQ(restored.scene.presets.at("dim")->size(), 2u);

    // A value that somebody wrote into the file.
    saved::Show show = show_of(scene, texts);
    show.mutable_lights(0)->set_level_ratio(7);
    show.mutable_camera()->set_fov_rad(-1);
    show.mutable_profiles(0)->set_photometry("nonsense");
    restored = restore_show(show, asset, true);
    EXPECT_GE(restored.warnings.size(), 3u);
    EXPECT_EQ(restored.scene.exposure_ev100, 3.25);
    EXPECT_EQ(restored.scene.camera.fov_rad, scene_of(asset).camera.fov_rad);
}

// Whatever a show holds, a service is ready in time: what did not fit is named.
TEST_F(SavedShow, ProfilesThatTakeTooLongAreLeftOutByName) {
    make_show();
    ProfileTexts no_texts;
    const RestoredShow restored = restore_show(show_of(scene, no_texts), asset, true, std::chrono::milliseconds(0));
    const auto says = [&](const std::string& text) {
        return std::any_of(restored.warnings.begin(), restored.warnings.end(),
                           [&](const std::string& one) { return one.find(text) != std::string::npos; });
    };
    EXPECT_TRUE(says("profile 'mine.ies' is left out"));
    EXPECT_TRUE(says("profile 'spot.ies' is left out"));
    EXPECT_TRUE(says("light 'wash' is dark: its profile is missing"));
    ASSERT_EQ(restored.scene.lights.size(), 4u);
    const Light* const wash = find_light(restored.scene, "wash");
    ASSERT_NE(wash, nullptr);
    EXPECT_EQ(wash->profile->flux_lm, 0.0);
    EXPECT_EQ(wash->profile->photometry.diagnostics.at(0).code, "missing_file");
    EXPECT_EQ(wash->position, find_light(scene, "wash")->position) << "it waits for another profile where it was";
    EXPECT_EQ(restored.scene.master_ratio, scene.master_ratio) << "all else is there";
}

TEST_F(SavedShow, OfAnotherSceneOnlyTheSettingsComeBack) {
    make_show();
    const RestoredShow restored = back(*load_scene("cornell"), false);
    EXPECT_EQ(restored.scene.lights.size(), 1u);
    EXPECT_EQ(restored.scene.lights[0].level_ratio, 1.0);
    EXPECT_EQ(restored.scene.presets.size(), 2u);
    EXPECT_EQ(restored.scene.master_ratio, 0.75);
    EXPECT_EQ(restored.scene.view, View::indirect);
    EXPECT_TRUE(restored.scene.patch != nullptr);
    EXPECT_TRUE(restored.scene.groups.empty());
}

TEST_F(SavedShow, WhatIsNoShowIsRefused) {
    for (const char* text : {"", "{", "[]", "null", "{}", "{\"version\":0}", "\xff\xfe", "{\"version\":\"one\"}"}) {
        const auto read = read_show(text);
        ASSERT_FALSE(read) << text;
        EXPECT_EQ(read.error().code, "bad_state") << text;
    }
    EXPECT_EQ(read_show("{\"version\":2}").error().code, "unsupported");
    EXPECT_TRUE(read_show("{\"version\":1,\"something\":[1,2]}")) << "unknown fields are ignored";
    std::string deep;
    for (int i = 0; i < 100'000; ++i) deep += "{\"patch\":";
    EXPECT_FALSE(read_show(deep));
    // Cut anywhere it is no show, and nothing worse happens.
    make_show();
    const std::string whole = write_show(show_of(scene, texts));
    for (std::size_t cut = 0; cut + 2 < whole.size(); cut += 97) EXPECT_FALSE(read_show(whole.substr(0, cut))) << cut;
}

}  // namespace
}  // namespace gonio
