// Shows that clients save, list, read and open: names that are no paths, files that are whole, who may, and what is
// said.
#include "server/session/shows.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"
#include "server/show/saved_show.h"
#include "server/show/show_folder.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

class ShowsTest : public testing::Test {
protected:
    void SetUp() override {
        home = fs::path(testing::TempDir()) / ("gonio-shows-" + std::to_string(::getpid()));
        fs::remove_all(home);
        fs::create_directories(home / "uploads");
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t, v1::ServerMessage message) { replies.push(std::move(message)); };
        outputs.state = [this](v1::State state, v1::StateChanged change) {
            whole = std::move(state);
            changed = std::move(change);
        };
        outputs.picture = [](Picture) {};
        outputs.gone = [](std::uint32_t) {};
        stage.emplace(std::make_unique<NullRenderer>(), scene_of(*asset), "null", queue, loader, std::move(outputs));
        SceneAccess access;
        access.upload_folder = (home / "uploads").string();
        access.show_folder = (home / "shows").string();
        stage->set_scene_access(access);
        light = stage->scene().lights[0].name;
        identify(1, "");
        identify(2, "viewer");
    }
    void TearDown() override { fs::remove_all(home); }
    void identify(std::uint32_t session, const std::string& role) {
        Work work;
        work.session = session;
        work.message.mutable_identify()->set_role(role);
        stage->take(std::move(work));
    }
    // Says it, and does what the loader hands back. Result: the answer.
    v1::ServerMessage say(std::uint32_t session, v1::ClientMessage message) {
        Work work;
        work.session = session;
        work.message = std::move(message);
        work.message.set_request_id(9);
        stage->take(std::move(work));
        for (int i = 0; i < 3000; ++i) {
            if (auto done = queue.try_pop()) stage->take(std::move(*done));
            if (auto answer = replies.try_pop()) return *answer;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        ADD_FAILURE() << "no answer";
        return {};
    }
    v1::Result save(const std::string& name, bool replace = false, std::uint32_t session = 1) {
        v1::ClientMessage message;
        message.mutable_save_show()->set_name(name);
        message.mutable_save_show()->set_replace(replace);
        return say(session, message).result();
    }
    v1::Result open(const std::string& name, std::uint32_t session = 1) {
        v1::ClientMessage message;
        message.mutable_command()->mutable_open_show()->set_name(name);
        return say(session, message).result();
    }
    v1::Result level(double ratio) {
        v1::ClientMessage message;
        message.mutable_command()->mutable_set_light()->set_name(light);
        message.mutable_command()->mutable_set_light()->set_level_ratio(ratio);
        return say(1, message).result();
    }
    v1::ServerMessage shows(std::optional<std::string> text_of = {}, std::uint32_t session = 1) {
        v1::ClientMessage message;
        message.mutable_shows();
        if (text_of) message.mutable_shows()->set_text_of(*text_of);
        return say(session, message);
    }
    fs::path file(const std::string& name) const { return home / "shows" / (name + ".json"); }
    static std::string text_of(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }

    fs::path home;
    Queue<v1::ServerMessage> replies{100};
    Queue<Work> queue{100};
    Loader loader;
    std::optional<RenderSession> stage;
    v1::State whole;
    v1::StateChanged changed;
    std::string light;
};

// What consoles drive is of the moment: 44 times a second it would be a change. A hand's fader is one, and a preset
// that a console saves.
TEST_F(ShowsTest, WhatConsolesDriveIsNoChangeOfTheShow) {
    const auto input = [&](double ratio, Driven driven) {
        std::vector<v1::Command> commands(2);
        commands[0].mutable_set_light()->set_name(light);
        commands[0].mutable_set_light()->set_level_ratio(ratio);
        commands[1].mutable_set_master()->set_ratio(ratio);
        stage->apply_inputs(commands, 0, driven);
    };
    ASSERT_EQ(save("Act 1").code(), "ok");
    input(0.5, Driven::by_console);
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.5);
    EXPECT_FALSE(stage->state().show().unsaved());
    // Also where it goes on between a save and its end.
    const Revision before = stage->scene().scene_rev;
    ASSERT_EQ(save("Act 1").code(), "ok");
    input(0.6, Driven::by_console);
    EXPECT_GT(stage->scene().scene_rev, before);
    EXPECT_FALSE(stage->state().show().unsaved());
    ASSERT_EQ(level(0.7).code(), "ok");
    input(0.8, Driven::by_console);
    EXPECT_TRUE(stage->state().show().unsaved()) << "a client's change stays one";
    ASSERT_EQ(save("Act 1").code(), "ok");
    EXPECT_FALSE(stage->state().show().unsaved());
    input(0.4, Driven::by_hand);
    EXPECT_TRUE(stage->state().show().unsaved());
    ASSERT_EQ(save("Act 1").code(), "ok");
    v1::Command preset;
    preset.mutable_save_preset()->set_name("by the desk");
    stage->apply_inputs({&preset, 1}, 0, Driven::by_console);
    EXPECT_TRUE(stage->state().show().unsaved());
    ASSERT_EQ(open("Act 1").code(), "ok");
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.4) << "the level that it had when it was saved";
}

