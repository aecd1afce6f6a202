// Meters beside the live picture: asked for in any number, they wait for each other and not the picture for them.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

// Takes 5 ms for each point.
class SlowMeters : public NullRenderer {
public:
    explicit SlowMeters(int& points) : points_(points) {}
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality,
                           int bounces) override {
        ++points_;
        std::this_thread::sleep_for(5ms);
        return NullRenderer::meter(scene, point, normal, quality, bounces);
    }

private:
    int& points_;
};

class StageMeters : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t, v1::ServerMessage message) { replies.push_back(std::move(message)); };
        outputs.state = [](v1::State, v1::StateChanged) {};
        outputs.picture = [](Picture) {};
        outputs.gone = [](std::uint32_t) {};
        stage.emplace(std::make_unique<SlowMeters>(points), scene_of(*asset), "null", queue, loader,
                      std::move(outputs));
    }
    void ask(std::uint32_t request_id, unsigned across = 0) {
        Work work;
        work.session = 1;
        work.message.set_request_id(request_id);
        v1::MeterQuery& meter = *work.message.mutable_meter();
        for (const double x : {0.0, 0.0, 0.0}) meter.add_point_m(x);
        for (const double x : {0.0, 1.0, 0.0}) meter.add_normal(x);
        if (across > 0) {
            for (const double x : {1.0, 0.0, 0.0}) meter.add_u_m(x);
            for (const double x : {0.0, 0.0, 1.0}) meter.add_v_m(x);
            meter.add_count(across);
            meter.add_count(1);
        }
        stage->take(std::move(work));
    }

    int points = 0;
    std::vector<v1::ServerMessage> replies;
    Queue<Work> queue{100};
    Loader loader;
    std::optional<RenderSession> stage;
};

TEST_F(StageMeters, AreReadInSlicesBetweenFrames) {
    for (std::uint32_t id = 1; id <= 20; ++id) ask(id);
    EXPECT_EQ(points, 0) << "messages are taken first";
    EXPECT_TRUE(stage->busy());
    stage->continue_work();
    EXPECT_GE(points, 1);
    EXPECT_LE(points, 2) << "8 ms and the one that goes beyond";
    for (int turns = 0; stage->busy() && turns < 100; ++turns) stage->continue_work();
    ASSERT_EQ(replies.size(), 20u);
    for (std::uint32_t id = 1; id <= 20; ++id) {
        EXPECT_EQ(replies[id - 1].request_id(), id);
        EXPECT_TRUE(replies[id - 1].has_meter());
    }
}

TEST_F(StageMeters, PointsAndGridsAnswerInTurn) {
    ask(1, 3);
    ask(2);
    for (int turns = 0; stage->busy() && turns < 100; ++turns) stage->continue_work();
    ASSERT_EQ(replies.size(), 2u);
    EXPECT_EQ(replies[0].meter_grid().points_size(), 3);
    EXPECT_TRUE(replies[1].has_meter());
    EXPECT_EQ(points, 4);
}

TEST_F(StageMeters, ARequestIsCancelledByItsOwnClient) {
    const auto cancel = [&](std::uint32_t session, std::uint32_t id, std::uint32_t request) {
        Work work;
        work.session = session;
        work.message.set_request_id(id);
        work.message.mutable_cancel()->set_request(request);
        stage->take(std::move(work));
    };
    ask(1, 100);
    ask(2);
    stage->continue_work();
    cancel(7, 3, 1);
    cancel(1, 4, 1);
    cancel(1, 5, 1);
    for (int turns = 0; stage->busy() && turns < 100; ++turns) stage->continue_work();
    ASSERT_EQ(replies.size(), 5u);
    EXPECT_EQ(replies[0].result().code(), "not_found") << "of another client";
    EXPECT_EQ(replies[1].request_id(), 1u);
    EXPECT_EQ(replies[1].result().code(), "cancelled");
    EXPECT_EQ(replies[2].request_id(), 4u);
    EXPECT_EQ(replies[2].result().code(), "ok");
    EXPECT_EQ(replies[3].result().code(), "not_found") << "answered already";
    EXPECT_EQ(replies[3].result().value(), "1");
    EXPECT_EQ(replies[4].request_id(), 2u);
    EXPECT_TRUE(replies[4].has_meter());
    EXPECT_LE(points, 4) << "the grid goes no further";
}

TEST_F(StageMeters, MoreThanItsBoundIsBusy) {
    for (std::uint32_t id = 1; id <= kMaxMeters + 1; ++id) ask(id);
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_EQ(replies[0].request_id(), kMaxMeters + 1);
    EXPECT_EQ(replies[0].result().code(), "busy");
}

}  // namespace
}  // namespace gonio
