// Photometry of the shared cases, each against what its README says. Own files with the same traits are in the tests
// of direct ratios and of each format.
#include <gtest/gtest.h>

#include "ies/direct_ratios.h"
#include "ies/photometry_file.h"
#include "ies/writers.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

class IesCases : public testing::Test {
protected:
    // Bytes of a file of the shared cases; empty where this machine has none.
    static std::string case_bytes(const std::string& name) {
        const auto path = gonio::test::shared_data("cases/" + name);
        return path ? test::read_file(*path) : "";
    }
};

TEST_F(IesCases, AConvertedDownlightHasDirectRatios) {
    const std::string bytes = case_bytes("01-ldt-direct-ratios/lambert.ies");
    if (bytes.empty()) GTEST_SKIP() << "no shared cases on this machine";
    const auto read = read_photometry(bytes);
    ASSERT_TRUE(read) << read.error().text();
    const auto again = read_photometry(write_eulumdat(*read));
    ASSERT_TRUE(again) << again.error().text();
    ASSERT_TRUE(again->eulumdat.has_value());
    const auto& ratios = again->eulumdat->direct_ratios;
    EXPECT_NEAR(ratios.front(), 0.3, 0.05);
    EXPECT_NEAR(ratios.back(), 0.85, 0.05);
    for (std::size_t i = 1; i < ratios.size(); ++i) EXPECT_GT(ratios[i], ratios[i - 1]) << kRoomIndices[i];
}

TEST_F(IesCases, ALinesLengthLiesAlongItsZeroPlane) {
    for (const char* name : {"line.ies", "line.ldt", "line.xml"}) {
        const std::string bytes = case_bytes(std::string("03-linear-opening-axis/") + name);
        if (bytes.empty()) GTEST_SKIP() << "no shared cases on this machine";
        const auto read = read_photometry(bytes);
        ASSERT_TRUE(read) << name << ": " << read.error().text();
        EXPECT_EQ(read->opening, (Opening{OpeningShape::rectangle, 0.158 * m, 1.268 * m, 0.0 * m})) << name;
    }
}

}  // namespace
}  // namespace gonio::ies
