// The corpus of the fuzzers of targets and configuration files, and damaged copies of it, through their checks.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/request_check.h"

namespace gonio {
namespace {

TEST(RequestReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(7);
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/request_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        for (int i = 0; i < 60; ++i) {
            std::string text = whole;
            for (int change = 0; change < i && !text.empty(); ++change) {
                const std::size_t at = random() % text.size();
                if (random() % 4 == 0)
                    text.erase(at, 1 + random() % 8);
                else
                    text[at] = static_cast<char>(random());
            }
            fuzz::check_target(text);
            fuzz::check_config(text);
            ++inputs;
        }
    }
    EXPECT_GE(inputs, 600u);
}

}  // namespace
}  // namespace gonio
