// Undo and redo of several clients at one scene: what comes back, what stays because another changed it, what is
// forgotten.
#include "server/session/undo.h"

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

TEST_F(UndoTest, EachCommandGoesThereAndBack) {
    v1::Command all = level("key", 0.25), aim;
    v1::SetLight& set = *all.mutable_set_light();
    for (const double x : {1.0, 2.0, 3.0}) set.add_position_m(x);
    for (const double x : {0.5, 0.25, 1.0}) set.add_color_rgb(x);
    set.set_tint_duv(0.01);
    set.set_cct_k(3200);
    set.set_gel("L204");
    aim.mutable_set_light()->set_name("fill");
    for (const double x : {0.3, -0.2, 0.1}) aim.mutable_set_light()->add_aim(x);
    expect_there_and_back({all,
                           aim,
                           pan("fill", 0.5),
                           group("all", {"key", "fill"}),
                           level("all", 0.125),
                           group("all", {"back"}),
                           add("spot"),
                           level("spot", 0.5),
                           group("all", {"spot", "key"}),
                           save("look"),
                           level("key", 1),
                           recall("look"),
                           level("key", 0.75),
                           save("look"),
                           add_cue("2"),
                           add_cue("1", 0, "look"),
                           label_cue("2", "Sunset"),
                           renaming("key", "main"),
                           remove_cue("1"),
                           remove_cue("2"),
                           patch("main", 1),
                           map("spot", 1),
                           map("spot", 2),
                           renaming("spot", "key"),
                           patch("key", 2),
                           removing("fill"),
                           removing("key"),
                           group("all", {}),
                           master(0.5),
                           remove_preset("look")});
}

TEST_F(UndoTest, ARemovedLightComesBackWithAllThatItHad) {
    say(kBob, group("all", {"back", "fill", "key"}));
    say(kBob, save("look"));
    say(kBob, level("fill", 0.25));
    say(kBob, level("fill", 0.5), another);
    say(kBob, command_of([](v1::Command& c) { c.mutable_set_view()->set_light("fill"); }));
    const std::string before = text();
    const std::uint32_t id = light("fill").id;
    ASSERT_EQ(say(kAnn, removing("fill")), "ok");
    EXPECT_EQ(scene().groups.at("all"), (std::vector<std::string>{"back", "key"}));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(difference(text(), before), "");
    EXPECT_EQ(scene().lights[1].name, "fill") << "in its place";
    EXPECT_EQ(light("fill").id, id);
    EXPECT_EQ(light("fill").profile, another);
    EXPECT_EQ(changes.back().by(), kAnn) << "a change like any other";
    EXPECT_EQ(changes.back().light_order(1), "fill");
    ASSERT_EQ(undo(kBob), "ok") << "what was done to it before it went";
    EXPECT_EQ(light("fill").level_ratio, 0.25);
    EXPECT_EQ(light("fill").profile, asset->lights[0].profile);
}

TEST_F(UndoTest, WhatAnotherChangedSinceStaysAndIsSaid) {
    v1::Command both = level("key", 0.5);
    both.mutable_set_light()->set_tint_duv(0.01);
    say(kAnn, both);
    say(kBob, level("key", 0.25));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{"level of 'key' was changed since by another client and stays"});
    EXPECT_EQ(light("key").level_ratio, 0.25);
    EXPECT_EQ(light("key").tint_duv, 0);
    ASSERT_EQ(undo(kBob), "ok");
    EXPECT_EQ(light("key").level_ratio, 0.5) << "as bob found it";
    ASSERT_EQ(redo(kAnn), "ok");
    EXPECT_EQ(light("key").tint_duv, 0.01);
    EXPECT_EQ(warnings(), std::vector<std::string>{}) << "it was said when it was undone";
}

