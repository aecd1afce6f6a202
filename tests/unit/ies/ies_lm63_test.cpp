// LM-63 conformance: one tiny file per rule.
#include "ies/lm63.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

using test::at;
using test::has;
using test::Lm63Text;
using test::warnings;

struct VersionCase {
    const char* name;
    std::string header;
    std::string format;
    std::string field12;
    double scale;
    const char* warning;  // nullptr: none
};

TEST(IesLm63, VersionsAndTheTwelfthNumber) {
    const std::string keywords = "[TEST] t\n[TESTLAB] l\n[ISSUEDATE] d\n[MANUFAC] m\n";
    const VersionCase cases[] = {
        {"1986", "free text\nmore text\n", "LM-63-1986", "0.9", 0.9, nullptr},
        {"1991", "IESNA91\n" + keywords, "LM-63-1991", "0.9", 0.9, nullptr},
        {"1995", "IESNA:LM-63-1995\n" + keywords, "LM-63-1995", "1", 1.0, nullptr},
        {"1995 future use", "IESNA:LM-63-1995\n" + keywords, "LM-63-1995", "0.9", 1.0, "future_use"},
        {"2002", "IESNA:LM-63-2002\n" + keywords, "LM-63-2002", "1", 1.0, nullptr},
        {"2002 future use", "IESNA:LM-63-2002\n" + keywords, "LM-63-2002", "0.9", 1.0, "future_use"},
        {"2019", "IES:LM-63-2019\n" + keywords, "LM-63-2019", "1.10000", 1.0, nullptr},
        {"2019 bad generation", "IES:LM-63-2019\n" + keywords, "LM-63-2019", "1.5", 1.0, "file_generation_type"},
        {"future", "IES:LM-63-2031\n" + keywords, "LM-63-2019", "1.10000", 1.0, "unknown_version"},
        {"spaced", "IESNA: LM-63-2002\n" + keywords, "LM-63-2002", "1", 1.0, "version_spelling"},
        {"lower", "iesna:lm-63-1995\n" + keywords, "LM-63-1995", "1", 1.0, "version_spelling"},
        {"1991 long name", "IESNA:LM-63-1991\n" + keywords, "LM-63-1991", "0.9", 0.9, "version_spelling"},
    };
    for (const VersionCase& item : cases) {
        Lm63Text file;
        file.header = item.header;
        file.factors = "1 " + item.field12 + " 40";
        const auto read = read_lm63(file.text());
        ASSERT_TRUE(read) << item.name << ": " << read.error().text();
        EXPECT_EQ(read->provenance.format, item.format) << item.name;
        EXPECT_DOUBLE_EQ(read->provenance.scale, item.scale) << item.name;
        EXPECT_FLOAT_EQ(read->web.candela[0], static_cast<float>(100.0 * item.scale)) << item.name;
        EXPECT_EQ(warnings(*read), item.warning != nullptr ? 1 : 0) << item.name;
        if (item.warning != nullptr) {
            EXPECT_TRUE(has(*read, item.warning)) << item.name;
        }
    }
}

TEST(IesLm63, MultiplierAndBallastScaleAndAreReported) {
    Lm63Text file;
    file.lamps = "2 1500 2.5";
    file.factors = "0.88 1.0001 40";
    const auto read = read_lm63(file.text());
    ASSERT_TRUE(read);
    EXPECT_FLOAT_EQ(read->web.candela[0], 220.0F);
    EXPECT_FALSE(read->provenance.absolute);
    EXPECT_EQ(read->provenance.lamps, 2);
    EXPECT_EQ(read->provenance.lumens_per_lamp, 1500.0);
    EXPECT_EQ(read->provenance.input_watts, 40.0);
    EXPECT_EQ(read->provenance.file_vertical_angles, 3);
    EXPECT_EQ(read->provenance.file_horizontal_angles, 1);
}

