// Reference jobs on their thread: answered in order, bounded, given up with their client; and their pictures developed.
#include "server/session/reference_work.h"

#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/session.pb.h"
#include "server/scene/scene.h"
#include "server/session/traced_capture.h"
#include "server/trace/denoise.h"
#include "tests/scenes/scenes.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

struct Answer {
    std::uint32_t session;
    v1::ServerMessage message;
};

class ReferenceJobs : public testing::Test {
protected:
    // A floor 2 m below an isotropic source of 1000 cd: 250 lx.
    Scene scene = test::floor_scene(10.0, 0.5f, test::isotropic(1000.0), {0, 2, 0});
    Queue<Answer> answers{1000};
    Queue<bool> wakes{1000};
    std::vector<std::pair<std::uint32_t, std::uint32_t>> too_few;  // requests and samples
    std::optional<ReferenceWork> work;

    void SetUp() override {
        work.emplace(ReferenceWork::Outputs{
            [this](std::uint32_t session, v1::ServerMessage message) {
                answers.push({session, std::move(message)});
            },
            [this] { wakes.push(true); },
            [this](const ReferenceJob& job, std::uint32_t samples) { too_few.emplace_back(job.request_id, samples); }});
    }
    ReferenceJob meter(std::uint32_t session, std::uint32_t id) const {
        MeterRequest request;
        request.quality = Quality::reference;
        request.points = {{{0, 0, 0}, {0, 1, 0}}};
        return {session, id, scene, request};
    }
    // A job that does not end by itself within a test.
    ReferenceJob endless(std::uint32_t session, std::uint32_t id) const {
        CaptureRequest request;
        request.quality = Quality::reference;
        request.format = "exr";
        request.view = View::beauty;
        request.width_px = request.height_px = 48;
        request.settings.noise = 1e-9;
        Scene room =
            test::scene_with({{test::inward_sphere(2.0, 16), glm::vec3(0.9f)}}, test::isotropic(1000.0), {0, 0, 0});
        room.camera.eye = {0, 0, 1};
        room.camera.target = {0, 0, 0};
        return {session, id, room, request};
    }
    // Result: the next answer, progress left out.
    std::optional<Answer> next_answer(std::chrono::nanoseconds time) {
        auto answer = answers.pop_for(time);
        while (answer && answer->message.has_progress()) answer = answers.pop_for(time);
        return answer;
    }
    v1::Stats stats() const {
        v1::Stats counters;
        work->add_counters(counters);
        return counters;
    }
    // Ticks until the condition holds; false after 20 s.
    template <typename Condition>
    bool until(const Condition& condition) {
        const auto deadline = std::chrono::steady_clock::now() + 60s;
        while (!condition()) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            (void)wakes.pop_for(20ms);
            work->tick();
        }
        return true;
    }
};

TEST_F(ReferenceJobs, AreAnsweredInOrder) {
    for (std::uint32_t id : {11u, 12u, 13u}) ASSERT_TRUE(work->submit(meter(5, id)));
    ASSERT_TRUE(until([&] { return stats().reference_done() == 3; }));
    for (std::uint32_t id : {11u, 12u, 13u}) {
        const auto answer = next_answer(5s);
        ASSERT_TRUE(answer);
        EXPECT_EQ(answer->session, 5u);
        EXPECT_EQ(answer->message.request_id(), id);
        EXPECT_NEAR(answer->message.meter().direct_lx(), 250.0, 0.1);
    }
    EXPECT_EQ(stats().reference_running(), 0u);
    EXPECT_EQ(stats().reference_cancelled(), 0u);
}

TEST_F(ReferenceJobs, EndWithTheirClient) {
    ASSERT_TRUE(work->submit(endless(1, 1)));
    ASSERT_TRUE(work->submit(endless(1, 2)));
    ASSERT_TRUE(work->submit(meter(2, 3)));
    ASSERT_TRUE(until([&] { return stats().reference_passes() > 0; }));
    EXPECT_EQ(stats().reference_running(), 1u);
    EXPECT_EQ(stats().reference_waiting(), 2u);
    work->forget_session(1);
    ASSERT_TRUE(until([&] { return stats().reference_done() == 1; })) << "the other client's job comes next";
    EXPECT_EQ(stats().reference_cancelled(), 2u);
    EXPECT_EQ(stats().reference_waiting(), 0u);
    std::set<std::uint32_t> answered;
    while (const auto answer = next_answer(50ms)) answered.insert(answer->message.request_id());
    EXPECT_EQ(answered, std::set<std::uint32_t>{3u});
}

