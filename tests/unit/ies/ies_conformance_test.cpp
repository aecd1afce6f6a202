// The rules of LM-63 beyond the plain Type C body, one tiny file each: tilt tables, keywords, openings, Types A and B,
// number styles, line ends, encodings, repairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <regex>

#include "ies/lm63.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

using test::at;
using test::has;
using test::Lm63Text;
using test::warnings;

std::string replaced(std::string text, std::string_view from, std::string_view to) {
    for (std::size_t i = text.find(from); i != std::string::npos; i = text.find(from, i + to.size())) {
        text.replace(i, from.size(), to);
    }
    return text;
}

TEST(IesConformance, TiltIncludeIsKeptAndInterpolated) {
    Lm63Text file;
    file.tilt = "TILT=INCLUDE\n3\n3\n0 45 90\n1.0 0.9 0.7\n";
    const auto read = read_lm63(file.text());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_TRUE(read->tilt);
    EXPECT_EQ(warnings(*read), 0);
    EXPECT_EQ(read->tilt->lamp_geometry, 3);
    EXPECT_FLOAT_EQ(read->web.candela[0], 100.0F);  // the table is not applied to the web
    const double expected[][2] = {{0, 1.0}, {22.5, 0.95}, {45, 0.9}, {67.5, 0.8}, {90, 0.7}, {135, 0.7}, {-45, 0.9}};
    for (const auto& [tilt_deg, factor] : expected) {
        EXPECT_NEAR(tilt_factor(*read->tilt, Angle::degrees(tilt_deg)), factor, 1e-12) << tilt_deg;
    }
    EXPECT_EQ(tilt_factor({}, Angle::degrees(30)), 1.0);
}

TEST(IesConformance, TiltVariants) {
    struct Case {
        const char* tilt;
        const char* code;  // error or warning; nullptr: clean
        bool accepted;
    };
    const Case cases[] = {
        {"TILT=NONE\n", nullptr, true},
        {"TILT=NONE  \r\n", nullptr, true},
        {"  TILT=NONE\n", "tilt_spelling", true},
        {"TILT = NONE\n", "tilt_spelling", true},
        {"tilt=none\n", "tilt_spelling", true},
        {"TILT=NONE ", nullptr, true},  // the numbers follow on the same line
        {"TILT=lamp.tlt\n", "tilt_file", true},
        {"TILT=../../etc/passwd\n", "tilt_file", true},
        {"TILT=\n", "tilt_file", true},
        {"TILT=INCLUDE\n1 3 0 45 90 1 0.9 0.8\n", "tilt_records_joined", true},
        {"TILT=INCLUDE\n4\n1\n0\n1\n", "tilt_geometry", true},
        {"TILT=INCLUDE\n1\n0\n", "tilt_empty", true},
        {"TILT=INCLUDE\n1\n2\n0 90\n1 -0.5\n", "negative_tilt_factor", true},
        {"TILT=INCLUDE\n1\n-2\n0 90\n1 1\n", "bad_count", false},
        {"TILT=INCLUDE\n1\n10001\n0 90\n1 1\n", "tilt_too_long", false},
        {"TILT=INCLUDE\n1\n2\n90 0\n1 1\n", "tilt_angles_not_ascending", false},
        {"TILT=INCLUDE\n1\n2\n0 x\n1 1\n", "not_a_number", false},
    };
    for (const Case& item : cases) {
        Lm63Text file;
        file.tilt = item.tilt;
        const auto read = read_lm63(file.text());
        ASSERT_EQ(read.ok(), item.accepted) << item.tilt << (read ? "" : read.error().text());
        if (!read) {
            EXPECT_EQ(read.error().code, item.code) << item.tilt;
        } else if (item.code != nullptr) {
            EXPECT_TRUE(has(*read, item.code)) << item.tilt;
            EXPECT_EQ(warnings(*read), 1) << item.tilt;
        } else {
            EXPECT_EQ(warnings(*read), 0) << item.tilt;
        }
    }
}

TEST(IesConformance, KeywordsMoreBlocksAndLabels) {
    Lm63Text file;
    file.header =
        "IESNA91\n[TEST] 123\n[manufac] Acme\n[MORE] of Ohio\nfree text\n[MORE] kept as its own "
        "keyword\n[BLOCK]\n[LUMCAT] X\n"
        "[ENDBLOCK]\n[OTHER] see TILT=NONE\n[OTHER]second\n[_USER] u\n";
    const auto read = read_lm63(file.text());
    ASSERT_TRUE(read) << read.error().text();
    const std::vector<std::pair<std::string, std::string>> expected = {
        {"TEST", "123"},     {"MANUFAC", "Acme\nof Ohio"},
        {"", "free text"},   {"MORE", "kept as its own keyword"},
        {"BLOCK", ""},       {"LUMCAT", "X"},
        {"ENDBLOCK", ""},    {"OTHER", "see TILT=NONE"},
        {"OTHER", "second"}, {"_USER", "u"}};
    EXPECT_EQ(read->provenance.keywords, expected);
}

