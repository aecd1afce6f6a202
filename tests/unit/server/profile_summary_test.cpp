// What a profile's summary says beyond the figures.
#include "server/session/profile_summary.h"

#include <gtest/gtest.h>

#include "protocol/schema/library.pb.h"
#include "server/assets/assets.h"
#include "tests/unit/ies_test_support.h"

namespace gonio {
namespace {

// A light keeps its white, whatever its file says; the note says how it gets the file's.
TEST(ProfileSummary, TellsTheColourAndHowALightGetsIt) {
    ies::test::Lm63Text text;
    text.header += "[_COLORTEMP] ww/827\n";
    const auto told = summary_of(**make_profile("a.ies", text.text()));
    ASSERT_GE(told.diagnostics_size(), 1);
    EXPECT_EQ(told.diagnostics(0),
              "note lamp_colour: the file says 2700 K, CRI at least 80; a light is of this colour with gonio set light "
              "NAME --cct 2700");
    const auto silent = summary_of(**make_profile("b.ies", ies::test::Lm63Text().text()));
    for (const std::string& one : silent.diagnostics()) EXPECT_EQ(one.find("lamp_colour"), std::string::npos);
}

}  // namespace
}  // namespace gonio
