// What a writer writes, the reader reads back: the same web, lamps, opening and names.
#include "ies/writers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "ies/eulumdat.h"
#include "ies/lm63.h"
#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

void expect_same_web(const PhotometricWeb& a, const PhotometricWeb& b, const std::string& name) {
    ASSERT_EQ(a.goniometer, b.goniometer) << name;
    ASSERT_EQ(a.v_rad.size(), b.v_rad.size()) << name;
    ASSERT_EQ(a.h_rad.size(), b.h_rad.size()) << name;
    for (std::size_t i = 0; i < a.v_rad.size(); ++i) EXPECT_NEAR(a.v_rad[i], b.v_rad[i], 1e-10) << name;
    for (std::size_t i = 0; i < a.h_rad.size(); ++i) EXPECT_NEAR(a.h_rad[i], b.h_rad[i], 1e-10) << name;
    EXPECT_EQ(a.candela, b.candela) << name;
}

// The same function where the grids differ by an interpolated plane.
void expect_same_light(const PhotometricWeb& a, const PhotometricWeb& b, double tolerance_cd, const std::string& name) {
    for (int v = 1; v < 180; v += 7) {
        for (int h = 1; h < 360; h += 11) {
            const Direction direction = direction_of(Goniometer::type_c, Angle::degrees(v), Angle::degrees(h));
            ASSERT_NEAR(intensity(a, direction).in(cd), intensity(b, direction).in(cd), tolerance_cd)
                << name << " v " << v << " h " << h;
        }
    }
}

void round_trip(const Photometry& first, const std::string& name) {
    const auto lm63 = read_lm63(write_lm63(first));
    ASSERT_TRUE(lm63) << name << ": " << lm63.error().text();
    expect_same_web(first.web, lm63->web, name);
    EXPECT_EQ(lm63->provenance.absolute, first.provenance.absolute) << name;
    EXPECT_EQ(lm63->provenance.input_watts, first.provenance.input_watts) << name;
    EXPECT_NEAR(lm63->provenance.rated_lumens, first.provenance.rated_lumens, 1e-9 * first.provenance.rated_lumens);
    EXPECT_EQ(lm63->opening.shape, first.opening.shape) << name;
    EXPECT_NEAR(lm63->opening.length.in(m), first.opening.length.in(m), 1e-12) << name;
    EXPECT_EQ(lm63->tilt.has_value(), first.tilt.has_value()) << name;

    const auto ldt = read_eulumdat(write_eulumdat(first));
    ASSERT_TRUE(ldt) << name << ": " << ldt.error().text();
    const double flux = total_flux(first.web).in(lm);
    if (first.web.goniometer != Goniometer::type_c) {
        EXPECT_NEAR(total_flux(ldt->web).in(lm), flux, 2e-3 * flux) << name;
        return;
    }
    const std::size_t last = first.web.h_rad.size() - 1;
    bool closed = true;
    for (std::size_t v = 0; v < first.web.v_rad.size(); ++v)
        closed = closed && first.web.at(0, v) == first.web.at(last, v);
    if (!closed) return;  // the format has one plane for both 0 and 360
    EXPECT_NEAR(total_flux(ldt->web).in(lm), flux, 1e-6 * flux) << name;
    expect_same_light(first.web, ldt->web, 1e-6 * peak_intensity(first.web).in(cd), name);
}

TEST(IesWriters, SyntheticLuminairesSurviveBothFormats) {
    for (const SyntheticLuminaire& luminaire : synthetic_luminaires()) {
        const auto read = read_lm63(synthetic_lm63(luminaire.name));
        ASSERT_TRUE(read);
        round_trip(*read, std::string(luminaire.name));
        const auto ldt = read_eulumdat(write_eulumdat(*read));
        ASSERT_TRUE(ldt);
        expect_same_web(read->web, ldt->web, std::string(luminaire.name));
    }
}

TEST(IesWriters, TheCorpusSurvivesBothFormats) {
    const auto folder = gonio::test::shared_data("photometry");
    if (!folder) GTEST_SKIP() << "no shared photometry corpus on this machine";
    for (const char* part : {"ies", "ldt", "malformed"}) {
        for (const auto& entry : std::filesystem::directory_iterator(*folder / part)) {
            const auto read = read_photometry(test::read_file(entry.path()));
            if (read) round_trip(*read, entry.path().filename().string());
        }
    }
}

TEST(IesWriters, FoldingKeepsTheSmallestSetOfPlanes) {
    const auto planes_written = [](const std::string& h, const std::string& counts, const std::string& candela) {
        test::Lm63Text file;
        file.h = h;
        file.counts = counts;
        file.candela = candela;
        const auto first = read_lm63(file.text());
        const auto second = read_lm63(write_lm63(*first));
        return second->provenance.file_horizontal_angles;
    };
    EXPECT_EQ(planes_written("0", "3 1", "9 8 7"), 1);
    EXPECT_EQ(planes_written("0 45 90", "3 3", "9 8 7 9 5 4 9 2 1"), 3);
    EXPECT_EQ(planes_written("0 90 180", "3 3", "9 8 7 9 5 4 9 2 1"), 3);
    EXPECT_EQ(planes_written("90 180 270", "3 3", "9 8 7 9 5 4 9 2 1"), 3);
    EXPECT_EQ(planes_written("0 90 180 270 360", "3 5", "9 8 7 9 5 4 9 2 1 9 3 2 9 8 7"), 5);
}

TEST(IesWriters, NamesTiltAndGenerationTypeAreKept) {
    test::Lm63Text file;
    file.header = "IES:LM-63-2019\n[TEST] t\n[TESTLAB] l\n[ISSUEDATE] d\n[MANUFAC] Müller\n[OTHER] one\n[MORE] two\n";
    file.tilt = "TILT=INCLUDE\n2\n3\n0 45 90\n1 0.9 0.8\n";
    file.lamps = "2 1500 1";
    file.factors = "1 1.10100 40";
    file.size = "-0.2 0.5 -0.1";
    const auto first = read_lm63(file.text());
    ASSERT_TRUE(first) << first.error().text();
    const auto second = read_lm63(write_lm63(*first));
    ASSERT_TRUE(second) << second.error().text();
    EXPECT_EQ(second->provenance.keywords, first->provenance.keywords);
    EXPECT_EQ(second->file_generation_type, "1.10100");
    ASSERT_TRUE(second->tilt);
    EXPECT_EQ(second->tilt->lamp_geometry, 2);
    EXPECT_EQ(second->tilt->factor, first->tilt->factor);
    EXPECT_EQ(second->tilt->angle_rad, first->tilt->angle_rad);
    EXPECT_EQ(second->opening.shape, OpeningShape::horizontal_cylinder_length);
    EXPECT_EQ(second->provenance.lamps, 2);
    EXPECT_EQ(second->provenance.lumens_per_lamp, 1500.0);
}

}  // namespace
}  // namespace gonio::ies
