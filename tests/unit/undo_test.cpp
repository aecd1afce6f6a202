// Undo and redo of several clients at one scene: what comes back, what stays because another changed it, what is
// forgotten.
#include "server/session/undo.h"

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "server/assets/assets.h"
#include "server/scene/state.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"
#include "server/show/saved_show.h"

namespace gonio {
namespace {

constexpr std::uint32_t kAnn = 1, kBob = 2, kCy = 3;

v1::Command command_of(const std::function<void(v1::Command&)>& fill) {
    v1::Command command;
    fill(command);
    return command;
}
v1::Command level(const std::string& light, double ratio, std::uint32_t gesture = 0) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_light()->set_name(light);
        c.mutable_set_light()->set_level_ratio(ratio);
        if (gesture != 0) c.set_gesture(gesture);
    });
}
v1::Command pan(const std::string& light, double rad) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_light()->set_name(light);
        c.mutable_set_light()->set_pan_rad(rad);
    });
}
v1::Command group(const std::string& name, const std::vector<std::string>& lights) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_group()->set_name(name);
        for (const std::string& light : lights) c.mutable_set_group()->add_lights(light);
    });
}
v1::Command add(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name(name); });
}
v1::Command removing(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_remove_light()->set_name(name); });
}
v1::Command renaming(const std::string& name, const std::string& new_name) {
    return command_of([&](v1::Command& c) {
        c.mutable_rename_light()->set_name(name);
        c.mutable_rename_light()->set_new_name(new_name);
    });
}
v1::Command master(double ratio) {
    return command_of([&](v1::Command& c) { c.mutable_set_master()->set_ratio(ratio); });
}
v1::Command save(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_save_preset()->set_name(name); });
}
v1::Command recall(const std::string& name, double fade_s = 0) {
    return command_of([&](v1::Command& c) {
        c.mutable_recall_preset()->set_name(name);
        c.mutable_recall_preset()->set_fade_s(fade_s);
    });
}
v1::Command remove_preset(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_remove_preset()->set_name(name); });
}
v1::Command patch(const std::string& light, std::uint32_t address) {
    return command_of([&](v1::Command& c) {
        v1::PatchRow& row = *c.mutable_set_patch()->add_rows();
        row.set_protocol("sacn");
        row.set_universe(1);
        row.set_address(address);
        row.set_target(light);
        row.set_property("level");
    });
}
v1::Command map(const std::string& light, int slider) {
    return command_of([&](v1::Command& c) {
        v1::SurfaceRow& row = *c.mutable_map_control()->mutable_row();
        row.set_device("*");
        row.set_control("slider " + std::to_string(slider));
        row.set_target(light);
        row.set_property("level");
    });
}