// There and back again is a change too.
TEST_F(UndoTest, ConsolesCountAsOthers) {
    say(kAnn, level("key", 0.5));
    say(kAnn, master(0.5));
    console(level("key", 0.75));
    console(level("key", 0.5));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(scene().master_ratio, 1) << "no console moved it";
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(warnings(),
              std::vector<std::string>{"level of 'key' was changed since by a console or a fader box and stays"});
    EXPECT_EQ(light("key").level_ratio, 0.5);
    EXPECT_EQ(redo(kAnn), "ok") << "the master";
    EXPECT_EQ(scene().master_ratio, 0.5);
}

TEST_F(UndoTest, ALightThatAnotherHasChangedIsNotTakenAway) {
    for (const bool grouped : {false, true}) {
        const std::string name = grouped ? "two" : "one";
        ASSERT_EQ(say(kAnn, add(name)), "ok");
        say(kBob, grouped ? group("bobs", {name}) : level(name, 0.5));
        ASSERT_EQ(undo(kAnn), "ok");
        EXPECT_EQ(warnings(),
                  std::vector<std::string>{"light '" + name + "' was changed since by another client and stays"});
        ASSERT_NE(find_light(scene(), name), nullptr);
    }
    ASSERT_EQ(say(kAnn, add("three")), "ok");
    console(level("three", 0.5));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_NE(find_light(scene(), "three"), nullptr) << "so it is for a console";
}

TEST_F(UndoTest, WhatCannotComeBackIsSaid) {
    say(kAnn, removing("key"));
    ASSERT_EQ(say(kBob, renaming("fill", "key")), "ok");
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{"light 'key' is not set back: a light or group 'key' is there now"});
    EXPECT_EQ(scene().lights.size(), 2u);
    say(kAnn, level("back", 0.5));
    say(kBob, removing("back"));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{"level of a light that is gone stays"});
}

TEST_F(UndoTest, ADragIsOneStep) {
    for (int i = 1; i <= 5; ++i) say(kAnn, level("key", 1 - 0.1 * i, 7));
    say(kAnn, level("key", 0.25, 8));
    EXPECT_EQ(labels[kAnn].undo_label(), "level of key");
    undo(kAnn);
    EXPECT_EQ(light("key").level_ratio, 0.5);
    undo(kAnn);
    EXPECT_EQ(light("key").level_ratio, 1);
    EXPECT_EQ(undo(kAnn), "not_found");
    redo(kAnn);
    EXPECT_EQ(light("key").level_ratio, 0.5);
    // A drag over another's value goes back to that.
    say(kAnn, level("fill", 0.75, 9));
    say(kBob, level("fill", 0.625));
    say(kAnn, level("fill", 0.5, 9));
    undo(kAnn);
    EXPECT_EQ(light("fill").level_ratio, 0.625);
}