TEST_F(ReferenceJobs, AreCancelledOneByOne) {
    ASSERT_TRUE(work->submit(endless(1, 1)));
    ASSERT_TRUE(work->submit(endless(1, 2)));
    ASSERT_TRUE(work->submit(meter(1, 3)));
    ASSERT_TRUE(until([&] { return stats().reference_passes() > 0; }));
    EXPECT_FALSE(work->cancel(2, 1)) << "another client's";
    EXPECT_FALSE(work->cancel(1, 9)) << "nobody's";
    EXPECT_TRUE(work->cancel(1, 2)) << "it waits";
    EXPECT_TRUE(work->cancel(1, 1)) << "it runs";
    EXPECT_FALSE(work->cancel(1, 1)) << "it is given up already";
    ASSERT_TRUE(until([&] { return stats().reference_done() == 1; })) << "the third comes next";
    EXPECT_FALSE(work->cancel(1, 3)) << "it is answered already";
    EXPECT_EQ(stats().reference_cancelled(), 2u);
    std::set<std::uint32_t> answered;
    while (const auto answer = next_answer(50ms)) answered.insert(answer->message.request_id());
    EXPECT_EQ(answered, std::set<std::uint32_t>{3u});
}

TEST_F(ReferenceJobs, WaitInABoundedListAndHearHowLong) {
    ASSERT_TRUE(work->submit(endless(1, 1)));
    for (std::uint32_t i = 0; i < kMaxReferenceJobs; ++i) ASSERT_TRUE(work->submit(meter(2, 100 + i))) << i;
    EXPECT_FALSE(work->submit(meter(2, 200))) << "the list is full";
    std::set<std::uint32_t> before;
    bool running = false;
    ASSERT_TRUE(until([&] {
        while (const auto answer = answers.pop_for(0ns)) {
            const v1::Progress& progress = answer->message.progress();
            EXPECT_EQ(answer->message.request_id(), 0u) << "progress is no answer";
            if (progress.request() == 1) {
                EXPECT_EQ(answer->session, 1u);
                EXPECT_EQ(progress.unit(), "samples");
                EXPECT_FALSE(progress.has_total()) << "its noise ends it";
                running = running || (progress.samples() > 0 && progress.seconds() > 0 && progress.noise_ratio() > 0);
            } else {
                EXPECT_EQ(answer->session, 2u);
                EXPECT_EQ(progress.jobs_before(), progress.request() - 99);
                before.insert(progress.jobs_before());
            }
        }
        return running && before.size() == kMaxReferenceJobs;
    }));
}

TEST_F(ReferenceJobs, StopWithTheServer) {
    ASSERT_TRUE(work->submit(endless(1, 1)));
    ASSERT_TRUE(until([&] { return stats().reference_passes() > 0; }));
    const auto start = std::chrono::steady_clock::now();
    work.reset();
    EXPECT_LT(std::chrono::steady_clock::now() - start, 5s);
}

TEST_F(ReferenceJobs, HoldTheirOwnScene) {
    ReferenceJob job = meter(1, 1);
    ASSERT_TRUE(work->submit(std::move(job)));
    scene.lights[0].level_ratio = 0.1;
    ASSERT_TRUE(until([&] { return stats().reference_done() == 1; }));
    EXPECT_NEAR(next_answer(5s)->message.meter().direct_lx(), 250.0, 0.1);
}

TEST_F(ReferenceJobs, EndInTimeWithWhatTheyHave) {
    ReferenceJob job = endless(1, 1);
    auto& capture = std::get<CaptureRequest>(job.request);
    capture.settings.max_seconds = 0.3;
    ASSERT_TRUE(work->submit(std::move(job)));
    ReferenceJob grid = meter(1, 2);
    auto& request = std::get<MeterRequest>(grid.request);
    request.points.assign(40, request.points.front());
    request.grid = true;
    request.settings.noise = 1e-9;
    request.settings.max_seconds = 0.3;
    grid.scene =
        test::scene_with({{test::inward_sphere(2.0, 16), glm::vec3(0.9f)}}, test::isotropic(1000.0), {0, 0, 0});
    ASSERT_TRUE(work->submit(std::move(grid)));
    ASSERT_TRUE(until([&] { return stats().reference_done() == 2; }));
    const auto picture = next_answer(5s), readings = next_answer(5s);
    ASSERT_TRUE(picture && readings);
    const v1::CaptureResult& result = picture->message.capture();
    EXPECT_TRUE(result.has_noise_reached());
    EXPECT_FALSE(result.noise_reached());
    EXPECT_GT(result.samples(), 0u);
    const v1::MeterGrid& found = readings->message.meter_grid();
    EXPECT_TRUE(found.has_noise_reached());
    EXPECT_FALSE(found.noise_reached());
    ASSERT_EQ(found.points_size(), 40);
    for (const v1::MeterReading& reading : found.points()) {
        EXPECT_GT(reading.samples(), 0u) << "each point has its share of the time";
        EXPECT_FALSE(reading.noise_reached());
    }
}