TEST(IesLm63, TypeCSymmetries) {
    // I depends on the plane only, so that each unfolded plane tells where it came from.
    Lm63Text axial;
    axial.candela = "30 30 30";
    const auto a = read_lm63(axial.text());
    ASSERT_TRUE(a);
    EXPECT_EQ(a->provenance.symmetry, Symmetry::axial);
    EXPECT_EQ(a->web.h_rad.size(), 2u);
    EXPECT_EQ(a->web.h_rad.back(), 2 * std::numbers::pi);
    for (const double h : {0.0, 77.0, 180.0, 359.0}) EXPECT_FLOAT_EQ(static_cast<float>(at(*a, 30, h)), 30.0F);

    Lm63Text quadrant;
    quadrant.counts = "3 3";
    quadrant.h = "0 45 90";
    quadrant.candela = "10 10 10 20 20 20 40 40 40";
    const auto q = read_lm63(quadrant.text());
    ASSERT_TRUE(q);
    EXPECT_EQ(q->provenance.symmetry, Symmetry::quadrant);
    for (const double h : {45.0, 135.0, 225.0, 315.0}) EXPECT_NEAR(at(*q, 30, h), 20, 1e-4);
    for (const double h : {0.0, 180.0}) EXPECT_NEAR(at(*q, 30, h), 10, 1e-4);
    for (const double h : {90.0, 270.0}) EXPECT_NEAR(at(*q, 30, h), 40, 1e-4);

    Lm63Text half = quadrant;
    half.h = "0 90 180";
    const auto b = read_lm63(half.text());
    ASSERT_TRUE(b);
    EXPECT_EQ(b->provenance.symmetry, Symmetry::bilateral_0_180);
    EXPECT_NEAR(at(*b, 30, 90), 20, 1e-4);
    EXPECT_NEAR(at(*b, 30, 270), 20, 1e-4);
    EXPECT_NEAR(at(*b, 30, 180), 40, 1e-4);
    EXPECT_NEAR(at(*b, 30, 225), 30, 1e-4);

    Lm63Text side = quadrant;
    side.h = "90 180 270";
    const auto s = read_lm63(side.text());
    ASSERT_TRUE(s);
    EXPECT_EQ(s->provenance.symmetry, Symmetry::bilateral_90_270);
    EXPECT_FALSE(has(*s, "irregular_h_range"));
    EXPECT_NEAR(at(*s, 30, 90), 10, 1e-4);
    EXPECT_NEAR(at(*s, 30, 180), 20, 1e-4);
    EXPECT_NEAR(at(*s, 30, 0), 20, 1e-4);
    EXPECT_NEAR(at(*s, 30, 270), 40, 1e-4);
    EXPECT_NEAR(at(*s, 30, 45), 15, 1e-4);

    Lm63Text side_without_180 = quadrant;
    side_without_180.h = "90 160 270";
    const auto w = read_lm63(side_without_180.text());
    ASSERT_TRUE(w);
    EXPECT_NEAR(at(*w, 30, 160), 20, 1e-4);
    EXPECT_NEAR(at(*w, 30, 20), 20, 1e-4);
    EXPECT_NEAR(at(*w, 30, 0), 20 + 20.0 * 20 / 110, 1e-3);

    Lm63Text full = quadrant;
    full.counts = "3 5";
    full.h = "0 90 180 270 360";
    full.candela = "1 1 1 2 2 2 3 3 3 4 4 4 1 1 1";
    const auto f = read_lm63(full.text());
    ASSERT_TRUE(f);
    EXPECT_EQ(f->provenance.symmetry, Symmetry::none);
    EXPECT_NEAR(at(*f, 30, 270), 4, 1e-5);
    EXPECT_NEAR(at(*f, 30, 315), 2.5, 1e-5);

    Lm63Text open = full;
    open.counts = "3 4";
    open.h = "0 90 180 270";
    open.candela = "1 1 1 2 2 2 3 3 3 4 4 4";
    const auto o = read_lm63(open.text());
    ASSERT_TRUE(o);
    EXPECT_TRUE(has(*o, "missing_360"));
    EXPECT_EQ(o->web.candela, f->web.candela);
    EXPECT_EQ(o->web.h_rad, f->web.h_rad);

    Lm63Text turned = open;
    turned.h = "-180 -90 0 90";
    turned.candela = "3 3 3 4 4 4 1 1 1 2 2 2";
    const auto t = read_lm63(turned.text());
    ASSERT_TRUE(t);
    EXPECT_EQ(t->web.candela, f->web.candela);
}

TEST(IesLm63, ToleratedDeviations) {
    Lm63Text descending;
    descending.v = "90 45 0";
    descending.candela = "0 50 100";
    const auto d = read_lm63(descending.text());
    ASSERT_TRUE(d);
    EXPECT_TRUE(has(*d, "v_descending"));
    EXPECT_EQ(d->web.candela, read_lm63(Lm63Text{}.text())->web.candela);

    Lm63Text trailing;
    trailing.tail = "666\n";
    const auto t = read_lm63(trailing.text());
    ASSERT_TRUE(t);
    EXPECT_TRUE(has(*t, "trailing_data"));

    Lm63Text negative;
    negative.candela = "100 -5 0";
    const auto n = read_lm63(negative.text());
    ASSERT_TRUE(n);
    EXPECT_TRUE(has(*n, "negative_candela"));
    EXPECT_EQ(n->web.candela[1], 0.0F);
    const Diagnostic& place = *std::find_if(n->diagnostics.begin(), n->diagnostics.end(),
                                            [](const Diagnostic& x) { return x.code == "negative_candela"; });
    EXPECT_EQ(place.line, 11);
    EXPECT_EQ(place.column, 5);

    Lm63Text numbers;
    numbers.v = "+0., .45E2 90.0";
    const auto s = read_lm63(numbers.text());
    ASSERT_TRUE(s) << s.error().text();
    EXPECT_NEAR(s->web.v_rad[1], std::numbers::pi / 4, 1e-15);
}

