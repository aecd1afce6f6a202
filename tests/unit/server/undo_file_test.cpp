// What can be undone, on the disk: each step is the same after a restart.
#include "server/show/undo_file.h"

#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "protocol/schema/undo_file.pb.h"
#include "server/scene/scene.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;
namespace fs = std::filesystem;

class UndoFileTest : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        char name[] = "/tmp/gonio-undo-XXXXXX";
        folder = ::mkdtemp(name);
        path = folder + "/show.json";
    }
    void TearDown() override { fs::remove_all(folder); }
    // The show alone: an aim that is read back from angles may differ by a rounding.
    std::string text() {
        saved::Show show = show_of(scene(), texts);
        show.clear_scene_rev();
        show.clear_show_unsaved();  // follows the revision
        return write_show(show);
    }
    static void write(const std::string& file, const std::string& bytes) {
        std::ofstream(file, std::ios::binary) << bytes;
    }
    std::string undo_bytes(const std::string& state, std::size_t most_bytes = kMaxUndoFileBytes) {
        UndoFileWriter writer(most_bytes);
        return writer.write(*stage->undo_record(), scene(), state,
                            [](const SceneAsset&, saved::Show&) { return true; });
    }
    // The server ends and begins again with what the disk has.
    void restart(std::size_t most_bytes = kMaxUndoFileBytes) {
        write(path + kUndoEnding, undo_bytes("state", most_bytes));
        const auto file = read_undo_file(path, "state");
        ASSERT_TRUE(file) << file.error().text();
        RestoredShow restored = restore_show(show_of(scene(), texts), asset, true);
        ASSERT_TRUE(restored.warnings.empty()) << restored.warnings.front();
        ASSERT_TRUE(renew_ids(file->steps(), restored.scene));
        const UndoRecord record = record_of(*file, restored.scene);
        start_with(std::move(restored.scene));
        stage->go_on(record);
        for (const auto& kept : record.earlier) {
            RestoredShow before = restore_show(kept->kept->show(), asset, true);
            ASSERT_TRUE(renew_ids(kept->kept->steps(), before.scene));
            auto left = std::make_shared<LeftScene>(*kept);
            std::uint64_t used = 0;
            left->steps = steps_of(kept->kept->steps(), before.scene, used);
            left->scene = std::make_shared<const Scene>(std::move(before.scene));
            stage->take_read(kept, left);
        }
    }
    std::string folder, path;
};

TEST_F(UndoFileTest, EachStepIsUndoneAndRedoneAfterARestart) {
    const std::vector<v1::Command> commands{
        level("key", 0.25),
        pan("fill", 0.5),
        add("spot"),
        level("spot", 0.75),
        save("look"),
        renaming("back", "rear"),
        removing("fill"),
        group("both", {"key", "rear"}),
        add_cue("1", 3, "look"),
        label_cue("1", "evening"),
        patch("spot", 7),
        map("key", 2),
        master(0.5),
        level("key", 0.5),
        recall("look"),
        removing("spot"),
        remove_preset("look"),
        load("cornell"),
        level("key", 0.125),
    };
    std::vector<std::string> before;
    for (const v1::Command& command : commands) {
        before.push_back(text());
        ASSERT_EQ(say(kAnn, command), "ok") << command.ShortDebugString() << reply.ShortDebugString();
    }
    before.push_back(text());
    restart();
    EXPECT_EQ(difference(text(), before.back()), "");
    for (std::size_t i = commands.size(); i-- > 0;) {
        ASSERT_EQ(undo(kAnn), "ok") << commands[i].ShortDebugString();
        EXPECT_EQ(warnings(), std::vector<std::string>{}) << commands[i].ShortDebugString();
        EXPECT_EQ(difference(text(), before[i]), "") << commands[i].ShortDebugString();
        if (i == 9) restart();  // with steps to redo
    }
    EXPECT_EQ(undo(kAnn), "not_found");
    for (std::size_t i = 0; i + 2 < commands.size(); ++i) {  // up to the load, whose redo ends with the program
        ASSERT_EQ(redo(kAnn), "ok") << commands[i].ShortDebugString();
        EXPECT_EQ(difference(text(), before[i + 1]), "") << commands[i].ShortDebugString();
    }
}

TEST_F(UndoFileTest, WhatAnotherClientChangedStaysAfterARestartToo) {
    say(kAnn, level("key", 0.25));
    say(kBob, level("key", 0.5));
    restart();
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, 0.5);
    EXPECT_EQ(warnings(), std::vector<std::string>{"level of 'key' was changed since by another client and stays"});
}

TEST_F(UndoFileTest, AnotherStatesADamagedAndAMissingFileAreRefused) {
    EXPECT_EQ(read_undo_file(path, "state").error().code, "file_unreadable");
    say(kAnn, level("key", 0.25));
    std::string bytes = undo_bytes("state");
    write(path + kUndoEnding, bytes);
    EXPECT_TRUE(read_undo_file(path, "state"));
    EXPECT_EQ(read_undo_file(path, "other").error().message, "It belongs to another state.");
    for (std::size_t at = 0; at < bytes.size(); at += 7) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ 4);
        write(path + kUndoEnding, damaged);
        EXPECT_FALSE(read_undo_file(path, "state")) << at;
        write(path + kUndoEnding, bytes.substr(0, at));
        EXPECT_FALSE(read_undo_file(path, "state")) << at;
    }
}

