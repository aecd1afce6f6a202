// EULUMDAT conformance: each symmetry indicator, lamp sets, absolute files, the turn of the azimuth, defects.
#include "ies/eulumdat.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/photometry_file.h"

#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

using test::has;

struct LdtText {
    std::string company = "Company";
    std::string type = "2";
    int isym = 0;
    std::vector<std::string> c = {"0", "90", "180", "270"};
    std::vector<std::string> gamma = {"0", "90"};
    std::string area = "600\n300\n0\n0\n0\n0";  // luminous length, width, four heights
    std::string lorl = "100";
    std::string dff = "100";
    std::string conversion = "1";
    std::string sets = "1\n1\nLED\n1000\n3000 K\n80\n10";
    std::vector<std::string> values = {"100", "0", "200", "0", "300", "0", "400", "0"};
    std::string tail;

    std::string text() const {
        std::string s = company + "\n" + type + "\n" + std::to_string(isym) + "\n" + std::to_string(c.size()) +
                        "\n90\n" + std::to_string(gamma.size()) +
                        "\n90\nreport\nname\nnumber\nfile\ndate\n1000\n500\n50\n" + area + "\n" + dff + "\n" + lorl +
                        "\n" + conversion + "\n0\n" + sets + "\n";
        for (int i = 0; i < 10; ++i) s += "0.5\n";
        for (const auto& list : {c, gamma, values}) {
            for (const std::string& value : list) s += value + "\n";
        }
        return s + tail;
    }
};

// I at gamma 0 .. 90 in the web's azimuth h; the test files fall linearly from the plane's value at 0 to 0 at 90.
double at_45(const Photometry& photometry, double h_deg) {
    return intensity(photometry.web, direction_of(Goniometer::type_c, Angle::degrees(45), Angle::degrees(h_deg)))
        .in(cd);
}

TEST(IesEulumdat, Isym0TurnsC0ToH270) {
    const auto read = read_eulumdat(LdtText{}.text());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->provenance.format, "EULUMDAT");
    EXPECT_FALSE(has(*read, "missing_360"));
    EXPECT_NEAR(at_45(*read, 270), 50, 1e-4);   // C0
    EXPECT_NEAR(at_45(*read, 0), 100, 1e-4);    // C90: along the luminaire
    EXPECT_NEAR(at_45(*read, 90), 150, 1e-4);   // C180
    EXPECT_NEAR(at_45(*read, 180), 200, 1e-4);  // C270
    EXPECT_NEAR(at_45(*read, 225), 125, 1e-4);
    EXPECT_EQ(read->provenance.rated_lumens, 1000.0);
    EXPECT_EQ(read->provenance.input_watts, 10.0);
    EXPECT_EQ(read->opening.shape, OpeningShape::rectangle);
    EXPECT_NEAR(read->opening.length.in(m), 0.6, 1e-12);
    EXPECT_NEAR(read->opening.width.in(m), 0.3, 1e-12);
}

TEST(IesEulumdat, Isym1To4) {
    LdtText axial;
    axial.isym = 1;
    axial.values = {"100", "0"};
    const auto one = read_eulumdat(axial.text());
    ASSERT_TRUE(one) << one.error().text();
    EXPECT_EQ(one->provenance.symmetry, Symmetry::axial);
    for (const double h : {0.0, 100.0, 300.0}) EXPECT_NEAR(at_45(*one, h), 50, 1e-4);

    LdtText about_c0;  // C0, C90, C180 stored
    about_c0.isym = 2;
    about_c0.values = {"100", "0", "200", "0", "300", "0"};
    const auto two = read_eulumdat(about_c0.text());
    ASSERT_TRUE(two) << two.error().text();
    EXPECT_NEAR(at_45(*two, 270), 50, 1e-4);
    EXPECT_NEAR(at_45(*two, 0), 100, 1e-4);
    EXPECT_NEAR(at_45(*two, 180), 100, 1e-4);
    EXPECT_NEAR(at_45(*two, 90), 150, 1e-4);

    LdtText about_c90;  // C270, C0, C90 stored
    about_c90.isym = 3;
    about_c90.values = {"100", "0", "200", "0", "300", "0"};
    const auto three = read_eulumdat(about_c90.text());
    ASSERT_TRUE(three) << three.error().text();
    EXPECT_NEAR(at_45(*three, 180), 50, 1e-4);   // C270
    EXPECT_NEAR(at_45(*three, 270), 100, 1e-4);  // C0
    EXPECT_NEAR(at_45(*three, 90), 100, 1e-4);   // C180, mirrored
    EXPECT_NEAR(at_45(*three, 0), 150, 1e-4);    // C90

    LdtText quadrant;  // C0, C90 stored
    quadrant.isym = 4;
    quadrant.values = {"100", "0", "200", "0"};
    const auto four = read_eulumdat(quadrant.text());
    ASSERT_TRUE(four) << four.error().text();
    EXPECT_NEAR(at_45(*four, 270), 50, 1e-4);
    EXPECT_NEAR(at_45(*four, 90), 50, 1e-4);
    EXPECT_NEAR(at_45(*four, 0), 100, 1e-4);
    EXPECT_NEAR(at_45(*four, 180), 100, 1e-4);
    EXPECT_NEAR(at_45(*four, 45), 75, 1e-4);
}

