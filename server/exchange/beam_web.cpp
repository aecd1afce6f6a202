#include "server/exchange/beam_web.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::gdtf {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLeastAngle_rad = 1e-4, kMostHalf_rad = kPi / 2.0;
constexpr double kDark = 1e-5;  // of the peak: nothing is beyond
constexpr int kSteps = 256;

bool has_soft_edge(BeamType type) {
    return type == BeamType::wash || type == BeamType::pc || type == BeamType::fresnel;
}

}  // namespace

ies::PhotometricWeb beam_web(const Beam& beam, std::optional<Angle> zoom) {
    const double ratio = beam.field_angle_rad.value / beam.beam_angle_rad.value;
    const double full = zoom ? zoom->radians() : beam.beam_angle_rad.value;
    const double half = std::clamp(full / 2.0, kLeastAngle_rad, kMostHalf_rad);
    ies::PhotometricWeb web;
    web.h_rad = {0.0, 2.0 * kPi};
    std::vector<double> shape;  // of the peak
    const auto add = [&](double v, double value) {
        web.v_rad.push_back(v);
        shape.push_back(value);
    };
    if (ratio > 1.001) {
        const double power = std::log(std::log(10.0) / std::log(2.0)) / std::log(ratio);
        const double end = std::min(kMostHalf_rad, half * std::pow(-std::log2(kDark), 1.0 / power));
        for (int i = 0; i <= kSteps; ++i) {
            const double v = end * i / kSteps;
            add(v, std::exp2(-std::pow(v / half, power)));
        }
        if (end < kMostHalf_rad) shape.back() = 0.0;
    } else {
        const double width = has_soft_edge(beam.type.value) ? 0.2 * half : 0.001 * half;
        const double from = half - width, to = std::min(half + width, kMostHalf_rad);
        add(0.0, 1.0);
        const int steps = has_soft_edge(beam.type.value) ? 64 : 4;
        for (int i = 0; i <= steps; ++i) {
            const double v = from + (to - from) * i / steps;
            if (to > from) add(v, 0.5 + 0.5 * std::cos(kPi * std::clamp((v - from) / (2.0 * width), 0.0, 1.0)));
        }
    }
    // With a peak of 1 the web's own flux is the factor, so that what is read from it has the beam's flux.
    web.candela.assign(shape.begin(), shape.end());
    web.candela.insert(web.candela.end(), shape.begin(), shape.end());
    const double flux_lm = ies::total_flux(web).in(lm);
    const double peak_cd = flux_lm > 0.0 ? beam.flux_lm.value / flux_lm : 0.0;
    for (std::size_t i = 0; i < web.candela.size(); ++i)
        web.candela[i] = static_cast<float>(std::min(shape[i % shape.size()] * peak_cd, 1e12));
    return web;
}

}  // namespace gonio::gdtf
