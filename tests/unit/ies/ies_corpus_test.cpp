// Every file of the shared corpus against reference values that were computed independently of this project.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "ies/photometry_file.h"
#include "ies/quantities.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

using nlohmann::json;

double number_or(const json& object, const char* key, double fallback) {
    const auto found = object.find(key);
    return found == object.end() || found->is_null() ? fallback : found->get<double>();
}

struct Deviation {
    double flux = 0.0, beam_deg = 0.0, field_deg = 0.0;
};

// Compares one file with its reference: flux 0.1 %, peak to the last bit of a float, angles 0.1 degree.
void compare(const std::string& name, const Photometry& photometry, const json& reference, Deviation& largest) {
    const Quantities q = quantities(photometry);
    const double flux = number_or(reference, "flux_lm", 0.0);
    EXPECT_NEAR(q.total.in(lm), flux, 1e-3 * flux + 1e-6) << name;
    if (flux > 0.0) largest.flux = std::max(largest.flux, std::abs(q.total.in(lm) / flux - 1.0));
    // The reference prints six decimals; beyond that the values must be the same float.
    const auto peak = static_cast<float>(number_or(reference, "max_cd", 0.0));
    const float step = std::nextafter(peak, std::numeric_limits<float>::infinity()) - peak;
    EXPECT_NEAR(static_cast<float>(q.peak.in(cd)), peak, std::max(step, 1e-6F)) << name;
    const double beam = number_or(reference, "beam_deg", -1.0);
    const double field = number_or(reference, "field_deg", -1.0);
    ASSERT_EQ(q.beam.has_value(), beam >= 0.0 && flux > 0.0) << name;
    if (!q.beam) return;
    if (beam == 360.0 && field == 360.0) {  // of an uplight the reference measures around the nadir, where it is dark
        EXPECT_LE(q.beam->degrees(), 180.0) << name;
        return;
    }
    EXPECT_NEAR(q.beam->degrees(), beam, 0.1) << name;
    EXPECT_NEAR(q.field->degrees(), field, 0.1) << name;
    largest.beam_deg = std::max(largest.beam_deg, std::abs(q.beam->degrees() - beam));
    largest.field_deg = std::max(largest.field_deg, std::abs(q.field->degrees() - field));
}

TEST(IesCorpus, EveryFileMatchesItsReference) {
    const auto folder = gonio::test::shared_data("photometry");
    if (!folder) GTEST_SKIP() << "no shared photometry corpus on this machine";
    const json reference = json::parse(test::read_file(*folder / "reference.json"));
    Deviation largest;
    int files = 0;
    for (const auto& [name, expected] : reference.items()) {
        const auto read = read_photometry(test::read_file(*folder / name));
        ASSERT_TRUE(read) << name << ": " << read.error().text();
        compare(name, *read, expected, largest);
        EXPECT_EQ(read->provenance.file_vertical_angles, expected["nV"].get<int>()) << name;
        EXPECT_EQ(read->provenance.file_horizontal_angles, expected["nH"].get<int>()) << name;
        EXPECT_EQ(read->provenance.absolute, expected["absolute"].get<bool>()) << name;
        ++files;
    }
    EXPECT_GT(files, 0);
    std::cout << files << " files; largest deviation: flux " << 100.0 * largest.flux << " %, beam " << largest.beam_deg
              << " deg, field " << largest.field_deg << " deg\n";
}

TEST(IesCorpus, EveryMalformedFileBehavesAsExpected) {
    const auto folder = gonio::test::shared_data("photometry");
    if (!folder) GTEST_SKIP() << "no shared photometry corpus on this machine";
    const json expected = json::parse(test::read_file(*folder / "malformed" / "expected.json"));
    int as_expected = 0;
    for (const auto& [name, item] : expected.items()) {
        const std::string action = item["action"];
        const auto read = read_photometry(test::read_file(*folder / "malformed" / name));
        const int failures = ::testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count();
        if (!read) {
            EXPECT_TRUE(action.find("reject") != std::string::npos) << name << ": " << read.error().text();
            EXPECT_FALSE(read.error().code.empty());
            EXPECT_EQ(read.error().where.rfind("line ", 0), 0u) << name;
        } else {
            EXPECT_TRUE(action.find("accept") != std::string::npos) << name << " was accepted";
            const bool warned = std::any_of(read->diagnostics.begin(), read->diagnostics.end(),
                                            [](const Diagnostic& d) { return d.severity == "warning"; });
            if (action.find("warn") != std::string::npos) {
                EXPECT_TRUE(warned) << name;
            } else if (action == "accept") {
                EXPECT_FALSE(warned) << name;
            }
            Deviation unused;
            if (item["reference"].contains("flux_lm")) compare(name, *read, item["reference"], unused);
        }
        if (::testing::UnitTest::GetInstance()->current_test_info()->result()->total_part_count() == failures)
            ++as_expected;
    }
    std::cout << as_expected << " of " << expected.size() << " malformed files behave as expected\n";
}

}  // namespace
}  // namespace gonio::ies