TEST_F(UndoTest, AFadeIsUndoneAsAWholeAndEnds) {
    say(kBob, level("key", 0.2));
    say(kBob, pan("fill", 1));
    say(kBob, save("look"));
    say(kBob, level("key", 1));
    say(kBob, pan("fill", 0));
    say(kBob, level("back", 0.5));
    const std::string before = text();
    ASSERT_EQ(say(kAnn, recall("look", 10)), "ok");
    ASSERT_TRUE(stage->fading());
    stage->advance_fade(monotonic_ns() + 4'000'000'000);
    EXPECT_NEAR(light("key").level_ratio, 0.68, 0.05);
    console(level("back", 0.25));  // another light leaves the fade
    stage->advance_fade(monotonic_ns() + 5'000'000'000);
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_FALSE(stage->fading());
    EXPECT_EQ(light("key").level_ratio, 1);
    EXPECT_EQ(light("fill").pan_rad, 0);
    EXPECT_EQ(light("back").level_ratio, 0.25);
    EXPECT_EQ(scene().recalled, "look") << "saved last, as before";
    console(level("back", 0.5));
    EXPECT_EQ(difference(text(), before), "");
    ASSERT_EQ(redo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, 0.2) << "at once";
    EXPECT_EQ(light("fill").pan_rad, 1);
}

TEST_F(UndoTest, AFadeGoesOnWithALightThatGetsAnotherName) {
    say(kBob, level("key", 0));
    say(kBob, save("dark"));
    say(kBob, level("key", 1));
    say(kAnn, recall("dark", 10));
    stage->advance_fade(monotonic_ns() + 2'000'000'000);
    ASSERT_EQ(say(kBob, renaming("key", "main")), "ok");
    stage->advance_fade(monotonic_ns() + 11'000'000'000);
    EXPECT_FALSE(stage->fading());
    EXPECT_EQ(light("main").level_ratio, 0);
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("main").level_ratio, 1);
}

TEST_F(UndoTest, LooksAreNotUndone) {
    say(kAnn, level("key", 0.5));
    say(kAnn, command_of([](v1::Command& c) { c.mutable_set_camera()->set_fov_rad(1); }));
    say(kAnn, command_of([](v1::Command& c) { c.mutable_set_exposure()->set_ev100(3); }));
    say(kAnn, command_of([](v1::Command& c) { c.mutable_set_view()->set_view("direct"); }));
    say(kAnn, command_of([](v1::Command& c) {
            c.mutable_set_size()->set_width_px(320);
            c.mutable_set_size()->set_height_px(240);
        }));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, 1);
    EXPECT_EQ(scene().camera.fov_rad, 1);
    EXPECT_EQ(scene().exposure_ev100, 3);
    EXPECT_EQ(scene().width_px, 320);
    EXPECT_EQ(undo(kAnn), "not_found");
}

TEST_F(UndoTest, AKeyOutlivesItsConnection) {
    say(kAnn, level("key", 0.5));
    say(kCy, level("fill", 0.5));
    leave(kAnn);
    leave(kCy);
    identify(11, "ann");
    EXPECT_EQ(labels[11].undo_label(), "level of key");
    identify(kCy, "");
    EXPECT_EQ(undo(kCy), "not_found") << "without a key it ends with the connection";
    ASSERT_EQ(undo(11), "ok");
    EXPECT_EQ(light("key").level_ratio, 1);
    EXPECT_EQ(labels[11].undo_label(), "");
    EXPECT_EQ(labels[11].redo_label(), "level of key");
}

TEST_F(UndoTest, LabelsAreToldWhereTheyChange) {
    v1::Command two = level("key", 0.5);
    two.mutable_set_light()->set_pan_rad(1);
    say(kAnn, two);
    EXPECT_EQ(labels[kAnn].undo_label(), "level and pan of key");
    EXPECT_EQ(labels.size(), 1u) << "to nobody else";
    say(kAnn, renaming("key", "main"));
    EXPECT_EQ(labels[kAnn].undo_label(), "rename key to main");
    undo(kAnn);
    EXPECT_EQ(labels[kAnn].undo_label(), "level and pan of key");
    EXPECT_EQ(labels[kAnn].redo_label(), "rename key to main");
    say(kAnn, master(0.5));
    EXPECT_EQ(labels[kAnn].redo_label(), "") << "a new change ends what could be redone";
    EXPECT_EQ(redo(kAnn), "not_found");
}

// A load is one step of whoever loaded: the whole scene comes back, and what everybody could undo in it.
TEST_F(UndoTest, ALoadIsOneStep) {
    say(kAnn, level("key", 0.5));
    say(kAnn, group("wash", {"key", "fill"}));
    say(kBob, save("look"));
    const std::string before = text();
    ASSERT_EQ(say(kAnn, load("cornell")), "ok");
    EXPECT_EQ(reply.result().replaced(), "cornell: 3 luminaires, 1 group, 1 preset; not saved");
    const std::string loaded = text();
    ASSERT_NE(difference(loaded, before), "");
    EXPECT_EQ(labels[kAnn].undo_label(), "load cornell");
    say(kAnn, level("back", 0.25));
    const std::string edited = text();
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(difference(text(), loaded), "") << "a step after the load comes first";
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{});
    EXPECT_EQ(difference(text(), before), "");
    EXPECT_EQ(labels[kAnn].undo_label(), "group wash");
    EXPECT_EQ(labels[kAnn].redo_label(), "load cornell");
    EXPECT_EQ(redo(kAnn), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{});
    EXPECT_EQ(difference(text(), loaded), "");
    EXPECT_EQ(redo(kAnn), "ok");
    EXPECT_EQ(difference(text(), edited), "") << "and what was undone in it";
    undo(kAnn), undo(kAnn);
    EXPECT_EQ(undo(kBob), "ok") << "bob's step of the scene that came back";
    EXPECT_TRUE(scene().presets.empty());
    undo(kAnn), undo(kAnn);
    EXPECT_EQ(light("key").level_ratio, 1.0);
    EXPECT_EQ(undo(kAnn), "not_found");
}

TEST_F(UndoTest, ALoadIsUndoneByWhomItWas) {
    say(kAnn, level("key", 0.5));
    ASSERT_EQ(say(kBob, load("cornell")), "ok");
    EXPECT_EQ(labels[kAnn].undo_label(), "");
    EXPECT_EQ(undo(kAnn), "not_found");
    EXPECT_EQ(reply.result().field(), "undo");
    EXPECT_EQ(reply.result().message(), "nothing to undo: a scene or a show was loaded since");
    say(kAnn, level("key", 0.75));
    EXPECT_EQ(undo(kBob), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{"what other clients changed since goes with it"});
    EXPECT_EQ(light("key").level_ratio, 0.5);
    EXPECT_EQ(redo(kBob), "ok");
    EXPECT_EQ(light("key").level_ratio, 0.75) << "ann's change came back with the scene";
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, 1.0);
    EXPECT_EQ(undo(kBob), "ok");
    EXPECT_EQ(undo(kAnn), "ok") << "her step before the load";
    EXPECT_EQ(light("key").level_ratio, 1.0);
}

