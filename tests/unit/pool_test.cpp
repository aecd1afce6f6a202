#include "server/shade/pool.h"

#include <gtest/gtest.h>

namespace gonio::shade {
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

}  // namespace
}  // namespace gonio::shade
