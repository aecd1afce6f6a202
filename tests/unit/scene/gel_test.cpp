#include "server/scene/gel.h"

#include <gtest/gtest.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/white.h"
#include "tests/unit/scene/chromaticity.h"

namespace gonio {
namespace {

using test::luminance;
using test::xy_of;

// What LEE Filters publish of 201 and 204 with 3,200 K, in front of a light of 3,200 K; the light is Planck's to
// 0.0003.
TEST(Gel, ALightOfTheMeasurementsTemperatureIsWhatTheMakerMeasured) {
    struct {
        const char* name;
        double x, y, transmission;
    } const rows[] = {{"L201", 0.330, 0.339, 0.350}, {"L204", 0.510, 0.420, 0.628}, {"L202", 0.372, 0.374, 0.532}};
    for (const auto& row : rows) {
        const auto gel = find_gel(nullptr, row.name);
        ASSERT_TRUE(gel) << row.name;
        const glm::dvec3 factors = filtered_white(3200, 0, gel.get());
        EXPECT_NEAR(luminance(factors), row.transmission, 1e-3) << row.name;
        EXPECT_NEAR(xy_of(factors).x, row.x, 2e-3) << row.name;
        EXPECT_NEAR(xy_of(factors).y, row.y, 2e-3) << row.name;
    }
}

// CIE illuminant C is no Planckian radiator: 0.0013 of Duv below it. What was measured with it is met by 6,774 K and
// that.
TEST(Gel, BetweenTwoMeasurementsTheLightsPlaceInMiredDecides) {
    const auto gel = find_gel(nullptr, "L201 Full C.T. Blue");
    ASSERT_TRUE(gel);
    EXPECT_NEAR(luminance(filtered_white(6774, 0, gel.get())), 0.340, 1e-3);
    EXPECT_NEAR(luminance(filtered_white(15'000, 0, gel.get())), 0.340, 1e-9) << "not beyond";
    EXPECT_NEAR(luminance(filtered_white(2000, 0, gel.get())), 0.350, 1e-9);
    const double middle_k = 2e6 / (1e6 / 3200 + 1e6 / 6774);
    EXPECT_NEAR(luminance(filtered_white(middle_k, 0, gel.get())), 0.345, 1e-3);
    EXPECT_NEAR(luminance(filtered_white(0, 0, gel.get())), 0.340, 1e-3) << "D65 lies near C";
}

TEST(Gel, NoFactorIsNegativeOrBeyondItsBoundWhateverTheLight) {
    for (const auto& gel : builtin_gels()) {
        for (const double cct_k : {0.0, 1000.0, 2000.0, 3200.0, 6500.0, 15'000.0}) {
            for (const double duv : {-0.05, 0.0, 0.05}) {
                const glm::dvec3 factors = filtered_white(cct_k, duv, gel.get());
                EXPECT_GE(std::min({factors.r, factors.g, factors.b}), 0) << gel->name << " " << cct_k;
                EXPECT_LE(std::max({factors.r, factors.g, factors.b}), 13.9) << gel->name << " " << cct_k;
                EXPECT_LE(luminance(factors), 0.9) << gel->name << " " << cct_k;
            }
        }
    }
}

TEST(Gel, AFileBringsOthersAndReplacesBuiltInOnes) {
    const auto gels = read_gels(
        "# of our own stock\n"
        "Straw, 0.72, 0.485, 0.428, 0.4234, 0.3990, measured here, 2026\n"
        "\r\n"
        "Straw, 0.70, 0.392, 0.392, 0.3101, 0.3162\r\n"
        "L201 Full C.T. Blue, 0.5, 0.3101, 0.3162, 0.3101, 0.3162");
    ASSERT_TRUE(gels) << gels.error().text();
    ASSERT_EQ(gels->size(), 2u);
    EXPECT_EQ(gels->at(0)->measured.size(), 2u);
    EXPECT_DOUBLE_EQ(gels->at(0)->measured[0].transmission_ratio, 0.72) << "the warmer light first";
    EXPECT_EQ(gels->at(0)->source, "measured here, 2026");
    EXPECT_EQ(find_gel(&*gels, "L201")->measured.size(), 1u);
    EXPECT_EQ(all_gels(&*gels).size(), builtin_gels().size() + 1);
    EXPECT_NEAR(luminance(filtered_white(4000, 0.01, find_gel(&*gels, "L201").get())), 0.5, 1e-12);
}

TEST(Gel, ABadFileIsRefusedWithItsLine) {
    struct {
        const char* text;
        const char* place;
    } const rows[] = {
        {"\nStraw,0.7,0.4,0.4,0.31", "line 2"},                              // a number is missing
        {"Straw,1.1,0.4,0.4,0.3101,0.3162", "line 1"},                       // more than all passes
        {"Straw,nan,0.4,0.4,0.3101,0.3162", "line 1"},                       //
        {"Straw,0.5,0.7,0.4,0.3101,0.3162", "line 1"},                       // no chromaticity
        {"Straw,0.5,0.4,0.4,0.7,0.29", "line 1"},                            // no white light
        {",0.5,0.4,0.4,0.3101,0.3162", "line 1"},                            // no name
        {"S,0.5,0.4,0.4,0.31,0.32\nS,0.5,0.4,0.4,0.3101,0.3162", "line 2"},  // twice the same light
    };
    for (const auto& row : rows) {
        const auto gels = read_gels(row.text);
        ASSERT_FALSE(gels) << row.text;
        EXPECT_EQ(gels.error().code, "bad_gels") << row.text;
        EXPECT_EQ(gels.error().where, row.place) << row.text;
    }
    EXPECT_EQ(read_gels(std::string(kMaxGelFileBytes + 1, '#')).error().code, "too_large");
}

TEST(Gel, ALightHasOneByNameAndLosesIt) {
    Scene scene = scene_of(*load_scene("cornell"));
    v1::Command command;
    v1::SetLight& set = *command.mutable_set_light();
    set.set_name(scene.lights[0].name);
    set.set_gel("L204");
    set.set_cct_k(3200);
    const glm::dvec3 before = own_weight(scene.lights[0]);
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_EQ(scene.lights[0].gel->name, "L204 Full C.T. Orange");
    EXPECT_NEAR(luminance(own_weight(scene.lights[0])), 0.628 * luminance(before), 1e-3 * luminance(before));
    set.set_gel("no such gel");
    const auto refused = apply(scene, command, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "not_found");
    EXPECT_EQ(refused.error().where, "set_light.gel");
    for (const double bad : {999.0, 15'001.0, -1.0}) {
        v1::Command wrong;
        wrong.mutable_set_light()->set_name(scene.lights[0].name);
        wrong.mutable_set_light()->set_cct_k(bad);
        EXPECT_EQ(apply(scene, wrong, {}).error().where, "set_light.cct_k") << bad;
    }
    set.set_gel("");
    set.set_cct_k(0);
    ASSERT_TRUE(apply(scene, command, {}));
    EXPECT_EQ(scene.lights[0].gel, nullptr);
    EXPECT_EQ(own_weight(scene.lights[0]), before);
}

}  // namespace
}  // namespace gonio