class UndoTest : public testing::Test {
protected:
    void SetUp() override {
        auto loaded = load_scene("cornell");
        ASSERT_TRUE(loaded);
        auto copy = std::make_shared<SceneAsset>(**loaded);
        copy->lights[0].name = "key";
        for (const char* name : {"fill", "back"}) {
            copy->lights.push_back(copy->lights[0]);
            copy->lights.back().name = name;
        }
        asset = copy;
        auto profile = std::make_shared<Profile>(*asset->lights[0].profile);
        profile->name = "another";
        another = profile;
        start();
    }
    void start() {
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t session, v1::ServerMessage message) {
            if (message.has_undo_state())
                labels[session] = message.undo_state();
            else
                reply = std::move(message);
        };
        outputs.state = [this](v1::State, v1::StateChanged change) { changes.push_back(std::move(change)); };
        outputs.picture = [](Picture) {};
        outputs.gone = [](std::uint32_t) {};
        labels.clear();
        stage.emplace(std::make_unique<NullRenderer>(), scene_of(asset), "null", queue, loader, std::move(outputs));
        identify(kAnn, "ann");
        identify(kBob, "bob");
        identify(kCy, "");
    }
    void identify(std::uint32_t session, const std::string& undo_key) {
        Work work;
        work.session = session;
        work.message.mutable_identify()->set_client("somebody");
        work.message.mutable_identify()->set_state(true);
        work.message.mutable_identify()->set_undo_key(undo_key);
        stage->take(std::move(work));
    }
    void leave(std::uint32_t session) { stage->take({.session = session, .message = {}, .closed = true}); }
    // Result: the code of the answer. A light that is added, or told so, gets `profile`.
    std::string say(std::uint32_t session, const v1::Command& command, std::shared_ptr<const Profile> profile = {}) {
        Work work;
        work.session = session;
        work.message.set_request_id(9);
        *work.message.mutable_command() = command;
        work.read = command.has_add_light() || command.has_load_scene() || profile;
        work.loaded.profile = profile ? profile : command.has_add_light() ? asset->lights[0].profile : nullptr;
        if (command.has_load_scene()) work.loaded.asset = asset;
        stage->take(std::move(work));
        return reply.result().code();
    }
    std::string undo(std::uint32_t session) {
        return say(session, command_of([](v1::Command& c) { c.mutable_undo(); }));
    }
    std::string redo(std::uint32_t session) {
        return say(session, command_of([](v1::Command& c) { c.mutable_redo(); }));
    }
    std::vector<std::string> warnings() const {
        return {reply.result().warnings().begin(), reply.result().warnings().end()};
    }
    void console(const v1::Command& command) {
        const Revision before = stage->scene().scene_rev;
        stage->apply_inputs({&command, 1});
        stage->tell_inputs(before);
    }
    // Result: the first line that differs; empty where none does.
    static std::string difference(const std::string& is, const std::string& was) {
        std::istringstream one(is), other(was);
        std::string a, b;
        for (int line = 1; std::getline(one, a) && std::getline(other, b); ++line)
            if (a != b) return "line " + std::to_string(line) + ": " + a.substr(0, 200) + " was " + b.substr(0, 200);
        return is == was ? "" : "the end";
    }
    const Scene& scene() const { return stage->scene(); }
    const Light& light(const std::string& name) const { return *find_light(scene(), name); }
    // All that makes the show and all that clients are told, without revisions.
    std::string text() {
        saved::Show show = show_of(scene(), texts);
        show.clear_scene_rev();
        v1::State state = full_state(scene());
        state.clear_scene_rev();
        std::string json;
        EXPECT_TRUE(google::protobuf::util::MessageToJsonString(state, &json).ok());
        return write_show(show) + json;
    }
    // The commands as Ann's, undone one by one and redone: each time the scene is as it was.
    void expect_there_and_back(const std::vector<v1::Command>& commands) {
        std::vector<std::string> before;
        for (const v1::Command& command : commands) {
            before.push_back(text());
            ASSERT_EQ(say(kAnn, command), "ok") << command.ShortDebugString() << reply.ShortDebugString();
            ASSERT_NE(difference(text(), before.back()), "") << command.ShortDebugString();
        }
        before.push_back(text());
        for (std::size_t i = commands.size(); i-- > 0;) {
            ASSERT_EQ(undo(kAnn), "ok");
            EXPECT_EQ(warnings(), std::vector<std::string>{}) << commands[i].ShortDebugString();
            EXPECT_EQ(difference(text(), before[i]), "") << commands[i].ShortDebugString();
        }
        EXPECT_EQ(undo(kAnn), "not_found");
        for (std::size_t i = 0; i < commands.size(); ++i) {
            ASSERT_EQ(redo(kAnn), "ok");
            EXPECT_EQ(warnings(), std::vector<std::string>{}) << commands[i].ShortDebugString();
            EXPECT_EQ(difference(text(), before[i + 1]), "") << commands[i].ShortDebugString();
        }
        EXPECT_EQ(redo(kAnn), "not_found");
    }

    std::shared_ptr<const SceneAsset> asset;
    std::shared_ptr<const Profile> another;
    v1::ServerMessage reply;
    std::map<std::uint32_t, v1::UndoState> labels;
    std::vector<v1::StateChanged> changes;
    ProfileTexts texts;
    Queue<Work> queue{100};
    Loader loader;
    std::optional<RenderSession> stage;
};

