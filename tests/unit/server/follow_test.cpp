// A show that is followed: the follower has what it is told, and only what changed is rendered anew there. What is
// malformed is refused.
#include "server/show/followed_show.h"

#include <algorithm>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/scene.h"
#include "tests/unit/server/follow_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

TEST_F(Follow, ItBeginsWithTheWholeAndIsToldWhatChanges) {
    say(kAnn, master(0.5));
    catch_up();
    expect_equal("at first");
    EXPECT_FALSE(ask("leader", scene().scene_rev)) << "there is nothing new: it waits";
    reply.Clear();
    say(kAnn, level("key", 0.25));
    // The answer to Follow comes with the change, behind the answer to the command.
    ASSERT_TRUE(reply.has_followed()) << reply.ShortDebugString();
    EXPECT_EQ(reply.request_id(), 1u);
    EXPECT_EQ(reply.followed().since_rev(), follower.scene_rev);
    ASSERT_EQ(reply.followed().parts_size(), 2);
    EXPECT_EQ(reply.followed().parts(0), "values");
    EXPECT_EQ(reply.followed().parts(1), "file");
    saved::Show show;
    ASSERT_TRUE(show.ParseFromString(reply.followed().show()));
    ASSERT_EQ(show.lights_size(), 1) << "the others are as they were";
    EXPECT_EQ(show.lights(0).name(), "key");
    EXPECT_TRUE(take(reply.followed()).empty());
    expect_equal("after a level");
}

TEST_F(Follow, ALevelIsALevelThereToo) {
    say(kAnn, master(0.5));
    catch_up();
    const Scene before = follower;
    say(kAnn, level("key", 0.25));
    catch_up();
    const Light &was = before.lights[0], &is = follower.lights[0];
    EXPECT_EQ(is.id, was.id);
    EXPECT_EQ(is.level_rev, follower.scene_rev);
    EXPECT_EQ(is.position_rev, was.position_rev);
    EXPECT_EQ(is.aim_rev, was.aim_rev);
    EXPECT_EQ(is.profile_rev, was.profile_rev);
    for (std::size_t i = 1; i < follower.lights.size(); ++i)
        EXPECT_EQ(newest_rev(follower.lights[i]), newest_rev(before.lights[i])) << i;
    EXPECT_EQ(follower.lights_rev, before.lights_rev);
    EXPECT_EQ(follower.geometry_rev, before.geometry_rev);
    EXPECT_EQ(follower.camera_rev, before.camera_rev);
    EXPECT_EQ(follower.exposure_rev, before.exposure_rev);
    EXPECT_EQ(follower.master_rev, before.master_rev);
}

// The leader was started again with its state: all is told anew, and nothing is another.
// A sun and a head that hangs askew were kept from a file, went, and plain lights took their names before the follower
// asked again.
TEST_F(Follow, ALightThatTakesTheNameOfASunIsNone) {
    const auto room = asset;
    auto before = std::make_shared<SceneAsset>(*asset);
    before->lights.resize(1);
    before->lights.push_back(before->lights[0]);
    before->lights[0].name = "sun";
    before->lights[0].sun = true;
    before->lights[0].multiplier = 3.0;
    before->lights[1].name = "head";
    before->lights[1].world_from_mount = glm::angleAxis(0.7, glm::dvec3(0, 0, 1));
    asset = before;
    say(kAnn, load("cornell"));
    asset = room;
    v1::Command keeping = load("cornell");
    keeping.mutable_load_scene()->add_keep("lights");
    say(kAnn, keeping);
    catch_up();
    expect_equal("with a sun and a head");
    ASSERT_TRUE(find_light(follower, "sun")->sun);
    for (const char* name : {"sun", "head"}) {
        say(kAnn, removing(name));
        say(kAnn, add(name));
    }
    catch_up();
    expect_equal("with plain lights of their names");
    EXPECT_FALSE(find_light(follower, "sun")->sun);
    EXPECT_EQ(find_light(follower, "head")->world_from_mount, glm::dquat(1.0, 0.0, 0.0, 0.0));
    EXPECT_EQ(find_light(follower, "head")->world_from_light, find_light(scene(), "head")->world_from_light);
}

TEST_F(Follow, TheSameShowOfAnotherRunRendersNothingAnew) {
    say(kAnn, add("spot"));
    say(kAnn, master(0.5));
    say(kAnn, save("p"));
    catch_up();
    const Scene before = follower;
    stage->set_boot("leader again", 0);
    say(kAnn, master(0.75));  // its revision is a later one, as after a restart with --state
    catch_up();
    EXPECT_EQ(known_boot, "leader again");
    expect_equal("after a restart");
    EXPECT_EQ(follower.master_rev, follower.scene_rev);
    for (const auto rev :
         {&Scene::geometry_rev, &Scene::camera_rev, &Scene::lights_rev, &Scene::exposure_rev, &Scene::view_rev,
          &Scene::technique_rev, &Scene::size_rev, &Scene::look_rev, &Scene::haze_rev})
        EXPECT_EQ(follower.*rev, before.*rev);
    for (std::size_t i = 0; i < follower.lights.size(); ++i) {
        EXPECT_EQ(follower.lights[i].id, before.lights[i].id);
        EXPECT_EQ(newest_rev(follower.lights[i]), newest_rev(before.lights[i]));
    }
}

