// `gonio convert`, and the choice of a luminaire with `gonio photometry`.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "client/cli/cli.h"
#include "ies/core/printed.h"
#include "ies/core/zip.h"
#include "ies/photometry_file.h"
#include "tests/unit/ies_test_support.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

class ConvertCommand : public ::testing::Test {
protected:
    void SetUp() override {
        const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::temp_directory_path() / (std::string("gonio_convert_") + info->name());
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    std::string path(const std::string& name) const { return (folder_ / name).string(); }
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(path(name), std::ios::binary) << text;
        return path(name);
    }
    int run(const std::vector<std::string>& words) {
        out_.str("");
        err_.str("");
        return run_cli(words, out_, err_);
    }
    // A lamp by Lambert's law, 100 cd at the nadir: 100 pi lm.
    std::string lambert() const {
        ies::test::Lm63Text text;
        text.counts = "91 1";
        text.v.clear();
        text.candela.clear();
        for (int v = 0; v <= 90; ++v) {
            text.v += printed("%d ", v);
            text.candela += printed("%.9g ", 100.0 * std::cos(v * std::numbers::pi / 180.0));
        }
        return write("lambert.ies", text.text());
    }
    static ies::Photometry read(const std::string& file) {
        const auto read = ies::read_photometry(ies::test::read_file(file));
        EXPECT_TRUE(read) << (read ? "" : read.error().text());
        return read ? *read : ies::Photometry{};
    }

    fs::path folder_;
    std::ostringstream out_, err_;
};

TEST_F(ConvertCommand, EachFormatIntoEachOther) {
    const std::string first = lambert();
    std::string from = first;
    for (const char* name : {"a.ldt", "b.xml", "c.IES", "d.xml", "e.ldt", "f.ies"}) {
        ASSERT_EQ(run({"convert", from, path(name)}), kExitOk) << name << err_.str();
        EXPECT_NEAR(total_flux(read(path(name)).web).in(lm), 100.0 * std::numbers::pi, 0.02) << name;
        EXPECT_EQ(read(path(name)).provenance.input_watts, 40.0) << name;
        EXPECT_EQ(err_.str().find("warning: the flux"), std::string::npos) << err_.str();
        from = path(name);
    }
    EXPECT_EQ(read(path("c.IES")).provenance.format, "LM-63-2019");
    EXPECT_EQ(read(path("d.xml")).provenance.format, "TM-33-22");
    EXPECT_EQ(read(path("e.ldt")).provenance.format, "EULUMDAT");
    EXPECT_EQ(read(path("d.xml")).web.candela, read(path("c.IES")).web.candela);
    for (const auto& entry : fs::directory_iterator(folder_))
        EXPECT_EQ(entry.path().string().find(".part"), std::string::npos);
}

TEST_F(ConvertCommand, PrintsWhatItDid) {
    ASSERT_EQ(run({"convert", lambert(), path("a.xml")}), kExitOk);
    EXPECT_EQ(out_.str().substr(0, path("a.xml").size() + 28), path("a.xml") + ": TM-33-22 from LM-63-2019, ");
    ASSERT_EQ(run({"convert", lambert(), path("a.xml"), "--json"}), kExitOk) << "an older file is replaced";
    const auto line = nlohmann::json::parse(out_.str());
    EXPECT_EQ(line["to"], "TM-33-22");
    EXPECT_EQ(line["flux_lm"], line["flux_written_lm"]);
    EXPECT_TRUE(line["diagnostics"].is_array());
}