TEST(IesEulumdat, LampSetsAndAbsoluteFiles) {
    LdtText file;
    file.sets = "2\n1\nsmall\n1000\nA\nB\n10\n2\nlarge\n3000\nC\nD\n30";
    const auto first = read_eulumdat(file.text());
    ASSERT_TRUE(first);
    EXPECT_TRUE(has(*first, "lamp_sets"));
    EXPECT_NEAR(at_45(*first, 0), 100, 1e-4);
    const auto second = read_eulumdat(file.text(), 1);
    ASSERT_TRUE(second);
    EXPECT_NEAR(at_45(*second, 0), 300, 1e-3);
    EXPECT_EQ(second->provenance.lamps, 2);
    EXPECT_EQ(second->provenance.lumens_per_lamp, 1500.0);
    EXPECT_EQ(second->provenance.input_watts, 30.0);
    EXPECT_EQ(read_eulumdat(file.text(), 2).error().code, "no_such_lamp_set");

    file.sets = "1\n-1\nLED\n2000\n3000 K\n80\n10";
    const auto absolute = read_eulumdat(file.text());
    ASSERT_TRUE(absolute);
    EXPECT_TRUE(absolute->provenance.absolute);
    EXPECT_NEAR(at_45(*absolute, 0), 200, 1e-3);
    EXPECT_EQ(absolute->provenance.rated_lumens, 0.0);
}

TEST(IesEulumdat, CrossChecks) {
    // Isotropic 1000/4pi cd/klm: LORL 100 %, half of it downward.
    LdtText file;
    file.isym = 1;
    file.gamma = {"0", "90", "180"};
    file.values = {"79.577472", "79.577472", "79.577472"};
    file.dff = "50";
    const auto right = read_eulumdat(file.text());
    ASSERT_TRUE(right);
    EXPECT_TRUE(right->diagnostics.empty());
    EXPECT_NEAR(total_flux(right->web).in(lm), 1000.0, 1e-3);
    file.lorl = "80";
    EXPECT_TRUE(has(*read_eulumdat(file.text()), "lorl_mismatch"));
    file.lorl = "100";
    file.dff = "100";
    EXPECT_TRUE(has(*read_eulumdat(file.text()), "dff_mismatch"));
    file.conversion = "0.9";
    EXPECT_TRUE(has(*read_eulumdat(file.text()), "conversion_factor"));
}

TEST(IesEulumdat, ToleratedDefects) {
    LdtText file;
    const PhotometricWeb expected = read_eulumdat(file.text())->web;
    const auto read_with = [](LdtText changed) { return read_eulumdat(changed.text()); };

    LdtText comma = file;
    comma.values = {"100,0", "0", "200", "0", "300", "0", "400", "0"};
    ASSERT_TRUE(read_with(comma));
    EXPECT_TRUE(has(*read_with(comma), "decimal_comma"));
    EXPECT_EQ(read_with(comma)->web.candela, expected.candela);

    LdtText empty = file;
    empty.values = {"100", "", "200", "", "300", "", "400", ""};
    ASSERT_TRUE(read_with(empty));
    EXPECT_TRUE(has(*read_with(empty), "empty_number"));
    EXPECT_EQ(read_with(empty)->web.candela, expected.candela);

    LdtText trailing = file;
    trailing.tail = "something\n";
    EXPECT_TRUE(has(*read_with(trailing), "trailing_data"));

    LdtText words = file;
    words.lorl = "n/a";
    EXPECT_TRUE(has(*read_with(words), "bad_field"));

    LdtText negative = file;
    negative.values[1] = "-3";
    EXPECT_TRUE(has(*read_with(negative), "negative_candela"));

    LdtText dos = file;
    dos.company = "M\x81ller";
    EXPECT_EQ(read_with(dos)->eulumdat->company, "M\xc3\xbcller");
    LdtText latin = file;
    latin.company = "M\xfcller";
    EXPECT_EQ(read_with(latin)->eulumdat->company, "M\xc3\xbcller");

    LdtText mark = file;
    mark.company = "\xef\xbb\xbf" + mark.company;
    EXPECT_EQ(read_with(mark)->eulumdat->company, "Company");

    LdtText ityp = file;
    ityp.type = "0";
    EXPECT_TRUE(read_with(ityp));

    LdtText lone = file;
    lone.c = {"0"};
    lone.values = {"100", "0"};
    ASSERT_TRUE(read_with(lone));
    EXPECT_EQ(read_with(lone)->provenance.symmetry, Symmetry::axial);
}

