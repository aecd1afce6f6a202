// The corpus of the fuzzer of jobs, and damaged copies of it, through its check.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/damaged.h"
#include "tests/fuzz/job_check.h"

namespace gonio {
namespace {

TEST(JobReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(25);
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/job_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        EXPECT_EQ(fuzz::check_job(whole), !entry.path().filename().string().starts_with("refused")) << entry.path();
        for (unsigned i = 0; i < 100; ++i, ++inputs) fuzz::check_job(fuzz::damaged(whole, 1 + i / 20, random));
    }
    EXPECT_GE(inputs, 400u);
}

}  // namespace
}  // namespace gonio
