// Shows that clients save, list, read and open: names that are no paths, files that are whole, who may, and what is
// said.
#include "server/session/shows.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"
#include "server/show/saved_show.h"
#include "server/show/show_folder.h"
#include "tests/unit/assets_gltf_fixture.h"

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
    v1::Result load(const std::string& scene, const std::vector<std::string>& keep = {}) {
        v1::ClientMessage message;
        v1::LoadScene& load_scene = *message.mutable_command()->mutable_load_scene();
        load_scene.set_file(scene);
        load_scene.mutable_keep()->Add(keep.begin(), keep.end());
        return say(1, message).result();
    }
    v1::Result undo() {
        v1::ClientMessage message;
        message.mutable_command()->mutable_undo();
        return say(1, message).result();
    }
    // A room of so many triangles, uploaded as an HTTP client's file appears: whole, under its name at once.
    void upload(const std::string& name, int triangles) const {
        std::vector<float> positions;
        for (int i = 0; i < triangles; ++i)
            for (const float value : {0, 0, i, 1, 0, i, 0, 1, i}) positions.push_back(value);
        std::ofstream(home / "uploads" / ".new", std::ios::binary) << with_positions(positions).dump();
        fs::rename(home / "uploads" / ".new", home / "uploads" / name);
    }
    // What the library has of the scene's lights, when the loader is at rest.
    std::vector<std::string> scene_profiles() {
        std::promise<void> idle;
        EXPECT_TRUE(loader.submit([&] { idle.set_value(); }));
        idle.get_future().wait();
        v1::ClientMessage message;
        message.mutable_library()->set_count(500);
        std::vector<std::string> names;
        const v1::ServerMessage answer = say(1, message);
        for (const v1::LibraryRow& row : answer.library().rows())
            if (row.source() == "scene") names.push_back(row.name());
        return names;
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
    ASSERT_EQ(say(1, undo).result().code(), "ok");
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.75) << "what opening replaced";
    EXPECT_EQ(stage->scene().lights[0].id, id);
    EXPECT_TRUE(stage->state().show().unsaved());
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

TEST_F(ShowsTest, ShowsGetOtherNamesAndAreRemoved) {
    const auto rename = [&](const std::string& name, const std::string& new_name, std::uint32_t session = 1) {
        v1::ClientMessage message;
        message.mutable_rename_show()->set_name(name);
        message.mutable_rename_show()->set_new_name(new_name);
        return say(session, message).result();
    };
    const auto remove = [&](const std::string& name, std::uint32_t session = 1) {
        v1::ClientMessage message;
        message.mutable_remove_show()->set_name(name);
        return say(session, message).result();
    };
    ASSERT_EQ(save("a").code(), "ok");
    ASSERT_EQ(save("b").code(), "ok");
    EXPECT_EQ(rename("a", "c", 2).code(), "permission");
    EXPECT_EQ(rename("a", "b").code(), "already_exists");
    EXPECT_EQ(rename("z", "y").code(), "not_found");
    EXPECT_EQ(rename("a", "../y").code(), "invalid_argument");
    EXPECT_EQ(rename("../a", "y").field(), "rename_show.name");
    EXPECT_EQ(shows().shows().shows_size(), 2);
    EXPECT_EQ(rename("a", "c").code(), "ok");
    EXPECT_EQ(stage->state().show().name(), "b") << "the show at hand is another";
    EXPECT_EQ(rename("b", "Act 2").code(), "ok");
    EXPECT_EQ(stage->state().show().name(), "Act 2");
    EXPECT_FALSE(stage->state().show().unsaved());
    EXPECT_EQ(changed.state().show().name(), "Act 2") << "clients are told";
    EXPECT_EQ(rename("Act 2", "Act 2").code(), "ok");
    EXPECT_EQ(remove("c", 2).code(), "permission");
    EXPECT_EQ(remove("c").code(), "ok");
    EXPECT_EQ(remove("c").code(), "not_found");
    EXPECT_EQ(stage->state().show().name(), "Act 2");
    EXPECT_EQ(remove("Act 2").code(), "ok");
    EXPECT_EQ(stage->state().show().name(), "");
    EXPECT_TRUE(stage->state().show().unsaved()) << "what is at hand is in no file any more";
    EXPECT_EQ(shows().shows().shows_size(), 0);
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

// On another machine, or after a restart: there are neither the uploads nor what the library had.
TEST_F(ShowsTest, AShowHoldsTheSceneThatWasUploaded) {
    upload("room.gltf", 3);
    ASSERT_EQ(load("upload:room.gltf", {"lights"}).code(), "ok");
    EXPECT_FALSE(stage->state().show().not_held());
    ASSERT_EQ(level(0.25).code(), "ok");
    const v1::Result saved = save("a");
    ASSERT_EQ(saved.code(), "ok");
    EXPECT_EQ(saved.warnings_size(), 0) << saved.warnings(0);
    ASSERT_EQ(load("cornell").code(), "ok");
    fs::remove(home / "uploads" / "room.gltf");
    const v1::Result opened = open("a");
    ASSERT_EQ(opened.code(), "ok") << opened.message();
    EXPECT_EQ(opened.warnings_size(), 0) << opened.warnings(0);
    EXPECT_EQ(stage->scene().asset->name, "upload:room.gltf");
    EXPECT_EQ(stage->scene().asset->triangles(), 3u);
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.25);
    // And so does what is saved or downloaded of it again.
    ASSERT_EQ(save("b").code(), "ok");
    EXPECT_EQ(read_show(text_of(file("b")))->files_size(), 1);
    EXPECT_EQ(read_show(shows("").shows().text())->files_size(), 1);
}