struct Refusal {
    const char* name;
    std::string text;
    const char* code;
    const char* where;  // nullptr: not looked at
};

TEST(IesLm63, RefusalsSayWhatAndWhere) {
    const auto with = [](auto change) {
        Lm63Text file;
        change(file);
        return file.text();
    };
    const Refusal cases[] = {
        {"empty", "", "empty_file", "line 1 column 1"},
        {"blank", " \r\n\t\n", "empty_file", nullptr},
        {"no tilt", "IES:LM-63-2019\n[TEST] TILT=NONE\n", "no_tilt", nullptr},
        {"ends after tilt",
         with([](Lm63Text& f) { f.lamps = f.counts = f.type = f.size = f.factors = f.v = f.h = f.candela = ""; }),
         "truncated", nullptr},
        {"text", with([](Lm63Text& f) { f.candela = "100 5o 0"; }), "not_a_number", "line 11 column 5"},
        {"inf", with([](Lm63Text& f) { f.candela = "100 inf 0"; }), "not_finite", "line 11 column 5"},
        {"nan", with([](Lm63Text& f) { f.candela = "100 NaN 0"; }), "not_finite", "line 11 column 5"},
        {"overflow", with([](Lm63Text& f) { f.candela = "100 1e400 0"; }), "not_finite", "line 11 column 5"},
        {"glued", with([](Lm63Text& f) { f.candela = "100 50.60.7 0"; }), "not_a_number", "line 11 column 5"},
        {"hexadecimal", with([](Lm63Text& f) { f.counts = "0x3 1"; }), "not_a_number", "line 7 column 8"},
        {"fraction", with([](Lm63Text& f) { f.counts = "3.5 1"; }), "not_an_integer", "line 7 column 8"},
        {"no v", with([](Lm63Text& f) { f.counts = "0 1"; }), "bad_count", "line 7 column 8"},
        {"negative v", with([](Lm63Text& f) { f.counts = "-19 1"; }), "bad_count", "line 7 column 8"},
        {"no h", with([](Lm63Text& f) { f.counts = "3 0"; }), "bad_count", "line 7 column 10"},
        {"huge v", with([](Lm63Text& f) { f.counts = "2000000000 1"; }), "grid_too_large", nullptr},
        {"huge grid", with([](Lm63Text& f) { f.counts = "65536 65536"; }), "grid_too_large", nullptr},
        {"more than there is", with([](Lm63Text& f) { f.counts = "3 1000000"; }), "truncated", nullptr},
        {"type 0", with([](Lm63Text& f) { f.type = "0 2"; }), "bad_type", "line 7 column 12"},
        {"type 4", with([](Lm63Text& f) { f.type = "4 2"; }), "bad_type", "line 7 column 12"},
        {"unordered v", with([](Lm63Text& f) { f.v = "0 90 45"; }), "angles_not_monotone", "line 9 column 6"},
        {"repeated v", with([](Lm63Text& f) { f.v = "0 45 45"; }), "angles_not_monotone", "line 9 column 6"},
        {"v beyond 180", with([](Lm63Text& f) { f.v = "0 45 190"; }), "angle_out_of_range", "line 9 column 6"},
        {"too bright", with([](Lm63Text& f) { f.lamps = "1 -1 1e30"; }), "candela_too_large", "line 11 column 1"},
        {"too few", with([](Lm63Text& f) { f.candela = "100 50"; }), "truncated", nullptr},
        {"leftover and odd planes", with([](Lm63Text& f) {
             f.counts = "3 2";
             f.h = "0 30";
             f.candela = "1 2 3 4 5 6 7";
         }),
         "trailing_data", "line 11 column 13"},
        {"decimal commas", with([](Lm63Text& f) { f.candela = "100,5 50,5 0"; }), "decimal_comma", nullptr},
    };
    for (const Refusal& item : cases) {
        const auto read = read_lm63(item.text);
        ASSERT_FALSE(read) << item.name;
        EXPECT_EQ(read.error().code, item.code) << item.name << ": " << read.error().text();
        if (item.where != nullptr) {
            EXPECT_EQ(read.error().where, item.where) << item.name;
        }
        EXPECT_FALSE(read.error().message.empty());
    }
}

}  // namespace
}  // namespace gonio::ies