TEST_F(Follow, RevisionsThatBeganAgainAreTakenWhole) {
    for (int i = 0; i < 5; ++i) say(kAnn, level("key", 0.1 * i));
    catch_up();
    start();  // the leader, without its state
    stage->set_boot("another", 0);
    const auto told = ask(known_boot, follower.scene_rev);
    ASSERT_TRUE(told);
    EXPECT_EQ(told->since_rev(), 0u);
    ASSERT_LT(told->scene_rev(), follower.scene_rev);
    const auto ids = follower.lights.back().id;
    EXPECT_TRUE(take(*told, true).empty());
    expect_equal("after the leader began again");
    EXPECT_GT(follower.lights.front().id, ids) << "ids are never used again";
    for (const Light& light : follower.lights) EXPECT_EQ(newest_rev(light), follower.scene_rev);
}

TEST_F(Follow, AShowThatIsSavedIsToldWithoutANewRevision) {
    say(kAnn, master(0.5));
    catch_up();
    ASSERT_FALSE(ask("leader", scene().scene_rev));
    EXPECT_TRUE(show_file(scene()).unsaved());
    Work saved{.session = kAnn};
    saved.message.set_request_id(3);
    saved.message.mutable_save_show()->set_name("evening");
    saved.read = true;  // as the loader gives it back
    saved.rev = scene().scene_rev;
    stage->take(std::move(saved));
    ASSERT_TRUE(reply.has_followed());
    EXPECT_EQ(reply.followed().scene_rev(), follower.scene_rev);
    take(reply.followed());
    EXPECT_EQ(follower.show_name, "evening");
    EXPECT_FALSE(show_file(follower).unsaved());
}

TEST_F(Follow, OneQuestionOfAServerWaits) {
    const auto told = ask("leader", scene().scene_rev);
    ASSERT_TRUE(told) << "it may have missed what is no revision";
    EXPECT_EQ(told->since_rev(), scene().scene_rev);
    EXPECT_EQ(told->cue_playback().chase(), "off");
    ASSERT_FALSE(ask("leader", scene().scene_rev));
    ASSERT_FALSE(ask("leader", scene().scene_rev));
    EXPECT_EQ(reply.result().code(), "unexpected") << "the one before is given back";
    leave(7);
    reply.Clear();
    say(kAnn, level("key", 0.25));
    EXPECT_FALSE(reply.has_followed());
}

// ---- what is malformed

class FollowRefuses : public Follow {
protected:
    void SetUp() override {
        Follow::SetUp();
        good = *ask("", 0);
        ASSERT_TRUE(read_followed(good));
    }
    // Result: the place of the refusal; empty: it is taken.
    std::string place(const std::function<void(v1::Followed&)>& spoil) {
        v1::Followed bad = good;
        spoil(bad);
        const auto read = read_followed(bad);
        if (read) return "";
        EXPECT_EQ(read.error().code, "bad_message");
        return read.error().where;
    }
    v1::Followed good;
};

TEST_F(FollowRefuses, WhatIsNoShow) {
    EXPECT_EQ(place([](v1::Followed& f) { f.set_show("\xff\xff\xff"); }), "followed.show");
    EXPECT_EQ(place([](v1::Followed& f) { f.set_show(""); }), "followed.show");
    EXPECT_EQ(place([](v1::Followed& f) { f.add_parts("smoke"); }), "followed.parts");
    EXPECT_EQ(place([](v1::Followed& f) { f.mutable_parts()->RemoveLast(); }), "followed.parts");
    EXPECT_EQ(place([](v1::Followed& f) { f.clear_boot(); }), "followed.boot");
    EXPECT_EQ(place([](v1::Followed& f) { f.set_scene_rev(0); }), "followed.scene_rev");
    EXPECT_EQ(place([](v1::Followed& f) {
                  saved::Show show;
                  show.ParseFromString(f.show());
                  show.set_scene("/etc/passwd");
                  show.SerializeToString(f.mutable_show());
              }),
              "followed.files")
        << "a file is fetched by its hash, never opened by a name that the leader says";
    EXPECT_EQ(place([](v1::Followed& f) {
                  saved::Show show;
                  show.ParseFromString(f.show());
                  show.add_profiles()->set_key("../../etc/passwd");
                  show.SerializeToString(f.mutable_show());
              }),
              "followed.show");
}

TEST_F(FollowRefuses, FilesThatLeaveTheirFolder) {
    const auto with_file = [&](const std::string& path, const std::string& hash) {
        return place([&](v1::Followed& f) {
            saved::Show show;
            show.ParseFromString(f.show());
            show.set_scene("upload:a.glb");
            show.SerializeToString(f.mutable_show());
            f.add_files()->set_path(path);
            f.mutable_files(0)->set_sha256(hash);
        });
    };
    const std::string hash = sha256("a");
    EXPECT_EQ(with_file("a.glb", hash), "");
    EXPECT_EQ(with_file("textures/a.png", hash), "");
    for (const char* path : {"", "/a.glb", "../a.glb", "a/../../b", "a//b", "a/./b", "./a", "a/", "a\\b", "a\nb", ".."})
        EXPECT_EQ(with_file(path, hash), "followed.files.path") << path;
    EXPECT_EQ(with_file(std::string(2000, 'a'), hash), "followed.files.path");
    for (const char* bad : {"", "abc", "../../../../etc/passwd"})
        EXPECT_EQ(with_file("a.glb", bad), "followed.files.sha256") << bad;
}