TEST_F(ShowsTest, ASavedShowIsOpenedAsItWas) {
    EXPECT_FALSE(stage->state().show().unsaved());
    EXPECT_TRUE(stage->state().show().can_save());
    ASSERT_EQ(level(0.25).code(), "ok");
    EXPECT_TRUE(changed.state().show().unsaved()) << "told with the change";
    ASSERT_EQ(save("Act 1").code(), "ok");
    EXPECT_EQ(changed.state().show().name(), "Act 1");
    EXPECT_FALSE(whole.show().unsaved());
    v1::ClientMessage look;
    look.mutable_command()->mutable_set_camera()->set_fov_rad(1.0);
    ASSERT_EQ(say(1, look).result().code(), "ok");
    EXPECT_FALSE(stage->state().show().unsaved()) << "how one looks at it does not count";
    ASSERT_EQ(level(0.75).code(), "ok");
    const Revision before = stage->scene().scene_rev;
    const std::uint32_t id = stage->scene().lights[0].id;
    ASSERT_EQ(open("Act 1").code(), "ok");
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.25);
    EXPECT_EQ(stage->scene().scene_rev, before + 1) << "one revision";
    EXPECT_NE(stage->scene().lights[0].id, id) << "it is another light";
    EXPECT_EQ(changed.state().lights(0).level_ratio(), 0.25);
    EXPECT_EQ(stage->state().show().name(), "Act 1");
    EXPECT_FALSE(stage->state().show().unsaved());
    v1::ClientMessage undo;
    undo.mutable_command()->mutable_undo();
    const v1::Result nothing = say(1, undo).result();
    EXPECT_EQ(nothing.code(), "not_found");
    EXPECT_NE(nothing.message().find("loaded since"), std::string::npos) << nothing.message();
}

TEST_F(ShowsTest, TheFileIsTheShowOfTheStateFile) {
    ASSERT_EQ(level(0.5).code(), "ok");
    ASSERT_EQ(save("a").code(), "ok");
    const auto show = read_show(text_of(file("a")));
    ASSERT_TRUE(show) << show.error().text();
    EXPECT_EQ(show->scene(), "cornell");
    EXPECT_EQ(show->lights(0).level_ratio(), 0.5);
    const auto whole_text = shows("").shows();
    EXPECT_EQ(whole_text.text_of(), "");
    EXPECT_TRUE(read_show(whole_text.text()));
    EXPECT_EQ(shows("a", 2).shows().text(), text_of(file("a"))) << "a viewer may look";
}

TEST_F(ShowsTest, AnotherShowIsWrittenOverOnlyWhenThatIsSaid) {
    ASSERT_EQ(save("a").code(), "ok");
    ASSERT_EQ(save("b").code(), "ok");
    EXPECT_EQ(save("a").code(), "already_exists");
    EXPECT_EQ(stage->state().show().name(), "b");
    ASSERT_EQ(level(0.5).code(), "ok");
    EXPECT_EQ(save("b").code(), "ok") << "the show at hand";
    EXPECT_EQ(save("").code(), "ok") << "likewise";
    EXPECT_EQ(save("a", true).code(), "ok");
    const auto listed = shows().shows();
    ASSERT_EQ(listed.shows_size(), 2);
    EXPECT_EQ(listed.shows(0).name(), "a");
    EXPECT_GT(listed.shows(0).bytes(), 100);
    EXPECT_LT(listed.shows(0).age_s(), 60);
}

TEST_F(ShowsTest, AViewerChangesNothing) {
    EXPECT_EQ(save("a", false, 2).code(), "permission");
    EXPECT_FALSE(fs::exists(file("a")));
    ASSERT_EQ(save("a").code(), "ok");
    EXPECT_EQ(open("a", 2).code(), "permission");
    EXPECT_EQ(shows({}, 2).shows().shows_size(), 1);
}

