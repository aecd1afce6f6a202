// Several clients at one stage: what each may do, who is told of it, and as whose change.
#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"

namespace gonio {
namespace {

class StageRoles : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t, v1::ServerMessage message) { reply = std::move(message); };
        outputs.state = [this](v1::State state, v1::StateChanged change) {
            whole = std::move(state);
            changes.push_back(std::move(change));
        };
        outputs.picture = [](Picture) {};
        outputs.learn = [this](std::uint32_t, std::uint32_t, double) { ++learned; };
        outputs.gone = [](std::uint32_t) {};
        stage.emplace(std::make_unique<NullRenderer>(), scene_of(*asset), "null", queue, loader, std::move(outputs));
        name = stage->scene().lights[0].name;
        identify(1, "ann");
        identify(2, "bob");
        identify(3, "eve", "viewer");
    }
    void identify(std::uint32_t session, const std::string& client, const std::string& role = "") {
        Work work;
        work.session = session;
        work.message.mutable_identify()->set_client(client);
        work.message.mutable_identify()->set_role(role);
        stage->take(std::move(work));
    }
    // Result: the code of the answer.
    std::string say(std::uint32_t session, const std::function<void(v1::ClientMessage&)>& fill) {
        Work work;
        work.session = session;
        work.message.set_request_id(9);
        fill(work.message);
        reply.Clear();
        stage->take(std::move(work));
        return reply.has_result() ? reply.result().code() : "";
    }
    void leave(std::uint32_t session) {
        Work work;
        work.session = session;
        work.closed = true;
        stage->take(std::move(work));
    }
    static v1::Command fov(double rad) {
        v1::Command command;
        command.mutable_set_camera()->set_fov_rad(rad);
        return command;
    }
    std::string command(std::uint32_t session, const v1::Command& command) {
        return say(session, [&](v1::ClientMessage& message) { *message.mutable_command() = command; });
    }
    std::string acquire(std::uint32_t session, bool take = false) {
        return say(session, [&](v1::ClientMessage& message) { message.mutable_acquire_control()->set_take(take); });
    }
    v1::ServerMessage reply;
    v1::State whole;
    std::vector<v1::StateChanged> changes;
    int learned = 0;
    Queue<Work> queue{100};
    Loader loader;
    std::optional<RenderSession> stage;
    std::string name;
};

// A saved view moves the camera: who has not got it is told so.
TEST_F(StageRoles, ASavedViewIsRecalledByTheHolderAlone) {
    v1::Command save, recall;
    save.mutable_save_view()->set_name("door");
    recall.mutable_recall_view()->set_name("door");
    EXPECT_EQ(command(3, save), "permission");
    ASSERT_EQ(command(2, save), "ok");
    ASSERT_EQ(command(1, fov(1)), "ok");
    ASSERT_EQ(acquire(1), "ok");
    EXPECT_EQ(command(2, recall), "held");
    EXPECT_EQ(reply.result().field(), "recall_view");
    EXPECT_EQ(stage->scene().camera.fov_rad, 1);
    ASSERT_EQ(command(1, recall), "ok");
    EXPECT_NE(stage->scene().camera.fov_rad, 1);
}

TEST_F(StageRoles, AViewerAsksButChangesNothing) {
    const Revision before = stage->scene().scene_rev;
    EXPECT_EQ(command(3, fov(1)), "permission");
    v1::Command load;
    load.mutable_load_scene()->set_file("atrium");
    EXPECT_EQ(command(3, load), "permission") << "not even read";
    EXPECT_EQ(acquire(3), "permission");
    EXPECT_EQ(say(3, [](v1::ClientMessage& message) { message.mutable_release_control(); }), "permission");
    EXPECT_EQ(say(3, [](v1::ClientMessage& message) { message.mutable_learn(); }), "permission");
    EXPECT_EQ(learned, 0);
    EXPECT_EQ(stage->scene().scene_rev, before);
    say(3, [](v1::ClientMessage& message) { message.mutable_get_state(); });
    EXPECT_EQ(reply.state().scene(), "cornell");
    EXPECT_TRUE(changes.empty());
}

