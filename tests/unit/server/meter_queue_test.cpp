// Meters of scenes whose light is not all there.
#include "server/session/meter_queue.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "protocol/schema/gonio.pb.h"
#include "server/assets/assets.h"
#include "server/session/null_renderer.h"

namespace gonio {
namespace {

using namespace std::chrono_literals;

class Lit : public NullRenderer {
public:
    explicit Lit(Readiness& there) : there_(there) {}
    Readiness ready(const Scene&) override { return there_; }

private:
    Readiness& there_;
};

class MetersInTheDark : public testing::Test {
protected:
    void ask(MeterQueue& meters) {
        Work work;
        work.session = 1;
        work.message.set_request_id(1);
        MeterRequest request;
        request.points.push_back({.position = {0, 0, 0}, .normal = {0, 1, 0}});
        meters.add(work, scene, std::move(request), replies);
    }

    Readiness there = Readiness::part;
    std::size_t answers = 0;
    const Scene scene = scene_of(make_cornell());
    Replies replies{[this](std::uint32_t, v1::ServerMessage) { ++answers; }, scene};
    GuardedRenderer renderer{std::make_unique<Lit>(there), [] { return false; }};
};

TEST_F(MetersInTheDark, WaitForAllLinks) {
    MeterQueue meters(1h);
    ask(meters);
    EXPECT_FALSE(meters.advance(renderer, replies)) << "nothing can be done meanwhile";
    EXPECT_EQ(answers, 0u);
    there = Readiness::all;
    meters.advance(renderer, replies);
    EXPECT_EQ(answers, 1u);
}

TEST_F(MetersInTheDark, TakeWhatThereIsInTheEnd) {
    MeterQueue meters(20ms);
    there = Readiness::none;
    ask(meters);
    std::this_thread::sleep_for(40ms);
    EXPECT_FALSE(meters.advance(renderer, replies)) << "there is nothing to read";
    EXPECT_EQ(answers, 0u);
    there = Readiness::part;
    EXPECT_FALSE(meters.advance(renderer, replies)) << "no other waits";
    EXPECT_EQ(answers, 1u);
    EXPECT_TRUE(meters.empty());
}

}  // namespace
}  // namespace gonio
