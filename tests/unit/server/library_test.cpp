// The library of photometry: what it lists, finds and reads, and what it leaves alone.
#include "server/session/library.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <thread>

#include "ies/core/zip.h"
#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "protocol/schema/library.pb.h"
#include "server/assets/assets.h"
#include "server/session/profile_summary.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

class LibraryTest : public testing::Test {
protected:
    void SetUp() override {
        folder = fs::temp_directory_path() / ("gonio-library-" + std::to_string(::getpid()));
        fs::remove_all(folder);
        fs::create_directories(folder / "in" / "spots");
        fs::create_directories(folder / "out");
    }
    void TearDown() override { fs::remove_all(folder); }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder / name, std::ios::binary) << text;
    }
    static std::string spot() { return ies::synthetic_lm63("narrow_spot"); }
    // Result: all rows once everything has been read.
    static v1::Library all(Library& library, v1::LibraryQuery query = {}) {
        query.set_count(kMaxLibraryRows);
        for (int i = 0; i < 1000; ++i) {
            const auto found = library.find(query);
            EXPECT_TRUE(found);
            if (!found->reading()) return *found;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        ADD_FAILURE() << "it reads for ever";
        return {};
    }
    static const v1::LibraryRow* row(const v1::Library& library, const std::string& name) {
        for (const v1::LibraryRow& each : library.rows())
            if (each.name() == name) return &each;
        return nullptr;
    }
    fs::path folder;
};

TEST_F(LibraryTest, HasTheBuiltInLuminairesWithTheirClosedForms) {
    Library library;
    const v1::Library found = all(library);
    EXPECT_EQ(static_cast<std::size_t>(found.rows_size()), ies::synthetic_luminaires().size());
    for (const ies::SyntheticLuminaire& luminaire : ies::synthetic_luminaires()) {
        const v1::LibraryRow* each = row(found, std::string(luminaire.name));
        ASSERT_NE(each, nullptr);
        EXPECT_EQ(each->source(), "built-in");
        EXPECT_NEAR(each->summary().flux_lm() / luminaire.flux.in(lm), 1.0, 0.002);
    }
    // I = I0 exp(200 (cos v - 1)) is I0/2 at cos v = 1 - ln 2/200.
    const v1::PhotometrySummary& spot = row(found, "narrow_spot")->summary();
    EXPECT_NEAR(spot.beam_rad(), 2 * std::acos(1 - std::log(2.0) / 200), 0.002);
    EXPECT_NEAR(spot.field_rad(), 2 * std::acos(1 - std::log(10.0) / 200), 0.002);
    EXPECT_EQ(spot.input_watts(), 15);
    EXPECT_NEAR(spot.length_m(), 0.1, 1e-9);
    EXPECT_TRUE(library.profile("narrow_spot"));
    EXPECT_EQ(library.profile("none").error().code, "not_found");
}

TEST_F(LibraryTest, ReadsFoldersAndStaysWithinThem) {
    write("in/spots/a.ies", spot());
    write("in/B.IES", spot());
    write("in/notes.txt", "no photometry, and not asked for");
    write("in/broken.ies", "this is no photometry");
    write("in/large.ies", std::string((1u << 20) + 1, 'x'));
    write("out/secret.ies", spot());
    fs::create_symlink(folder / "out" / "secret.ies", folder / "in" / "link.ies");
    fs::create_directory_symlink(folder / "out", folder / "in" / "door");
    fs::create_symlink(folder / "in" / "B.IES", folder / "in" / "same.ies");
    Library library({(folder / "in").string()});
    const v1::Library found = all(library);
    const std::size_t own = ies::synthetic_luminaires().size();
    EXPECT_EQ(found.total(), own + 6);
    EXPECT_TRUE(row(found, "spots/a.ies")->has_summary());
    EXPECT_TRUE(row(found, "B.IES")->has_summary());
    EXPECT_TRUE(row(found, "same.ies")->has_summary()) << "a link to a file of the folder";
    EXPECT_FALSE(row(found, "broken.ies")->error().empty());
    EXPECT_NE(row(found, "large.ies")->error().find("1 MiB"), std::string::npos);
    EXPECT_NE(row(found, "link.ies")->error().find("out of the folder"), std::string::npos);
    EXPECT_EQ(row(found, "door/secret.ies"), nullptr);
    const auto a = library.profile("spots/a.ies");
    ASSERT_TRUE(a);
    EXPECT_EQ((*a)->name, "spots/a.ies");
    for (const char* name : {"link.ies", "door/secret.ies", "../out/secret.ies", "broken.ies", "notes.txt"})
        EXPECT_EQ(library.profile(name).error().code, "not_found") << name;
    // The file becomes a link after it was listed.
    fs::remove(folder / "in" / "B.IES");
    fs::create_symlink(folder / "out" / "secret.ies", folder / "in" / "B.IES");
    EXPECT_EQ(library.profile("B.IES").error().code, "not_found");
}

