#include "server/base/pool.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace gonio::lighting {
namespace {

// Whoever comes too late is not waited for, and must not take jobs of the next run with the function of the last.
TEST(Pool, RunsEveryJobOnceThroughManyShortRuns) {
    Pool pool(4);
    for (int run = 0; run < 2000; ++run) {
        std::vector<int> done(static_cast<std::size_t>(1 + run % 23));
        pool.run(static_cast<int>(done.size()), [&](int job) { done[static_cast<std::size_t>(job)] += run + 1; });
        for (const int by : done) ASSERT_EQ(by, run + 1);
    }
}

TEST(Pool, AsksBeforeEachJobAndLeavesOutTheRest) {
    Pool pool(1);  // the caller alone: it asks before the run and before each job
    for (int yes_at = 0; yes_at < 30; ++yes_at) {
        int asked = 0, done = 0;
        const auto count = [&](int) { ++done; };
        {
            const std::function<bool()> interrupted = [&] { return asked++ == yes_at; };
            const Pool::Interruptible work(pool, interrupted);
            pool.run(20, count);
            EXPECT_EQ(done, std::clamp(yes_at - 1, 0, 20));
            EXPECT_EQ(work.stopped(), yes_at <= 20);
            if (work.stopped()) pool.run(20, count);  // though the answer is no again
            EXPECT_EQ(done, std::clamp(yes_at - 1, 0, 20));
        }
        done = 0;
        pool.run(20, count);
        EXPECT_EQ(done, 20);
    }
}

TEST(Pool, DoesNoJobTwiceAndWaitsForThoseBegunWhenInterrupted) {
    Pool pool(3);
    int stopped = 0;
    for (int round = 0; round < 200; ++round) {
        std::vector<std::atomic<int>> done(500);
        std::atomic<int> running = 0;
        int asked = 0;
        const std::function<bool()> interrupted = [&] { return ++asked > round % 20 + 1; };
        const Pool::Interruptible work(pool, interrupted);
        pool.run(500, [&](int job) {
            ++running;
            for (int i = 0; i < 200; ++i) done[static_cast<std::size_t>(job)].load();
            ++done[static_cast<std::size_t>(job)];
            --running;
        });
        ASSERT_EQ(running, 0);
        int all = 0;
        for (const auto& times : done) {
            ASSERT_LE(times, 1);
            all += times;
        }
        if (!work.stopped()) {
            ASSERT_EQ(all, 500);
        }
        stopped += all < 500;
    }
    EXPECT_GT(stopped, 0);
}

TEST(Threads, AreAsManyAsProcessorsThatMayBeUsed) {
    int bound = 0, chosen = 0, unbound = 0;
    std::thread([&] {
        cpu_set_t all, one;
        ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
        CPU_ZERO(&one);
        for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu)
            if (CPU_ISSET(cpu, &all)) CPU_SET(cpu, &one);
        ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
        bound = thread_count();
        ASSERT_EQ(sched_setaffinity(0, sizeof all, &all), 0);
        unbound = thread_count() - CPU_COUNT(&all);
    }).join();
    EXPECT_EQ(bound, 1);
    EXPECT_EQ(unbound, 0);
    set_thread_count(3);
    chosen = thread_count();
    set_thread_count(0);
    EXPECT_EQ(chosen, 3);
}

}  // namespace
}  // namespace gonio::lighting
