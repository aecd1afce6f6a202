// Beam and field angles: where the intensity along one plane falls to a fraction of a reference.
#include <algorithm>
#include <cmath>

#include "ies/quantities.h"

namespace gonio::ies {

namespace {

struct Sample {
    double t = 0.0;  // radians from photometric zero; negative on the far side
    double candela = 0.0;
};

// Index and fraction of x among ascending values, clamped to the ends.
std::pair<std::size_t, double> locate(const std::vector<double>& values, double x) {
    const auto above = std::upper_bound(values.begin() + 1, values.end() - 1, x);
    const auto low = static_cast<std::size_t>(above - values.begin()) - 1;
    return {low, std::clamp((x - values[low]) / (values[low + 1] - values[low]), 0.0, 1.0)};
}

bool covers(const std::vector<double>& values, double x) {
    return values.front() <= x && x <= values.back();
}

// I along one line of the grid, at the grid's own samples: between them it is linear, so that crossings are exact.
std::vector<Sample> profile(const PhotometricWeb& web, double h) {
    std::vector<Sample> samples;
    const auto column = [&](double azimuth, double side) {
        const auto [low, fraction] = locate(web.h_rad, azimuth);
        std::vector<Sample> half;
        for (std::size_t i = 0; i < web.v_rad.size(); ++i) {
            half.push_back(
                {side * web.v_rad[i], std::lerp(double{web.at(low, i)}, double{web.at(low + 1, i)}, fraction)});
        }
        return half;
    };
    if (web.goniometer == Goniometer::type_c) {
        samples = column(std::fmod(h + kPi, 2.0 * kPi), -1.0);
        std::reverse(samples.begin(), samples.end());
        const std::vector<Sample> near = column(h, 1.0);
        samples.insert(samples.end(), near.begin(), near.end());
    } else if (h < kPi / 4) {
        if (covers(web.h_rad, 0.0)) samples = column(0.0, 1.0);
    } else if (covers(web.v_rad, 0.0)) {
        const auto [low, fraction] = locate(web.v_rad, 0.0);
        for (std::size_t j = 0; j < web.h_rad.size(); ++j) {
            samples.push_back({web.h_rad[j], std::lerp(double{web.at(j, low)}, double{web.at(j, low + 1)}, fraction)});
        }
    }
    return samples;
}

// The profile of the same light turned over: measured from the direction opposite to photometric zero, which both of
// its ends are.
std::vector<Sample> turned_over(const std::vector<Sample>& samples) {
    std::vector<Sample> result;
    for (const double side : {-1.0, 1.0}) {
        const std::size_t begin = result.size();
        for (const Sample& sample : samples)
            if (side * sample.t >= 0.0) result.push_back({side * kPi - sample.t, sample.candela});
        std::reverse(result.begin() + static_cast<std::ptrdiff_t>(begin), result.end());
    }
    return result;
}

// The part of the profile in the hemisphere of photometric zero, cut exactly at +-90 degrees.
std::vector<Sample> front_hemisphere(const std::vector<Sample>& samples) {
    std::vector<Sample> result;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Sample& a = samples[i > 0 ? i - 1 : 0];
        const Sample& b = samples[i];
        for (const double cut : {-kPi / 2, kPi / 2})
            if (a.t < cut && cut < b.t)
                result.push_back({cut, std::lerp(a.candela, b.candela, (cut - a.t) / (b.t - a.t))});
        if (std::abs(b.t) <= kPi / 2 + 1e-12) result.push_back(b);
    }
    return result;
}

double crossing(const Sample& above, const Sample& below, double threshold) {
    if (above.candela == below.candela) return above.t;
    return std::lerp(above.t, below.t, (above.candela - threshold) / (above.candela - below.candela));
}

// From a sample at or above the threshold, step by step to where the profile first falls below it.
template <typename Step>
double edge_from(const std::vector<Sample>& samples, std::size_t start, double threshold, Step next) {
    std::size_t i = start;
    while (true) {
        const std::size_t j = next(i);
        if (j >= samples.size()) return samples[i].t;
        if (samples[j].candela < threshold) return crossing(samples[i], samples[j], threshold);
        i = j;
    }
}

const auto kUp = [](std::size_t i) { return i + 1; };
const auto kDown = [](std::size_t i) { return i - 1; };  // wraps to the largest value below 0

Angle lobe_around(const std::vector<Sample>& samples, std::size_t start, double threshold) {
    return Angle::radians(edge_from(samples, start, threshold, kUp) - edge_from(samples, start, threshold, kDown));
}

Angle outermost(const std::vector<Sample>& samples, double threshold) {
    const auto bright = [&](const Sample& sample) { return sample.candela >= threshold; };
    const auto first = std::find_if(samples.begin(), samples.end(), bright);
    const auto last = std::find_if(samples.rbegin(), samples.rend(), bright);
    const auto first_index = static_cast<std::size_t>(first - samples.begin());
    const auto last_index = samples.size() - 1 - static_cast<std::size_t>(last - samples.rbegin());
    return Angle::radians(edge_from(samples, last_index, threshold, kUp) -
                          edge_from(samples, first_index, threshold, kDown));
}

}  // namespace

PlaneBeams plane_beams(const PhotometricWeb& web, Angle h) {
    PlaneBeams result;
    if (web.v_rad.size() < 2 || web.h_rad.size() < 2) return result;
    std::vector<Sample> samples = profile(web, std::fmod(h.radians(), 2.0 * kPi));
    const auto dimmer = [](const Sample& a, const Sample& b) { return a.candela < b.candela; };
    if (samples.empty()) return result;
    auto peak = std::max_element(samples.begin(), samples.end(), dimmer);
    if (!(peak->candela > 0.0)) return result;
    if (std::abs(peak->t) > kPi / 2 + 1e-12) samples = turned_over(samples);
    samples = front_hemisphere(samples);
    peak = std::max_element(samples.begin(), samples.end(), dimmer);
    const auto peak_index = static_cast<std::size_t>(peak - samples.begin());
    const auto zero = std::min_element(samples.begin(), samples.end(),
                                       [](const Sample& a, const Sample& b) { return std::abs(a.t) < std::abs(b.t); });
    const auto zero_index = static_cast<std::size_t>(zero - samples.begin());
    const double maximum = peak->candela;
    result.peak = maximum * cd;
    const auto angles = [&](double fraction) {
        BeamAngles found;
        found.outermost = outermost(samples, fraction * maximum);
        found.lobe = lobe_around(samples, peak_index, fraction * maximum);
        if (samples[zero_index].candela > 0.0 && std::abs(samples[zero_index].t) < 1e-9) {
            found.centre = lobe_around(samples, zero_index, fraction * samples[zero_index].candela);
        }
        return found;
    };
    result.beam = angles(0.5);
    result.field = angles(0.1);
    return result;
}

}  // namespace gonio::ies
