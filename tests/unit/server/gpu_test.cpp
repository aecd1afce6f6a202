// The loss of the GPU: what it does to a stage, and when the program gives up. Over the renderer without GL.
#include "server/session/gpu.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

Gpu::Made null_gpu() {
    return {nullptr, std::make_unique<NullRenderer>()};
}

TEST(Gpu, FaultsAreRead) {
    GpuFaults faults;
    add_fault(faults, "gl-loss-after=3");
    add_fault(faults, "gl-rebuild-fails=2");
    EXPECT_EQ(faults.loss_after, 3u);
    EXPECT_EQ(faults.rebuild_fails, 2u);
    for (const char* bad : {"", "gl-loss-after", "gl-loss-after=", "gl-loss-after=x", "gl-loss-after=3x", "other=1"})
        EXPECT_THROW(add_fault(faults, bad), std::invalid_argument) << bad;
}

TEST(Gpu, AFailedRebuildIsTriedAgainAndTheThirdIsTheLast) {
    int made = 0;
    const auto make = [&] {
        ++made;
        return null_gpu();
    };
    Gpu patient(make, {.rebuild_fails = 2});
    patient.picture_done();
    int pauses = 0;
    EXPECT_TRUE(patient.rebuild([&] { return ++pauses > 0; }));
    EXPECT_EQ(pauses, 2);
    EXPECT_EQ(made, 2);
    patient.picture_done();
    EXPECT_TRUE(patient.rebuild([] { return true; })) << "a loss after a picture is no failure";

    Gpu broken(make, {.rebuild_fails = 3});
    broken.picture_done();
    EXPECT_THROW(broken.rebuild([] { return true; }), std::runtime_error);
    Gpu stopped(make, {.rebuild_fails = 1});
    EXPECT_FALSE(stopped.rebuild([] { return false; })) << "told to end meanwhile";
}

TEST(Gpu, AContextThatDiesBeforeItsFirstPictureIsAFailure) {
    Gpu gpu(null_gpu);
    gpu.picture_done();
    const auto go_on = [] { return true; };
    EXPECT_TRUE(gpu.rebuild(go_on));
    EXPECT_TRUE(gpu.rebuild(go_on));
    EXPECT_TRUE(gpu.rebuild(go_on));
    EXPECT_THROW(gpu.rebuild(go_on), std::runtime_error);
}

TEST(Gpu, AContextThatWasGivenUpThoughItWorkedIsNoFailure) {
    Gpu gpu(null_gpu);
    for (int i = 0; i < 10; ++i) EXPECT_TRUE(gpu.rebuild([] { return true; }, false));
}

TEST(Gpu, InjectedLosses) {
    Gpu once(null_gpu, {.loss_after = 2});
    once.picture_done();
    EXPECT_FALSE(once.lost());
    once.picture_done();
    EXPECT_TRUE(once.lost());
    once.rebuild([] { return true; });
    for (int i = 0; i < 5; ++i) once.picture_done();
    EXPECT_FALSE(once.lost());
}

class StageOnLosingGpu : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        Scene scene = scene_of(*asset);
        scene.width_px = scene.height_px = 32;
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t, v1::ServerMessage message) { replies.push(std::move(message)); };
        outputs.state = [](v1::State, v1::StateChanged) {};
        outputs.picture = [this](Picture picture) { pictures.push_back(std::move(picture)); };
        outputs.counters = [] { return v1::Stats(); };
        outputs.sources = [] { return v1::Sources(); };
        outputs.gone = [](std::uint32_t) {};
        outputs.gpu_lost = [this] { return lost; };
        stage.emplace(std::make_unique<NullRenderer>(), std::move(scene), "null", queue, loader, std::move(outputs));
    }
    void frame() {
        stage->begin_frame(monotonic_ns());
        stage->finish_frames(true);
    }
    void ask(const std::function<void(v1::ClientMessage&)>& fill) {
        Work work;
        work.session = 1;
        work.message.set_request_id(1);
        fill(work.message);
        stage->take(std::move(work));
    }
    void recover() {
        stage->drop_renderer();
        lost = false;
        stage->set_renderer(std::make_unique<NullRenderer>());
    }
    static void fill_meter(v1::ClientMessage& message) {
        for (const double x : {0.0, 0.0, 1.0}) {
            message.mutable_meter()->add_point_m(x);
            message.mutable_meter()->add_normal(x);
        }
    }
    bool lost = false;
    Queue<v1::ServerMessage> replies{100};
    Queue<Work> queue{100};
    Loader loader;
    std::vector<Picture> pictures;
    std::optional<RenderSession> stage;
};

TEST_F(StageOnLosingGpu, NoPictureIsShownOfALostContextAndOneIsDueAfterwards) {
    frame();
    ASSERT_EQ(pictures.size(), 1u);
    EXPECT_FALSE(stage->frame_wanted());
    v1::Command master;
    master.mutable_set_master()->set_ratio(0.5);
    stage->apply_inputs({&master, 1});
    stage->begin_frame(monotonic_ns());
    lost = true;
    stage->finish_frames(true);
    EXPECT_EQ(pictures.size(), 1u);
    recover();
    EXPECT_TRUE(stage->frame_wanted());
    frame();
    ASSERT_EQ(pictures.size(), 2u);
    EXPECT_EQ(pictures[1].scene_rev, stage->scene().scene_rev);
    ask([](v1::ClientMessage& message) { message.mutable_stats(); });
    EXPECT_EQ(replies.try_pop()->stats().gpu_resets(), 1u);
}

TEST_F(StageOnLosingGpu, CapturesAndMetersGoOnWithTheNextRenderer) {
    ask([](v1::ClientMessage& message) {
        message.mutable_capture()->set_format("png");
        message.mutable_capture()->set_width_px(8);
        message.mutable_capture()->set_height_px(8);
    });
    ask([](v1::ClientMessage& message) {
        fill_meter(message);
        message.mutable_meter()->add_count(2);
        message.mutable_meter()->add_count(1);
        message.mutable_meter()->add_u_m(1);
        message.mutable_meter()->add_u_m(0);
        message.mutable_meter()->add_u_m(0);
        for (int i = 0; i < 3; ++i) message.mutable_meter()->add_v_m(0);
    });
    lost = true;
    stage->continue_work();
    EXPECT_TRUE(stage->busy());
    EXPECT_FALSE(replies.try_pop()) << "nothing of a lost context is answered";
    ask(fill_meter);
    stage->continue_work();
    EXPECT_FALSE(replies.try_pop());
    recover();
    while (stage->busy()) stage->continue_work();
    const auto grid = replies.try_pop();
    ASSERT_TRUE(grid);
    EXPECT_EQ(grid->meter_grid().points_size(), 2);
    const auto point = replies.try_pop();
    ASSERT_TRUE(point);
    EXPECT_TRUE(point->has_meter());
    const auto capture = replies.pop_for(10s);
    ASSERT_TRUE(capture);
    EXPECT_EQ(capture->capture().width_px(), 8u);
}

}  // namespace
}  // namespace gonio