// As makers hand them out: photometry beside pictures of more than 1 MiB. Of several files none is guessed.
TEST_F(LibraryTest, ReadsAZipWithOnePhotometricFile) {
    std::vector<ZipFile> files = {{"sheet.pdf", std::string(2u << 20, 'x'), false}, {"ies/a.ies", spot()}};
    write("in/one.zip", *write_zip(files));
    files.push_back({"ies/b.ies", spot()});
    write("in/two.zip", *write_zip(files));
    Library library({(folder / "in").string()});
    const v1::Library found = all(library);
    ASSERT_NE(row(found, "one.zip"), nullptr);
    EXPECT_EQ(row(found, "one.zip")->error(), "");
    EXPECT_TRUE(library.profile("one.zip"));
    ASSERT_NE(row(found, "two.zip"), nullptr);
    EXPECT_NE(row(found, "two.zip")->error().find("ies/a.ies, ies/b.ies"), std::string::npos)
        << row(found, "two.zip")->error();
}

// The same spot in other formats; a container may be larger than a plain file.
TEST_F(LibraryTest, ReadsTm33AndGldf) {
    const ies::Photometry first = *ies::read_photometry(spot());
    write("in/t.xml", ies::write_tm33(first));
    const std::string product =
        "<Root><Header><FormatVersion major=\"1\"/></Header><GeneralDefinitions><Files><File id=\"f\" "
        "contentType=\"ldc/ies\" type=\"localFileName\">a.ies</File></Files><Photometries><Photometry id=\"p\">"
        "<PhotometryFileReference fileId=\"f\"/></Photometry></Photometries><Emitters><Emitter id=\"e\">"
        "<FixedLightEmitter><PhotometryReference photometryId=\"p\"/><RatedLuminousFlux>1234</RatedLuminousFlux>"
        "</FixedLightEmitter></Emitter></Emitters></GeneralDefinitions><ProductDefinitions><Variants><Variant "
        "id=\"v\"><Geometry><EmitterReference emitterId=\"e\"/></Geometry></Variant></Variants></ProductDefinitions>"
        "</Root>";
    const std::vector<ZipFile> files = {
        {"product.xml", product}, {"ldc/a.ies", spot()}, {"image/a.png", std::string(2u << 20, 'x'), false}};
    write("in/p.gldf", *write_zip(files));
    Library library({(folder / "in").string()});
    const v1::Library found = all(library);
    ASSERT_NE(row(found, "t.xml"), nullptr);
    EXPECT_NEAR(row(found, "t.xml")->summary().flux_lm(), total_flux(first.web).in(lm), 1e-3);
    ASSERT_NE(row(found, "p.gldf"), nullptr);
    EXPECT_EQ(row(found, "p.gldf")->error(), "");
    EXPECT_NEAR(row(found, "p.gldf")->summary().flux_lm(), 1234.0, 1e-2);
    EXPECT_TRUE(library.profile("p.gldf"));
}

