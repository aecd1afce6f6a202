// The unified glare rating against CIE 117's table and a worked example, the tabular method against CIE 190's own
// luminaire.
#include "ies/glare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "ies/eulumdat.h"
#include "ies/photometry_file.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

TEST(IesGlare, PositionIndexIsTheTableBilinear) {
    const struct {
        double t_over_r, h_over_r, p;
    } rows[] = {{0, 0, 1},    {0, 0.5, 2.86},       {0.5, 0.5, 2.91}, {1, 1, 7},
                {1, 0, 2.11}, {0.55, 0.55, 3.2525}, {2.7, 0.6, 7.5},  {3, 1.9, 16}};
    for (const auto& row : rows) {
        const auto p = position_index(row.t_over_r, row.h_over_r);
        ASSERT_TRUE(p) << row.t_over_r << ", " << row.h_over_r;
        EXPECT_NEAR(*p, row.p, 1e-9) << row.t_over_r << ", " << row.h_over_r;
    }
}

TEST(IesGlare, HiddenSourcesHaveNoPositionIndex) {
    EXPECT_FALSE(position_index(0, 1.9));     // empty cell of the table
    EXPECT_FALSE(position_index(0, 1.75));    // beside an empty cell
    EXPECT_FALSE(position_index(3.01, 0.5));  // too far aside
    EXPECT_FALSE(position_index(1, 2));       // above the brow
    EXPECT_FALSE(position_index(std::nan(""), 0));
}

// Four Lambertian panels of 0.6 m, 4000 lm each, 1.6 m above the eye, 1.2 m to either side, 2.4 and 4.8 m ahead.
TEST(IesGlare, FourPanels) {
    const double area_m2 = 0.36, i0_cd = 4000 / std::numbers::pi, height_m = 1.6, aside_m = 1.2;
    std::vector<GlareSource> sources;
    for (const double ahead_m : {2.4, 4.8}) {
        const double r2 = ahead_m * ahead_m + aside_m * aside_m + height_m * height_m;
        const double omega = area_m2 * height_m / std::sqrt(r2) / r2;
        const auto p = position_index(aside_m / ahead_m, height_m / ahead_m);
        ASSERT_TRUE(p);
        sources.insert(sources.end(), 2, {i0_cd / area_m2 * nit, omega * sr, *p});
    }
    EXPECT_NEAR(*unified_glare_rating(20 * nit, sources), 22.92, 0.005);
    EXPECT_NEAR(*unified_glare_rating(40 * nit, sources), 20.51, 0.005);
    EXPECT_NEAR(*unified_glare_rating(60 * nit, sources), 19.10, 0.005);
    EXPECT_FALSE(unified_glare_rating(0 * nit, sources));
    EXPECT_FALSE(unified_glare_rating(40 * nit, {}));
}

// Row of the table for a room.
const GlareTable::Row* find_row(const GlareTable& table, double x_h, double y_h) {
    for (const GlareTable::Row& row : table.rows)
        if (row.x_h == x_h && row.y_h == y_h) return &row;
    return nullptr;
}

TEST(IesGlare, TableOfTheReferenceLuminaire) {
    const auto corpus = gonio::test::shared_data("photometry");
    if (!corpus) GTEST_SKIP() << "no shared data here";
    const auto read = read_eulumdat(test::read_file(*corpus / "../formats/ugr/data/input/sample_11.ldt"));
    ASSERT_TRUE(read) << read.error().text();
    const auto table = glare_table(*read, 1.0);
    ASSERT_TRUE(table) << table.error().text();
    EXPECT_TRUE(table->regular);
    EXPECT_EQ(table->rows.size(), 19u);
    const GlareTable::Row* row = find_row(*table, 4, 8);
    ASSERT_NE(row, nullptr);
    EXPECT_NEAR(row->background[0].in(nit), 9.49, 0.05);
    constexpr std::array kCie190 = {13.0, 13.8, 13.5, 14.2, 14.7};
    for (std::size_t i = 0; i < kCie190.size(); ++i) EXPECT_NEAR(row->crosswise[i].value_or(0), kCie190[i], 0.2) << i;
}

// A Lambertian square looks the same from either side; a mirror image of a room has the same background.
TEST(IesGlare, ASquareIsSeenAlikeFromBothSides) {
    test::Lm63Text file;
    file.size = "0.6 0.6 0";
    file.counts = "7 1";
    file.v = "0 15 30 45 60 75 90";
    file.candela = "1000 965.93 866.03 707.11 500 258.82 0";
    const auto read = read_photometry(file.text());
    ASSERT_TRUE(read) << read.error().text();
    const auto table = glare_table(*read, 0.25);
    ASSERT_TRUE(table) << table.error().text();
    for (const GlareTable::Row& row : table->rows)
        for (std::size_t i = 0; i < row.crosswise.size(); ++i) {
            EXPECT_NEAR(row.crosswise[i].value_or(-1), row.endwise[i].value_or(-2), 1e-6);
            EXPECT_GT(row.background[0].in(nit), row.background[4].in(nit));  // lighter surfaces
        }
}

TEST(IesGlare, WithoutAnOpeningOrLightThereIsNoTable) {
    test::Lm63Text file;
    EXPECT_EQ(glare_table(*read_photometry(file.text()), 0.25).error().code, "no_opening");
    file.size = "0.6 0.6 0";
    EXPECT_EQ(glare_table(*read_photometry(file.text()), 5.0).error().code, "out_of_range");
    file.candela = "0 0 0";
    EXPECT_EQ(glare_table(*read_photometry(file.text()), 0.25).error().code, "all_dark");
}

}  // namespace
}  // namespace gonio::ies
