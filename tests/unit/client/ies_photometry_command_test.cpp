// `gonio photometry`: the JSON that scripts read, and that one bad file does not stop the others.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/cli/photometry.h"
#include "ies/synthetic.h"
#include "tests/unit/ies_test_support.h"

namespace gonio {
namespace {

using Json = nlohmann::json;

class PhotometryCommand : public ::testing::Test {
protected:
    void SetUp() override {
        const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::temp_directory_path() / (std::string("gonio_photometry_") + info->name());
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::string write(const std::string& name, const std::string& text) const {
        const std::filesystem::path path = folder_ / name;
        std::ofstream(path, std::ios::binary) << text;
        return path.string();
    }

    std::filesystem::path folder_;
};

TEST_F(PhotometryCommand, PrintsTheFieldsThatScriptsRelyOn) {
    std::ostringstream out;
    std::ostringstream err;
    const std::string file = write("a.ies", ies::synthetic_lm63("downlight"));
    ASSERT_EQ(run_photometry(std::vector{file}, PhotometryFormat::json, out, err), 0);
    const Json printed = Json::parse(out.str());
    EXPECT_EQ(printed["type"], "C");
    EXPECT_EQ(printed["n_vertical"], 37);
    EXPECT_EQ(printed["n_horizontal"], 1);
    EXPECT_EQ(printed["max_cd"], 2400.0);
    EXPECT_NEAR(printed["flux_lm"].get<double>(), 3015.9, 6.0);
    // cos^4 falls to a half at 32.77 and to a tenth at 55.78 degrees.
    EXPECT_NEAR(printed["beam_deg"].get<double>(), 65.5, 0.1);
    EXPECT_NEAR(printed["field_deg"].get<double>(), 111.6, 0.1);
    EXPECT_EQ(printed["absolute"], true);
    EXPECT_TRUE(printed["diagnostics"].is_array());
    EXPECT_EQ(printed["provenance"]["format"], "LM-63-2019");
    EXPECT_EQ(printed["provenance"]["scale"], 1.0);
    EXPECT_TRUE(err.str().empty());
}

TEST_F(PhotometryCommand, DiagnosticsAndErrorsSayWhere) {
    std::string text = ies::synthetic_lm63("bulb") + "left over\n";
    const std::string odd = write("odd.ies", text);
    text.replace(text.find("TILT=NONE"), 4, "SLOT");
    const std::string bad = write("bad.ies", text);
    std::ostringstream out;
    std::ostringstream err;
    EXPECT_EQ(run_photometry(std::vector{bad, odd, folder_.string() + "/none"}, PhotometryFormat::json, out, err), 1);
    const Json printed = Json::parse(out.str());
    ASSERT_EQ(printed.size(), 3u);
    EXPECT_EQ(printed[0]["error"]["code"], "no_tilt");
    EXPECT_EQ(printed[0]["diagnostics"][0]["severity"], "error");
    EXPECT_EQ(printed[1]["diagnostics"][0]["code"], "trailing_data");
    EXPECT_EQ(printed[1]["diagnostics"][0]["severity"], "warning");
    EXPECT_GT(printed[1]["diagnostics"][0]["line"].get<int>(), 10);
    EXPECT_EQ(printed[2]["error"]["code"], "unreadable");
}

TEST_F(PhotometryCommand, TellsTheColour) {
    std::ostringstream out;
    std::ostringstream text;
    std::ostringstream err;
    ies::test::Lm63Text lamp;
    lamp.header += "[LAMP] TL5 49W/830\n";
    const std::vector file = {write("a.ies", lamp.text())};
    EXPECT_EQ(run_photometry(file, PhotometryFormat::json, out, err), 0);
    EXPECT_EQ(Json::parse(out.str())["colour"], Json({{"cct_k", 3000.0}, {"cri", 80.0}, {"cri_is_least", true}}));
    EXPECT_EQ(run_photometry(file, PhotometryFormat::text, text, err), 0);
    EXPECT_NE(text.str().find("colour temperature 3000 K, CRI at least 80"), std::string::npos);
    out.str("");
    const std::vector plain = {write("b.ies", ies::synthetic_lm63("bulb"))};
    EXPECT_EQ(run_photometry(plain, PhotometryFormat::json, out, err), 0);
    EXPECT_EQ(Json::parse(out.str())["colour"]["cct_k"], nullptr);
}

// The content decides; a name that says another format is told of.
TEST_F(PhotometryCommand, AnEndingOfAnotherFormat) {
    std::ostringstream out;
    std::ostringstream err;
    const std::vector files = {write("a.ldt", ies::synthetic_lm63("bulb")), write("b.IES", ies::synthetic_lm63("bulb")),
                               write("c.txt", ies::synthetic_lm63("bulb"))};
    EXPECT_EQ(run_photometry(files, PhotometryFormat::json, out, err), 0);
    const Json printed = Json::parse(out.str());
    EXPECT_EQ(printed[0]["diagnostics"][0]["code"], "other_ending");
    EXPECT_NE(printed[0]["diagnostics"][0]["message"].get<std::string>().find("LM-63-2019"), std::string::npos);
    for (int i = 1; i < 3; ++i)
        for (const Json& one : printed[static_cast<std::size_t>(i)]["diagnostics"])
            EXPECT_NE(one["code"], "other_ending");
}

TEST_F(PhotometryCommand, DrawsCurves) {
    const std::vector files = {write("a<b.ies", ies::synthetic_lm63("street")),
                               write("c.ies", ies::synthetic_lm63("linear"))};
    std::ostringstream svg;
    std::ostringstream text;
    std::ostringstream err;
    EXPECT_EQ(run_photometry(files, PhotometryFormat::svg, svg, err), 0);
    EXPECT_EQ(svg.str().rfind("<svg ", 0), 0u);
    EXPECT_NE(svg.str().find("a&lt;b.ies"), std::string::npos);
    EXPECT_NE(svg.str().find("height=\"920\""), std::string::npos);
    EXPECT_EQ(run_photometry(files, PhotometryFormat::text, text, err), 0);
    EXPECT_NE(text.str().find("BUG B"), std::string::npos);
    EXPECT_NE(text.str().find("\xe2\xa0"), std::string::npos);
    EXPECT_EQ(run_photometry({}, PhotometryFormat::text, text, err), 2);
}

// A luminaire with an opening has CIE 190's table; one without is refused by name, and the others go on.
TEST_F(PhotometryCommand, UgrTable) {
    ies::test::Lm63Text text;
    const std::string point = write("point.ies", text.text());
    text.size = "0.6 0.6 0";
    const std::string panel = write("panel.ies", text.text());
    std::ostringstream out;
    std::ostringstream err;
    EXPECT_EQ(run_photometry(std::vector{panel}, PhotometryFormat::json, out, err, 1.0), 0);
    const Json ugr = Json::parse(out.str())["ugr"];
    EXPECT_EQ(ugr["spacing_to_height"], 1.0);
    ASSERT_EQ(ugr["rows"].size(), 19u);
    EXPECT_EQ(ugr["rows"][10]["x_h"], 4.0);
    EXPECT_EQ(ugr["rows"][10]["crosswise"].size(), 5u);
    out.str("");
    EXPECT_EQ(run_photometry(std::vector{point, panel}, PhotometryFormat::text, out, err, 0.25), 1);
    EXPECT_NE(err.str().find("point.ies"), std::string::npos);
    EXPECT_NE(err.str().find("luminous opening"), std::string::npos);
    EXPECT_NE(out.str().find("UGR (CIE 190), spacing 0.25"), std::string::npos);
}

}  // namespace
}  // namespace gonio
