// The project's own luminaires: the files hold the flux that their laws have in closed form.
#include "ies/synthetic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "ies/lm63.h"

namespace gonio::ies {
namespace {

TEST(IesSynthetic, FileFluxAgreesWithTheClosedForm) {
    const std::set<std::string_view> wanted = {"downlight", "narrow_spot", "batwing", "wall_washer",
                                               "linear",    "street",      "bulb",    "flood"};
    std::set<std::string_view> seen;
    for (const SyntheticLuminaire& luminaire : synthetic_luminaires()) {
        seen.insert(luminaire.name);
        const auto read = read_lm63(synthetic_lm63(luminaire.name));
        ASSERT_TRUE(read) << luminaire.name << ": " << read.error().text();
        const double flux = total_flux(read->web).in(lm);
        const double expected = luminaire.flux.in(lm);
        EXPECT_NEAR(flux, expected, 0.002 * expected) << luminaire.name;
        EXPECT_TRUE(std::none_of(read->diagnostics.begin(), read->diagnostics.end(), [](const Diagnostic& d) {
            return d.severity == "warning";
        })) << luminaire.name;
        EXPECT_FALSE(luminaire.description.empty());
        EXPECT_GT(expected, 500.0);
        EXPECT_LT(expected, 8000.0);
    }
    EXPECT_EQ(seen, wanted);
}

TEST(IesSynthetic, WallWasherAndStreetAreAsymmetric) {
    const auto washer = read_lm63(synthetic_lm63("wall_washer"));
    ASSERT_TRUE(washer);
    const double forward = intensity(washer->web, direction_of(Goniometer::type_c, Angle::degrees(45), {})).in(cd);
    const double back =
        intensity(washer->web, direction_of(Goniometer::type_c, Angle::degrees(45), Angle::degrees(180))).in(cd);
    EXPECT_GT(forward, 100 * back);
    const auto street = read_lm63(synthetic_lm63("street"));
    ASSERT_TRUE(street);
    const double along =
        intensity(street->web, direction_of(Goniometer::type_c, Angle::degrees(65), Angle::degrees(75))).in(cd);
    const double behind =
        intensity(street->web, direction_of(Goniometer::type_c, Angle::degrees(65), Angle::degrees(180))).in(cd);
    EXPECT_GT(along, 10 * behind);
}

TEST(IesSynthetic, UnknownNameIsEmpty) {
    EXPECT_TRUE(synthetic_lm63("candle").empty());
}

}  // namespace
}  // namespace gonio::ies
