// The colour of the light as files tell it.
#include "ies/lamp_colour.h"

#include <gtest/gtest.h>

#include "ies/photometry_file.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

LampColour of(std::vector<std::pair<std::string, std::string>> keywords) {
    Photometry photometry;
    photometry.provenance.keywords = std::move(keywords);
    return lamp_colour(photometry);
}

TEST(LampColour, Temperatures) {
    for (const char* text :
         {"2700", "2700K", "2700 K", "2700 Kelvin", "827", "ww/827", "ca. 2700 K", "T2 2700K", "L58W/827"})
        EXPECT_EQ(of({{"_COLORTEMP", text}}).cct_k, 2700.0) << text;
    EXPECT_EQ(of({{"_COLORTEMP", "830"}}), (LampColour{3000.0, 80.0, true}));
    EXPECT_EQ(of({{"_COLORTEMP", "965"}}), (LampColour{6500.0, 90.0, true}));
    EXPECT_EQ(of({{"_COLORTEMP", "830"}, {"_CRI", "85"}}), (LampColour{3000.0, 85.0, false})) << "the field first";
    for (const char* text : {"", "0", "nw", "warm white", "2700-6500 K", "2700K/4000K", "100", "123", "25000", "83"})
        EXPECT_FALSE(of({{"_COLORTEMP", text}}).cct_k) << text;
}

TEST(LampColour, Rendering) {
    for (const char* text : {"90", "Ra 90", "CRI 90", "90.0"})
        EXPECT_EQ(of({{"_CRI", text}}), (LampColour{{}, 90.0, false})) << text;
    for (const char* text : {"1A", "1A/>90", ">90", "Ra > 90", "90-100", "\xe2\x89\xa5 90", "90+"})
        EXPECT_EQ(of({{"_CRI", text}}).cri, 90.0) << text;
    for (const char* text : {"1A", ">90", "Ra > 90", "90-100", "\xe2\x89\xa5 90"})
        EXPECT_TRUE(of({{"_CRI", text}}).cri_is_least) << text;
    EXPECT_EQ(of({{"_CRI", "1B"}}).cri, 80.0);
    EXPECT_EQ(of({{"_CRI", "2B"}}).cri, 60.0);
    EXPECT_EQ(of({{"_CRI", "3"}}).cri, 40.0);
    EXPECT_EQ(of({{"_CRI", "35"}}).cri, 35.0);
    for (const char* text : {"", "0", "-", "good", "999"}) EXPECT_FALSE(of({{"_CRI", text}}).cri) << text;
}

TEST(LampColour, NamesOfLamps) {
    EXPECT_EQ(of({{"LAMP", "LED 2700K CRI90"}}), (LampColour{2700.0, 90.0, false}));
    EXPECT_EQ(of({{"LAMP", "TL5 HO 49W/830"}}), (LampColour{3000.0, 80.0, true}));
    EXPECT_EQ(of({{"LAMP", "24 LED, 4000 lm, Ra>80, 4000 K"}}), (LampColour{4000.0, 80.0, true}));
    EXPECT_EQ(of({{"LAMP", "Generic 1500 W module 840 mA"}}), LampColour{});
    EXPECT_EQ(of({{"LAMP", "LED 3000K"}, {"_COLORTEMP", "4000 K"}}).cct_k, 4000.0) << "the field first";
    EXPECT_EQ(of({{"_CCT", "2700"}, {"LAMP", "x"}}).cct_k, 2700.0);
}

TEST(LampColour, TheSharedCases) {
    const auto folder = gonio::test::shared_data("cases/56-ldt-colour-temperature");
    if (!folder) GTEST_SKIP() << "no shared cases on this machine";
    for (const char* name : {"a.ldt", "a.ies"}) {
        const auto read = read_photometry(test::read_file(*folder / name));
        ASSERT_TRUE(read);
        EXPECT_EQ(lamp_colour(*read), (LampColour{2700.0, 90.0, false})) << name;
    }
}

}  // namespace
}  // namespace gonio::ies