TEST(IesConformance, MissingKeywordsAndLongLines) {
    Lm63Text file;
    file.header = "IESNA:LM-63-2002\n[TEST] t\n[TESTLAB] l\n[ISSUEDATE] d\n";
    EXPECT_TRUE(has(*read_lm63(file.text()), "missing_keyword"));
    file.header += "[MANUFAC] " + std::string(300, 'x') + "\n";
    EXPECT_TRUE(has(*read_lm63(file.text()), "long_line"));
    EXPECT_FALSE(has(*read_lm63(file.text()), "missing_keyword"));
    file.header = replaced(file.header, "IESNA:LM-63-2002", "IES:LM-63-2019");
    EXPECT_EQ(warnings(*read_lm63(file.text())), 0);
}

TEST(IesConformance, LineEndsSeparatorsAndEncodings) {
    Lm63Text plain;
    plain.header = "IES:LM-63-2019\n[TEST] t\n[TESTLAB] l\n[ISSUEDATE] d\n[MANUFAC] M\xc3\xbcller\n";
    const std::string text = plain.text();
    const PhotometricWeb expected = read_lm63(text)->web;
    std::string utf16 = "\xff\xfe";
    for (const char c : replaced(text, "\xc3\xbc", "u")) {
        utf16 += c;
        utf16 += '\0';
    }
    struct Case {
        const char* name;
        std::string text;
        const char* warning;
    };
    const Case cases[] = {
        {"CR only", replaced(text, "\n", "\r"), nullptr},
        {"CR LF", replaced(text, "\n", "\r\n"), nullptr},
        {"byte order mark", "\xef\xbb\xbf" + text, nullptr},
        {"tabs", replaced(text, " ", "\t"), nullptr},
        {"blank lines", replaced(text, "\n", "\n\n"), nullptr},
        {"blank line first", "\n" + text, nullptr},
        {"commas", replaced(text, "100 50 0", "100, 50,0"), nullptr},
        {"Ctrl-Z", text + "\x1a", nullptr},
        {"no last line end", text.substr(0, text.size() - 1), nullptr},
        {"Latin-1", replaced(text, "\xc3\xbc", "\xfc"), nullptr},
        {"code page 850", replaced(text, "\xc3\xbc", "\x81"), nullptr},
        {"UTF-16", utf16, "utf16"},
        {"semicolons", replaced(text, "100 50 0", "100;50;0"), "semicolon"},
        {"exponents", replaced(text, "100 50 0", "1E2 5.0e+1 0"), "scientific_notation"},
        {"Fortran", replaced(text, "100 50 0", "1D2 5.0d+1 0"), "fortran_exponent"},
        {"whole numbers with a point", replaced(text, "3 1 1 2", "3.0 1 1 2"), "integer_with_point"},
        {"underflow", replaced(text, "100 50 0", "100 50 1e-400"), "scientific_notation"},
    };
    for (const Case& item : cases) {
        const auto read = read_lm63(item.text);
        ASSERT_TRUE(read) << item.name << ": " << read.error().text();
        EXPECT_EQ(read->web.candela, expected.candela) << item.name;
        EXPECT_EQ(warnings(*read), item.warning != nullptr ? 1 : 0) << item.name;
        if (item.warning != nullptr) {
            EXPECT_TRUE(has(*read, item.warning)) << item.name;
        }
        const std::string& maker = read->provenance.keywords[3].second;
        EXPECT_TRUE(maker == "M\xc3\xbcller" || maker == "Muller") << item.name << ": " << maker;
    }
}

