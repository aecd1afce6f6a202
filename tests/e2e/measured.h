// Rates and times, which are the machine's as much as the program's.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace gonio::test {

// Result: what is said, unless it holds; then nothing.
inline std::string unless(bool holds, const std::string& said) {
    return holds ? "" : said + "; ";
}

// Measures until all holds, at most three times: a fault of the program shows each time, a machine that was busy
// elsewhere in one or two of them. measure(): what did not hold, nothing where all did.
template <typename Measure>
void holds_in_one_of_three(const Measure& measure) {
    std::string missed;
    for (int i = 0; i < 3; ++i) {
        missed = measure();
        if (missed.empty() || testing::Test::HasFatalFailure()) return;
        std::printf("measured %d of 3: %s\n", i + 1, missed.c_str());
    }
    ADD_FAILURE() << missed;
}

}  // namespace gonio::test