// It was allowed to when it asked; nobody is there for the answer.
TEST_F(StageRoles, ACommandWithAFileIsCarriedOutThoughItsSenderHungUp) {
    v1::Command load;
    load.mutable_load_scene()->set_file("atrium");
    EXPECT_EQ(command(1, load), "") << "it is being read";
    leave(1);
    EXPECT_EQ(command(1, fov(1)), "permission") << "who has gone may change nothing";
    auto read = queue.pop_for(std::chrono::seconds(60));
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->read);
    stage->take(std::move(*read));
    EXPECT_EQ(stage->state().scene(), "atrium");
    ASSERT_FALSE(changes.empty());
    EXPECT_EQ(changes.back().by(), 1u);
    EXPECT_EQ(reply.result().code(), "ok");
}

TEST_F(StageRoles, ChangesNameWhoMadeThem) {
    ASSERT_EQ(command(2, fov(1)), "ok");
    EXPECT_EQ(changes.back().by(), 2u);
    const v1::Command desk = fov(1.1);
    const Revision before = stage->scene().scene_rev;
    EXPECT_FALSE(stage->apply_inputs({&desk, 1})[0]);
    stage->tell_inputs(before);
    EXPECT_EQ(changes.back().by(), 0u);
}

TEST_F(StageRoles, TheLeaseIsToldToAllAndKeepsTheCamera) {
    ASSERT_EQ(acquire(1), "ok");
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0].by(), 1u);
    EXPECT_EQ(changes[0].scene_rev(), stage->scene().scene_rev) << "the scene is as it was";
    EXPECT_EQ(changes[0].state().control().name(), "ann");
    EXPECT_EQ(whole.control().holder(), 1u) << "also for who comes later";
    EXPECT_EQ(acquire(1), "ok");
    EXPECT_EQ(changes.size(), 1u) << "a renewal is no news";
    EXPECT_EQ(command(2, fov(1)), "held");
    EXPECT_EQ(reply.result().value(), "ann");
    const v1::Command desk[] = {fov(1.2), [] {
                                    v1::Command master;
                                    master.mutable_set_master()->set_ratio(0.5);
                                    return master;
                                }()};
    const auto refused = stage->apply_inputs(desk);
    ASSERT_TRUE(refused[0]);
    EXPECT_EQ(refused[0]->code, "held");
    EXPECT_FALSE(refused[1]) << "the rest of the desk goes on";
    EXPECT_EQ(stage->scene().master_ratio, 0.5);
    EXPECT_EQ(command(1, fov(0.9)), "ok");
    EXPECT_EQ(stage->scene().camera.fov_rad, 0.9);
    EXPECT_EQ(acquire(2), "held");
    EXPECT_EQ(acquire(2, true), "ok");
    EXPECT_EQ(changes.back().state().control().name(), "bob");
    EXPECT_EQ(command(1, fov(1)), "held");
    leave(2);
    EXPECT_EQ(changes.back().state().control().holder(), 0u);
    EXPECT_EQ(command(1, fov(1)), "ok");
}

TEST_F(StageRoles, BaseRevIsCheckedWhenTheCommandIsApplied) {
    const Revision base = stage->scene().scene_rev;
    v1::Command level;
    level.mutable_set_light()->set_name(name);
    level.mutable_set_light()->set_level_ratio(0.5);
    ASSERT_EQ(command(1, level), "ok");
    level.mutable_set_light()->set_level_ratio(0.6);
    level.set_base_rev(base);
    EXPECT_EQ(command(2, level), "conflict");
    EXPECT_EQ(reply.result().field(), "lights." + name + ".level_ratio");
    EXPECT_EQ(reply.result().value(), std::to_string(base + 1));
    EXPECT_EQ(stage->scene().lights[0].level_ratio, 0.5);
    EXPECT_EQ(command(1, level), "ok");
    // A desk is somebody else to everybody.
    v1::Command desk = level;
    desk.clear_base_rev();
    desk.mutable_set_light()->set_level_ratio(0.1);
    const Revision known = stage->scene().scene_rev;
    stage->apply_inputs({&desk, 1});
    level.set_base_rev(known);
    EXPECT_EQ(command(1, level), "conflict");
}

}  // namespace
}  // namespace gonio