TEST(IesEulumdat, OpeningShapes) {
    LdtText file;
    const auto shape = [&](const char* area) {
        file.area = area;
        return read_eulumdat(file.text())->opening.shape;
    };
    EXPECT_EQ(shape("600\n300\n0\n0\n0\n0"), OpeningShape::rectangle);
    EXPECT_EQ(shape("600\n300\n10\n10\n10\n10"), OpeningShape::box);
    EXPECT_EQ(shape("600\n0\n0\n0\n0\n0"), OpeningShape::ellipse);
    EXPECT_EQ(shape("600\n0\n0\n20\n0\n0"), OpeningShape::vertical_cylinder);
    EXPECT_EQ(shape("0\n0\n0\n0\n0\n0"), OpeningShape::point);
}

TEST(IesEulumdat, RefusalsSayWhatAndWhere) {
    struct Case {
        const char* name;
        LdtText file;
        const char* code;
        const char* where;
    };
    const auto with = [](auto change) {
        LdtText file;
        change(file);
        return file;
    };
    const Case cases[] = {
        {"symmetry", with([](LdtText& f) { f.isym = 5; }), "bad_symmetry", "line 3 column 1"},
        {"no planes", with([](LdtText& f) { f.c.clear(); }), "bad_count", "line 4 column 1"},
        {"no gammas", with([](LdtText& f) { f.gamma.clear(); }), "bad_count", "line 6 column 1"},
        {"no lamp set", with([](LdtText& f) { f.sets = "0"; }), "bad_count", "line 26 column 1"},
        {"text", with([](LdtText& f) { f.values[3] = "x"; }), "not_a_number", "line 52 column 1"},
        {"two numbers", with([](LdtText& f) { f.values[3] = "1 2"; }), "not_a_number", "line 52 column 1"},
        {"infinite", with([](LdtText& f) { f.values[3] = "inf"; }), "not_finite", "line 52 column 1"},
        {"bright", with([](LdtText& f) { f.values[3] = "1e15"; }), "candela_too_large", "line 52 column 1"},
        {"truncated", with([](LdtText& f) { f.values.resize(5); }), "truncated", nullptr},
        {"unordered planes", with([](LdtText& f) {
             f.c = {"0", "180", "90", "270"};
         }),
         "angles_not_monotone", "line 45 column 1"},
        {"unordered gammas", with([](LdtText& f) {
             f.gamma = {"0", "0"};
         }),
         "angles_not_monotone", "line 48 column 1"},
        {"gamma beyond 180", with([](LdtText& f) {
             f.gamma = {"0", "190"};
         }),
         "angle_out_of_range", "line 48 column 1"},
        {"planes and symmetry", with([](LdtText& f) {
             f.isym = 4;
             f.c = {"0", "80", "180", "270"};
         }),
         "angles_not_monotone", nullptr},
    };
    for (const Case& item : cases) {
        const auto read = read_eulumdat(item.file.text());
        ASSERT_FALSE(read) << item.name;
        EXPECT_EQ(read.error().code, item.code) << item.name << ": " << read.error().text();
        if (item.where != nullptr) {
            EXPECT_EQ(read.error().where, item.where) << item.name;
        }
    }
    EXPECT_EQ(read_eulumdat("").error().code, "empty_file");
    EXPECT_EQ(read_eulumdat("a\n2\n0\n4000000\n0\n4000000\n").error().code, "grid_too_large");
}

TEST(IesEulumdat, TheFormatIsToldByContent) {
    const auto read = read_photometry(LdtText{}.text());
    ASSERT_TRUE(read);
    EXPECT_EQ(read->provenance.format, "EULUMDAT");
    EXPECT_EQ(read_photometry("<html>").error().code, "not_photometry");
    EXPECT_EQ(read_photometry("").error().code, "empty_file");
}

}  // namespace
}  // namespace gonio::ies
