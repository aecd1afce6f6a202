// The frame-time budget against a machine of known speed, with a clock of its own.
#include "server/session/budget.h"

#include <gtest/gtest.h>

namespace gonio {
namespace {

// A machine that needs full_ms for a whole frame and as much less as the efforts say.
struct RenderingMachine {
    Budget budget;
    double full_ms;
    std::int64_t now_ns = 0;

    std::size_t heavy_frame() {
        const std::size_t effort = budget.choose(now_ns);
        const double ms = full_ms * kQualityLevels[effort].cost;
        now_ns += static_cast<std::int64_t>(ms * 1e6);
        budget.took(ms, true, now_ns);
        return effort;
    }
};

TEST(Budget, WithoutALimitEverythingIsDone) {
    RenderingMachine machine{Budget(), 500.0};
    for (int i = 0; i < 10; ++i) EXPECT_EQ(machine.heavy_frame(), 0u);
}

TEST(Budget, AFastMachineDoesEverything) {
    RenderingMachine machine{Budget(1000.0 / 60.0), 12.0};
    for (int i = 0; i < 100; ++i) EXPECT_EQ(machine.heavy_frame(), 0u);
}

TEST(Budget, KeepsUpWithinHalfASecond) {
    for (const double full_ms : {20.0, 30.0, 35.0}) {
        RenderingMachine machine{Budget(1000.0 / 60.0), full_ms};
        while (machine.now_ns < 500'000'000) machine.heavy_frame();
        const std::size_t effort = machine.heavy_frame();
        EXPECT_LE(full_ms * kQualityLevels[effort].cost, 1000.0 / 60.0) << full_ms;
        EXPECT_GT(full_ms * kQualityLevels[effort - 1].cost, 0.95 * 1000.0 / 60.0)
            << "no less than need be, " << full_ms;
    }
}

TEST(Budget, ALoadThatComesAndGoes) {
    RenderingMachine machine{Budget(1000.0 / 30.0), 20.0};
    for (int i = 0; i < 20; ++i) machine.heavy_frame();
    EXPECT_EQ(machine.budget.chosen(), 0u);
    machine.full_ms = 75.0;
    const std::int64_t loaded_ns = machine.now_ns;
    while (machine.now_ns < loaded_ns + 500'000'000) machine.heavy_frame();
    EXPECT_LE(75.0 * kQualityLevels[machine.heavy_frame()].cost, 1000.0 / 30.0);
    machine.full_ms = 20.0;
    const std::int64_t free_ns = machine.now_ns;
    while (machine.now_ns < free_ns + 500'000'000) machine.heavy_frame();
    EXPECT_EQ(machine.heavy_frame(), 0u);
}

TEST(Budget, DoesNotSwing) {
    for (double full_ms = 10.0; full_ms < 150.0; full_ms += 1.0) {
        RenderingMachine machine{Budget(1000.0 / 60.0), full_ms};
        for (int i = 0; i < 30; ++i) machine.heavy_frame();
        const std::size_t effort = machine.heavy_frame();
        for (int i = 0; i < 30; ++i) EXPECT_EQ(machine.heavy_frame(), effort) << full_ms;
    }
}

TEST(Budget, OwesTheWholePictureWhenNothingMoves) {
    RenderingMachine machine{Budget(1000.0 / 60.0), 60.0};
    for (int i = 0; i < 20; ++i) machine.heavy_frame();
    ASSERT_NE(machine.budget.chosen(), 0u);
    EXPECT_FALSE(machine.budget.owes(machine.now_ns));
    EXPECT_EQ(machine.budget.owes_in_ns(machine.now_ns), Budget::kRestNs);
    machine.now_ns += Budget::kRestNs;
    EXPECT_TRUE(machine.budget.owes(machine.now_ns));
    EXPECT_EQ(machine.budget.choose(machine.now_ns), 0u);
    EXPECT_FALSE(machine.budget.owes(machine.now_ns)) << "it is being made";
    EXPECT_EQ(machine.budget.owes_in_ns(machine.now_ns), INT64_MAX);
}

TEST(Budget, LightFramesSayNothing) {
    RenderingMachine machine{Budget(1000.0 / 60.0), 60.0};
    for (int i = 0; i < 20; ++i) machine.heavy_frame();
    const std::size_t effort = machine.budget.chosen();
    for (int i = 0; i < 5; ++i) machine.budget.took(2.0, false, machine.now_ns += 16'000'000);
    EXPECT_EQ(machine.budget.choose(machine.now_ns), effort);
}

}  // namespace
}  // namespace gonio
