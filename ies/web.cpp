#include "ies/web.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::ies {

namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

struct Bracket {
    std::size_t low = 0;
    double fraction = 0.0;
    bool inside = false;
};

// Where x falls in ascending values. The slack takes the rounding of inverse trigonometry at the ends of the range.
Bracket bracket(const std::vector<double>& values, double x) {
    constexpr double kSlackRad = 1e-9;
    if (values.size() < 2 || !(x >= values.front() - kSlackRad && x <= values.back() + kSlackRad)) return {};
    const auto above = std::upper_bound(values.begin() + 1, values.end() - 1, x);
    const auto low = static_cast<std::size_t>(above - values.begin()) - 1;
    const double fraction = (x - values[low]) / (values[low + 1] - values[low]);
    return {low, std::clamp(fraction, 0.0, 1.0), true};
}

// Integral of a linear function (y0 at a, y1 at b) times sin x over a..b; exact.
double linear_times_sin(double a, double b, double y0, double y1) {
    const double slope = (y1 - y0) / (b - a);
    return y0 * (std::cos(a) - std::cos(b)) + slope * ((std::sin(b) - std::sin(a)) - (b - a) * std::cos(b));
}

// The same times cos x.
double linear_times_cos(double a, double b, double y0, double y1) {
    const double slope = (y1 - y0) / (b - a);
    return y0 * (std::sin(b) - std::sin(a)) + slope * ((b - a) * std::sin(b) + std::cos(b) - std::cos(a));
}

}  // namespace

LuminousIntensity intensity(const PhotometricWeb& web, const Direction& direction) {
    const auto [x, y, z] = direction;
    double v = 0.0;
    double h = 0.0;
    if (x == 0.0 && y == 0.0 && z == 0.0) return {};
    switch (web.goniometer) {
        case Goniometer::type_c:
            v = std::atan2(std::hypot(x, y), -z);
            h = x == 0.0 && y == 0.0 ? 0.0 : std::atan2(y, x);
            if (h < 0.0) h += kTwoPi;
            break;
        case Goniometer::type_b:
            v = std::atan2(x, -z);
            h = std::atan2(-y, std::hypot(x, z));
            break;
        case Goniometer::type_a:
            v = std::atan2(x, std::hypot(y, z));
            h = std::atan2(-y, -z);
            break;
    }
    return intensity_at(web, Angle::radians(v), Angle::radians(h));
}

LuminousIntensity intensity_at(const PhotometricWeb& web, Angle v, Angle h) {
    const Bracket bv = bracket(web.v_rad, v.radians());
    const Bracket bh = bracket(web.h_rad, h.radians());
    if (!bv.inside || !bh.inside) return {};
    const double near_h = std::lerp(double{web.at(bh.low, bv.low)}, double{web.at(bh.low, bv.low + 1)}, bv.fraction);
    const double far_h =
        std::lerp(double{web.at(bh.low + 1, bv.low)}, double{web.at(bh.low + 1, bv.low + 1)}, bv.fraction);
    return std::lerp(near_h, far_h, bh.fraction) * cd;
}

Direction direction_of(Goniometer goniometer, Angle v_angle, Angle h_angle) {
    const double v = v_angle.radians();
    const double h = h_angle.radians();
    switch (goniometer) {
        case Goniometer::type_b:
            return {std::cos(h) * std::sin(v), -std::sin(h), -std::cos(h) * std::cos(v)};
        case Goniometer::type_a:
            return {std::sin(v), -std::cos(v) * std::sin(h), -std::cos(v) * std::cos(h)};
        case Goniometer::type_c:
            break;
    }
    return {std::sin(v) * std::cos(h), std::sin(v) * std::sin(h), -std::cos(v)};
}

LuminousIntensity peak_intensity(const PhotometricWeb& web) {
    if (web.candela.empty()) return {};
    return double{*std::max_element(web.candela.begin(), web.candela.end())} * cd;
}

LuminousFlux total_flux(const PhotometricWeb& web) {
    const std::size_t nv = web.v_rad.size();
    const std::size_t nh = web.h_rad.size();
    if (nv < 2 || nh < 2) return {};
    // Inner integral along the axis that carries no weight (trapezoid: exact for a linear function), outer one with it.
    const bool h_is_latitude = web.goniometer == Goniometer::type_b;
    const auto& plain = h_is_latitude ? web.v_rad : web.h_rad;
    const auto& weighted = h_is_latitude ? web.h_rad : web.v_rad;
    std::vector<double> inner(weighted.size(), 0.0);
    for (std::size_t j = 0; j + 1 < plain.size(); ++j) {
        const double half_step = 0.5 * (plain[j + 1] - plain[j]);
        for (std::size_t i = 0; i < weighted.size(); ++i) {
            const double sum = h_is_latitude ? double{web.at(i, j)} + double{web.at(i, j + 1)}
                                             : double{web.at(j, i)} + double{web.at(j + 1, i)};
            inner[i] += half_step * sum;
        }
    }
    const auto integral = web.goniometer == Goniometer::type_c ? linear_times_sin : linear_times_cos;
    double flux = 0.0;
    for (std::size_t i = 0; i + 1 < weighted.size(); ++i) {
        flux += integral(weighted[i], weighted[i + 1], inner[i], inner[i + 1]);
    }
    return flux * lm;
}

}  // namespace gonio::ies