TEST_F(UndoTest, AChangeEndsTheRedoOfALoad) {
    say(kAnn, load("cornell"));
    undo(kAnn);
    say(kAnn, level("key", 0.5));
    EXPECT_EQ(redo(kAnn), "not_found");
    EXPECT_EQ(undo(kAnn), "ok");
    say(kBob, load("cornell"));
    undo(kBob);
    EXPECT_EQ(redo(kAnn), "ok") << "a load of another ends nothing";
    EXPECT_EQ(light("key").level_ratio, 0.5);
}

// What the viewers chose stays theirs; the show's file still holds what it held.
TEST_F(UndoTest, AnUndoneLoadKeepsSizeAndViewAndWhatIsSaved) {
    const bool unsaved = show_file(scene()).unsaved();
    ASSERT_FALSE(unsaved);
    const std::uint32_t next = scene().next_light_id, id = light("key").id;
    say(kAnn, load("cornell"));
    EXPECT_TRUE(show_file(scene()).unsaved());
    say(kAnn, command_of([](v1::Command& c) {
            c.mutable_set_size()->set_width_px(640);
            c.mutable_set_size()->set_height_px(360);
        }));
    say(kAnn, command_of([](v1::Command& c) { c.mutable_set_view()->set_view("illuminance"); }));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(scene().width_px, 640);
    EXPECT_EQ(scene().view, View::illuminance);
    EXPECT_FALSE(show_file(scene()).unsaved());
    EXPECT_EQ(light("key").id, id);
    EXPECT_GT(scene().next_light_id, next) << "ids are not used twice";
    say(kAnn, level("key", 0.5));
    EXPECT_TRUE(show_file(scene()).unsaved());
    say(kAnn, load("cornell"));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_TRUE(show_file(scene()).unsaved()) << "it was not saved before the load either";
}