TEST_F(UndoTest, EachCommandGoesThereAndBack) {
    v1::Command all = level("key", 0.25), aim;
    v1::SetLight& set = *all.mutable_set_light();
    for (const double x : {1.0, 2.0, 3.0}) set.add_position_m(x);
    for (const double x : {0.5, 0.25, 1.0}) set.add_color_rgb(x);
    set.set_tint_duv(0.01);
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
                           renaming("key", "main"),
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

TEST_F(UndoTest, AnotherSceneForgetsAll) {
    say(kAnn, level("key", 0.5));
    ASSERT_EQ(say(kBob, command_of([](v1::Command& c) { c.mutable_load_scene()->set_file("cornell"); })), "ok");
    EXPECT_EQ(undo(kAnn), "not_found");
    EXPECT_EQ(reply.result().field(), "undo");
    EXPECT_EQ(reply.result().message(), "nothing to undo: the scene was loaded since");
    EXPECT_EQ(undo(kBob), "not_found");
    EXPECT_EQ(reply.result().message(), "nothing to undo") << "bob had done nothing before";
    EXPECT_EQ(labels[kAnn].undo_label(), "");
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

// ---- random sequences of three clients and a console
class UndoAtRandom : public UndoTest, public testing::WithParamInterface<int> {
protected:
    std::mt19937 random{static_cast<std::uint32_t>(GetParam())};
    std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random); }
    double ratio() { return 0.001 * static_cast<double>(pick(1001)); }
    std::string some_light() {
        if (pick(8) == 0 || scene().lights.empty()) return "l" + std::to_string(pick(4));
        return scene().lights[pick(scene().lights.size())].name;
    }
    std::string some(const char* prefix, std::size_t count) { return prefix + std::to_string(pick(count)); }
    v1::Command some_command(bool renames) {
        switch (pick(renames ? 16 : 15)) {
            case 0:
                return add(some("l", 4));
            case 1:
                return removing(some_light());
            case 2: {
                std::vector<std::string> lights;
                for (std::size_t i = pick(4); i > 0; --i) lights.push_back(some_light());
                return group(some("g", 3), lights);
            }
            case 3:
                return master(ratio());
            case 4:
                return save(some("p", 3));
            case 5:
                return recall(some("p", 3));
            case 6:
                return remove_preset(some("p", 3));
            case 7:
                return patch(some_light(), static_cast<std::uint32_t>(1 + pick(5)));
            case 8:
                return map(some_light(), static_cast<int>(pick(5)));
            case 9:
                return level(some("g", 3), ratio());
            case 10:
                return pan(some_light(), ratio());
            case 11: {
                v1::Command command = level(some_light(), ratio());
                for (int i = 0; i < 3; ++i) command.mutable_set_light()->add_position_m(ratio());
                for (int i = 0; i < 3; ++i) command.mutable_set_light()->add_aim(0.1 + ratio());
                return command;
            }
            case 15:
                return renaming(some_light(), some("l", 6));
            default:
                return level(some_light(), ratio());
        }
    }
    std::shared_ptr<const Profile> some_profile(const v1::Command& command) {
        return command.has_set_light() && pick(6) == 0 ? pick(2) == 0 ? another : asset->lights[0].profile : nullptr;
    }
};

TEST_P(UndoAtRandom, UndoneInReverseOrderTheSceneIsAsBeforeAndRedoneAsAfter) {
    std::vector<std::uint32_t> order;
    std::vector<std::string> before, said;
    while (order.size() < 60) {
        const v1::Command command = some_command(true);
        const std::uint32_t session = static_cast<std::uint32_t>(1 + pick(3));
        const std::string was = text();
        const Revision rev = scene().scene_rev;
        if (say(session, command, some_profile(command)) != "ok" || scene().scene_rev == rev) continue;
        order.push_back(session);
        before.push_back(was);
        said.push_back(command.ShortDebugString());
    }
    before.push_back(text());
    for (std::size_t i = order.size(); i-- > 0;) {
        ASSERT_EQ(undo(order[i]), "ok");
        ASSERT_EQ(warnings(), std::vector<std::string>{}) << "step " << i;
        ASSERT_EQ(difference(text(), before[i]), "") << "step " << i << " " << said[i];
    }
    for (const std::uint32_t session : {kAnn, kBob, kCy}) EXPECT_EQ(undo(session), "not_found");
    for (std::size_t i = 0; i < order.size(); ++i) {
        ASSERT_EQ(redo(order[i]), "ok");
        ASSERT_EQ(difference(text(), before[i + 1]), "") << "step " << i << " " << said[i];
    }
}