TEST_F(UndoFileTest, TheProgramMayBeKilledBetweenTheTwoFiles) {
    say(kAnn, level("key", 0.25));
    write(path + kUndoEnding, undo_bytes("old"));
    write(path + kUndoNextEnding, undo_bytes("new"));
    EXPECT_TRUE(read_undo_file(path, "old"));
    EXPECT_TRUE(read_undo_file(path, "new"));
    EXPECT_FALSE(fs::exists(path + kUndoNextEnding)) << "the next save writes that name before the state";
    EXPECT_TRUE(read_undo_file(path, "new"));
}

TEST_F(UndoFileTest, BeyondItsBytesTheOldestStepsGo) {
    for (int i = 1; i <= 40; ++i) say(kAnn, level("key", i / 100.0));
    restart(1500);
    int undone = 0;
    while (undo(kAnn) == "ok") {
        ++undone;
        EXPECT_NEAR(light("key").level_ratio, (40 - undone) / 100.0, 1e-12);
    }
    EXPECT_GT(undone, 2);
    EXPECT_LT(undone, 40);
}

TEST_F(UndoFileTest, AStepThatIsTooLargeAloneIsLeftOut) {
    say(kAnn, master(0.5));
    std::vector<std::string> lights(200, "key");
    for (std::size_t i = 0; i < lights.size(); ++i)
        ASSERT_EQ(say(kAnn, add(lights[i] = "a light with a long name, number " + std::to_string(i))), "ok");
    ASSERT_EQ(say(kAnn, group("all", lights)), "ok");
    restart(200);
    EXPECT_EQ(undo(kAnn), "not_found");
}

// A file that somebody has changed by hand.
TEST_F(UndoFileTest, StepsThatNoCommandMakesAreDropped) {
    say(kAnn, level("key", 0.25));
    const auto spoil = [&](const std::function<void(saved::UndoEdit&)>& change) {
        write(path + kUndoEnding, undo_bytes("state"));
        auto file = read_undo_file(path, "state");
        change(*file->mutable_steps()->mutable_stacks(0)->mutable_steps(0)->mutable_edits(0));
        const UndoRecord record = record_of(*file, scene());
        return record.steps.stacks.empty();
    };
    EXPECT_FALSE(spoil([](saved::UndoEdit&) {}));
    EXPECT_TRUE(spoil([](saved::UndoEdit& edit) { edit.mutable_before()->clear_value(); })) << "the light stays";
    EXPECT_TRUE(spoil([](saved::UndoEdit& edit) { edit.mutable_before()->mutable_numbers()->set_values(0, NAN); }));
    EXPECT_TRUE(spoil([&](saved::UndoEdit& edit) { edit.mutable_key()->set_light(scene().next_light_id); }));
}

TEST_F(UndoFileTest, ALightThatComesBackHasAllThatALightHas) {
    say(kAnn, removing("key"));
    write(path + kUndoEnding, undo_bytes("state"));
    auto file = read_undo_file(path, "state");
    EXPECT_FALSE(record_of(*file, scene()).steps.stacks.empty());
    for (saved::UndoEdit& edit : *file->mutable_steps()->mutable_stacks(0)->mutable_steps(0)->mutable_edits())
        if (edit.before().has_text()) edit.mutable_before()->clear_value();  // its name
    EXPECT_TRUE(record_of(*file, scene()).steps.stacks.empty());
}

TEST_F(UndoFileTest, WhatIsToldIsMadeOnceAChange) {
    say(kAnn, level("key", 0.25));
    const auto record = stage->undo_record();
    say(kBob, command_of([](v1::Command& c) { c.mutable_set_camera()->set_fov_rad(0.9); }));
    EXPECT_EQ(stage->undo_record(), record) << "a camera is no step";
    console(level("fill", 0.5));
    EXPECT_EQ(stage->undo_record(), record) << "no step knows the light";
    console(level("key", 0.5));
    EXPECT_NE(stage->undo_record(), record);
    restart();
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, 0.5) << "the console's stays";
}

TEST_F(UndoFileTest, ASceneThatCannotBeReadGoesWithThoseBeforeIt) {
    say(kAnn, load("cornell"));
    say(kAnn, load("cornell"));
    say(kAnn, level("key", 0.25));
    write(path + kUndoEnding, undo_bytes("state"));
    const auto file = read_undo_file(path, "state");
    ASSERT_TRUE(file);
    const UndoRecord record = record_of(*file, scene());
    ASSERT_EQ(record.earlier.size(), 2u);
    stage->go_on(record);
    EXPECT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(undo(kAnn), "busy");
    stage->take_read(record.earlier[1], nullptr);
    EXPECT_EQ(undo(kAnn), "not_found");
}

}  // namespace
}  // namespace gonio