// A fixture of a console is the luminaire of its first beam: 10,000 lm in 25° is what its file says.
TEST_F(LibraryTest, ReadsGdtf) {
    const std::string geometry =
        "<Geometry Name='Base'><Beam Name='Lens' LuminousFlux='10000' BeamAngle='25' "
        "FieldAngle='40'/></Geometry>";
    const auto fixture = [](const std::string& geometries) {
        return *write_zip(std::vector<ZipFile>{
            {"description.xml", test::gdtf_text({.geometries = geometries, .modes = test::mode_text("Base", "")})}});
    };
    write("in/head.gdtf", fixture(geometry));
    write("in/broken.gdtf", "PK no archive");
    Library library({(folder / "in").string()});
    const v1::Library found = all(library);
    ASSERT_NE(row(found, "head.gdtf"), nullptr);
    ASSERT_TRUE(row(found, "head.gdtf")->has_summary()) << row(found, "head.gdtf")->error();
    EXPECT_NEAR(row(found, "head.gdtf")->summary().flux_lm(), 10000, 20);
    EXPECT_NEAR(row(found, "head.gdtf")->summary().beam_rad() * 180 / std::numbers::pi, 25, 0.5);
    EXPECT_FALSE(row(found, "broken.gdtf")->has_summary());
    EXPECT_FALSE(row(found, "broken.gdtf")->error().empty());
    const auto read = library.profile("head.gdtf");
    ASSERT_TRUE(read);
    EXPECT_EQ((*read)->name, "head.gdtf");
}

TEST_F(LibraryTest, FindsByWordsFluxAndBeamAngle) {
    Library library;
    const auto names = [&](const std::function<void(v1::LibraryQuery&)>& fill) {
        v1::LibraryQuery query;
        fill(query);
        std::string text;
        const auto found = library.find(query);
        for (const v1::LibraryRow& each : found->rows()) text += each.name() + " ";
        return text;
    };
    EXPECT_EQ(names([](v1::LibraryQuery& q) { q.set_text("SPOT  narrow"); }), "narrow_spot ");
    EXPECT_EQ(names([](v1::LibraryQuery& q) { q.set_max_beam_rad(0.3); }), "narrow_spot ");
    EXPECT_EQ(names([](v1::LibraryQuery& q) {
                  q.set_min_flux_lm(2 * std::numbers::pi * 2400 / 5 - 20);  // the downlight's
                  q.set_max_flux_lm(2 * std::numbers::pi * 2400 / 5 + 20);
              }),
              "downlight ");
    v1::LibraryQuery two;
    two.set_offset(1);
    two.set_count(2);
    const auto found = library.find(two);
    EXPECT_EQ(found->rows_size(), 2);
    EXPECT_EQ(found->found(), ies::synthetic_luminaires().size());
    EXPECT_TRUE(found->rows(0).curve().empty());
    two.set_curves(true);
    EXPECT_EQ(library.find(two)->rows(0).curve().size(), 4u * 37);
    two.set_count(kMaxLibraryRows + 1);
    EXPECT_EQ(library.find(two).error().where, "library.count");
    two.set_count(1);
    two.set_min_beam_rad(std::nan(""));
    EXPECT_EQ(library.find(two).error().where, "library.min_beam_rad");
}

TEST_F(LibraryTest, KeepsUploadsAndTheScenesOwn) {
    Library library;
    library.keep_upload(*make_profile("mine.ies", spot()));
    library.keep_upload(*make_profile("mine.ies", ies::synthetic_lm63("flood")));
    library.keep_scene({*make_profile("lamp", spot()), *builtin_profile("flood"), punctual_point_profile(),
                        panel_profile({ies::OpeningShape::rectangle, 1.0 * m, 1.0 * m, 0.0 * m}),
                        unlit_profile("gone.ies", "missing_file", "the file is missing")});
    v1::Library found = all(library);
    EXPECT_EQ(found.total(), ies::synthetic_luminaires().size() + 2);
    EXPECT_EQ((*library.profile("upload:mine.ies"))->flux_lm, (*builtin_profile("flood"))->flux_lm) << "the newer one";
    EXPECT_EQ((*library.profile("scene:lamp"))->name, "lamp");
    library.keep_scene({});
    EXPECT_EQ(library.profile("scene:lamp").error().code, "not_found");
    for (std::size_t i = 0; i <= kMaxKeptProfiles; ++i)
        library.keep_upload(*make_profile("n" + std::to_string(i), spot()));
    found = all(library);
    EXPECT_EQ(found.total(), ies::synthetic_luminaires().size() + kMaxKeptProfiles);
    EXPECT_FALSE(library.profile("upload:mine.ies"));
}