TEST_F(ShowsTest, AFileOfTheServerThatIsAnotherByNowIsSaid) {
    upload("room.gltf", 3);
    ASSERT_EQ(load("upload:room.gltf").code(), "ok");
    ASSERT_EQ(save("a").code(), "ok");
    upload("room.gltf", 5);
    const v1::Result opened = open("a");
    ASSERT_EQ(opened.code(), "ok");
    ASSERT_EQ(opened.warnings_size(), 1);
    EXPECT_NE(opened.warnings(0).find("upload:room.gltf"), std::string::npos) << opened.warnings(0);
    EXPECT_EQ(stage->scene().asset->triangles(), 3u) << "as it was saved";
}

// The scene that comes back is that of the former bytes, and what is saved of it has them.
TEST_F(ShowsTest, UndoBringsTheFormerBytesOfAnUploadBack) {
    upload("room.gltf", 3);
    ASSERT_EQ(load("upload:room.gltf").code(), "ok");
    upload("room.gltf", 5);
    ASSERT_EQ(load("upload:room.gltf").code(), "ok");
    EXPECT_EQ(stage->scene().asset->triangles(), 5u);
    ASSERT_EQ(undo().code(), "ok");
    EXPECT_EQ(stage->scene().asset->triangles(), 3u);
    const v1::Result saved = save("a");
    ASSERT_EQ(saved.code(), "ok");
    EXPECT_EQ(saved.warnings_size(), 0) << saved.warnings(0);
    ASSERT_EQ(load("cornell").code(), "ok");
    ASSERT_EQ(open("a").code(), "ok");
    EXPECT_EQ(stage->scene().asset->triangles(), 3u);
}

TEST_F(ShowsTest, WhatAShowCannotHoldIsSaidBeforeAndAtSaving) {
    upload("room.gltf", 3);
    fs::rename(home / "uploads" / "room.gltf", home / "hall.gltf");
    ASSERT_EQ(load((home / "hall.gltf").string()).code(), "ok");
    EXPECT_FALSE(stage->state().show().not_held());
    fs::resize_file(home / "hall.gltf", 10);
    const v1::Result saved = save("a");
    ASSERT_EQ(saved.code(), "ok") << "the lights are saved all the same";
    ASSERT_EQ(saved.warnings_size(), 1);
    EXPECT_NE(saved.warnings(0).find("'hall.gltf' was changed"), std::string::npos) << saved.warnings(0);
    const v1::Result opened = open("a");
    EXPECT_NE(opened.code(), "ok");
    EXPECT_NE(opened.message().find("does not hold the file of its scene"), std::string::npos) << opened.message();
}