// A file of the name holds what was saved last: the scene that comes back is not in it any more.
TEST_F(UndoTest, AFileThatHoldsAnotherSceneHoldsNotTheOneThatComesBack) {
    ASSERT_FALSE(show_file(scene()).unsaved());
    say(kAnn, load("cornell"));
    Undo undo;
    undo.identify(1, "one", false);
    Scene kept = scene();
    kept.show_name = "Hall";
    kept.show_rev = kept.scene_rev;
    undo.note(1, kept, scene(), load("cornell"));
    ASSERT_FALSE(show_file(*undo.plan(1, false, scene())->scene).unsaved());
    undo.note_saved("Act 1");
    EXPECT_FALSE(show_file(*undo.plan(1, false, scene())->scene).unsaved());
    undo.note_saved("Hall");
    EXPECT_TRUE(show_file(*undo.plan(1, false, scene())->scene).unsaved());
}

// Whoever undoes with a base_rev wants no change of another to go with the scene.
TEST_F(UndoTest, AnUndoOfALoadWithBaseRevIsRefusedAfterAChangeOfAnother) {
    say(kAnn, load("cornell"));
    const Revision seen = scene().scene_rev;
    say(kBob, level("key", 0.75));
    v1::Command back = command_of([](v1::Command& c) { c.mutable_undo(); });
    back.set_base_rev(seen);
    EXPECT_EQ(say(kAnn, back), "conflict");
    EXPECT_EQ(light("key").level_ratio, 0.75);
    EXPECT_EQ(undo(kAnn), "ok");
}

// Others who gave a base_rev from before the scene changed are told of it.
TEST_F(UndoTest, AnUndoneLoadIsAChangeForBaseRev) {
    say(kAnn, load("cornell"));
    v1::Command stale = level("key", 0.25);
    stale.set_base_rev(scene().scene_rev);
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(say(kBob, stale), "conflict");
}

TEST_F(UndoTest, AConnectionWithoutAKeyTakesItsLoadsAlong) {
    say(kAnn, load("cornell"));
    say(kCy, load("cornell"));
    leave(kCy);
    EXPECT_EQ(undo(kAnn), "not_found") << "the scene after her load can come back no more";
}

// What a client sets with base_rev is in the way of an undo, and the other way round.
TEST_F(UndoTest, AnUndoIsAChangeForBaseRev) {
    say(kAnn, level("key", 0.5));
    const Revision seen = scene().scene_rev;
    undo(kAnn);
    v1::Command stale = level("key", 0.25);
    stale.set_base_rev(seen);
    EXPECT_EQ(say(kBob, stale), "conflict");
    EXPECT_EQ(reply.result().field(), "lights.key.level_ratio");
}

// Directly, of many keys.
class UndoBounds : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        scene = scene_of(*asset);
        name = scene.lights[0].name;
    }
    void say(std::uint32_t session, const v1::Command& command, const Loaded& loaded = {}) {
        const Scene before = scene;
        const auto applied = apply(scene, command, loaded);
        ASSERT_TRUE(applied) << applied.error().text();
        undo.note(session, before, scene, command);
    }
    int undone(std::uint32_t session) {
        for (int count = 0;; ++count) {
            const auto plan = undo.plan(session, false, scene);
            if (!plan) return count;
            const Scene before = scene;
            v1::Command command;
            command.mutable_undo();
            Loaded loaded;
            loaded.targets = std::make_shared<const std::vector<EditTarget>>(plan->targets);
            EXPECT_TRUE(apply(scene, command, loaded));
            undo.carried_out(session, false, *plan, before, scene);
        }
    }
    Scene scene;
    std::string name;
    Undo undo;
};

TEST_F(UndoBounds, AStepTakesWhatItChangedNotWhatThereIs) {
    undo.identify(1, "one", false);
    say(1, level(name, 0.5));
    const std::size_t small = undo.bytes();
    while (scene.lights.size() < kMaxLights) {
        const Loaded loaded{.profile = scene.lights[0].profile};
        ASSERT_TRUE(apply(scene, add("light " + std::to_string(scene.lights.size())), loaded));
    }
    say(1, level(name, 0.25));
    EXPECT_EQ(undo.bytes(), 2 * small);
    EXPECT_LT(small, 2048u);
}

