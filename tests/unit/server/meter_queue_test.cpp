// Meters of scenes whose light is not all there.
#include "server/session/meter_queue.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

#include "protocol/schema/gonio.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/session/null_renderer.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

struct Metered {
    glm::dvec3 point{0.0};
    LiveRenderer::MeterQuality quality{};
};

class Lit : public NullRenderer {
public:
    Lit(Readiness& there, std::vector<Metered>& metered) : there_(there), metered_(metered) {}
    Readiness ready(const Scene&) override { return there_; }
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality,
                           int bounces) override {
        metered_.push_back({point, quality});
        return NullRenderer::meter(scene, point, normal, quality, bounces);
    }

private:
    Readiness& there_;
    std::vector<Metered>& metered_;
};

class MetersInTheDark : public testing::Test {
protected:
    static Work asked() {
        Work work;
        work.session = 1;
        work.message.set_request_id(1);
        return work;
    }
    void ask(MeterQueue& meters, Quality quality = Quality::interactive) {
        MeterRequest request;
        request.quality = quality;
        request.points.push_back({.position = {0, 0, 0}, .normal = {0, 1, 0}});
        meters.add(asked(), scene, std::move(request), replies);
    }

    Readiness there = Readiness::part;
    std::size_t answers = 0;
    std::vector<Metered> metered;
    const Scene scene = scene_of(make_cornell());  // of the meters
    Scene now = scene;
    Replies replies{[this](std::uint32_t, v1::ServerMessage) { ++answers; }, scene};
    GuardedRenderer renderer{std::make_unique<Lit>(there, metered), [] { return false; }};
};

TEST_F(MetersInTheDark, WaitForAllLinks) {
    MeterQueue meters(20ms);
    ask(meters);
    std::this_thread::sleep_for(40ms);
    EXPECT_FALSE(meters.advance(now, renderer, replies)) << "nothing can be done meanwhile";
    EXPECT_EQ(answers, 0u);
    there = Readiness::all;
    meters.advance(now, renderer, replies);
    EXPECT_EQ(answers, 1u);
}

TEST_F(MetersInTheDark, OfAReplacedSceneTakeWhatThereIsInTheEnd) {
    MeterQueue meters(20ms);
    now = scene_of(make_cornell());
    ask(meters);
    EXPECT_FALSE(meters.advance(now, renderer, replies)) << "it waits as long as it has patience";
    there = Readiness::none;
    std::this_thread::sleep_for(40ms);
    EXPECT_FALSE(meters.advance(now, renderer, replies)) << "there is nothing to read";
    EXPECT_EQ(answers, 0u);
    there = Readiness::part;
    EXPECT_FALSE(meters.advance(now, renderer, replies)) << "no other waits";
    EXPECT_EQ(answers, 1u);
    EXPECT_TRUE(meters.empty());
}

TEST_F(MetersInTheDark, AreReadWhereAndAsTheyWereAsked) {
    MeterQueue meters;
    there = Readiness::all;
    ask(meters);
    ask(meters, Quality::rsm);
    Picked picked;
    picked.point.position = {1, 2, 3};
    meters.add(asked(), scene, picked, replies);
    while (meters.advance(now, renderer, replies)) continue;
    EXPECT_EQ(answers, 3u);
    ASSERT_EQ(metered.size(), 3u);
    EXPECT_EQ(metered[0].quality, LiveRenderer::MeterQuality::interactive);
    EXPECT_EQ(metered[1].quality, LiveRenderer::MeterQuality::rsm);
    EXPECT_EQ(metered[2].quality, LiveRenderer::MeterQuality::interactive);
    EXPECT_EQ(metered[2].point, glm::dvec3(1, 2, 3));
}

}  // namespace
}  // namespace gonio
