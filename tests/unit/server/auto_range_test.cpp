// When the automatic range of a false-colour view is metered, and what becomes of it.
#include "server/session/auto_range.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/unit/server/changing_scene.h"

namespace gonio {
namespace {

class AutomaticRange : public test::ChangingScene {
protected:
    AutomaticRange() { scene = scene_of(make_cornell()); }
    // A turn so many seconds after the start; what was asked for in it is answered and carried out.
    void turn(double s) {
        const auto now_ns = static_cast<std::int64_t>(s * 1e9);
        auto high = range.tend(scene, now_ns);
        std::promise<void> idle;
        ASSERT_TRUE(loader.submit([&] { idle.set_value(); }));
        idle.get_future().wait();
        if (!high) high = range.tend(scene, now_ns);
        if (!high) return;
        change([&](v1::Command& c) {
            c.mutable_set_view()->set_range_high(*high);
            c.mutable_set_view()->set_range_auto(true);
        });
    }
    Loader loader;
    std::atomic<int> metered = 0;
    std::optional<double> answer = 200.0;
    AutoRange range{loader, [] {},
                    [this](const Scene&, View) {
                        ++metered;
                        return answer;
                    }};
};

TEST_F(AutomaticRange, FollowsWhatRests) {
    turn(1.0);
    EXPECT_EQ(metered, 0) << "beauty has none";
    change([](v1::Command& c) { c.mutable_set_view()->set_view("illuminance"); });
    turn(2.0);
    EXPECT_EQ(metered, 0) << "it is fixed";
    change([](v1::Command& c) { c.mutable_set_view()->set_range_auto(true); });
    turn(3.0);
    EXPECT_EQ(metered, 1);
    EXPECT_EQ(scene.false_color[0].range_high, 200.0);
    EXPECT_TRUE(scene.false_color[0].range_auto);
    turn(4.0);
    EXPECT_EQ(metered, 1) << "nothing changed but the range";
    answer = 100.0;
    dim(0.5);
    turn(5.0);
    dim(0.4);
    turn(5.4);
    EXPECT_EQ(metered, 1) << "it moves";
    turn(6.0);
    EXPECT_EQ(metered, 2);
    EXPECT_EQ(scene.false_color[0].range_high, 100.0);
    answer.reset();
    dim(0.0);
    turn(7.0);
    turn(8.0);
    EXPECT_EQ(metered, 3);
    EXPECT_EQ(scene.false_color[0].range_high, 100.0) << "in the dark it stays";
    change([](v1::Command& c) { c.mutable_set_view()->set_range_high(300.0); });
    dim(1.0);
    turn(9.0);
    turn(10.0);
    EXPECT_EQ(metered, 3) << "a typed range stays";
}

}  // namespace
}  // namespace gonio