TEST(IesConformance, OpeningBySignForEveryVersion) {
    struct Case {
        const char* version;
        const char* size;
        OpeningShape shape;
        double width, length, height;
    };
    using enum OpeningShape;
    const Case cases[] = {
        {"IESNA91", "0 0 0", point, 0, 0, 0},
        {"IESNA91", "2 3 0", rectangle, 2, 3, 0},
        {"IESNA91", "2 3 4", box, 2, 3, 4},
        {"IESNA91", "-2 0 0", ellipse, 2, 2, 0},
        {"IESNA91", "-2 3 0", ellipse, 2, 3, 0},
        {"IESNA91", "-2 0 4", vertical_cylinder, 2, 2, 4},
        {"IESNA91", "-2 3 4", ellipsoid, 2, 3, 4},
        {"IESNA:LM-63-1995", "-2 0 -2", ellipsoid, 2, 2, 2},
        {"IESNA:LM-63-1995", "-2 3 -4", ellipsoid, 2, 3, 4},
        {"IESNA:LM-63-1995", "2 -3 -4", ellipsoid, 2, 3, 4},
        {"IESNA:LM-63-1995", "0 3 -2", horizontal_cylinder_length, 2, 3, 2},
        {"IESNA:LM-63-1995", "3 0 -2", horizontal_cylinder_width, 3, 2, 2},
        {"IESNA:LM-63-2002", "-2 -2 0", ellipse, 2, 2, 0},
        {"IESNA:LM-63-2002", "-2 0 0", ellipse, 2, 2, 0},
        {"IESNA:LM-63-2002", "0 -2 0", ellipse, 2, 2, 0},
        {"IESNA:LM-63-2002", "0 -2 4", vertical_cylinder, 2, 2, 4},
        {"IESNA:LM-63-2002", "-2 -3 0", ellipse, 2, 3, 0},
        {"IESNA:LM-63-2002", "-2 -2 4", vertical_cylinder, 2, 2, 4},
        {"IESNA:LM-63-2002", "-2 -2 -2", ellipsoid, 2, 2, 2},
        {"IES:LM-63-2019", "-2 3 -2", horizontal_cylinder_length, 2, 3, 2},
        {"IES:LM-63-2019", "3 -2 -2", horizontal_cylinder_width, 3, 2, 2},
        {"IES:LM-63-2019", "-2 0 -3", vertical_ellipse, 2, 0, 3},
    };
    for (const Case& item : cases) {
        for (const bool feet : {false, true}) {
            Lm63Text file;
            file.header = std::string(item.version) + "\n[TEST] t\n[TESTLAB] l\n[ISSUEDATE] d\n[MANUFAC] m\n";
            file.size = item.size;
            file.type = feet ? "1 1" : "1 2";
            const auto read = read_lm63(file.text());
            ASSERT_TRUE(read);
            const double metre = feet ? 0.3048 : 1.0;
            EXPECT_EQ(read->opening.shape, item.shape) << item.version << " " << item.size;
            EXPECT_NEAR(read->opening.width.in(m), item.width * metre, 1e-12) << item.version << " " << item.size;
            EXPECT_NEAR(read->opening.length.in(m), item.length * metre, 1e-12) << item.version << " " << item.size;
            EXPECT_NEAR(read->opening.height.in(m), item.height * metre, 1e-12) << item.version << " " << item.size;
            EXPECT_EQ(warnings(*read), 0);
            EXPECT_EQ(read->web.candela[0], 100.0F);
        }
    }
    Lm63Text unknown;
    unknown.size = "1 2 -3";
    EXPECT_TRUE(has(*read_lm63(unknown.text()), "unknown_opening"));
    Lm63Text units;
    units.type = "1 3";
    EXPECT_TRUE(has(*read_lm63(units.text()), "unknown_units"));
}

