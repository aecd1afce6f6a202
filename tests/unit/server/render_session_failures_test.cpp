// Programs that do not link: an older picture stays, who waits is told, and the server goes on.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/gl/program.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"
#include "server/session/render_session.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

constexpr const char* kWhy = "x.frag does not link";

// Its programs link while `links` is true.
class Unlinkable : public NullRenderer {
public:
    explicit Unlinkable(const bool& links) : links_(links) {}
    std::optional<FinishedFrame> finish_frame(bool wait) override {
        auto frame = NullRenderer::finish_frame(wait);
        if (frame && !links_) {
            v1::PassReport& row = *frame->report.add_passes();
            row.set_name("composite");
            row.set_state("failed");
            row.set_failure(kWhy);
        }
        return frame;
    }
    bool continue_capture(CaptureJob& job) override {
        if (links_) return NullRenderer::continue_capture(job);
        job.failure = kWhy;
        return true;
    }
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality,
                           int bounces) override {
        if (!links_) throw gl::ProgramError(kWhy);
        return NullRenderer::meter(scene, point, normal, quality, bounces);
    }

private:
    const bool& links_;
};

class SessionFailures : public testing::Test {
protected:
    void SetUp() override {
        auto asset = load_scene("cornell");
        ASSERT_TRUE(asset);
        Scene scene = scene_of(*asset);
        scene.width_px = scene.height_px = 16;
        SessionOutputs outputs;
        outputs.reply = [this](std::uint32_t, v1::ServerMessage message) { replies.push(std::move(message)); };
        outputs.state = [this](const v1::State&, const v1::StateChanged& change) {
            if (change.state().has_picture_error()) told.push_back(change.state().picture_error());
        };
        outputs.picture = [](const Picture&) {};
        outputs.counters = [] { return v1::Stats(); };
        outputs.sources = [] { return v1::Sources(); };
        outputs.gone = [](std::uint32_t) {};
        session.emplace(std::make_unique<Unlinkable>(links), std::move(scene), "null", queue, loader,
                        std::move(outputs));
    }
    void change_and_show() {
        v1::Command command;
        command.mutable_set_master()->set_ratio(0.25 + 0.01 * ++changes);
        session->apply_inputs({&command, 1});
        session->begin_frame(monotonic_ns());
        session->finish_frames(true);
    }
    v1::ServerMessage answer_to(const std::function<void(v1::ClientMessage&)>& fill) {
        Work work;
        work.session = 1;
        work.message.set_request_id(7);
        fill(work.message);
        session->take(std::move(work));
        for (int turns = 0; turns < 10; ++turns) session->continue_work();
        return replies.pop_for(30s).value_or(v1::ServerMessage());
    }
    v1::ServerMessage capture() {
        return answer_to([](v1::ClientMessage& message) {
            message.mutable_capture()->set_format("png");
            message.mutable_capture()->set_width_px(16), message.mutable_capture()->set_height_px(16);
        });
    }
    v1::ServerMessage meter() {
        return answer_to([](v1::ClientMessage& message) {
            for (const double x : {0.0, 0.0, 1.0}) {
                message.mutable_meter()->add_point_m(x);
                message.mutable_meter()->add_normal(x);
            }
        });
    }
    std::string error_of_stats() {
        return answer_to([](v1::ClientMessage& message) { message.mutable_stats(); }).stats().picture_error();
    }

    bool links = true;
    int changes = 0;
    std::vector<std::string> told;
    Queue<v1::ServerMessage> replies{100};
    Queue<Work> queue{100};
    Loader loader;
    std::optional<RenderSession> session;
};

TEST_F(SessionFailures, EverybodyIsToldOnceAndWhenItIsOver) {
    const std::string why = std::string("composite: ") + kWhy;
    change_and_show();
    EXPECT_TRUE(told.empty());
    links = false;
    change_and_show();
    EXPECT_FALSE(session->frame_wanted()) << "it is not tried again and again";
    EXPECT_EQ(error_of_stats(), why);
    EXPECT_EQ(session->state().picture_error(), why);
    change_and_show();
    EXPECT_EQ(told, std::vector<std::string>{why});
    links = true;
    change_and_show();
    EXPECT_EQ(error_of_stats(), "");
    EXPECT_EQ(told, (std::vector<std::string>{why, ""}));
}

TEST_F(SessionFailures, WhoWaitsIsRefused) {
    change_and_show();
    links = false;
    for (const v1::ServerMessage& refused : {capture(), meter()}) {
        EXPECT_EQ(refused.request_id(), 7u);
        EXPECT_EQ(refused.result().code(), "unavailable");
        EXPECT_EQ(refused.result().message(), kWhy);
    }
    EXPECT_FALSE(session->busy());
    links = true;
    EXPECT_TRUE(capture().has_capture());
    EXPECT_TRUE(meter().has_meter());
}

}  // namespace
}  // namespace gonio