TEST_F(UndoBounds, TheOldestStepOfAKeyGoes) {
    undo.identify(1, "one", false);
    for (std::size_t i = 0; i <= kMaxUndoSteps; ++i) say(1, master(0.001 * static_cast<double>(i)));
    EXPECT_EQ(undone(1), static_cast<int>(kMaxUndoSteps));
    EXPECT_EQ(scene.master_ratio, 0) << "what the first step made";
}

TEST_F(UndoBounds, TheKeyThatWasNotUsedForLongestGoes) {
    for (std::uint32_t key = 0; key <= kMaxUndoKeys; ++key) {
        undo.identify(key + 1, "key " + std::to_string(key), false);
        say(key + 1, master(0.001 * key));
        if (key == 1) say(1, master(0.5));  // the first is used again
    }
    EXPECT_EQ(undo.keys(), kMaxUndoKeys);
    EXPECT_TRUE(undo.plan(1, false, scene));
    EXPECT_FALSE(undo.plan(2, false, scene));
    EXPECT_TRUE(undo.plan(3, false, scene));
}

// The scenes that loads replaced: by their number, and by what they take.
TEST_F(UndoBounds, TheOldestSceneGoes) {
    constexpr std::size_t kMost = 100'000'000;
    undo = Undo(kMost);
    undo.identify(1, "one", false);
    const auto load_asset = [&](std::size_t image_bytes) {
        auto asset = std::make_shared<SceneAsset>(*scene.asset);
        asset->images.assign(1, Image{1, 1, std::vector<std::uint8_t>(image_bytes)});
        say(1, load("cornell"), {.asset = asset});
    };
    for (std::size_t i = 0; i <= kMaxUndoLoads; ++i) load_asset(4);
    EXPECT_EQ(undo.scenes(), kMaxUndoLoads);
    load_asset(kMost / 2 + 1);
    load_asset(kMost / 2 + 1);
    EXPECT_EQ(undo.scenes(), kMaxUndoLoads);
    load_asset(4);
    EXPECT_EQ(undo.scenes(), 1u) << "two large ones are too much";
    load_asset(kMost + 1);
    load_asset(4);
    EXPECT_EQ(undo.scenes(), 0u) << "one that is too large is not kept";
}

TEST_F(UndoBounds, TheOldestStepOfAllGoesBeyondTheBytes) {
    undo.identify(1, "one", false);
    undo.identify(2, "two", false);
    for (int i = 0; i < 100; ++i) {
        auto profile = std::make_shared<Profile>(*scene.lights[0].profile);
        profile->photometry.web.candela.resize(100'000);  // 0.8 MiB as counted, before and after
        profile->name = std::to_string(i);
        v1::Command set = level(name, 0.5);
        say(i % 2 == 0 ? 1 : 2, set, {.profile = profile});
        EXPECT_LE(undo.bytes(), kMaxUndoBytes);
    }
    const int first = undone(1), second = undone(2);
    EXPECT_GE(first + second, 8);
    EXPECT_LE(first + second, 20);
    EXPECT_LE(std::abs(first - second), 1) << "by age, not by client";
}

// A drag is one connection's: one of the same number by another connection of the same person is a step of its own.
TEST_F(UndoTest, AnotherConnectionsGestureIsAnotherStep) {
    constexpr std::uint32_t kAnnAgain = 4;
    identify(kAnnAgain, "ann");
    const double key = light("key").level_ratio, fill = light("fill").level_ratio;
    say(kAnn, level("key", 0.5, 7));
    say(kAnnAgain, level("fill", 0.25, 7));
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("fill").level_ratio, fill);
    EXPECT_EQ(light("key").level_ratio, 0.5);
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, key);
}

}  // namespace
}  // namespace gonio