TEST(IesConformance, TypesAAndBKeepTheirGrid) {
    Lm63Text full;
    full.type = "2 2";
    full.counts = "3 3";
    full.v = "-90 0 90";
    full.h = "-90 0 90";
    full.candela = "1 2 3 4 50 6 7 8 9";
    for (const char* type : {"2 2", "3 2"}) {
        full.type = type;
        const auto read = read_lm63(full.text());
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(warnings(*read), 0);
        EXPECT_EQ(read->web.goniometer, type[0] == '2' ? Goniometer::type_b : Goniometer::type_a);
        EXPECT_EQ(read->web.v_rad.size(), 3u);
        EXPECT_EQ(read->web.h_rad.size(), 3u);
        EXPECT_NEAR(at(*read, 0, 0), 50, 1e-9);
        EXPECT_NEAR(at(*read, 45, 0), 28, 1e-9);
        EXPECT_NEAR(at(*read, 0, 45), 29, 1e-9);
        EXPECT_NEAR(at(*read, 0, -45), 26, 1e-9);
    }

    Lm63Text lateral = full;
    lateral.counts = "3 2";
    lateral.h = "0 90";
    lateral.candela = "4 50 6 7 8 9";
    const auto half = read_lm63(lateral.text());
    ASSERT_TRUE(half);
    EXPECT_EQ(warnings(*half), 0);
    EXPECT_EQ(half->provenance.symmetry, Symmetry::lateral);
    EXPECT_EQ(half->provenance.file_horizontal_angles, 2);
    EXPECT_NEAR(at(*half, 0, -45), 29, 1e-9);
    EXPECT_NEAR(at(*half, 0, 45), 29, 1e-9);

    Lm63Text quarter = lateral;
    quarter.counts = "2 2";
    quarter.v = "0 90";
    quarter.candela = "50 6 8 9";
    const auto mirrored = read_lm63(quarter.text());
    ASSERT_TRUE(mirrored);
    EXPECT_TRUE(has(*mirrored, "v_mirrored"));
    EXPECT_NEAR(at(*mirrored, -45, 0), 28, 1e-9);

    Lm63Text single = full;
    single.counts = "3 1";
    single.h = "0";
    single.candela = "4 50 6";
    const auto one = read_lm63(single.text());
    ASSERT_TRUE(one);
    EXPECT_TRUE(has(*one, "single_plane"));
    EXPECT_NEAR(at(*one, 0, 70), 50, 1e-9);

    Lm63Text beyond = full;
    beyond.type = "3 2";
    beyond.v = "-90 0 100";
    EXPECT_EQ(read_lm63(beyond.text()).error().code, "angle_out_of_range");
}

TEST(IesConformance, RepairsOfTheGrid) {
    struct Case {
        const char* name;
        const char* counts;
        const char* v;
        const char* h;
        const char* candela;
        const char* code;
    };
    const Case cases[] = {
        {"v starts at 5", "3 1", "5 45 90", "0", "9 5 1", "v_range"},
        {"v ends at 140", "3 1", "0 90 140", "0", "9 5 1", "v_range"},
        {"single v", "1 1", "30", "0", "9", "single_v"},
        {"single plane at 45", "3 1", "0 45 90", "45", "9 5 1", "single_plane_not_zero"},
        {"h to 270", "2 4", "0 90", "0 90 180 200", "9 5 9 5 9 5 9 5", "irregular_h_range"},
        {"h descending", "2 3", "0 90", "90 45 0", "9 5 9 4 9 3", "h_descending"},
        {"wrap", "2 3", "0 90", "0 180 360", "9 5 9 4 9 3", "wrap_mismatch"},
        {"pole", "2 2", "0 90", "0 90", "9 5 8 4", "pole_mismatch"},
        {"dark", "2 1", "0 90", "0", "0 0", "all_dark"},
        {"other half", "2 2", "0 90", "180 360", "9 5 9 4", "irregular_h_range"},
        {"rounded", "2 2", "0 90", "0.0005 90", "9 5 9 4", nullptr},
    };
    for (const Case& item : cases) {
        Lm63Text file;
        file.counts = item.counts;
        file.v = item.v;
        file.h = item.h;
        file.candela = item.candela;
        const auto read = read_lm63(file.text());
        ASSERT_TRUE(read) << item.name << ": " << read.error().text();
        if (item.code != nullptr) {
            EXPECT_TRUE(has(*read, item.code)) << item.name;
        } else {
            EXPECT_EQ(warnings(*read), 0) << item.name;
        }
        EXPECT_EQ(read->web.h_rad.back(), 2 * std::numbers::pi) << item.name;
    }
}

TEST(IesConformance, LampsAndScales) {
    struct Case {
        const char* name;
        const char* lamps;
        const char* factors;
        const char* code;
        bool absolute;
        double rated_lm;
    };
    const Case cases[] = {
        {"absolute", "1 -1 1", "1 1 40", nullptr, true, 0},
        {"relative", "2 1500 1", "1 1 40", nullptr, false, 3000},
        {"fractional lumens", "1 1500.5 1", "1 1 40", nullptr, false, 1500.5},
        {"zero lumens", "1 0 1", "1 1 40", "zero_lumens", true, 0},
        {"other negative lumens", "1 -5 1", "1 1 40", "negative_lumens", true, 0},
        {"no lamps", "0 -1 1", "1 1 40", "no_lamps", true, 0},
        {"multiplier 0", "1 -1 0", "1 1 40", "scale_not_positive", true, 0},
    };
    for (const Case& item : cases) {
        Lm63Text file;
        file.lamps = item.lamps;
        file.factors = item.factors;
        const auto read = read_lm63(file.text());
        ASSERT_TRUE(read) << item.name;
        EXPECT_EQ(read->provenance.absolute, item.absolute) << item.name;
        EXPECT_EQ(read->provenance.rated_lumens, item.rated_lm) << item.name;
        if (item.code != nullptr) {
            EXPECT_TRUE(has(*read, item.code)) << item.name;
        } else {
            EXPECT_EQ(warnings(*read), 0) << item.name;
        }
    }
}

