// Cues on the render thread: who hears what, who takes whose lights, and time code from both inputs.
#include "server/session/played_cues.h"

#include "protocol/schema/command.pb.h"
#include "server/scene/scene.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

class PlayedCuesTest : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        say(kBob, level("key", 1));
        say(kBob, add_cue("1", 4));
        say(kBob, level("key", 0));
        say(kBob, add_cue("2", 0));
    }
    void at(double seconds) { stage->advance_fade(began_ns + std::llround(seconds * 1e9)); }
    std::string start() {
        const std::string code = say(kAnn, go());
        began_ns = monotonic_ns();
        return code;
    }
    std::int64_t began_ns = 0;
};

TEST_F(PlayedCuesTest, AGoFadesIsToldAndIsNoStepOfUndo) {
    changes.clear();
    ASSERT_EQ(start(), "ok");
    ASSERT_FALSE(changes.empty());
    EXPECT_EQ(changes.back().state().cue_playback().active(), "1");
    EXPECT_EQ(changes.back().state().cue_playback().next(), "2");
    EXPECT_TRUE(changes.back().state().cue_playback().running());
    EXPECT_EQ(changes.back().by(), kAnn);
    EXPECT_FALSE(changes.back().state().has_cues()) << "the list is what it was";
    EXPECT_TRUE(stage->fading());
    at(2);
    EXPECT_NEAR(light("key").level_ratio, 0.5, 0.05);
    at(5);
    EXPECT_EQ(light("key").level_ratio, 1);
    EXPECT_FALSE(stage->fading());
    EXPECT_EQ(undo(kAnn), "not_found") << "Ann only played";
    ASSERT_EQ(undo(kBob), "ok");
    EXPECT_EQ(scene().cues->size(), 1u) << "Bob takes back his second cue";
    EXPECT_EQ(light("key").level_ratio, 1);
}

TEST_F(PlayedCuesTest, RefusalsHaveCodeAndField) {
    EXPECT_EQ(start(), "ok");
    EXPECT_EQ(say(kBob, go()), "too_soon") << "whoever says it";
    EXPECT_EQ(reply.result().field(), "cue_go");
    EXPECT_NE(reply.result().message().find("0.2"), std::string::npos);
    EXPECT_EQ(scene().cue_active, 1000u);
}

TEST_F(PlayedCuesTest, ConsolesAndBoxesPlayThemToo) {
    const v1::Command command = go();
    const Revision before = scene().scene_rev;
    const auto refused = stage->apply_inputs({&command, 1});
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_FALSE(refused[0]);
    EXPECT_EQ(scene().cue_active, 1000u);
    stage->tell_inputs(before);
    EXPECT_EQ(changes.back().state().cue_playback().active(), "1");
    EXPECT_EQ(stage->apply_inputs({&command, 1})[0]->code, "too_soon");
}

TEST_F(PlayedCuesTest, TheLaterOfARecallAndACueHasTheLights) {
    say(kBob, level("key", 0.5));
    say(kBob, save("half"));
    say(kBob, level("key", 0));
    ASSERT_EQ(start(), "ok");
    at(2);
    ASSERT_EQ(say(kBob, recall("half", 4)), "ok");
    at(100);
    EXPECT_NEAR(light("key").level_ratio, 0.5, 1e-9) << "the recall was later";
    ASSERT_EQ(say(kBob, recall("half", 4)), "ok");
    ASSERT_EQ(say(kAnn, command_of([](v1::Command& c) { c.mutable_cue_goto()->set_number("1"); })), "ok");
    stage->advance_fade(monotonic_ns() + 100'000'000'000);
    EXPECT_EQ(light("key").level_ratio, 1) << "the cue was later";
}

TEST_F(PlayedCuesTest, ALoadedSceneEndsThem) {
    ASSERT_EQ(start(), "ok");
    ASSERT_EQ(say(kBob, command_of([](v1::Command& c) { c.mutable_load_scene()->set_file("cornell"); })), "ok");
    at(10);
    EXPECT_FALSE(stage->fading());
    EXPECT_EQ(stage->state().cue_playback().active(), "");
    EXPECT_EQ(stage->state().cue_playback().next(), "1");
    EXPECT_EQ(stage->state().cues().cues_size(), 2);
}

TEST_F(PlayedCuesTest, TimeCodeOfTheChosenSourceStartsThem) {
    const auto option = [&](const char* source) {
        say(kBob, command_of([&](v1::Command& c) { c.mutable_set_cue_options()->set_timecode(source); }));
    };
    say(kBob, command_of([](v1::Command& c) {
            c.mutable_set_cue()->set_number("2");
            c.mutable_set_cue()->set_timecode("00:00:10:00");
        }));
    const auto hear = [&](TimecodeSource source, int frame) {
        stage->hear_timecode(source, timecode_of(250 + frame, TimecodeRate::ebu25), monotonic_ns());
    };
    hear(TimecodeSource::mtc, 5);
    EXPECT_EQ(scene().cue_active, 0u) << "off";
    option("mtc");
    EXPECT_EQ(stage->state().cue_playback().chase(), "waiting");
    hear(TimecodeSource::artnet, 5);
    EXPECT_EQ(scene().cue_active, 0u) << "another source";
    hear(TimecodeSource::mtc, -1);
    EXPECT_EQ(scene().cue_active, 0u) << "not there yet";
    EXPECT_EQ(stage->state().cue_playback().chase(), "running");
    EXPECT_EQ(stage->state().cue_playback().timecode(), "00:00:09:24");
    hear(TimecodeSource::mtc, 1);
    EXPECT_EQ(scene().cue_active, 2000u);
    option("off");
    EXPECT_EQ(stage->state().cue_playback().chase(), "off");
}

// Progress is told about four times a second and the standing picture not at all.
TEST(CueNews, GoOnOnlyWhileACueRuns) {
    auto asset = load_scene("cornell");
    Scene scene = scene_of(*asset);
    PlayedCues cues;
    cues.take_news(scene, 0);
    EXPECT_FALSE(cues.take_news(scene, 10'000'000'000)) << "nothing runs";
    ASSERT_TRUE(apply(scene, add_cue("1", 1), {}));
    ASSERT_FALSE(cues.run(scene, go(), 10'000'000'000));
    EXPECT_TRUE(cues.take_news(scene, 10'000'000'000));
    EXPECT_FALSE(cues.take_news(scene, 10'100'000'000));
    const auto told = cues.take_news(scene, 10'250'000'000);
    ASSERT_TRUE(told);
    EXPECT_DOUBLE_EQ(told->progress_ratio(), 0.25);
    EXPECT_TRUE(cues.take_news(scene, 20'000'000'000)) << "the end";
    EXPECT_FALSE(cues.take_news(scene, 30'000'000'000));
}

}  // namespace
}  // namespace gonio
