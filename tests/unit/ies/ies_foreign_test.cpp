// Files that are no photometry, or an archive with some: what is said of them, and what is taken all the same.
#include <gtest/gtest.h>

#include "ies/core/zip.h"
#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

std::string archive_of(std::vector<ZipFile> files) {
    auto bytes = write_zip(files);
    EXPECT_TRUE(bytes);
    return bytes ? *bytes : std::string();
}

std::string refusal(std::string_view bytes, const Choice& choice = {}) {
    const auto read = read_photometry(bytes, choice);
    return read ? "was read" : read.error().code + ": " + read.error().text();
}

TEST(ForeignFiles, AreCalledByTheirName) {
    struct Case {
        std::string bytes;
        const char* called;
    };
    const Case cases[] = {
        {"<!DOCTYPE html><html><head><title>404 Not Found</title></head></html>\n", "web page"},
        {"\r\n <HTML lang=\"de\"><Body>Anmelden</Body></HTML>", "web page"},
        {"<?xml version=\"1.0\"?><!DOCTYPE html PUBLIC \"-//W3C//DTD XHTML 1.0 Strict//EN\"><html/>", "web page"},
        {std::string("\0\1ULD\0\1\2", 8) + std::string(100, '\3'), "ULD"},
        {std::string(64, '\0') + std::string(200, '\7'), "binary"},
        {"%PDF-1.7\n1 0 obj", "PDF"},
        {"\x89PNG\r\n\x1a\n", "PNG"},
        {std::string("\xff\xd8\xff\xe0\0\x10JFIF", 10), "JPEG"},
        {"\x1f\x8b\x08", "gzip"},
        {"7z\xbc\xaf\x27\x1c", "7z"},
        {"glTF", "GLB"},
        {"<svg width=\"1\"/>", "SVG"},
        {"<?xml version=\"1.0\"?><GDTF DataVersion=\"1.2\"/>", "GDTF"},
        {"<note>x</note>", "XML of another kind"},
        {"{\"asset\": {\"version\": \"2.0\"}}", "glTF"},
        {"{\"a\": 1}", "JSON"},
    };
    for (const Case& item : cases) {
        const std::string said = refusal(item.bytes);
        EXPECT_EQ(said.rfind("not_photometry: ", 0), 0u) << said;
        EXPECT_NE(said.find(item.called), std::string::npos) << said;
    }
    EXPECT_NE(refusal(cases[0].bytes).find("404 Not Found"), std::string::npos) << "what the server said";
    EXPECT_EQ(refusal("").rfind("empty_file", 0), 0u);
    EXPECT_EQ(refusal(" \r\n\n").rfind("empty_file", 0), 0u);
    EXPECT_EQ(refusal("just words\nand more\n").rfind("no_tilt", 0), 0u);
    EXPECT_EQ(refusal("<?xml version=\"1.0\"?><IESTM33-22><a></IESTM33-22>").rfind("bad_xml", 0), 0u);
}

// A maker's or an old file's first line may begin as another format does.
TEST(ForeignFiles, AFileThatCanBeReadIsRead) {
    test::Lm63Text text;
    text.header = "MZ Leuchten\nGIF8 <html>\n";
    EXPECT_TRUE(read_photometry(text.text()));
    std::string eulumdat = write_eulumdat(*read_photometry(synthetic_lm63("flood")));
    eulumdat.insert(0, "%PDF-Leuchten");
    EXPECT_TRUE(read_photometry(eulumdat));
}

