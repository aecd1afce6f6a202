// The saved corpus of the consoles' fuzzers through the decoders, and a short deterministic mutation run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/fuzz/console_check.h"
#include "tests/fuzz/damaged.h"

namespace gonio {
namespace {

std::vector<std::string> corpus() {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(GONIO_SOURCE_DIR "/tests/fuzz/console_corpus")) {
        std::ifstream file(entry.path(), std::ios::binary);
        files.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
    return files;
}

void check_all(const std::string& text) {
    const Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    fuzz::check_e131(bytes);
    fuzz::check_artnet(bytes);
    fuzz::check_osc(bytes);
    fuzz::check_patch_file(text);
}

TEST(ConsoleReplay, SavedCorpusAndItsPrefixes) {
    const auto files = corpus();
    EXPECT_GE(files.size(), 15u);
    for (const std::string& file : files)
        for (std::size_t length = 0; length <= file.size(); length += 3) check_all(file.substr(0, length));
    for (const std::string& file : files) check_all(file);
}

TEST(ConsoleReplay, MutatedFiles) {
    const auto files = corpus();
    std::mt19937 random(20260102);
    for (int round = 0; round < 4000; ++round) {
        const std::string& file = files[random() % files.size()];
        const unsigned changes = 1 + random() % 4;
        check_all(fuzz::damaged(file, changes, random));
    }
}

}  // namespace
}  // namespace gonio
