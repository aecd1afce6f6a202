// Several clients at one scene who undo and redo, and the commands that they give.
#pragma once

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <sstream>

#include "server/assets/assets.h"
#include "server/scene/state.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"
#include "server/show/saved_show.h"

namespace gonio::undo_test {

inline constexpr std::uint32_t kAnn = 1, kBob = 2, kCy = 3;

inline v1::Command command_of(const std::function<void(v1::Command&)>& fill) {
    v1::Command command;
    fill(command);
    return command;
}
inline v1::Command level(const std::string& light, double ratio, std::uint32_t gesture = 0) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_light()->set_name(light);
        c.mutable_set_light()->set_level_ratio(ratio);
        if (gesture != 0) c.set_gesture(gesture);
    });
}
inline v1::Command pan(const std::string& light, double rad) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_light()->set_name(light);
        c.mutable_set_light()->set_pan_rad(rad);
    });
}
inline v1::Command group(const std::string& name, const std::vector<std::string>& lights) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_group()->set_name(name);
        for (const std::string& light : lights) c.mutable_set_group()->add_lights(light);
    });
}
inline v1::Command add(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_add_light()->mutable_light()->set_name(name); });
}
inline v1::Command removing(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_remove_light()->set_name(name); });
}
inline v1::Command renaming(const std::string& name, const std::string& new_name) {
    return command_of([&](v1::Command& c) {
        c.mutable_rename_light()->set_name(name);
        c.mutable_rename_light()->set_new_name(new_name);
    });
}
inline v1::Command master(double ratio) {
    return command_of([&](v1::Command& c) { c.mutable_set_master()->set_ratio(ratio); });
}
inline v1::Command load(const std::string& file) {
    return command_of([&](v1::Command& c) { c.mutable_load_scene()->set_file(file); });
}
inline v1::Command save(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_save_preset()->set_name(name); });
}
inline v1::Command recall(const std::string& name, double fade_s = 0) {
    return command_of([&](v1::Command& c) {
        c.mutable_recall_preset()->set_name(name);
        c.mutable_recall_preset()->set_fade_s(fade_s);
    });
}
inline v1::Command remove_preset(const std::string& name) {
    return command_of([&](v1::Command& c) { c.mutable_remove_preset()->set_name(name); });
}
inline v1::Command add_cue(const std::string& number, double up_s = 5, const std::string& preset = "") {
    return command_of([&](v1::Command& c) {
        c.mutable_add_cue()->set_number(number);
        c.mutable_add_cue()->set_up_s(up_s);
        if (!preset.empty()) c.mutable_add_cue()->set_preset(preset);
    });
}
inline v1::Command label_cue(const std::string& number, const std::string& label) {
    return command_of([&](v1::Command& c) {
        c.mutable_set_cue()->set_number(number);
        c.mutable_set_cue()->set_label(label);
    });
}
inline v1::Command remove_cue(const std::string& number) {
    return command_of([&](v1::Command& c) { c.mutable_remove_cue()->set_number(number); });
}
inline v1::Command go() {
    return command_of([](v1::Command& c) { c.mutable_cue_go(); });
}
inline v1::Command patch(const std::string& light, std::uint32_t address) {
    return command_of([&](v1::Command& c) {
        v1::PatchRow& row = *c.mutable_set_patch()->add_rows();
        row.set_protocol("sacn");
        row.set_universe(1);
        row.set_address(address);
        row.set_target(light);
        row.set_property("level");
    });
}
inline v1::Command map(const std::string& light, int slider) {
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
    void start() { start_with(scene_of(asset)); }
    void start_with(Scene first) {
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
        stage.emplace(std::make_unique<NullRenderer>(), std::move(first), "null", queue, loader, std::move(outputs));
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
        const bool undoes = command.has_undo() || command.has_redo();
        if (undoes) reply.Clear();
        stage->take(std::move(work));
        // A scene that comes back goes by way of the loader.
        for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
             undoes && reply.message_case() == 0 && std::chrono::steady_clock::now() < until;)
            if (auto back = queue.pop_for(std::chrono::milliseconds(100))) stage->take(std::move(*back));
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
        show.clear_show_unsaved();  // follows the revision
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

}  // namespace gonio::undo_test
