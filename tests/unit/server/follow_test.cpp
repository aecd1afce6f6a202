// A show that is followed: whatever is told of it together or left out, the follower ends with the same show, and only
// what changed is rendered anew there. What is malformed is refused.
#include "server/show/followed_show.h"

#include <algorithm>
#include <random>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/base/sha256.h"
#include "server/follow/follower.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

// A leader, UndoTest's, and what a follower makes of what it is told.
class Follow : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        stage->set_boot("leader", 0);
    }
    // Asks as a follower that has this. Result: the answer; nothing where it has to wait.
    std::optional<v1::Followed> ask(const std::string& boot, Revision since, std::uint32_t session = 7) {
        Work work{.session = session};
        work.message.set_request_id(1);
        work.message.mutable_follow()->set_boot(boot);
        work.message.mutable_follow()->set_since_rev(since);
        reply.Clear();
        stage->take(std::move(work));
        if (!reply.has_followed()) return std::nullopt;
        return reply.followed();
    }
    std::shared_ptr<const Profile> profile_of(const std::string& key) {
        const auto known = profiles.find(key);
        if (known != profiles.end()) return known->second;
        show_of(scene(), leader_texts);
        const auto content = leader_texts.known().at(key);
        EXPECT_EQ(sha256(*content), key);
        auto read = followed_profile(*content, true);
        EXPECT_TRUE(read) << read.error().text();
        return profiles[key] = *read;
    }
    // Takes what was told. Result: the warnings.
    std::vector<std::string> take(const v1::Followed& followed, bool anew = false) {
        const auto show = read_followed(followed);
        EXPECT_TRUE(show) << show.error().text();
        FetchedParts fetched{asset, nullptr, nullptr, {}};
        for (const saved::Profile& profile : show->show.profiles())
            fetched.profiles[profile.key()] = profile_of(profile.key());
        RestoredShow restored = follow_show(follower, *show, fetched, anew);
        follower = std::move(restored.scene);
        return restored.warnings;
    }
    // The follower asks for what is new, and takes it.
    void catch_up() {
        const auto told = ask(known_boot, follower.scene_rev);
        if (!told) return;
        const auto warnings = take(*told);
        EXPECT_TRUE(warnings.empty()) << warnings.front();
        known_boot = told->boot();
    }
    std::string hash(const Scene& of) {
        ProfileTexts fresh;
        return show_hash(of, fresh);
    }
    void expect_equal(const std::string& when) {
        ASSERT_EQ(follower.scene_rev, scene().scene_rev) << when;
        if (hash(follower) == hash(scene())) return;
        ProfileTexts one, other;
        saved::Show is = show_of(follower, one), was = show_of(scene(), other);
        for (saved::Show* show : {&is, &was}) show->clear_profiles();
        FAIL() << when << ": " << difference(write_show(is), write_show(was));
    }

    Scene follower = unheard_scene("http://leader");
    std::string known_boot;
    ProfileTexts leader_texts;
    std::map<std::string, std::shared_ptr<const Profile>> profiles;
};

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

// ---- at random

