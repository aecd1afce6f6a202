#include "server/exchange/beam_web.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::gdtf {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLeastAngle_rad = 1e-4;
constexpr double kDark = 1e-5;  // of the peak: nothing is beyond
constexpr int kSteps = 256;
constexpr double kHardEdge = 1e-3;  // of an angle, within which an edge falls to nothing
// Of a pyramid: columns across half of its width, rows within its lowest side, and the least step between them, which
// lighting need not thin.
constexpr int kColumns = 64, kRows = 16;
constexpr double kLeastColumn_rad = 0.02 * kPi / 180.0, kLeastRow_rad = 0.1 * kPi / 180.0;

bool has_soft_edge(BeamType type) {
    return type == BeamType::wash || type == BeamType::pc || type == BeamType::fresnel;
}

// With a peak of 1 the web's own flux is the factor, so that what is read from it has the beam's flux.
void scale_to(ies::PhotometricWeb& web, double flux_lm) {
    const double own_lm = ies::total_flux(web).in(lm);
    const double factor = own_lm > 0.0 ? flux_lm / own_lm : 0.0;
    for (float& candela : web.candela)
        candela = static_cast<float>(std::min(static_cast<double>(candela) * factor, 1e12));
}

ies::PhotometricWeb cone(const Beam& beam, std::optional<Angle> zoom) {
    const double ratio = beam.field_angle_rad.value / beam.beam_angle_rad.value;
    const double full = zoom ? zoom->radians() : beam.beam_angle_rad.value;
    const bool around = std::max({full, beam.beam_angle_rad.value, beam.field_angle_rad.value}) > kPi;
    const double most = around ? kPi : kPi / 2.0;
    const double half = std::clamp(full / 2.0, kLeastAngle_rad, most);
    ies::PhotometricWeb web;
    web.h_rad = {0.0, 2.0 * kPi};
    std::vector<float> shape;  // of the peak
    const auto add = [&](double v, double value) {
        web.v_rad.push_back(v);
        shape.push_back(static_cast<float>(value));
    };
    if (half > kPi - 1e-9) {
        add(0.0, 1.0);
        add(kPi, 1.0);
    } else if (ratio > 1.001) {
        const double power = std::log(std::log(10.0) / std::log(2.0)) / std::log(ratio);
        const double end = std::min(most, half * std::pow(-std::log2(kDark), 1.0 / power));
        for (int i = 0; i <= kSteps; ++i) {
            const double v = end * i / kSteps;
            add(v, std::exp2(-std::pow(v / half, power)));
        }
        if (end < most) shape.back() = 0.0f;
    } else {
        double width = (has_soft_edge(beam.type.value) ? 0.2 : kHardEdge) * half;
        if (around) width = std::min(width, kPi - half);  // a cone that closes behind becomes a bulb
        const double from = half - width, to = std::min(half + width, most);
        add(0.0, 1.0);
        const int steps = has_soft_edge(beam.type.value) ? 64 : 4;
        for (int i = 0; i <= steps; ++i) {
            const double v = from + (to - from) * i / steps;
            if (to > from) add(v, 0.5 + 0.5 * std::cos(kPi * std::clamp((v - from) / (2.0 * width), 0.0, 1.0)));
        }
    }
    web.candela = shape;
    web.candela.insert(web.candela.end(), shape.begin(), shape.end());
    return web;
}

// Ascending and positive, and the same downwards.
std::vector<double> both_ways(const std::vector<double>& up) {
    std::vector<double> all;
    for (std::size_t i = up.size(); i-- > 0;) all.push_back(-up[i]);
    all.push_back(0.0);
    all.insert(all.end(), up.begin(), up.end());
    return all;
}

// A side of the width is one angle of type B; one of the height bends, so that rows follow it from column to column.
ies::PhotometricWeb pyramid(const Beam& beam, std::optional<Angle> zoom) {
    const double least = std::tan(kLeastAngle_rad), most = std::tan(kMostPyramid_deg * kPi / 180.0);
    const double given = zoom ? std::tan(std::min(zoom->radians() / 2.0, 1.5)) : 0.5 / beam.throw_ratio.value;
    const double across = std::clamp(given, least, most);  // tangents of half angles
    const double up = std::clamp(given / beam.rectangle_ratio.value, least, most);
    const double side = std::atan(across);
    const int columns = std::clamp(static_cast<int>(side / kLeastColumn_rad), 4, kColumns);
    const auto top_at = [&](double v) { return std::atan(up * std::cos(v)); };
    std::vector<double> right, above;
    for (int i = 1; i <= columns; ++i) right.push_back(std::atan(across * i / columns));
    const double lowest = top_at(side), highest = top_at(0.0);
    const int rows = std::clamp(static_cast<int>(lowest / kLeastRow_rad), 2, kRows);
    for (int i = 1; i <= rows; ++i) above.push_back(lowest * i / rows);
    for (int i = columns - 1; i > 0; --i) {
        const double top = top_at(right[static_cast<std::size_t>(i - 1)]);
        if (top - above.back() >= kLeastRow_rad && highest - top >= kLeastRow_rad) above.push_back(top);
    }
    if (highest > above.back()) above.push_back(highest);
    right.push_back(right.back() * (1.0 + kHardEdge));
    above.push_back(above.back() * (1.0 + kHardEdge));
    ies::PhotometricWeb web;
    web.goniometer = ies::Goniometer::type_b;
    web.v_rad = both_ways(right);
    web.h_rad = both_ways(above);
    for (const double h : web.h_rad)
        for (const double v : web.v_rad) {
            const bool inside = std::abs(v) <= side + 1e-12 && std::abs(h) <= top_at(v) + 1e-12;
            web.candela.push_back(inside ? static_cast<float>(std::pow(std::cos(h) * std::cos(v), -3.0)) : 0.0f);
        }
    return web;
}

ies::PhotometricWeb glow() {
    ies::PhotometricWeb web;
    web.h_rad = {0.0, 2.0 * kPi};
    for (int i = 0; i <= kSteps; ++i) web.v_rad.push_back(kPi / 2.0 * i / kSteps);
    for (std::size_t h = 0; h < web.h_rad.size(); ++h)
        for (const double v : web.v_rad) web.candela.push_back(static_cast<float>(std::max(std::cos(v), 0.0)));
    return web;
}

}  // namespace

ies::PhotometricWeb beam_web(const Beam& beam, std::optional<Angle> zoom) {
    ies::PhotometricWeb web = glows(beam.type.value)                   ? glow()
                              : beam.type.value == BeamType::rectangle ? pyramid(beam, zoom)
                                                                       : cone(beam, zoom);
    scale_to(web, beam.flux_lm.value);
    return web;
}

}  // namespace gonio::gdtf
