// Lights that shine into nothing are among the warnings of the scene, until they are mended.
#include <algorithm>
#include <optional>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/scene.h"
#include "server/sequence/timeline.h"
#include "server/session/outlets.h"
#include "server/trace/geometry.h"
#include "tests/scenes/scenes.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio::undo_test {
namespace {

constexpr const char* kSaid = "the light 'light' shines into nothing";

// A floor, and a ceiling 4 m above it.
Scene room_with_light_at(double height_m) {
    const glm::vec3 grey(0.5f);
    std::vector<test::Piece> pieces;
    pieces.push_back({test::quad({-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}), grey});
    pieces.push_back({test::quad({-4, 4, -4}, {4, 4, -4}, {4, 4, 4}, {-4, 4, 4}), grey});
    Scene scene =
        test::scene_with(std::move(pieces), test::as_point(test::cosine_power(900.0, 1.0)), {0.0, height_m, 0.0});
    scene.traced = std::make_shared<const trace::Geometry>(scene.asset);
    return scene;
}

v1::Command height(double y) {
    return command_of([&](v1::Command& said) {
        said.mutable_set_light()->set_name("light");
        for (const double at : {0.0, y, 0.0}) said.mutable_set_light()->add_position_m(at);
    });
}

v1::Command recessing() {
    return command_of([](v1::Command& said) { said.mutable_recess_light()->set_name("light"); });
}

class HiddenLightsTest : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        const Scene room = room_with_light_at(4.02);
        asset = room.asset;
        Work work;
        work.session = kAnn;
        work.message.set_request_id(9);
        *work.message.mutable_command() = load("room");
        work.read = true;
        work.loaded.asset = room.asset;
        work.loaded.traced = room.traced;
        stage->take(std::move(work));
        ASSERT_EQ(reply.result().code(), "ok") << reply.ShortDebugString();
        ASSERT_EQ(scene().lights.size(), 1u);
        say(kAnn, height(4.02));
    }
    bool is_said() const {
        const v1::State state = stage->state();
        for (const std::string& warning : state.scene_warnings())
            if (warning.starts_with(kSaid)) return true;
        return false;
    }
    // What the last change told of it; nothing: it had no warnings of the scene.
    std::optional<bool> told() const {
        const v1::State& state = changes.back().state();
        if (!state.has_scene()) return std::nullopt;
        return std::ranges::any_of(state.scene_warnings(),
                                   [](const std::string& warning) { return warning.starts_with(kSaid); });
    }
};

TEST_F(HiddenLightsTest, TheStateSaysSoUntilItIsRecessed) {
    EXPECT_TRUE(is_said());
    ASSERT_EQ(say(kAnn, recessing()), "ok") << reply.ShortDebugString();
    EXPECT_FALSE(is_said());
    EXPECT_EQ(told(), false) << "the change takes it back";
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_TRUE(is_said());
    EXPECT_EQ(told(), true);
    ASSERT_EQ(redo(kAnn), "ok");
    EXPECT_FALSE(is_said());
}

TEST_F(HiddenLightsTest, AMoveMendsItAndOtherChangesTellNothing) {
    say(kAnn, level("light", 0.5));
    EXPECT_EQ(told(), std::nullopt);
    EXPECT_TRUE(is_said());
    say(kAnn, height(3.0));
    EXPECT_EQ(told(), false);
    say(kAnn, height(2.9));
    EXPECT_EQ(told(), std::nullopt);
    say(kAnn, height(4.02));
    EXPECT_EQ(told(), true);
    console(height(3.0));
    EXPECT_EQ(told(), false) << "a console's move counts too";
    say(kAnn, height(4.02));
    say(kAnn, renaming("light", "lamp"));
    EXPECT_FALSE(is_said()) << "under its old name";
    EXPECT_EQ(stage->state().scene_warnings_size(), 1);
    say(kAnn, removing("lamp"));
    EXPECT_EQ(stage->state().scene_warnings_size(), 0);
}

// A frame of a job may recess a light too. 900 / 16 lx stand below it then, less the millimetre.
TEST(RecessInJobs, WordsOfAFramePutTheOpeningIntoThePlane) {
    Scene scene = room_with_light_at(4.02);
    sequence::apply_words(scene, {"recess", "light", scene.lights[0].name}, {}, "frames[0].set[0]");
    EXPECT_NEAR(scene.lights[0].position.y, 3.999, 1e-5);
    EXPECT_TRUE(outlet_warnings(scene).empty());
}

}  // namespace
}  // namespace gonio::undo_test
