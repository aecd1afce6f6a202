// Another file of the same room: what of the scene before stays.
#include <fstream>
#include <iterator>
#include <regex>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/grid.pb.h"
#include "server/scene/apply.h"
#include "server/scene/cue.h"
#include "server/scene/light_values.h"
#include "server/scene/orientation.h"
#include "server/scene/packed_gobo.h"
#include "server/scene/scene.h"
#include "server/show/followed_show.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio::undo_test {
namespace {

class KeepTest : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        say(kAnn, level("key", 0.5));
        say(kAnn, group("wash", {"key", "fill"}));
        say(kAnn, patch("key", 7));
        say(kAnn, save("look"));
        say(kAnn, add_cue("1"));
        say(kAnn, add_cue("2"));
        say(kAnn, go());
        say(kAnn, command_of([](v1::Command& c) {
                v1::Grid& grid = *c.mutable_set_grid()->mutable_grid();
                grid.set_name("desk");
                for (const double at : {-0.5, 0.1, -0.5}) grid.add_corner_m(at);
                for (const double along : {1.0, 0.0, 0.0}) grid.add_u_m(along);
                for (const double along : {0.0, 0.0, 1.0}) grid.add_v_m(along);
            }));
        EXPECT_EQ(reply.result().code(), "ok") << reply.ShortDebugString();
        say(kAnn, command_of([](v1::Command& c) { c.mutable_set_camera()->set_fov_rad(0.9); }));
        say(kAnn, command_of([](v1::Command& c) { c.mutable_save_view()->set_name("door"); }));
        EXPECT_EQ(reply.result().code(), "ok") << reply.ShortDebugString();
        // The next revision of the room, with a luminaire of its own.
        auto room = std::make_shared<SceneAsset>(*asset);
        room->name = "room-2";
        room->lights.resize(1);
        room->lights[0].name = "house";
        asset = room;
    }
    std::string load_keeping(const std::vector<std::string>& words) {
        v1::Command command = load("room-2");
        for (const std::string& word : words) command.mutable_load_scene()->add_keep(word);
        return say(kAnn, command);
    }
};

// The page offers to keep all that can be kept, in words of its own list.
TEST_F(KeepTest, ThePageSaysTheWordsThatTheServerTakes) {
    std::ifstream file(GONIO_SOURCE_DIR "/client/web/unsaved.js");
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    std::smatch list;
    ASSERT_TRUE(std::regex_search(page, list, std::regex(R"(keep\.checked \? \[([^\]]*)\])")));
    const std::string words = list[1];
    std::vector<std::string> said;
    const std::regex quoted("\"([a-z]+)\"");
    for (std::sregex_iterator word(words.begin(), words.end(), quoted), end; word != end; ++word)
        said.push_back((*word)[1]);
    EXPECT_EQ(load_keeping({"walls"}), "invalid_argument");
    std::string all;  // as the refusal lists them
    for (std::size_t i = 0; i < said.size(); ++i) all += (i == 0 ? "" : i + 1 == said.size() ? " or " : ", ") + said[i];
    EXPECT_EQ(reply.result().message(), "must be " + all);
    EXPECT_EQ(load_keeping(said), "ok") << reply.ShortDebugString();
}

TEST_F(KeepTest, NothingStaysUnasked) {
    ASSERT_EQ(load_keeping({}), "ok");
    ASSERT_EQ(scene().lights.size(), 1u);
    EXPECT_EQ(scene().lights[0].name, "house");
    EXPECT_TRUE(scene().groups.empty());
    EXPECT_TRUE(scene().grids.empty());
    EXPECT_TRUE(scene().saved_views.empty());
    EXPECT_EQ(scene().cue_active, 0u);
    EXPECT_NE(scene().camera.fov_rad, 0.9);
}

