// What lists call a luminaire.
#include "ies/product.h"

#include <gtest/gtest.h>

#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

std::string of(std::vector<std::pair<std::string, std::string>> keywords) {
    Provenance provenance;
    provenance.keywords = std::move(keywords);
    return product_name(provenance);
}

TEST(IesProduct, IsMakerAndLuminaire) {
    EXPECT_EQ(of({{"TEST", "1"}, {"MANUFAC", "Maker"}, {"LUMCAT", "4711"}, {"LUMINAIRE", "Spot 12 W"}}),
              "Maker Spot 12 W");
    EXPECT_EQ(of({{"MANUFAC", "Maker"}, {"LUMCAT", "4711"}}), "Maker 4711");
    EXPECT_EQ(of({{"MANUFAC", "Maker"}, {"LUMINAIRE", "Maker Spot"}}), "Maker Spot") << "said once";
    EXPECT_EQ(of({{"LUMINAIRE", "Spot"}}), "Spot");
    EXPECT_EQ(of({{"MANUFAC", "unknown"}, {"LUMINAIRE", "Spot"}}), "Spot") << "as our own files have it";
    EXPECT_EQ(of({{"MANUFAC", "Maker"}}), "") << "a maker alone is no luminaire";
    EXPECT_EQ(of({}), "");
}

TEST(IesProduct, BuiltInLuminairesKeepTheirShortNames) {
    const auto read = read_photometry(synthetic_lm63("downlight"));
    ASSERT_TRUE(read);
    EXPECT_EQ(product_name(read->provenance), "");
}

// A saved show has luminaires as LM-63, whatever their files were.
TEST(IesProduct, StaysWhenWrittenAsAnotherFormat) {
    const auto path = gonio::test::shared_data("photometry/ldt/eulumdat-luminance__sample_10.ldt");
    if (!path) GTEST_SKIP() << "no shared data on this machine";
    const auto read = read_photometry(test::read_file(*path));
    ASSERT_TRUE(read);
    EXPECT_EQ(product_name(read->provenance), "company sample_10");
    const auto again = read_photometry(write_lm63(*read));
    ASSERT_TRUE(again);
    EXPECT_EQ(product_name(again->provenance), "company sample_10");
}

}  // namespace
}  // namespace gonio::ies