TEST(PhotometryInZip, TheOnlyOneIsTaken) {
    const std::string lm63 = synthetic_lm63("flood");
    const Photometry alone = *read_photometry(lm63);
    for (const std::string& inner : {lm63, write_eulumdat(alone), write_tm33(alone)}) {
        const bool xml = inner.starts_with("<?xml");
        const std::string name = xml ? "a.XML" : inner == lm63 ? "Photometry/Panel 1.IES" : "x.ldt";
        const auto read = read_photometry(archive_of({{"docs/readme.txt", "x"},
                                                      {"__MACOSX/._a.ies", "x"},
                                                      {"docs/.hidden.ies", "x"},
                                                      {"docs/data.xml", "<sheet/>"},
                                                      {name, inner}}));
        ASSERT_TRUE(read) << name << ": " << read.error().text();
        EXPECT_NEAR(total_flux(read->web).in(lm), total_flux(alone.web).in(lm), 1e-3 * total_flux(alone.web).in(lm));
        ASSERT_TRUE(test::has(*read, "from_archive"));
        EXPECT_NE(read->diagnostics.front().message.find(name), std::string::npos);
    }
}

TEST(PhotometryInZip, OfSeveralOneIsChosen) {
    std::vector<ZipFile> files;
    for (int i = 0; i < 20; ++i)
        files.push_back({"ies/" + std::string(1, static_cast<char>('a' + i)) + ".ies", synthetic_lm63("flood")});
    files[2].bytes = synthetic_lm63("bulb");
    const std::string bytes = archive_of(files);
    const std::string said = refusal(bytes);
    EXPECT_EQ(said.rfind("several_files: ", 0), 0u) << said;
    EXPECT_NE(said.find("ies/a.ies, ies/b.ies"), std::string::npos) << said;
    EXPECT_EQ(said.find("ies/i.ies"), std::string::npos) << "eight are listed: " << said;
    for (const char* name : {"c.ies", "ies/c.ies"}) {
        const auto read = read_photometry(bytes, {name, ""});
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(read->web, read_photometry(synthetic_lm63("bulb"))->web);
    }
    EXPECT_EQ(refusal(bytes, {"z.ies", ""}).rfind("no_such_variant", 0), 0u);
}

TEST(PhotometryInZip, OthersAreCalledByTheirName) {
    const std::string ies = synthetic_lm63("flood");
    const auto said = [&](const char* name, const std::string& text) {
        return refusal(archive_of({{name, text}, {"a.ies", ies}}));
    };
    EXPECT_NE(said("description.xml", "<?xml version=\"1.0\"?><GDTF/>").find("GDTF"), std::string::npos);
    EXPECT_NE(said("spot/description.xml", "<GDTF/>").find("GDTF"), std::string::npos) << "with its folder";
    EXPECT_NE(said("GeneralSceneDescription.xml", "<GeneralSceneDescription/>").find("MVR"), std::string::npos);
    EXPECT_NE(said("[Content_Types].xml", "<Types/>").find("office"), std::string::npos);
    EXPECT_EQ(said("description.xml", "<luminaire/>"), "was read") << "a maker's own description";
    EXPECT_EQ(refusal(archive_of({{"a.txt", "x"}})).rfind("no_product", 0), 0u);
    EXPECT_EQ(refusal(archive_of({{"a.ies", archive_of({{"b.ies", ies}})}})).rfind("unknown_format", 0), 0u);
    EXPECT_EQ(refusal(archive_of({{"a/b.ies", "x"}})),
              "no_tilt: the file has no TILT line: it is no LM-63 file (a/b.ies "
              "line 1 column 2)");
}

TEST(ForeignFiles, TheSharedCases) {
    const auto folder = gonio::test::shared_data("cases/02-not-photometry");
    if (!folder) GTEST_SKIP() << "no shared cases on this machine";
    const auto said = [&](const char* name) { return refusal(test::read_file(*folder / name)); };
    EXPECT_EQ(said("page.ies").rfind("not_photometry", 0), 0u);
    EXPECT_EQ(said("plugin.uld").rfind("not_photometry", 0), 0u);
    EXPECT_NE(said("spec.gdtf").find("GDTF"), std::string::npos);
    EXPECT_EQ(said("empty.ies").rfind("empty_file", 0), 0u);
    for (const char* name : {"bundle.zip", "bundle.ies", "swapped.ldt"}) EXPECT_EQ(said(name), "was read") << name;
}

}  // namespace
}  // namespace gonio::ies