class FollowAtRandom : public Follow, public testing::WithParamInterface<int> {
protected:
    std::mt19937 random{static_cast<std::uint32_t>(GetParam())};
    std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random); }
    double ratio() { return 0.001 * static_cast<double>(1 + pick(1000)); }
    std::string some(const char* prefix, std::size_t count) { return prefix + std::to_string(pick(count)); }
    std::string some_light() {
        if (pick(8) == 0 || scene().lights.empty()) return some("l", 5);
        return scene().lights[pick(scene().lights.size())].name;
    }
    template <std::size_t count>
    std::string one_of(const char* const (&names)[count]) {
        return names[pick(count)];
    }
    v1::Command some_light_command() {
        v1::Command command = level(some_light(), ratio());
        v1::SetLight& set = *command.mutable_set_light();
        switch (pick(9)) {
            case 0:
                for (int i = 0; i < 3; ++i) set.add_position_m(ratio());
                break;
            case 1:
                for (int i = 0; i < 3; ++i) set.add_aim(0.1 + ratio());
                break;
            case 2:
                set.set_pan_rad(ratio());
                set.set_roll_rad(ratio());
                break;
            case 3:
                set.set_cct_k(pick(3) == 0 ? 0 : 1000 + 14'000 * ratio());
                set.set_tint_duv(0.05 * ratio());
                break;
            case 4:
                set.set_gel(pick(3) == 0 ? "" : pick(2) == 0 ? "L201" : "L204");
                break;
            case 5:
                set.set_opening(one_of({"file", "disc 0.4", "rect 1.2x0.3"}));
                break;
            case 6:
                set.set_zoom_rad(0.2 + ratio());
                set.set_strobe_hz(pick(2) == 0 ? 0.0 : 4.0);
                break;
            default:
                for (int i = 0; i < 3; ++i) set.add_color_rgb(ratio());
                set.set_shutter_ratio(ratio());
        }
        return command;
    }
    v1::Command some_view_command() {
        return command_of([&](v1::Command& c) {
            v1::SetView& view = *c.mutable_set_view();
            view.set_view(one_of({"beauty", "illuminance", "luminance", "solid", "mask"}));
            view.set_gain(0.5 + ratio());
            switch (pick(6)) {
                case 0:
                    view.set_view("illuminance");
                    view.set_scale(one_of({"log", "linear"}));
                    view.set_range_high(100 + 1000 * ratio());
                    view.set_range_low(0.1 + ratio());
                    break;
                case 1:
                    view.set_view("luminance");
                    view.set_range_auto(true);
                    view.set_steps(static_cast<unsigned>(2 + pick(8)));
                    break;
                case 2:
                    view.set_light(some_light());
                    break;
                case 3:
                    view.set_compare(pick(2) == 0 ? "" : some("p", 3));
                    break;
                case 4:
                    view.set_only(pick(2) == 0 ? "" : some_light());
                    break;
                default:
                    view.set_work_light(pick(2) == 0);
            }
        });
    }
    v1::Command some_setting() {
        return command_of([&](v1::Command& c) {
            switch (pick(6)) {
                case 0:
                    c.mutable_set_exposure()->set_ev100(10 * ratio());
                    c.mutable_set_exposure()->set_automatic(pick(4) == 0);
                    return;
                case 1:
                    c.mutable_set_haze()->set_extinction_per_m(0.1 * ratio());
                    c.mutable_set_haze()->set_g(0.5 * ratio());
                    return;
                case 2:
                    c.mutable_set_look()->set_tone(one_of({"knee", "aces", "agx"}));
                    c.mutable_set_look()->set_white_k(pick(2) == 0 ? 0 : 3000 + 3000 * ratio());
                    return;
                case 3:
                    c.mutable_set_size()->set_width_px(static_cast<unsigned>(16 + 2 * pick(50)));
                    c.mutable_set_size()->set_height_px(static_cast<unsigned>(16 + 2 * pick(50)));
                    return;
                case 4:
                    c.mutable_set_technique()->set_technique(one_of({"default", "seed"}));
                    c.mutable_set_technique()->set_samples(static_cast<unsigned>(16 + pick(400)));
                    return;
                default:
                    for (int i = 0; i < 3; ++i) c.mutable_set_camera()->add_eye_m(1 + ratio());
                    c.mutable_set_camera()->set_fov_rad(0.1 + ratio());
            }
        });
    }
    v1::Command some_cue_command() {
        const std::string number = std::to_string(1 + pick(4));
        switch (pick(7)) {
            case 0:
                return add_cue(number, ratio(), pick(2) == 0 ? "" : some("p", 3));
            case 1:
                return label_cue(number, some("label ", 9));
            case 2:
                return remove_cue(number);
            case 3:
                return go();
            case 4:
                return command_of([&](v1::Command& c) {
                    c.mutable_set_cue()->set_number(number);
                    c.mutable_set_cue()->set_record(true);
                });
            case 5:
                return command_of([&](v1::Command& c) {
                    c.mutable_cue_goto()->set_number(number);
                    c.mutable_cue_goto()->set_time_s(0);
                });
            default:
                return command_of([&](v1::Command& c) {
                    c.mutable_set_cue_options()->set_guard_s(ratio());
                    c.mutable_set_cue_options()->set_back_s(ratio());
                });
        }
    }
    v1::Command some_kept_command() {
        return command_of([&](v1::Command& c) {
            switch (pick(6)) {
                case 0:
                    c.mutable_save_view()->set_name(some("v", 3));
                    return;
                case 1:
                    c.mutable_recall_view()->set_name(some("v", 3));
                    return;
                case 2:
                    c.mutable_remove_view()->set_name(some("v", 3));
                    return;
                case 3: {
                    v1::Grid& grid = *c.mutable_set_grid()->mutable_grid();
                    grid.set_name(some("grid ", 3));
                    for (const double number : {0.0, 0.0, 0.0}) grid.add_corner_m(number);
                    for (const double number : {ratio() + 0.1, 0.0, 0.0}) grid.add_u_m(number);
                    for (const double number : {0.0, 0.0, 1.0}) grid.add_v_m(number);
                    grid.set_quantity(one_of({"horizontal", "camera", "cylindrical"}));
                    if (grid.quantity() == "camera") grid.set_view(pick(2) == 0 ? "" : some("v", 3));
                    grid.set_maintenance_factor(ratio());
                    return;
                }
                case 4:
                    c.mutable_remove_grid()->set_name(some("grid ", 3));
                    return;
                default:
                    c.mutable_load_scene()->set_file("cornell");
            }
        });
    }
    v1::Command some_command() {
        switch (pick(20)) {
            case 0:
                return add(some("l", 5));
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
                return renaming(some_light(), some("l", 5));
            case 10:
            case 11:
                return command_of(
                    [&](v1::Command& c) { pick(2) == 0 ? (void)c.mutable_undo() : (void)c.mutable_redo(); });
            case 12:
                return some_view_command();
            case 13:
                return some_setting();
            case 14:
            case 15:
                return some_cue_command();
            case 16:
                return some_kept_command();
            default:
                return some_light_command();
        }
    }
    std::shared_ptr<const Profile> some_profile(const v1::Command& command) {
        if (!command.has_set_light() && !command.has_add_light()) return nullptr;
        if (pick(4) != 0) return nullptr;
        const std::size_t which = pick(3);
        if (which == 0) return asset->lights[0].profile;
        auto profile = std::make_shared<Profile>(**builtin_profile(which == 1 ? "bulb" : "batwing"));
        profile->uploaded = true;
        return profile;
    }
};

TEST_P(FollowAtRandom, HoweverManyChangesComeTogetherTheShowIsTheSame) {
    int applied = 0;
    std::map<std::string, int> kinds;
    for (int step = 0; step < 400; ++step) {
        const v1::Command command = some_command();
        const Revision rev = scene().scene_rev;
        const bool ok = say(static_cast<std::uint32_t>(1 + pick(3)), command, some_profile(command)) == "ok";
        if (ok && scene().scene_rev != rev) {
            ++applied;
            ++kinds[command.GetDescriptor()->FindFieldByNumber(command.command_case())->name()];
        }
        if (pick(3) != 0) continue;  // a slow one gets several at once
        if (pick(40) == 0) follower = unheard_scene("http://leader"), known_boot.clear();  // was killed
        catch_up();
        expect_equal(std::to_string(step) + " " + command.ShortDebugString());
        if (HasFatalFailure()) return;
    }
    catch_up();
    expect_equal("at the end");
    EXPECT_GT(applied, 150);
    EXPECT_GT(kinds.size(), 18u) << "of that many kinds";
}
INSTANTIATE_TEST_SUITE_P(Seeds, FollowAtRandom, testing::Range(1, 17));

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
