// Quantities against closed forms, and the same light written in every way the formats allow.
#include "ies/quantities.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "ies/eulumdat.h"
#include "ies/lm63.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "tests/unit/angles.h"

namespace gonio::ies {
namespace {

double from_nadir_deg(const Direction& d) {
    return std::acos(std::clamp(-d[2], -1.0, 1.0)) / kDegree;
}

using Law = std::function<double(const Direction&)>;

// A luminaire on a grid of equal steps, over the ranges given in degrees.
Photometry sample(Goniometer goniometer, double step_deg, double v0, double v1, double h0, double h1, const Law& law) {
    Photometry photometry;
    PhotometricWeb& web = photometry.web;
    web.goniometer = goniometer;
    for (int i = 0; i <= std::lround((v1 - v0) / step_deg); ++i) web.v_rad.push_back((v0 + i * step_deg) * kPi / 180.0);
    for (int i = 0; i <= std::lround((h1 - h0) / step_deg); ++i) web.h_rad.push_back((h0 + i * step_deg) * kPi / 180.0);
    for (const double h : web.h_rad) {
        for (const double v : web.v_rad) {
            const double value = law(direction_of(goniometer, Angle::radians(v), Angle::radians(h)));
            web.candela.push_back(static_cast<float>(value));
        }
    }
    return photometry;
}

Photometry sample_c(double step_deg, const Law& law) {
    Photometry photometry = sample(Goniometer::type_c, step_deg, 0, 180, 0, 360, law);
    photometry.web.h_rad.back() = 2 * kPi;
    return photometry;
}

double lower(const Direction& d) {
    return std::max(0.0, -d[2]);
}

TEST(IesQuantities, ZonalFluxOfAnIsotropicSource) {
    const Quantities q = quantities(sample_c(5, [](const Direction&) { return 100.0; }));
    for (std::size_t i = 0; i < 18; ++i) {
        const double a = 10.0 * static_cast<double>(i) * kPi / 180;
        const double b = a + 10.0 * kPi / 180;
        EXPECT_NEAR(q.zonal[i].in(lm), 2 * kPi * 100 * (std::cos(a) - std::cos(b)), 1e-6);
    }
    EXPECT_NEAR(q.downward.in(lm), 2 * kPi * 100, 1e-6);
    EXPECT_NEAR(q.upward.in(lm), 2 * kPi * 100, 1e-6);
    EXPECT_NEAR(q.cie_flux_code[0], 25, 1e-6);
    EXPECT_NEAR(q.cie_flux_code[1], 50, 1e-6);
    EXPECT_NEAR(q.cie_flux_code[2], 75, 1e-6);
    EXPECT_NEAR(q.cie_flux_code[3], 50, 1e-6);
}

TEST(IesQuantities, PowersOfTheCosine) {
    // cos^n: Phi = 2 pi I0 / (n + 1); share within theta = 1 - cos^(n+1); half angle acos(0.5^(1/n)).
    for (const int n : {1, 2, 8, 64}) {
        Photometry photometry = sample_c(0.5, [n](const Direction& d) { return 1000 * std::pow(lower(d), n); });
        photometry.provenance.absolute = false;
        photometry.provenance.rated_lumens = 10'000;
        photometry.provenance.input_watts = 20;
        const Quantities q = quantities(photometry);
        const double flux = 2 * kPi * 1000 / (n + 1);
        EXPECT_NEAR(q.total.in(lm), flux, 2e-3 * flux);
        EXPECT_NEAR(q.beam->degrees(), 2 * std::acos(std::pow(0.5, 1.0 / n)) * 180 / kPi, 0.02);
        EXPECT_NEAR(q.field->degrees(), 2 * std::acos(std::pow(0.1, 1.0 / n)) * 180 / kPi, 0.02);
        EXPECT_NEAR(q.planes[1].beam.lobe->degrees(), q.beam->degrees(), 1e-3);
        EXPECT_NEAR(q.planes[0].beam.centre->degrees(), q.beam->degrees(), 1e-3);
        EXPECT_NEAR(q.cie_flux_code[0], 100 * (1 - std::pow(0.75, n + 1)), 0.05);
        EXPECT_NEAR(q.cie_flux_code[1], 100 * (1 - std::pow(0.5, n + 1)), 0.05);
        EXPECT_NEAR(q.cie_flux_code[2], 100 * (1 - std::pow(0.25, n + 1)), 0.05);
        EXPECT_NEAR(*q.light_output_ratio, flux / 10'000, 2e-3 * flux / 10'000);
        EXPECT_NEAR(*q.efficacy_lm_per_w, flux / 20, 2e-3 * flux / 20);
        // Spacing: 2 cos^(n+3) = 1 for two luminaires, 4 cos^(n+3) = 1 for four.
        const double two = std::acos(std::pow(0.5, 1.0 / (n + 3)));
        const double four = std::acos(std::pow(0.25, 1.0 / (n + 3)));
        EXPECT_NEAR(*q.spacing_criterion[0], 2 * std::tan(two), 2e-3);
        EXPECT_NEAR(*q.spacing_criterion[1], 2 * std::tan(two), 2e-3);
        EXPECT_NEAR(*q.spacing_criterion[2], std::sqrt(2.0) * std::tan(four), 2e-3);
    }
}

// Types A and B, whose grids do not follow the zones: I0 cos^n has the share 1 - cos^(n+1) within theta.
TEST(IesQuantities, ZonesOfTypesAAndB) {
    for (const Goniometer goniometer : {Goniometer::type_a, Goniometer::type_b}) {
        for (const int n : {1, 8, 64}) {
            const auto law = [n](const Direction& d) { return 1000 * std::pow(lower(d), n); };
            const Quantities q = quantities(sample(goniometer, 1, -90, 90, -90, 90, law));
            const double flux = 2 * kPi * 1000 / (n + 1);
            EXPECT_NEAR(q.total.in(lm), flux, 3e-3 * flux);
            for (std::size_t i = 0; i < 9; ++i) {
                const auto beyond = [&](double deg) { return std::pow(std::cos(deg * kPi / 180), n + 1); };
                const double zone = flux * (beyond(10.0 * i) - beyond(10.0 * (i + 1)));
                EXPECT_NEAR(q.zonal[i].in(lm), zone, 4e-3 * flux) << n << " " << i;
            }
            EXPECT_NEAR(q.downward.in(lm), q.total.in(lm), 1e-9 * flux);
            EXPECT_NEAR(q.cie_flux_code[0], 100 * (1 - std::pow(0.75, n + 1)), 0.4);
        }
    }
}

// A tenth of a degree of light between the points of any grid of half degrees: its zone holds all of it.
TEST(IesQuantities, ASpikeOfTypeBIsInItsZone) {
    Photometry photometry;
    photometry.web.goniometer = Goniometer::type_b;
    photometry.web.v_rad = {2.6 * kPi / 180, 2.7 * kPi / 180};
    photometry.web.h_rad = {12.1 * kPi / 180, 12.2 * kPi / 180};
    photometry.web.candela = {1e6f, 1e6f, 1e6f, 1e6f};
    const Quantities q = quantities(photometry);
    const double flux = 1e6 * 0.1 * kPi / 180 * (std::sin(12.2 * kPi / 180) - std::sin(12.1 * kPi / 180));
    EXPECT_NEAR(q.total.in(lm), flux, 1e-5 * flux);
    EXPECT_NEAR(q.zonal[1].in(lm), flux, 1e-5 * flux) << "12.4 degrees from photometric zero";
    EXPECT_NEAR(q.downward.in(lm), flux, 1e-5 * flux);
    EXPECT_NEAR(q.upward.in(lm), 0, 1e-5 * flux);
}

TEST(IesQuantities, ConeWithAHardEdge) {
    // A cone of 30 degrees half angle; the edge falls within one step of 0.25 degrees.
    const Photometry photometry =
        sample_c(0.25, [](const Direction& d) { return -d[2] >= std::cos(30.1 * kPi / 180) ? 1000.0 : 0.0; });
    const Quantities q = quantities(photometry);
    EXPECT_NEAR(q.total.in(lm), 2 * kPi * 1000 * (1 - std::cos(30.125 * kPi / 180)), 1.0);
    EXPECT_NEAR(q.beam->degrees(), 60.25, 0.01);
    EXPECT_NEAR(q.field->degrees(), 60.45, 0.01);
}

TEST(IesQuantities, ThreeBeamDefinitionsDifferOnABatwing) {
    // I = 1 + 3 t up to 60 degrees, then falling to 0 at 80: max 4 (at 60) and I(0) = 1.
    const auto law = [](const Direction& d) {
        const double t = from_nadir_deg(d);
        return t <= 60 ? 1 + 3 * t / 60 : std::max(0.0, 4 * (80 - t) / 20);
    };
    const Quantities q = quantities(sample_c(1, law));
    EXPECT_NEAR(q.planes[0].beam.outermost->degrees(), 140, 1e-4);
    EXPECT_NEAR(q.planes[0].beam.lobe->degrees(), 50, 1e-4);     // one wing: 20 to 70
    EXPECT_NEAR(q.planes[0].beam.centre->degrees(), 155, 1e-4);  // to 0.5 on both sides
    EXPECT_NEAR(q.peak_v.degrees(), 60, 1e-9);
}

// I = 100 cos(t) about the zenith: half of it at 60 degrees, a tenth at 84.26.
TEST(IesQuantities, AnUplightsAnglesAreAboutTheZenith) {
    const Quantities q = quantities(sample_c(1, [](const Direction& d) { return 100 * std::max(0.0, d[2]); }));
    EXPECT_NEAR(q.beam->degrees(), 120, 1e-6);
    EXPECT_NEAR(q.planes[0].beam.lobe->degrees(), 120, 1e-6);
    EXPECT_NEAR(q.planes[0].beam.centre->degrees(), 120, 1e-6);
    EXPECT_NEAR(q.field->degrees(), 2 * std::acos(0.1) * 180 / kPi, 0.01);
    EXPECT_NEAR(q.downward.in(lm), 0, 1e-6);
}

// An oblique lobe, and some light in the other hemisphere: the same angles whichever way up it is.
TEST(IesQuantities, AnUplightIsADownlightTurnedOver) {
    const auto law = [](const Direction& d, double up) {
        const double along = 0.25 * d[0] + 0.1 * d[1] + up * std::sqrt(1 - 0.0725) * d[2];
        return 1000 * std::pow(std::max(0.0, along), 60) + 5;
    };
    const Quantities down = quantities(sample_c(0.5, [&](const Direction& d) { return law(d, -1); }));
    const Quantities up = quantities(sample_c(0.5, [&](const Direction& d) { return law(d, 1); }));
    for (std::size_t i = 0; i < 2; ++i) {
        for (const auto fraction : {&PlaneBeams::beam, &PlaneBeams::field}) {
            for (const auto angle : {&BeamAngles::outermost, &BeamAngles::lobe, &BeamAngles::centre}) {
                const auto one = down.planes[i].*fraction.*angle, other = up.planes[i].*fraction.*angle;
                ASSERT_TRUE(one && other);
                EXPECT_NEAR(other->degrees(), one->degrees(), 1e-4);
                EXPECT_LT(one->degrees(), 60);
            }
        }
    }
}

TEST(IesQuantities, ADarkWebHasNoAngles) {
    const Quantities q = quantities(sample_c(10, [](const Direction&) { return 0.0; }));
    EXPECT_FALSE(q.beam);
    EXPECT_FALSE(q.spacing_criterion[0]);
    EXPECT_EQ(q.total.in(lm), 0.0);
}

TEST(IesQuantities, BugZonesAndRatings) {
    // 1200 cd forward only, 60 to 80 degrees; the grid's edges are one step wide.
    const auto law = [](const Direction& d) {
        const double t = from_nadir_deg(d);
        return d[0] > 0.01 && t > 60.1 && t < 79.9 ? 1200.0 : 0.0;
    };
    const Photometry photometry = sample_c(0.5, law);
    const BugRating bug = bug_rating(photometry.web, {});
    const double zone = kPi * 1200 * (std::cos(60 * kPi / 180) - std::cos(80 * kPi / 180));
    EXPECT_NEAR(bug.forward_high.in(lm), zone, 0.04 * zone);
    EXPECT_LT(bug.back_high.in(lm), 5.0);
    EXPECT_EQ(bug.backlight, 0);
    EXPECT_EQ(bug.uplight, 0);
    EXPECT_EQ(bug.glare, 1);  // 660 < FH <= 1800
    EXPECT_FALSE(bug.quadrilateral);
    const BugRating turned = bug_rating(photometry.web, Angle::degrees(180));
    EXPECT_NEAR(turned.back_high.in(lm), bug.forward_high.in(lm), 1e-6);
    EXPECT_EQ(turned.backlight, 3);  // 1000 < BH <= 2500
    EXPECT_EQ(turned.glare, 3);
    const BugRating aside = bug_rating(photometry.web, Angle::degrees(90));
    EXPECT_NEAR(aside.forward_high.in(lm), aside.back_high.in(lm), 1.0);

    const auto bulb = read_lm63(synthetic_lm63("bulb"));
    EXPECT_TRUE(bug_rating(bulb->web, {}).quadrilateral);
    const Quantities q = quantities(*bulb);
    const BugRating& b = q.bug;
    const double sum = (b.forward_low + b.forward_medium + b.forward_high + b.forward_very_high + b.back_low +
                        b.back_medium + b.back_high + b.back_very_high + b.up_low + b.up_high)
                           .in(lm);
    EXPECT_NEAR(sum, q.total.in(lm), 1e-6 * sum);
}

// A ring of light of 1500 lm to each side, 60 to 80 degrees from the nadir. TM-15-11, addendum A: table A-1 rates the
// backlight by BH, 1000 < 1500 <= 2500; table A-3 rates the glare of a type V by FH's limits on both sides, 660 < 1500
// <= 1800, and that of other types by BH's own.
TEST(IesQuantities, TheGlareOfALightThatIsTheSameOnAllSidesHasLimitsOfItsOwn) {
    const auto ring = [](double back) {
        const double candela = 1500 / (kPi * (std::cos(60 * kPi / 180) - std::cos(80 * kPi / 180)));
        return bug_rating(sample_c(0.5,
                                   [=](const Direction& d) {
                                       const double t = from_nadir_deg(d);
                                       return (t > 60.1 && t < 79.9 ? candela : 0.0) * (d[0] < 0 ? back : 1.0);
                                   })
                              .web,
                          {});
    };
    const BugRating same = ring(1.0), dimmer = ring(0.8);
    EXPECT_TRUE(same.quadrilateral);
    EXPECT_NEAR(same.back_high.in(lm), 1500, 60);
    EXPECT_EQ(same.backlight, 3);
    EXPECT_EQ(same.glare, 1);
    EXPECT_FALSE(dimmer.quadrilateral);
    EXPECT_NEAR(dimmer.back_high.in(lm), 1200, 50);
    EXPECT_EQ(dimmer.glare, 3);
}

TEST(IesQuantities, EachZoneIsOfItsOwnSide) {
    constexpr double kEdges[] = {0, 30, 60, 80, 90};
    for (std::size_t zone = 0; zone < 4; ++zone) {
        const auto front_only = [&](const Direction& d) {
            const double t = from_nadir_deg(d);
            return d[0] > 0.01 && t > kEdges[zone] + 0.1 && t < kEdges[zone + 1] - 0.1 ? 1000.0 : 0.0;
        };
        const BugRating bug = bug_rating(sample_c(0.5, front_only).web, {});
        const LuminousFlux front[] = {bug.forward_low, bug.forward_medium, bug.forward_high, bug.forward_very_high},
                           back[] = {bug.back_low, bug.back_medium, bug.back_high, bug.back_very_high};
        const double due = kPi * 1000 * (std::cos(kEdges[zone] * kPi / 180) - std::cos(kEdges[zone + 1] * kPi / 180));
        for (std::size_t i = 0; i < 4; ++i) {
            EXPECT_NEAR(front[i].in(lm), i == zone ? due : 0.0, 0.06 * due) << zone << i;
            EXPECT_NEAR(back[i].in(lm), 0.0, 0.01 * due) << zone << i;
        }
    }
}

// TM-15-11 allows no light upwards for U0. A file's rounding is no light: 0.05 lm are within it.
TEST(IesQuantities, RoundingIsNoUplight) {
    const auto up = [](double lumens) {
        return bug_rating(sample_c(1, [=](const Direction& d) { return d[2] > 0 ? lumens / (2 * kPi) : 0.0; }).web, {});
    };
    EXPECT_EQ(up(0.04).uplight, 0);
    EXPECT_EQ(up(0.2).uplight, 1);
}

TEST(IesQuantities, ProjectedAreaAndLuminance) {
    const Direction down = {0, 0, -1};
    const Direction slant = direction_of(Goniometer::type_c, Angle::degrees(60), {});
    const Direction side_x = {1, 0, 0};
    const Direction side_y = {0, -1, 0};
    const auto area = [](OpeningShape shape, const Direction& direction) {
        return projected_area({shape, 2.0 * m, 3.0 * m, 4.0 * m}, direction).base();
    };
    EXPECT_EQ(area(OpeningShape::point, down), 0.0);
    EXPECT_NEAR(area(OpeningShape::rectangle, slant), 3.0, 1e-12);
    EXPECT_NEAR(area(OpeningShape::box, side_x), 8.0, 1e-12);   // width x height
    EXPECT_NEAR(area(OpeningShape::box, side_y), 12.0, 1e-12);  // length x height
    EXPECT_NEAR(area(OpeningShape::ellipse, down), kPi / 4 * 6, 1e-12);
    EXPECT_NEAR(area(OpeningShape::vertical_cylinder, side_x), 8.0, 1e-12);
    EXPECT_NEAR(area(OpeningShape::vertical_cylinder, side_y), 12.0, 1e-12);
    EXPECT_NEAR(area(OpeningShape::ellipsoid, side_x), kPi / 4 * 8, 1e-12);
    EXPECT_NEAR(area(OpeningShape::horizontal_cylinder_length, down), 6.0, 1e-12);
    EXPECT_NEAR(area(OpeningShape::horizontal_cylinder_length, side_x), kPi / 4 * 8, 1e-12);
    EXPECT_NEAR(area(OpeningShape::horizontal_cylinder_width, side_y), kPi / 4 * 12, 1e-12);
    EXPECT_NEAR(area(OpeningShape::vertical_ellipse, side_x), kPi / 4 * 8, 1e-12);

    // A Lambertian rectangle has the same luminance from everywhere.
    Photometry photometry = sample_c(1, [](const Direction& d) { return 600 * lower(d); });
    photometry.opening = {OpeningShape::rectangle, 0.5 * m, 1.2 * m, {}};
    const Quantities q = quantities(photometry);
    for (const LuminanceRow& row : q.luminance) {
        for (const auto& value : row.at_h) EXPECT_NEAR(value->in(nit), 1000.0, 0.5);
    }
    EXPECT_FALSE(opening_luminance(photometry, side_x));
}

// One light, quadrant symmetric, written in every way: all must give the same quantities.
TEST(IesSameLight, EveryTypeSymmetryUnitAndFormatAgree) {
    const Law law = [](const Direction& d) {
        const double c = lower(d);
        return 500 * c * c * (1 + 2 * d[0] * d[0]);
    };
    // Phi = 500 (2 pi / 3 + 2 pi (1/3 - 1/5)): integral of c^2 s, and of c^2 s^3 cos^2(h) = pi (1/3 - 1/5).
    const double flux = 500 * (2 * kPi / 3 + 2 * kPi * (1.0 / 3 - 1.0 / 5));
    Photometry full = sample_c(2.5, law);
    full.opening = {OpeningShape::rectangle, 0.3 * m, 1.2 * m, {}};
    full.provenance.absolute = true;
    const auto part = [&](double v1, double h0, double h1) {
        Photometry p = sample(Goniometer::type_c, 2.5, 0, v1, h0, h1, law);
        std::string text = "IES:LM-63-2019\nTILT=NONE\n1 -1 1 " + std::to_string(p.web.v_rad.size()) + " " +
                           std::to_string(p.web.h_rad.size()) + " 1 1 0.984251969 3.937007874 0\n1 1.00010 0\n";
        for (const double v : p.web.v_rad) text += std::to_string(v * 180 / kPi) + " ";
        text += "\n";
        for (const double h : p.web.h_rad) text += std::to_string(h * 180 / kPi) + " ";
        for (const float value : p.web.candela) text += "\n" + std::to_string(value);
        return text;
    };
    struct Case {
        const char* name;
        Result<Photometry> light;
        double tolerance;  // of the flux, relative to the closed form
    };
    const Case cases[] = {
        {"quadrant, feet", read_lm63(part(90, 0, 90)), 1e-3},
        {"bilateral, feet", read_lm63(part(90, 0, 180)), 1e-3},
        {"bilateral 90-270, feet", read_lm63(part(90, 90, 270)), 1e-3},
        {"full, feet", read_lm63(part(180, 0, 360)), 1e-3},
        {"written, metres", read_lm63(write_lm63(full)), 1e-3},
        {"EULUMDAT", read_eulumdat(write_eulumdat(full)), 1e-3},
        {"Type B", read_lm63(write_lm63(sample(Goniometer::type_b, 2.5, -90, 90, -90, 90, law))), 2e-3},
        {"Type A", read_lm63(write_lm63(sample(Goniometer::type_a, 2.5, -90, 90, -90, 90, law))), 2e-3},
    };
    for (const Case& item : cases) {
        ASSERT_TRUE(item.light) << item.name << ": " << item.light.error().text();
        const Quantities q = quantities(*item.light);
        EXPECT_NEAR(q.total.in(lm), flux, item.tolerance * flux) << item.name;
        EXPECT_NEAR(q.peak.in(cd), 500 * 1.125, 2.0) << item.name;
        for (int v = 3; v < 88; v += 6) {
            for (int h = 1; h < 360; h += 17) {
                const Direction direction = direction_of(Goniometer::type_c, Angle::degrees(v), Angle::degrees(h));
                ASSERT_NEAR(intensity(item.light->web, direction).in(cd), law(direction), 1.5)
                    << item.name << " v " << v << " h " << h;
            }
        }
        if (item.light->web.goniometer == Goniometer::type_c) {
            EXPECT_EQ(item.light->web.h_rad, full.web.h_rad) << item.name;
            EXPECT_EQ(item.light->opening.shape, OpeningShape::rectangle) << item.name;
            EXPECT_NEAR(item.light->opening.length.in(m), 1.2, 1e-6) << item.name;
            EXPECT_NEAR(item.light->opening.width.in(m), 0.3, 1e-6) << item.name;
        }
    }
}

}  // namespace
}  // namespace gonio::ies
