// The saved fuzzing corpus through the readers and what follows them: no crash, and every promise kept. The corpus
// holds the inputs that once broke something and a sample that covers the readers' branches.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "ies/curves.h"
#include "ies/eulumdat.h"
#include "ies/lm63.h"
#include "ies/photometry_file.h"
#include "ies/quantities.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "tests/fuzz/damaged.h"
#include "tests/fuzz/ies_container_check.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

void run_all(const std::string& bytes) {
    fuzz::check(read_lm63(bytes));
    fuzz::check(read_eulumdat(bytes));
    fuzz::check_tm33(bytes);
    fuzz::check_gldf(bytes);
    fuzz::check_zip(bytes);
    const auto photometry = read_photometry(bytes);
    fuzz::check(photometry);
    if (!photometry) return;
    ASSERT_TRUE(read_lm63(write_lm63(*photometry)));
    ASSERT_TRUE(read_eulumdat(write_eulumdat(*photometry)));
}

TEST(IesReplay, SavedCorpus) {
    const std::filesystem::path folder = std::filesystem::path(GONIO_SOURCE_DIR) / "tests" / "fuzz" / "ies_corpus";
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        run_all(test::read_file(entry.path()));
        ++files;
    }
    EXPECT_GT(files, 20);
}

TEST(IesReplay, DamagedContainers) {
    const std::filesystem::path folder = std::filesystem::path(GONIO_SOURCE_DIR) / "tests" / "fuzz" / "ies_corpus";
    std::mt19937 random(33);
    int inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string name = entry.path().filename();
        const bool container =
            name.starts_with("seed_tm33") || name.starts_with("seed_gldf") || name.starts_with("seed_zip");
        const std::string whole = container ? test::read_file(entry.path()) : "";
        for (unsigned i = 0; container && i < 60; ++i, ++inputs) {
            const std::string bytes = gonio::fuzz::damaged(whole, 1 + i / 4, random);
            fuzz::check_tm33(bytes);
            fuzz::check_gldf(bytes);
            fuzz::check_zip(bytes);
        }
    }
    EXPECT_GE(inputs, 500);
}

TEST(IesReplay, EveryPrefixOfAFile) {
    const std::string lm63 = synthetic_lm63("flood");
    const std::string ldt = write_eulumdat(*read_lm63(lm63));
    for (const std::string& text : {lm63, ldt}) {
        for (std::size_t length = 0; length < text.size(); length += 7) {
            const std::string_view prefix = std::string_view(text).substr(0, length);
            fuzz::check(read_photometry(prefix));
        }
    }
}

// A short deterministic mutation run, for machines without libFuzzer.
TEST(IesReplay, MutatedFiles) {
    const std::string seeds[] = {synthetic_lm63("wall_washer"), write_eulumdat(*read_lm63(synthetic_lm63("linear")))};
    const std::string tokens[] = {"-1",      "1e400",          "nan", "0", "360", "180", "90",
                                  "4194305", "TILT=INCLUDE\n", "\n",  ",", ""};
    std::mt19937 random(20260101);
    for (int round = 0; round < 1500; ++round) {
        std::string text = seeds[round % 2].substr(0, 3000 + random() % 4000);
        for (unsigned k = 0; k < 1 + random() % 4; ++k) {
            const std::size_t at = random() % text.size();
            const std::string& token = tokens[random() % std::size(tokens)];
            if (random() % 2 == 0) {
                text.replace(at, random() % 6, token);
            } else {
                text[at] = static_cast<char>(random());
            }
        }
        fuzz::check(read_photometry(text));
    }
}

}  // namespace
}  // namespace gonio::ies