TEST_F(KeepTest, AllStaysAndIsUndone) {
    const std::uint32_t id = light("key").id, active = scene().cue_active, next = scene().cue_next;
    ASSERT_NE(active, 0u);
    const std::string before = text();
    ASSERT_EQ(load_keeping({"lights", "cues", "views", "grids"}), "ok");
    EXPECT_EQ(warnings(), std::vector<std::string>{"the file's own luminaires are left out: 1"});
    EXPECT_EQ(scene().asset->name, "room-2");
    ASSERT_EQ(scene().lights.size(), 3u);
    EXPECT_EQ(light("key").level_ratio, 0.5);
    EXPECT_EQ(light("key").id, id);
    EXPECT_EQ(scene().groups.at("wash"), (std::vector<std::string>{"key", "fill"}));
    ASSERT_TRUE(scene().patch);
    EXPECT_EQ(scene().patch->rows(0).address(), 7u);
    EXPECT_EQ(scene().presets.count("look"), 1u);
    EXPECT_EQ(scene().cue_active, active);
    EXPECT_EQ(scene().cue_next, next);
    EXPECT_EQ(scene().grids.count("desk"), 1u);
    EXPECT_EQ(scene().saved_views.count("door"), 1u);
    EXPECT_EQ(scene().camera.fov_rad, 0.9);
    EXPECT_TRUE(show_file(scene()).unsaved());
    say(kAnn, level("key", 0.25));
    EXPECT_EQ(reply.result().code(), "ok") << "they are lights like any others";
    undo(kAnn);
    EXPECT_EQ(light("key").level_ratio, 0.5);
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(difference(text(), before), "");
}

TEST_F(KeepTest, EachPartAlone) {
    ASSERT_EQ(load_keeping({"grids"}), "ok");
    EXPECT_EQ(scene().lights[0].name, "house");
    EXPECT_EQ(scene().grids.size(), 1u);
    EXPECT_TRUE(scene().saved_views.empty());
    undo(kAnn);
    ASSERT_EQ(load_keeping({"views"}), "ok");
    EXPECT_EQ(scene().saved_views.size(), 1u);
    EXPECT_TRUE(scene().grids.empty());
    undo(kAnn);
    ASSERT_EQ(load_keeping({"cues"}), "ok");
    EXPECT_NE(scene().cue_active, 0u);
    EXPECT_EQ(scene().lights[0].name, "house");
}

// Positions are relative to the place of a scene in survey coordinates, which a revision of the same room may shift by
// a kilometre. In the file's coordinates they stay.
TEST_F(KeepTest, WhatIsKeptKeepsItsPlaceInTheFile) {
    auto shifted = std::make_shared<SceneAsset>(*asset);
    shifted->place = {1000.0, 0.0, -2000.0};
    asset = shifted;
    const Scene before = scene();
    ASSERT_EQ(load_keeping({"lights", "cues", "views", "grids"}), "ok");
    const auto is_where = [&](const glm::dvec3& now, const glm::dvec3& was) {
        EXPECT_LT(glm::distance(now + scene().asset->place, was), 1e-6);
    };
    is_where(light("key").position, find_light(before, "key")->position);
    is_where(scene().camera.eye, before.camera.eye);
    is_where(scene().saved_views.at("door").target, before.saved_views.at("door").target);
    is_where(scene().presets.at("look")->front().position, before.presets.at("look")->front().position);
    is_where(scene().cues->front()->content->front().position, before.cues->front()->content->front().position);
    EXPECT_EQ(scene().grids.at("desk")->corner_m(0) + 1000.0, before.grids.at("desk")->corner_m(0));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").position, find_light(before, "key")->position);
}

