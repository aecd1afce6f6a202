// The corpus of the fuzz targets, and damaged copies of it, through the same checks as the fuzzers.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/damaged.h"
#include "tests/fuzz/surface_check.h"

namespace gonio {
namespace {

TEST(SurfaceReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(7);
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/surface_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        for (unsigned i = 0; i < 60; ++i) {
            const std::string text = fuzz::damaged(whole, i, random);
            const Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
            fuzz::check_midi(bytes);
            fuzz::check_hid(bytes);
            fuzz::check_files(text);
            ++inputs;
        }
    }
    EXPECT_GE(inputs, 500u);
}

}  // namespace
}  // namespace gonio
