// Webs of GDTF beams: the formula's peak and flux, integrated elsewhere to 1e-6.
#include "server/exchange/beam_web.h"
#include "tests/unit/angles.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// A bulb: Φ/4π everywhere, 5,000 lm give 397.9 cd. A cone beyond the half space: Φ/(2π(1 − cos θb)).
TEST(BeamWeb, BeyondTheHalfSpaceItGoesAround) {
    for (const double field_deg : {25.0, 360.0})
        for (const auto type : {gdtf::BeamType::wash, gdtf::BeamType::spot}) {
            const auto bulb = gdtf::beam_web(beam_of(5000, 360, field_deg, type));
            for (const double v_deg : {0.0, 30.0, 90.0, 150.0, 180.0}) EXPECT_NEAR(at(bulb, v_deg), 397.9, 0.1);
        }
    const auto wide = gdtf::beam_web(beam_of(5000, 270, 270, gdtf::BeamType::spot));
    EXPECT_NEAR(at(wide, 0.0), 5000 / (2 * std::numbers::pi * (1 - std::cos(135 * kDegree))), 0.5);
    EXPECT_NEAR(at(wide, 134.0), at(wide, 0.0), 0.5);
    EXPECT_EQ(at(wide, 136.0), 0.0);
    const auto soft = gdtf::beam_web(beam_of(5000, 330, 330));
    EXPECT_NEAR(at(soft, 165.0) / at(soft, 0.0), 0.5, 1e-2);
    EXPECT_GT(at(soft, 175.0), 0.0);
    const auto field = gdtf::beam_web(beam_of(5000, 120, 240));
    EXPECT_NEAR(at(field, 60.0) / at(field, 0.0), 0.5, 5e-3);
    EXPECT_NEAR(at(field, 120.0) / at(field, 0.0), 0.1, 2e-3);
}

// Lux on a plane 3 m before it, x to the right and y up.
double lux_at_3_m(const ies::PhotometricWeb& web, double x, double y) {
    const double square = x * x + y * y + 9.0;
    return ies::intensity(web, {x, y, -3.0}).in(cd)*3.0 / std::pow(square, 1.5);
}

// ThrowRatio 1 and ratio 2: 3 m x 1.5 m, 10,000 lm over 4.5 m².
TEST(BeamWeb, ARectangleIsAHardPyramid) {
    auto beam = beam_of(10000, 25, 25, gdtf::BeamType::rectangle);
    beam.throw_ratio = {1.0, false};
    beam.rectangle_ratio = {2.0, false};
    const auto web = gdtf::beam_web(beam);
    EXPECT_NEAR(ies::total_flux(web).in(lm), 10000, 10);
    EXPECT_NEAR(lux_at_3_m(web, 0, 0), 10000 / 4.5, 25);
    for (const auto& [x, y] : {std::pair{1.4, 0.0}, {-1.49, 0.0}, {0.0, 0.74}, {1.0, -0.7}, {-1.48, 0.735}})
        EXPECT_NEAR(lux_at_3_m(web, x, y) / lux_at_3_m(web, 0, 0), 1.0, 0.02) << x << " " << y;
    for (const auto& [x, y] : {std::pair{1.51, 0.0}, {0.0, 0.76}, {0.0, -1.4}, {1.4, 0.77}, {-1.6, 0.1}})
        EXPECT_EQ(lux_at_3_m(web, x, y), 0.0) << x << " " << y;
    const auto zoomed = gdtf::beam_web(beam, Angle::degrees(90.0));  // 6 m wide, 3 m high
    EXPECT_NEAR(lux_at_3_m(zoomed, 2.9, 1.4), 10000 / 18.0, 15);
    EXPECT_EQ(lux_at_3_m(zoomed, 0.0, 1.55), 0.0);
    for (const double ratio : {1e-3, 0.05, 0.3, 30.0, 1e3})
        for (const double sides : {1e-3, 0.5, 1.0, 1e3}) {
            beam.throw_ratio = {ratio, false};
            beam.rectangle_ratio = {sides, false};
            const auto extreme = gdtf::beam_web(beam);
            EXPECT_NEAR(ies::total_flux(extreme).in(lm), 10000, 10) << ratio << " " << sides;
            for (const auto* angles : {&extreme.v_rad, &extreme.h_rad})
                for (std::size_t i = 1; i < angles->size(); ++i) ASSERT_LT((*angles)[i - 1], (*angles)[i]);
            const bool wide = ratio < 20.0 && ratio * sides < 20.0;
            EXPECT_TRUE(!wide || !ies::thinned(extreme, Angle::degrees(0.01), Angle::degrees(0.05)))
                << ratio << " " << sides;
        }
}

// No beam: the surface glows, I = Φ/π · cos θ, whatever its angles and zoom.
TEST(BeamWeb, NoneAndGlowAreSurfaces) {
    for (const auto type : {gdtf::BeamType::none, gdtf::BeamType::glow}) {
        const auto web = gdtf::beam_web(beam_of(10000, 25, 25, type), Angle::degrees(10.0));
        for (const double v_deg : {0.0, 30.0, 60.0, 85.0})
            EXPECT_NEAR(at(web, v_deg), 10000 / std::numbers::pi * std::cos(v_deg * kDegree), 0.5) << v_deg;
        EXPECT_EQ(at(web, 95.0), 0.0);
    }
}

TEST(BeamWeb, ExtremesAreWebsStill) {
    for (const double beam_deg : {0.01, 1.0, 170.0, 178.0, 180.0, 181.0, 270.0, 360.0})
        for (const double field_deg : {0.01, 1.0, beam_deg * 1.01, 180.0, 360.0})
            for (const double flux_lm : {0.0, 1e9}) {
                const auto web = gdtf::beam_web(beam_of(flux_lm, beam_deg, field_deg));
                ASSERT_GE(web.v_rad.size(), 2u);
                for (std::size_t i = 1; i < web.v_rad.size(); ++i) ASSERT_LT(web.v_rad[i - 1], web.v_rad[i]);
                for (const float candela : web.candela) ASSERT_TRUE(candela >= 0.0f && candela <= 1e12f);
                const bool around = std::max(beam_deg, field_deg) > 180.0;
                ASSERT_LE(web.v_rad.back(), std::numbers::pi / (around ? 1 : 2) + 1e-12);
                const bool bounded = ies::peak_intensity(web).in(cd) > 0.999e12;
                ASSERT_TRUE(bounded || std::abs(ies::total_flux(web).in(lm)-flux_lm) <= 1e-3 * flux_lm);
            }
}

}  // namespace
}  // namespace gonio