// An upload is a row as soon as its file is there; a light that takes it is told as uploaded.
TEST_F(LibraryTest, HasTheFilesOfUploads) {
    fs::create_directories(folder / "up");
    write("up/first.ies", spot());
    write("up/room.json", "{}");
    Library library({}, (folder / "up").string());
    ASSERT_NE(row(all(library), "upload:first.ies"), nullptr);
    EXPECT_EQ(row(all(library), "upload:first.ies")->source(), "uploaded");
    EXPECT_EQ(all(library).total(), ies::synthetic_luminaires().size() + 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // folders know the time to some milliseconds
    write("up/late.ies", ies::synthetic_lm63("flood"));
    EXPECT_TRUE(library.profile("upload:late.ies")) << "also before the folder was read again";
    EXPECT_TRUE(library.find({})->reading()) << "it has seen that something came";
    ASSERT_NE(row(all(library), "upload:late.ies"), nullptr);
    const auto late = library.profile("upload:late.ies");
    ASSERT_TRUE(late) << late.error().text();
    EXPECT_EQ((*late)->name, "late.ies");
    EXPECT_TRUE((*late)->uploaded);
    library.keep_upload(*late);
    EXPECT_EQ(all(library).total(), ies::synthetic_luminaires().size() + 2) << "one row";
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    fs::remove(folder / "up" / "first.ies");
    all(library);
    EXPECT_EQ(row(all(library), "upload:first.ies"), nullptr);
}

// What a show brings back is what it was: uploads are none of the scene's, nor are built-in ones.
TEST_F(LibraryTest, UploadsOfAShowStayUploads) {
    auto mine = std::make_shared<Profile>(**make_profile("mine.ies", spot()));
    mine->uploaded = true;
    Library library;
    library.keep_scene({mine, *make_profile("flood", ies::synthetic_lm63("flood")), *make_profile("lamp", spot())});
    const v1::Library found = all(library);
    EXPECT_EQ(found.total(), ies::synthetic_luminaires().size() + 2);
    ASSERT_NE(row(found, "upload:mine.ies"), nullptr);
    EXPECT_EQ(row(found, "upload:mine.ies")->source(), "uploaded");
    ASSERT_NE(row(found, "scene:lamp"), nullptr);
    EXPECT_EQ(row(found, "scene:lamp")->source(), "scene");
}

// A lamp of the scene whose file is in a folder is listed once; another file of its name is another luminaire.
TEST_F(LibraryTest, ListsALuminaireOnce) {
    write("in/spots/lamp.ies", spot());
    Library library({(folder / "in").string()});
    library.keep_scene({*make_profile("lamp.ies", spot())});
    EXPECT_EQ(row(all(library), "scene:lamp.ies"), nullptr);
    EXPECT_NE(row(all(library), "spots/lamp.ies"), nullptr);
    EXPECT_EQ(all(library).total(), ies::synthetic_luminaires().size() + 1);
    EXPECT_TRUE(library.profile("scene:lamp.ies")) << "what names it still finds it";
    library.keep_scene({*make_profile("lamp.ies", ies::synthetic_lm63("flood"))});
    EXPECT_NE(row(all(library), "scene:lamp.ies"), nullptr);
}

TEST_F(LibraryTest, ReadsAgainWhenAsked) {
    Library library({(folder / "in").string()});
    EXPECT_EQ(row(all(library), "late.ies"), nullptr);
    write("in/late.ies", spot());
    v1::LibraryQuery again;
    again.set_read_again(true);
    EXPECT_TRUE(library.find(again)->reading());
    EXPECT_NE(row(all(library), "late.ies"), nullptr);
}

}  // namespace
}  // namespace gonio
