// docs/performance.md and its notebook are what the command writes of the committed results, so that nobody edits their
// figures by hand.
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/bench/report.h"
#include "tests/gl/test_context.h"

namespace gonio::bench {
namespace {

const std::filesystem::path kSource = GONIO_SOURCE_DIR;
const std::filesystem::path kResults = kSource / "tests/bench/results/amd-epyc-2";

std::string text_of(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

// Results are deleted with the pipeline that they are of, until it is measured anew.
bool measured() {
    return std::filesystem::exists(kResults / "pareto.json");
}

TEST(Report, ThePagesAreWhatTheCommandWrites) {
    if (!measured()) GTEST_SKIP();
    const Report report = make_report(kResults, kSource / "tests/bench");
    const char* again = "run: gonio-bench report tests/bench/results/amd-epyc-2";
    EXPECT_EQ(report.pages.size(), 2u);
    for (const auto& [page, text] : report.pages) {
        EXPECT_TRUE(text == text_of(kSource / "docs" / page)) << page << ": " << again;
        EXPECT_EQ(text.find("{{"), std::string::npos) << page;
    }
    EXPECT_TRUE(report.pareto_svg == text_of(kSource / "docs/images/pareto.svg")) << again;
}

struct Template : testing::Test {
    std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("gonio-report-test-" + std::to_string(getpid()));
    Template() { std::filesystem::create_directory(folder); }
    ~Template() override { std::filesystem::remove_all(folder); }
    std::string make(const std::string& text) {
        std::ofstream(folder / "performance.in.md") << text;
        std::ofstream(folder / "notebook.in.md")
            << "{{stress}}{{stream}}{{beams}}{{haze_rates}}{{panels}}{{hazy}}{{bakes}}{{seed_bake}}";
        return make_report(kResults, folder).pages.at("performance.md");
    }
};

TEST_F(Template, NamesStandForTablesAndFigures) {
    if (!measured()) GTEST_SKIP();
    const std::string all =
        "{{frames}}\n{{scaling}}\n{{rsm}}\n{{efforts}}\n{{lights}}\n{{refinement}}\n{{transport}}\n"
        "{{accuracy}}\n{{pareto}}\n{{goals}}\nat {{threads}} threads.";
    const std::string page = make(all);
    EXPECT_TRUE(page.ends_with("\nat 2 threads."));
    EXPECT_TRUE(page.starts_with("| scene | technique |"));
    const auto frames = nlohmann::json::parse(text_of(kResults / "frames.json"));
    for (const auto& row : frames.at("rows")) {
        if (row.at("scene") != "cornell" || row.at("technique") != "default") continue;
        char goal[100];
        std::snprintf(goal, sizeof goal, "| cornell, everything anew | 45 frames/s | %.1f frames/s |",
                      row.at("fps_average").get<double>());
        EXPECT_NE(page.find(goal), page.npos) << goal;
    }
    EXPECT_THROW(make(all + " {{speed}}"), std::runtime_error);
    EXPECT_THROW(make(all + " {{threads"), std::runtime_error);
    EXPECT_THROW(make("{{frames}}"), std::runtime_error) << "tables that nobody would see";
    EXPECT_THROW(make_report(kResults / "none", folder), std::runtime_error);
}

}  // namespace
}  // namespace gonio::bench
