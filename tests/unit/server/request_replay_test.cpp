// The corpus of the fuzzers of targets and configuration files, and damaged copies of it, through their checks.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/damaged.h"
#include "tests/fuzz/request_check.h"

namespace gonio {
namespace {

TEST(RequestReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(7);
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/request_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        for (unsigned i = 0; i < 60; ++i) {
            const std::string text = fuzz::damaged(whole, i, random);
            fuzz::check_target(text);
            fuzz::check_config(text);
            ++inputs;
        }
    }
    EXPECT_GE(inputs, 600u);
}

}  // namespace
}  // namespace gonio