// As versions before this one saved them.
TEST_F(ShowsTest, AnOlderShowOpensWhereItsSceneIsOrSaysWhyNot) {
    upload("room.gltf", 3);
    ASSERT_EQ(load("upload:room.gltf").code(), "ok");
    auto show = *read_show(shows("").shows().text());
    show.clear_files();
    fs::create_directories(home / "shows");
    std::ofstream(file("old")) << write_show(show);
    ASSERT_EQ(open("old").code(), "ok");
    fs::remove(home / "uploads" / "room.gltf");
    const v1::Result opened = open("old");
    EXPECT_EQ(opened.code(), "not_found");
    EXPECT_EQ(opened.value(), "old");
    EXPECT_NE(opened.message().find("upload:room.gltf"), std::string::npos) << opened.message();
}

// A file of at most this size stands for a full disk: the kernel breaks the write off with EFBIG.
TEST_F(ShowsTest, AFullDiskLeavesTheShowThatWasThere) {
    ASSERT_EQ(save("a").code(), "ok");
    const std::string before = text_of(file("a"));
    ASSERT_EQ(level(0.25).code(), "ok");
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit bound{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &bound), 0);
    rlimit small = bound;
    small.rlim_cur = before.size() / 2;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const v1::Result refused = save("a");
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &bound), 0);
    EXPECT_EQ(refused.code(), "file_unwritable");
    EXPECT_EQ(refused.message(), std::generic_category().message(EFBIG));
    EXPECT_EQ(text_of(file("a")), before);
    EXPECT_TRUE(stage->state().show().unsaved());
    EXPECT_FALSE(fs::exists(home / "shows" / "a.json.part")) << "no half of a file stays";
    EXPECT_EQ(save("a").code(), "ok");
}

// Also after an undo, beside lights that were kept, and after a load that was refused when its file had been read.
TEST_F(ShowsTest, TheLibraryHasTheProfilesOfTheSceneThatIsShown) {
    v1::ClientMessage lamp;
    v1::SetLight& set = *lamp.mutable_command()->mutable_set_light();
    set.set_name(light);
    set.mutable_profile()->set_name("mine.ies");
    set.mutable_profile()->set_photometry(
        "IESNA:LM-63-2002\n[TEST] x\n[TESTLAB] x\n[ISSUEDATE] x\n[MANUFAC] x\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 "
        "10\n0 90 180\n0\n100 100 1\n");
    ASSERT_EQ(say(1, lamp).result().code(), "ok");
    auto own = *read_show(shows("").shows().text());
    own.mutable_profiles(0)->set_uploaded(false);  // as of a light that came with a scene
    fs::create_directories(home / "shows");
    std::ofstream(file("own")) << write_show(own);
    ASSERT_EQ(open("own").code(), "ok");
    const std::vector<std::string> mine{"scene:mine.ies"};
    EXPECT_EQ(scene_profiles(), mine);
    ASSERT_EQ(load("atrium").code(), "ok");
    EXPECT_EQ(scene_profiles(), std::vector<std::string>());
    ASSERT_EQ(undo().code(), "ok");
    EXPECT_EQ(scene_profiles(), mine);
    EXPECT_EQ(load("atrium", {"walls"}).code(), "invalid_argument");
    EXPECT_EQ(scene_profiles(), mine) << "nothing was loaded";
    ASSERT_EQ(load("atrium", {"lights"}).code(), "ok");
    EXPECT_EQ(scene_profiles(), mine) << "its light was kept";
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