// Every property as text, by its name. The orientation is one, as base_rev has it.
std::map<std::string, std::string> properties_of(const Scene& scene) {
    std::map<std::string, std::string> properties;
    for (const Light& light : scene.lights) {
        const std::string path = "light " + light.name + " ";
        properties[path] = "there";
        for (const LightRow& row : light_rows()) {
            std::string& text =
                properties[path + (row.stale == &Light::aim_rev ? "aim" : std::string(row_of(row.property).name))];
            for (const double number : numbers_of(light, row)) text += std::to_string(number) + " ";
        }
        properties[path + "profile"] = light.profile->name;
    }
    for (const auto& [name, lights] : scene.groups)
        for (const std::string& light : lights) properties["group " + name] += light + " ";
    for (const auto& [name, preset] : scene.presets)
        properties["preset " + name] = std::to_string(reinterpret_cast<std::uintptr_t>(preset.get()));
    properties["patch"] = std::to_string(reinterpret_cast<std::uintptr_t>(scene.patch.get()));
    properties["surfaces"] = std::to_string(reinterpret_cast<std::uintptr_t>(scene.surfaces.get()));
    properties["master"] = std::to_string(scene.master_ratio);
    return properties;
}

// An account of its own: of each property who wrote which value. An undo may take back the newest value alone, and its
// own alone.
TEST_P(UndoAtRandom, UndoneInAnyOrderNoLaterValueOfAnotherChanges) {
    using Account = std::map<std::string, std::vector<std::pair<std::string, std::uint32_t>>>;
    Account account;
    for (const auto& [path, value] : properties_of(scene())) account[path].emplace_back(value, 0);
    int taken_back = 0, stayed = 0;
    for (int turn = 0; turn < 300; ++turn) {
        const auto before = properties_of(scene());
        const std::uint32_t session = static_cast<std::uint32_t>(1 + pick(3));
        const std::size_t what = pick(10);
        std::uint32_t by = session;
        if (what < 3) {
            undo(session);
            stayed += reply.result().warnings_size();
        } else if (what < 4) {
            redo(session);
        } else if (what < 6) {
            by = 0;
            console(pick(2) == 0 ? level(some_light(), ratio()) : pan(some_light(), ratio()));
        } else {
            const v1::Command command = some_command(false);
            say(session, command, some_profile(command));
        }
        auto after = properties_of(scene());
        std::set<std::string> paths;
        for (const auto& [path, value] : before) paths.insert(path);
        for (const auto& [path, value] : after) paths.insert(path);
        for (const std::string& path : paths) {
            const std::string was = before.contains(path) ? before.at(path) : "", is = after[path];
            if (was == is) continue;
            auto& values = account[path];
            if (what >= 3) {
                values.emplace_back(is, by);
                continue;
            }
            ++taken_back;
            ASSERT_FALSE(values.empty()) << path;
            ASSERT_EQ(values.back().second, session) << path << " is another's, turn " << turn;
            values.pop_back();
            ASSERT_EQ(values.empty() ? "" : values.back().first, is) << path << ", turn " << turn;
        }
        for (const auto& [name, lights] : scene().groups)
            for (const std::string& light : lights) ASSERT_NE(find_light(scene(), light), nullptr) << name;
        ASSERT_TRUE(std::ranges::is_sorted(scene().lights, {}, &Light::id));
    }
    EXPECT_GT(taken_back, 20);
    EXPECT_GT(stayed, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, UndoAtRandom, testing::Range(1, 21));

}  // namespace
}  // namespace gonio