// Elsewhere in the country nothing is kept, and presets come back as they were.
TEST_F(KeepTest, WhatCouldNotBeSetThereIsNotKept) {
    const auto near = asset;
    const glm::dvec3 preset = scene().presets.at("look")->front().position;
    auto far = std::make_shared<SceneAsset>(*asset);
    far->place = {5'000e3, 0.0, 0.0};
    asset = far;
    for (const char* word : {"lights", "views", "grids"}) EXPECT_EQ(load_keeping({word}), "unsupported") << word;
    ASSERT_EQ(load_keeping({}), "ok");
    EXPECT_EQ(scene().presets.at("look")->front().position, preset);
    asset = near;
    ASSERT_EQ(load_keeping({}), "ok");
    EXPECT_EQ(scene().presets.at("look")->front().position, preset);
}

TEST_F(KeepTest, AnUnknownWordIsRefused) {
    const std::string before = text();
    EXPECT_EQ(load_keeping({"lights", "walls"}), "invalid_argument");
    EXPECT_EQ(reply.result().field(), "load_scene.keep");
    EXPECT_EQ(reply.result().value(), "walls");
    EXPECT_EQ(difference(text(), before), "");
}

// A head that hangs askew and a sun came with a file; the show holds them without it.
TEST_F(KeepTest, ASavedShowHoldsWhatOnlyAFileSaysOfALight) {
    auto before = std::make_shared<SceneAsset>(*asset);
    before->lights.resize(1);
    before->lights.push_back(before->lights[0]);
    before->lights[0].name = "head";
    before->lights[0].world_from_mount = glm::angleAxis(0.7, glm::dvec3(0, 0, 1));
    before->lights[1].name = "sun";
    before->lights[1].sun = true;
    before->lights[1].multiplier = 3.0;
    before->name = "before";
    const auto room = asset;
    asset = before;
    say(kAnn, load("before"));
    say(kAnn, pan("head", 0.4));
    asset = room;
    ASSERT_EQ(load_keeping({"lights"}), "ok");
    const RestoredShow restored = restore_show(show_of(scene(), texts), room, true);
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    ASSERT_EQ(restored.scene.lights.size(), 2u);
    for (const Light& was : scene().lights) {
        const Light* const is = find_light(restored.scene, was.name);
        ASSERT_NE(is, nullptr) << was.name;
        EXPECT_EQ(is->sun, was.sun) << was.name;
        EXPECT_EQ(is->multiplier, was.multiplier) << was.name;
        EXPECT_NEAR(std::abs(glm::dot(is->world_from_mount, was.world_from_mount)), 1.0, 1e-12) << was.name;
        EXPECT_NEAR(std::abs(glm::dot(is->world_from_light, was.world_from_light)), 1.0, 1e-12) << was.name;
    }
}

// So do the wheels of luminaires whose file is gone.
TEST_F(KeepTest, ASavedShowHoldsTheWheelsOfKeptLights) {
    auto before = std::make_shared<SceneAsset>(*asset);
    before->lights.resize(1);
    auto profile = std::make_shared<Profile>(*before->lights[0].profile);
    profile->gobos = std::make_shared<const Gobos>(
        Gobos{{"open", 0, {}}, {"dots", 2, {0, 65535, 256, 255}}, {"breakup", 1, {32768}}});
    profile->open_width_rad = 0.25;
    before->lights[0].name = "head";
    before->lights[0].profile = profile;
    before->lights.push_back(before->lights[0]);
    before->lights[1].name = "plain";  // of the same web without a wheel
    before->lights[1].profile = asset->lights[0].profile;
    before->name = "before";
    const auto room = asset;
    asset = before;
    say(kAnn, load("before"));
    asset = room;
    ASSERT_EQ(load_keeping({"lights"}), "ok");
    EXPECT_EQ(reply.ShortDebugString().find("wheel"), std::string::npos) << reply.ShortDebugString();
    const auto read = read_show(write_show(show_of(scene(), texts)));
    ASSERT_TRUE(read);
    const RestoredShow restored = restore_show(*read, room, true);
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    const Light *const head = find_light(restored.scene, "head"), *const plain = find_light(restored.scene, "plain");
    ASSERT_TRUE(head != nullptr && plain != nullptr);
    ASSERT_NE(head->profile->gobos, nullptr);
    EXPECT_EQ(*head->profile->gobos, *profile->gobos);
    EXPECT_EQ(head->profile->open_width_rad, 0.25) << "zoom is told from it";
    EXPECT_EQ(plain->profile->gobos, nullptr);
    // A picture that is cut off leaves its slot open.
    saved::Show cut = *read;
    for (saved::Profile& one : *cut.mutable_profiles())
        if (one.gobos_size() > 1) one.mutable_gobos(1)->mutable_transmission()->pop_back();
    const RestoredShow less = restore_show(cut, room, true);
    ASSERT_EQ(less.warnings.size(), 1u);
    EXPECT_NE(less.warnings[0].find("dots"), std::string::npos) << less.warnings[0];
    EXPECT_EQ(find_light(less.scene, "head")->profile->gobos->at(1).size_px, 0);
}

int kept_decodes = 0;

// The hash of a show is the same after a restart and on a server that follows, and asking for it decodes no picture.
TEST_F(KeepTest, TheHashOfKeptWheelsDecodesNothing) {
    const auto packed = [](const std::string& name, std::string bytes, PackedGobo::Decode decode) {
        auto made = std::make_shared<PackedGobo>();
        made->bytes = std::move(bytes);
        made->decode = decode;
        return Gobo{name, 2, {}, std::move(made)};
    };
    const auto dots = [](std::string_view, const std::string&) {
        ++kept_decodes;
        return Result<std::vector<std::uint16_t>>(std::vector<std::uint16_t>{0, 65535, 256, 255});
    };
    const auto torn = [](std::string_view, const std::string&) {
        return Result<std::vector<std::uint16_t>>(Error{"bad_image", "torn", "", "it ends early"});
    };
    auto before = std::make_shared<SceneAsset>(*asset);
    before->lights.resize(1);
    before->lights[0].name = "head";
    before->name = "before";
    const auto keep = [&](const std::string& picture) {
        auto profile = std::make_shared<Profile>(*before->lights[0].profile);
        profile->gobos = std::make_shared<const Gobos>(
            Gobos{{"open", 0, {}}, packed("dots", picture, dots), packed("torn", "PNG", torn)});
        before->lights[0].profile = profile;
        const auto room = std::exchange(asset, std::make_shared<SceneAsset>(*before));
        say(kAnn, load("before"));
        asset = room;
        EXPECT_EQ(load_keeping({"lights"}), "ok");
    };
    keep("a picture");
    kept_decodes = 0;
    ProfileTexts hashed;
    const std::string hash = show_hash(scene(), hashed);
    EXPECT_EQ(show_hash(scene(), hashed), hash);
    EXPECT_EQ(kept_decodes, 0);
    EXPECT_TRUE(hashed.known().size() <= scene().lights.size());
    const auto read = read_show(write_show(show_of(scene(), texts)));
    ASSERT_TRUE(read);
    RestoredShow restored = restore_show(*read, asset, true);
    EXPECT_EQ(restored.warnings, std::vector<std::string>{});
    ProfileTexts other;
    EXPECT_EQ(show_hash(restored.scene, other), hash);
    const Gobos& wheel = *find_light(restored.scene, "head")->profile->gobos;
    EXPECT_EQ(transmission_of(wheel[1])[1], 65535);
    EXPECT_TRUE(transmission_of(wheel[2]).empty()) << "is open as it was";
    keep("another picture of the same size");
    EXPECT_NE(show_hash(scene(), hashed), hash);
}

// A saved show keeps the angles of a preset, and how a head is mounted is the head's own. A recall after a restart aims
// where it aimed before.
TEST(Mounted, AHeadAimsAfterARestartAsBefore) {
    const auto cornell = load_scene("cornell");
    ASSERT_TRUE(cornell);
    auto hung = std::make_shared<SceneAsset>(**cornell);
    hung->lights[0].world_from_mount = glm::angleAxis(0.7, glm::normalize(glm::dvec3(0.3, 0.2, 1)));
    Scene scene = scene_of(hung, 7);
    const auto run = [&](const v1::Command& command) { ASSERT_TRUE(apply(scene, command, {})); };
    const auto turn = [&](double pan_rad) {
        v1::Command command;
        command.mutable_set_light()->set_name(scene.lights[0].name);
        command.mutable_set_light()->set_pan_rad(pan_rad);
        command.mutable_set_light()->set_tilt_rad(0.6);
        run(command);
    };
    turn(0.4);
    const glm::dquat aimed = scene.lights[0].world_from_light;
    const glm::dquat expected = scene.lights[0].world_from_mount * orientation_of({0.4, 0.6, scene.lights[0].roll_rad});
    ASSERT_NEAR(std::abs(glm::dot(aimed, expected)), 1.0, 1e-12);
    v1::Command save, recall;
    save.mutable_save_preset()->set_name("look");
    recall.mutable_recall_preset()->set_name("look");
    run(save);
    turn(-1.1);
    const auto restart = [&] {
        ProfileTexts texts;
        const RestoredShow restored = restore_show(show_of(scene, texts), hung, true);
        EXPECT_EQ(restored.warnings, std::vector<std::string>{});
        scene = restored.scene;
    };
    const auto as_before = [&] { return std::abs(glm::dot(scene.lights[0].world_from_light, aimed)); };
    restart();
    EXPECT_LT(as_before(), 0.99) << "it was left turned";
    run(recall);
    EXPECT_NEAR(as_before(), 1.0, 1e-12);
    const Revision rev = scene.lights[0].aim_rev;
    run(recall);
    EXPECT_EQ(scene.lights[0].aim_rev, rev) << "nothing turns again";
    restart();  // with the preset in force
    EXPECT_NEAR(as_before(), 1.0, 1e-12);
}

}  // namespace
}  // namespace gonio::undo_test
