// The corpus of the fuzzers of scene files, and damaged copies of it, through their checks.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/asset_check.h"
#include "tests/fuzz/damaged.h"

namespace gonio {
namespace {

TEST(AssetReplay, TheCorpusAndDamagedCopiesOfIt) {
    std::mt19937 random(8);
    std::size_t inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/asset_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(file)), {});
        for (unsigned i = 0; i < 40; ++i) {
            const std::string text = fuzz::damaged(whole, i, random);
            const ByteView bytes = std::as_bytes(std::span(text));
            fuzz::check_draco(bytes);
            fuzz::check_meshopt(bytes);
            fuzz::check_image(bytes);
            fuzz::check_scene(bytes);
            ++inputs;
        }
    }
    EXPECT_GE(inputs, 400u);
}

}  // namespace
}  // namespace gonio
