// The corpus of the fuzzers of other programs' files, and damaged copies of it, through their checks.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/damaged.h"
#include "tests/fuzz/exchange_check.h"
#include "tests/fuzz/exchange_import.h"

namespace gonio {
namespace {

TEST(ExchangeReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(24);
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/exchange_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        for (unsigned i = 0; i < 200; ++i) {
            const std::string text = fuzz::damaged(whole, i / 4, random);
            fuzz::check_gdtf(text);
            fuzz::check_mvr(text);
            fuzz::check_3ds(text);
            if (i % 4 == 0) fuzz::check_import(text), fuzz::check_fixture_type(text);
            ++inputs;
        }
    }
    EXPECT_GE(inputs, 600u);
}

}  // namespace
}  // namespace gonio