TEST_F(ShowsTest, ANameIsNoPath) {
    std::ofstream(home / "outside.json") << "{}";
    fs::create_directories(home / "shows");
    for (const std::string bad :
         {"../outside", "a/b", "/etc/passwd", "..", ".hidden", "a\\b", "a\nb", "upload:x", "\xff\xfe"}) {
        EXPECT_EQ(save(bad).code(), "invalid_argument") << bad;
        EXPECT_EQ(shows(bad).result().code(), "invalid_argument") << bad;
        EXPECT_NE(open(bad).code(), "ok") << bad;
    }
    EXPECT_EQ(save(std::string(101, 'a')).code(), "invalid_argument");
    EXPECT_EQ(save("").code(), "invalid_argument") << "it has no name yet";
    EXPECT_EQ(save("Zweiter Akt, süß.json").code(), "ok");
    EXPECT_TRUE(fs::exists(file("Zweiter Akt, süß")));
    fs::create_symlink(home / "outside.json", file("link"));
    EXPECT_EQ(shows("link").result().code(), "not_found");
    EXPECT_EQ(open("link").code(), "not_found");
    EXPECT_EQ(save("link", true).code(), "file_unwritable");
    EXPECT_EQ(text_of(home / "outside.json"), "{}");
    EXPECT_EQ(shows().shows().shows_size(), 1) << "links are not listed";
}

TEST_F(ShowsTest, WhatCannotBeOpenedChangesNothingAndSaysWhy) {
    ASSERT_EQ(level(0.5).code(), "ok");
    ASSERT_EQ(save("good").code(), "ok");
    const Revision before = stage->scene().scene_rev;
    EXPECT_EQ(open("missing").code(), "not_found");
    std::ofstream(file("broken")) << "{\"version\": 1, ";
    const v1::Result broken = open("broken");
    EXPECT_EQ(broken.code(), "bad_state");
    EXPECT_EQ(broken.value(), "broken") << "names the file";
    std::ofstream(file("later")) << "{\"version\": 99}";
    EXPECT_EQ(open("later").code(), "unsupported");
    std::string text = text_of(file("good"));
    text.replace(text.find("\"cornell\""), 9, "\"/no/such/room.gltf\"");
    std::ofstream(file("elsewhere")) << text;
    EXPECT_NE(open("elsewhere").code(), "ok");
    EXPECT_EQ(stage->scene().scene_rev, before);
    EXPECT_EQ(stage->state().show().name(), "good");
}

TEST_F(ShowsTest, AnUploadIsOpenedAndIsNotSavedYet) {
    ASSERT_EQ(level(0.125).code(), "ok");
    std::ofstream(home / "uploads" / "mine.json") << shows("").shows().text();
    ASSERT_EQ(level(1).code(), "ok");
    ASSERT_EQ(open("upload:mine.json").code(), "ok");
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.125);
    EXPECT_EQ(stage->state().show().name(), "");
    EXPECT_TRUE(stage->state().show().unsaved());
}

TEST_F(ShowsTest, ADiskThatRefusesIsSaidWithFileAndReason) {
    std::ofstream(home / "shows") << "a file stands where the folder should be";
    const v1::Result refused = save("a");
    EXPECT_EQ(refused.code(), "file_unwritable");
    EXPECT_NE(refused.value().find("shows"), std::string::npos) << refused.value();
    EXPECT_FALSE(refused.message().empty());
    EXPECT_EQ(stage->state().show().name(), "");
}

TEST_F(ShowsTest, TheListIsBounded) {
    fs::create_directories(home / "shows");
    for (std::size_t i = 0; i < kMostShows + 7; ++i) std::ofstream(file("s" + std::to_string(i))) << "{}";
    std::ofstream(home / "shows" / "notes.txt") << "no show";
    const auto listed = shows().shows();
    EXPECT_EQ(listed.shows_size(), static_cast<int>(kMostShows));
    EXPECT_EQ(listed.left_out(), 7u);
}

TEST_F(ShowsTest, GelsAreToldWithTheirSource) {
    v1::ClientMessage message;
    message.mutable_gels();
    const v1::Gels gels = say(2, message).gels();
    ASSERT_GT(gels.gels_size(), 10);
    for (const v1::Gel& gel : gels.gels()) {
        EXPECT_FALSE(gel.source().empty()) << gel.name();
        ASSERT_GE(gel.measured_size(), 1) << gel.name();
        EXPECT_EQ(gel.measured(0).xy_size(), 2) << gel.name();
    }
}

}  // namespace
}  // namespace gonio