// 100 cd everywhere are 400 pi lm over the sphere.
TEST(IesConformance, WhatCannotBeMeantSoIsSaid) {
    Lm63Text file;
    file.v = "0 90 180";
    file.candela = "100 100 100";
    const double flux_lm = 400 * std::numbers::pi;
    for (const auto& [rated_lm, told] : {std::pair{flux_lm / 1.04, false}, {flux_lm / 1.06, true}}) {
        file.lamps = "1 " + std::to_string(rated_lm) + " 1";
        EXPECT_EQ(has(*read_lm63(file.text()), "output_ratio"), told) << rated_lm;
    }
    file.lamps = "1 -1 1";
    EXPECT_FALSE(has(*read_lm63(file.text()), "output_ratio"));
    EXPECT_FALSE(read_lm63(file.text())->provenance.radiometric);
    file.header += "[_INTENSITYUNITS] mW/sr\n";
    EXPECT_TRUE(has(*read_lm63(file.text()), "radiometric"));
    EXPECT_TRUE(read_lm63(file.text())->provenance.radiometric);
}

TEST(IesConformance, AMissingBallastLineIsNamed) {
    Lm63Text file;
    file.factors = "";
    file.counts = "5 2";
    file.h = "0 90";
    file.candela = "5 4 3 2 1 5 4 3 2 1";
    for (const char* v : {"0 22.5 45 67.5 90", "90 112.5 135 157.5 180"}) {
        file.v = v;
        const auto read = read_lm63(file.text());
        ASSERT_FALSE(read);
        EXPECT_EQ(read.error().code, "missing_ballast_line") << read.error().text();
        EXPECT_EQ(read.error().where.substr(0, 6), "line 9") << read.error().text();  // line 8 is empty
    }
    file.candela = "5 4 3 2 1";
    EXPECT_EQ(read_lm63(file.text()).error().code, "truncated");
}

TEST(IesConformance, LimitsHoldBeforeAnythingIsAllocated) {
    EXPECT_EQ(read_lm63(std::string(kMaxFileBytes + 1, ' ')).error().code, "too_large");
    Lm63Text file;
    file.counts = "4194304 1";
    EXPECT_EQ(read_lm63(file.text()).error().code, "truncated");
    file.counts = "4194305 1";
    EXPECT_EQ(read_lm63(file.text()).error().code, "grid_too_large");
    // Ten thousand keywords are kept, the rest is dropped with a warning.
    std::string many = "IES:LM-63-2019\n";
    for (int i = 0; i < 10010; ++i) many += "[A] b\n";
    const auto read = read_lm63(replaced(Lm63Text{}.text(), "IES:LM-63-2019\n", many));
    ASSERT_TRUE(read);
    EXPECT_TRUE(has(*read, "too_many_keywords"));
    EXPECT_EQ(read->provenance.keywords.size(), 10000u);
}

// ies/README.md lists every code that the readers can give.
TEST(IesConformance, EveryCodeIsDocumented) {
    const std::filesystem::path folder = std::filesystem::path(GONIO_SOURCE_DIR) / "ies";
    const std::string manual = test::read_file(folder / "README.md");
    const std::regex given(
        "(?:warn|note|fail)\\(\\s*\"([a-z0-9_]+)\"|error_at\\([^;\"]*\"([a-z0-9_]+)\"|Error\\{\"([a-z0-9_]+)\"|"
        "GridFault\\{\"([a-z0-9_]+)\"|error_of\\(\"([a-z0-9_]+)\"|product\\.error\\([^;\"]*\"([a-z0-9_]+)\"");
    int codes = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.path().extension() != ".cpp") continue;
        const std::string source = test::read_file(entry.path());
        for (std::sregex_iterator match(source.begin(), source.end(), given), end; match != end; ++match) {
            for (std::size_t group = 1; group < match->size(); ++group) {
                if (!(*match)[group].matched) continue;
                EXPECT_NE(manual.find("`" + (*match)[group].str() + "`"), std::string::npos) << (*match)[group];
                ++codes;
            }
        }
    }
    EXPECT_GT(codes, 150);
}

}  // namespace
}  // namespace gonio::ies
