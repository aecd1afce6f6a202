// Webs of GDTF beams: the formula's peak and flux, integrated elsewhere to 1e-6.
#include "server/exchange/beam_web.h"
#include "tests/unit/angles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace gonio {
namespace {

gdtf::Beam beam_of(double flux_lm, double beam_deg, double field_deg, gdtf::BeamType type = gdtf::BeamType::wash) {
    gdtf::Beam beam;
    beam.flux_lm = {flux_lm, false};
    beam.beam_angle_rad = {beam_deg * kDegree, false};
    beam.field_angle_rad = {field_deg * kDegree, false};
    beam.type = {type, false};
    return beam;
}

double at(const ies::PhotometricWeb& web, double v_deg) {
    return ies::intensity_at(web, Angle::degrees(v_deg), Angle::degrees(33.0)).in(cd);
}

TEST(BeamWeb, PeakAndFluxOfTheFormula) {
    struct Row {
        double flux_lm, beam_deg, field_deg, peak_cd;
    };
    for (const Row& row :
         {Row{10000, 25, 40, 54579}, Row{10000, 25, 50, 41345}, Row{7000, 60, 90, 7295.8}, Row{20000, 4, 6, 4511797}}) {
        const auto web = gdtf::beam_web(beam_of(row.flux_lm, row.beam_deg, row.field_deg));
        const double peak = ies::peak_intensity(web).in(cd);
        EXPECT_NEAR(peak / row.peak_cd, 1.0, 1e-3);
        EXPECT_NEAR(ies::total_flux(web).in(lm) / row.flux_lm, 1.0, 1e-3);
        EXPECT_NEAR(at(web, row.beam_deg / 2) / peak, 0.5, 2e-3) << "BeamAngle is that of half the peak";
        EXPECT_NEAR(at(web, row.field_deg / 2) / peak, 0.1, 1e-3) << "FieldAngle is that of a tenth";
    }
}

TEST(BeamWeb, AFieldNoWiderThanTheBeamIsAFlatCone) {
    const auto spot = gdtf::beam_web(beam_of(10000, 25, 25, gdtf::BeamType::spot));
    EXPECT_NEAR(ies::peak_intensity(spot).in(cd) / 67143, 1.0, 1e-3);
    EXPECT_NEAR(ies::total_flux(spot).in(lm) / 10000, 1.0, 1e-3);
    EXPECT_EQ(at(spot, 12.6), 0.0);
    const auto wash = gdtf::beam_web(beam_of(10000, 25, 25));
    EXPECT_NEAR(ies::total_flux(wash).in(lm) / 10000, 1.0, 1e-3);
    EXPECT_NEAR(at(wash, 12.5) / at(wash, 0.0), 0.5, 1e-3);
    EXPECT_GT(at(wash, 13.5), 0.0);
    EXPECT_EQ(at(wash, 15.1), 0.0);
}

TEST(BeamWeb, ZoomReplacesTheBeamAngleAndKeepsRatioAndFlux) {
    const auto zoomed = gdtf::beam_web(beam_of(10000, 25, 40), Angle::degrees(50));
    const double peak = ies::peak_intensity(zoomed).in(cd);
    EXPECT_NEAR(at(zoomed, 25) / peak, 0.5, 2e-3);
    EXPECT_NEAR(at(zoomed, 40) / peak, 0.1, 1e-3);
    EXPECT_NEAR(ies::total_flux(zoomed).in(lm) / 10000, 1.0, 1e-3);
}

TEST(BeamWeb, ExtremesAreWebsStill) {
    for (const double beam_deg : {0.01, 1.0, 170.0, 180.0})
        for (const double field_deg : {0.01, 1.0, beam_deg * 1.01, 180.0})
            for (const double flux_lm : {0.0, 1e9}) {
                const auto web = gdtf::beam_web(beam_of(flux_lm, beam_deg, field_deg));
                ASSERT_GE(web.v_rad.size(), 2u);
                for (std::size_t i = 1; i < web.v_rad.size(); ++i) ASSERT_LT(web.v_rad[i - 1], web.v_rad[i]);
                for (const float candela : web.candela) ASSERT_TRUE(candela >= 0.0f && candela <= 1e12f);
                ASSERT_LE(web.v_rad.back(), std::numbers::pi / 2 + 1e-12);
            }
}

}  // namespace
}  // namespace gonio