TEST_F(ConvertCommand, RefusesAndLeavesWhatIsThere) {
    const std::string in = lambert();
    const std::string before = ies::test::read_file(in);
    EXPECT_EQ(run({"convert", in, in}), kExitRefused);
    EXPECT_NE(err_.str().find("same_file OUT " + in), std::string::npos) << err_.str();
    fs::create_symlink(in, path("link.ies"));
    EXPECT_EQ(run({"convert", in, path("link.ies")}), kExitRefused);
    EXPECT_EQ(run({"convert", in, (folder_ / "." / "lambert.ies").string()}), kExitRefused);
    EXPECT_EQ(ies::test::read_file(in), before);
    EXPECT_EQ(run({"convert", in, path("a.gldf")}), kExitRefused);
    EXPECT_NE(err_.str().find("invalid_argument OUT"), std::string::npos) << err_.str();
    const std::string bad = write("bad.ies", before.substr(0, before.size() - 40));
    write("old.xml", "old");
    EXPECT_EQ(run({"convert", bad, path("old.xml")}), kExitRefused);
    EXPECT_NE(err_.str().find("truncated " + bad + ": line"), std::string::npos) << err_.str();
    EXPECT_EQ(ies::test::read_file(path("old.xml")), "old");
    EXPECT_EQ(run({"convert", path("none.ies"), path("x.ies")}), kExitRefused);
    EXPECT_NE(err_.str().find("unreadable"), std::string::npos) << err_.str();
    EXPECT_EQ(run({"convert", in, path("no/such/folder.ldt")}), kExitUsage);
    EXPECT_NE(err_.str().find("file_unwritable"), std::string::npos) << err_.str();
    EXPECT_EQ(run({"convert", in}), kExitUsage);
}

TEST_F(ConvertCommand, VariantsAndEmitters) {
    const auto variant = [](const char* id, const char* emitter) {
        return printed("<Variant id=\"%s\"><Geometry><EmitterReference emitterId=\"%s\"/></Geometry></Variant>", id,
                       emitter);
    };
    const auto emitter = [](const char* id, int lumens) {
        return printed(
            "<Emitter id=\"%s\"><FixedLightEmitter><PhotometryReference photometryId=\"p\"/>"
            "<RatedLuminousFlux>%d</RatedLuminousFlux></FixedLightEmitter></Emitter>",
            id, lumens);
    };
    const std::string product =
        "<Root><Header><FormatVersion major=\"1\"/></Header><GeneralDefinitions><Files><File id=\"f\" "
        "contentType=\"ldc/ies\" type=\"localFileName\">a.ies</File></Files><Photometries><Photometry id=\"p\">"
        "<PhotometryFileReference fileId=\"f\"/></Photometry></Photometries><Emitters>" +
        emitter("one", 500) + emitter("two", 900) + "</Emitters></GeneralDefinitions><ProductDefinitions><Variants>" +
        variant("small", "one") + variant("large", "two") + "</Variants></ProductDefinitions></Root>";
    const std::vector<ZipFile> files = {{"product.xml", product}, {"ldc/a.ies", ies::test::read_file(lambert())}};
    const std::string gldf = write("p.gldf", *write_zip(files));
    ASSERT_EQ(run({"convert", gldf, path("a.ies")}), kExitOk) << err_.str();
    EXPECT_NE(err_.str().find("large"), std::string::npos) << "the others are listed: " << err_.str();
    EXPECT_NEAR(total_flux(read(path("a.ies")).web).in(lm), 500.0, 1e-3);
    ASSERT_EQ(run({"convert", gldf, path("a.ies"), "--variant", "large"}), kExitOk) << err_.str();
    EXPECT_NEAR(total_flux(read(path("a.ies")).web).in(lm), 900.0, 1e-3);
    ASSERT_EQ(run({"photometry", gldf, "--json", "--variant=large"}), kExitOk);
    EXPECT_NEAR(nlohmann::json::parse(out_.str())["flux_lm"].get<double>(), 900.0, 1e-3);
    ASSERT_EQ(run({"photometry", gldf, "--json", "--emitter", "three"}), kExitRefused);
    const auto refused = nlohmann::json::parse(out_.str());
    EXPECT_EQ(refused["error"]["code"], "no_such_emitter");
    EXPECT_EQ(refused["diagnostics"][0]["line"], 1);
}

TEST_F(ConvertCommand, Help) {
    EXPECT_EQ(run({"convert", "--help"}), kExitOk);
    for (const char* word : {"IN", "OUT", ".ldt", "--variant", "--emitter"})
        EXPECT_NE(out_.str().find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace gonio