TEST_F(ReferenceJobs, LeaveAPictureOfTooFewSamplesToTheLiveRenderer) {
    const auto submit = [&](std::uint32_t id, std::uint32_t samples) {
        ReferenceJob job = endless(1, id);
        auto& capture = std::get<CaptureRequest>(job.request);
        capture.width_px = capture.height_px = 16;
        capture.settings.max_passes = samples;
        capture.denoise = true;
        ASSERT_TRUE(work->submit(std::move(job)));
    };
    submit(1, trace::kLeastDenoised - 1);
    submit(2, trace::kLeastDenoised);
    ASSERT_TRUE(until([&] { return stats().reference_done() == 2; }));
    ASSERT_EQ(too_few.size(), 1u);
    EXPECT_EQ(too_few[0], std::pair(1u, trace::kLeastDenoised - 1));
    const auto picture = next_answer(5s);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->message.request_id(), 2u) << "the first is answered by the live renderer alone";
    EXPECT_TRUE(picture->message.capture().denoised());
    EXPECT_NE(picture->message.capture().image().find("gonio:denoised"), std::string::npos);
}

// IEC 61966-2-1: linear 0.5 is encoded as 0.735, that is 187.5 of 255; the exposure maps 1.2·2^EV cd/m² to 1.
TEST(Develop, ExposesAndEncodesLikeThePicture) {
    Scene scene;
    scene.exposure_ev100 = 5.0;
    CaptureRequest request;
    request.format = "png";
    request.width_px = 4;
    request.height_px = 4;
    const float half = 0.5f * 1.2f * 32.0f;
    std::vector<float> values;
    for (int i = 0; i < 15; ++i) values.insert(values.end(), {half, half, 0.0f, 1.0f});
    values.insert(values.end(), {0.0f, 0.0f, 0.0f, 0.0f});
    const CapturedPicture picture = develop(values, scene, request);
    double mean = 0.0;
    for (std::size_t i = 0; i < 15; ++i) {
        EXPECT_NEAR(picture.rgba8[4 * i], 187.5, 1.0) << "half a code value of dither";
        EXPECT_LE(picture.rgba8[4 * i + 2], 1);
        mean += picture.rgba8[4 * i] / 15.0;
    }
    EXPECT_NEAR(mean, 187.5, 0.2) << "the dither has no mean";
    EXPECT_EQ(picture.rgba8[60], 5) << "the background: 0.02 of 255";
}

TEST(Develop, ValuesKeepTheirUnitAndOnlyIndirectHasAGain) {
    Scene scene;
    scene.view_gain = 4.0;
    CaptureRequest request;
    request.format = "exr";
    request.width_px = request.height_px = 1;
    const std::vector<float> traced = {10.0f, 20.0f, 30.0f, 1.0f};
    request.view = View::indirect;
    EXPECT_FLOAT_EQ(develop(traced, scene, request).values[1], 80.0f);
    request.view = View::direct;
    EXPECT_FLOAT_EQ(develop(traced, scene, request).values[1], 20.0f);
    request.view = View::illuminance;
    EXPECT_FLOAT_EQ(develop(traced, scene, request).values[0], 0.2126f * 10 + 0.7152f * 20 + 0.0722f * 30);
}

// Half of a pixel's samples met a surface: its colour is that of the surface over the background, not darker.
TEST(Develop, EdgesMixWithTheBackground) {
    Scene scene;
    scene.exposure_ev100 = 0.0;
    CaptureRequest request;
    request.format = "jpg";
    request.view = View::illuminance;
    request.width_px = request.height_px = 1;
    const auto red = [&](float lx, float coverage) {
        return develop({lx * coverage, lx * coverage, lx * coverage, coverage}, scene, request).rgba8[0] / 255.0;
    };
    EXPECT_NEAR(red(1e4f, 0.5f), 0.5 * red(1e4f, 1.0f) + 0.5 * 0.02, 0.005);
}

}  // namespace
}  // namespace gonio
