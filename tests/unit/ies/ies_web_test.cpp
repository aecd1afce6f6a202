// The web itself: directions, interpolation and flux against closed forms.
#include "ies/web.h"
#include "tests/unit/angles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace gonio::ies {
namespace {

PhotometricWeb sample(Goniometer goniometer, double step_deg, const std::function<double(const Direction&)>& law) {
    PhotometricWeb web;
    web.goniometer = goniometer;
    const auto fill = [&](std::vector<double>& list, double first, double last) {
        const int count = static_cast<int>(std::lround((last - first) / step_deg));
        for (int i = 0; i <= count; ++i) list.push_back((first + i * step_deg) * kPi / 180.0);
    };
    const bool c = goniometer == Goniometer::type_c;
    const bool a = goniometer == Goniometer::type_a;
    fill(web.v_rad, c ? 0.0 : a ? -90.0 : -180.0, c ? 180.0 : a ? 90.0 : 180.0);
    fill(web.h_rad, c ? 0.0 : a ? -180.0 : -90.0, c ? 360.0 : a ? 180.0 : 90.0);
    for (const double h : web.h_rad) {
        for (const double v : web.v_rad) {
            const Direction direction = direction_of(goniometer, Angle::radians(v), Angle::radians(h));
            web.candela.push_back(static_cast<float>(law(direction)));
        }
    }
    return web;
}

constexpr Goniometer kAll[] = {Goniometer::type_c, Goniometer::type_b, Goniometer::type_a};

TEST(IesWeb, PhotometricZeroIsMinusZ) {
    for (const Goniometer goniometer : kAll) {
        const Direction zero = direction_of(goniometer, {}, {});
        EXPECT_NEAR(zero[0], 0.0, 1e-15);
        EXPECT_NEAR(zero[1], 0.0, 1e-15);
        EXPECT_NEAR(zero[2], -1.0, 1e-15);
    }
    const Direction c90 = direction_of(Goniometer::type_c, Angle::degrees(90.0), Angle::degrees(90.0));
    EXPECT_NEAR(c90[1], 1.0, 1e-15);
    const Direction c0 = direction_of(Goniometer::type_c, Angle::degrees(90.0), {});
    EXPECT_NEAR(c0[0], 1.0, 1e-15);
    const Direction b = direction_of(Goniometer::type_b, Angle::degrees(90.0), {});
    EXPECT_NEAR(b[0], 1.0, 1e-15);
    const Direction a = direction_of(Goniometer::type_a, {}, Angle::degrees(90.0));
    EXPECT_NEAR(a[1], -1.0, 1e-15);
}

TEST(IesWeb, IntensityReturnsTheGridAtItsNodesAndTheMeanBetween) {
    // An asymmetric law, so that a swapped sign or axis shows.
    const auto law = [](const Direction& d) { return 100.0 + 20.0 * d[0] + 30.0 * d[1] + 40.0 * d[2]; };
    for (const Goniometer goniometer : kAll) {
        const PhotometricWeb web = sample(goniometer, 5.0, law);
        for (std::size_t h = 1; h + 1 < web.h_rad.size(); h += 3) {
            for (std::size_t v = 1; v + 1 < web.v_rad.size(); v += 2) {
                const Direction at =
                    direction_of(goniometer, Angle::radians(web.v_rad[v]), Angle::radians(web.h_rad[h]));
                EXPECT_NEAR(intensity(web, at).in(cd), law(at), 1e-4);
                const Direction between = direction_of(
                    goniometer, Angle::radians(0.5 * (web.v_rad[v] + web.v_rad[v + 1])), Angle::radians(web.h_rad[h]));
                EXPECT_NEAR(intensity(web, between).in(cd), 0.5 * double{web.at(h, v)} + 0.5 * double{web.at(h, v + 1)},
                            1e-3);
            }
        }
        EXPECT_NEAR(
            intensity(web, {0.6, -0.5, 7.0}).in(cd),
            law({0.6 / std::hypot(0.6, 0.5, 7.0), -0.5 / std::hypot(0.6, 0.5, 7.0), 7.0 / std::hypot(0.6, 0.5, 7.0)}),
            0.3);
    }
}

TEST(IesWeb, NothingOutsideTheMeasuredRange) {
    PhotometricWeb web;
    web.v_rad = {0.0, kPi / 2};
    web.h_rad = {0.0, 2 * kPi};
    web.candela = {10, 10, 10, 10};
    EXPECT_EQ(intensity(web, {0, 0, -1}).in(cd), 10.0);
    EXPECT_EQ(intensity(web, {1, 0, 0}).in(cd), 10.0);
    EXPECT_EQ(intensity(web, {1, 0, 0.001}).in(cd), 0.0);
    EXPECT_EQ(intensity(web, {0, 0, 1}).in(cd), 0.0);
    EXPECT_EQ(intensity(web, {0, 0, 0}).in(cd), 0.0);
    EXPECT_EQ(intensity(web, {std::nan(""), 0, 1}).in(cd), 0.0);
    EXPECT_NEAR(total_flux(web).in(lm), 2 * kPi * 10, 1e-9);
}

struct FluxCase {
    const char* name;
    std::function<double(const Direction&)> law;
    double flux_lm;
};

// The closed forms are of the continuous law; a 1 degree grid leaves the error of its chords.
TEST(IesWeb, FluxMatchesClosedFormsOnEveryGoniometer) {
    const FluxCase cases[] = {
        {"isotropic", [](const Direction&) { return 100.0; }, 4 * kPi * 100},
        {"lambertian", [](const Direction& d) { return 100.0 * std::max(0.0, -d[2]); }, kPi * 100},
        {"cos^8", [](const Direction& d) { return 100.0 * std::pow(std::max(0.0, -d[2]), 8); }, 2 * kPi * 100 / 9},
        {"sideways", [](const Direction& d) { return 100.0 * (1.0 + 0.5 * d[0] - 0.25 * d[1]); }, 4 * kPi * 100},
        {"x squared", [](const Direction& d) { return 100.0 * d[0] * d[0]; }, 4 * kPi / 3 * 100},
        {"y squared", [](const Direction& d) { return 100.0 * d[1] * d[1]; }, 4 * kPi / 3 * 100},
    };
    for (const FluxCase& item : cases) {
        for (const Goniometer goniometer : kAll) {
            const double flux = total_flux(sample(goniometer, 1.0, item.law)).in(lm);
            EXPECT_NEAR(flux, item.flux_lm, 5e-4 * item.flux_lm) << item.name << " goniometer " << int(goniometer);
        }
    }
}

TEST(IesWeb, FluxIsTheExactIntegralOfTheBilinearWeb) {
    // One cell per axis: I falls linearly from 90 at v = 0 to 0 at v = pi/2.
    // 2 pi * integral of 90 (1 - 2v/pi) sin v = 2 pi * 90 (1 - 2/pi).
    PhotometricWeb web;
    web.v_rad = {0.0, kPi / 2};
    web.h_rad = {0.0, 2 * kPi};
    web.candela = {90, 0, 90, 0};
    EXPECT_NEAR(total_flux(web).in(lm), 2 * kPi * 90 * (1 - 2 / kPi), 1e-9);
}

}  // namespace
}  // namespace gonio::ies