// Values beyond their ranges are refused by the commands that they become: the rest counts.
TEST_F(FollowRefuses, ValuesOutOfRangeAreWarnings) {
    saved::Show show;
    ASSERT_TRUE(show.ParseFromString(good.show()));
    show.set_master_ratio(7);
    show.mutable_lights(0)->set_level_ratio(-1);
    show.SerializeToString(good.mutable_show());
    EXPECT_EQ(take(good).size(), 2u);
    EXPECT_LE(follower.master_ratio, 1.0);
    EXPECT_GE(follower.lights[0].level_ratio, 0.0);
    EXPECT_EQ(follower.lights.size(), scene().lights.size());
}

TEST(FollowedProfile, IsTheSameAfterItsWayAsText) {
    for (const char* name : {"bulb", "batwing", "narrow_spot", "street"}) {
        const auto profile = builtin_profile(name);
        ASSERT_TRUE(profile) << name;
        ProfileTexts texts, again;
        const ProfileTexts::Text there = texts.of(*profile);
        const auto here = followed_profile(*there.content, false);
        ASSERT_TRUE(here) << here.error().text();
        EXPECT_EQ(again.of(*here).key, there.key) << name;
    }
}

// ---- the session of a follower

TEST_F(Follow, AFollowerRefusesWhateverWouldChangeIt) {
    stage->set_leader("http://leader:8080");
    const Revision rev = scene().scene_rev;
    const auto refused = [&](const std::string& code) {
        EXPECT_EQ(code, "permission");
        EXPECT_EQ(reply.result().value(), "http://leader:8080");
        EXPECT_NE(reply.result().message().find("change it there"), std::string::npos);
    };
    refused(say(kAnn, level("key", 0.5)));
    refused(undo(kAnn));
    refused(say(kAnn, go()));
    for (const auto& fill : std::initializer_list<std::function<void(v1::ClientMessage&)>>{
             [](v1::ClientMessage& m) { m.mutable_save_show()->set_name("x"); },
             [](v1::ClientMessage& m) { m.mutable_acquire_control(); },
             [](v1::ClientMessage& m) { m.mutable_release_control(); },
             [](v1::ClientMessage& m) { m.mutable_learn(); }}) {
        Work work{.session = kAnn};
        work.message.set_request_id(5);
        fill(work.message);
        reply.Clear();
        stage->take(std::move(work));
        refused(reply.result().code());
    }
    const v1::Command moved = level("key", 0.5);
    const auto input = stage->apply_inputs({&moved, 1});  // a console, a fader box
    ASSERT_TRUE(input.at(0));
    EXPECT_EQ(input[0]->value, "http://leader:8080");
    stage->advance_fade(1'000'000'000);
    stage->continue_work();
    EXPECT_EQ(scene().scene_rev, rev);
    EXPECT_EQ(stage->state().leader(), "http://leader:8080");
}

TEST_F(Follow, AFollowerIsFollowedWhileItIsInTouch) {
    stage->set_leader("http://leader:8080");
    ASSERT_FALSE(ask("", 0));
    EXPECT_EQ(reply.result().code(), "unavailable");
    EXPECT_NE(reply.result().message().find("ring"), std::string::npos);
    const auto hear = [&](LeaderNews news) {
        Work work;
        work.leader = std::make_shared<const LeaderNews>(std::move(news));
        stage->take(std::move(work));
    };
    Scene heard = scene();
    heard.scene_rev = heard.master_rev = 40;
    heard.master_ratio = 0.25;
    changes.clear();
    hear({std::make_shared<const Scene>(heard), "root", false, {}});
    EXPECT_EQ(scene().scene_rev, 40u);
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0].state().master_ratio(), 0.25);
    EXPECT_FALSE(changes[0].state().has_camera()) << "only what is another is told";
    EXPECT_EQ(changes[0].state().boot(), "root");
    const auto told = ask("", 0);
    ASSERT_TRUE(told);
    EXPECT_EQ(told->boot(), "root") << "its revisions are the leader's";
    ASSERT_FALSE(ask("root", 40));
    v1::CuePlayback cues;
    cues.set_active("7");
    hear({std::make_shared<const Scene>(heard), "root", false, cues});
    EXPECT_EQ(changes.back().state().cue_playback().active(), "7");
    ASSERT_TRUE(reply.has_followed()) << "a cue's news are no revision, and are told";
    EXPECT_EQ(reply.followed().cue_playback().active(), "7");
    ASSERT_FALSE(ask("root", 40));
    hear({});
    EXPECT_EQ(reply.result().code(), "unavailable") << "who waits is told";
}

}  // namespace
}  // namespace gonio
