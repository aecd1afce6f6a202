// Beam and field angles: where the intensity along one plane falls to a fraction of a reference.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/quantities.h"

namespace gonio::ies {

namespace {

constexpr double kPi = std::numbers::pi;

struct Node {
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

// I along one line of the grid, at the grid's own nodes: between them it is linear, so that crossings are exact.
std::vector<Node> profile(const PhotometricWeb& web, double h) {
    std::vector<Node> nodes;
    const auto column = [&](double azimuth, double side) {
        const auto [low, fraction] = locate(web.h_rad, azimuth);
        std::vector<Node> half;
        for (std::size_t i = 0; i < web.v_rad.size(); ++i) {
            half.push_back(
                {side * web.v_rad[i], std::lerp(double{web.at(low, i)}, double{web.at(low + 1, i)}, fraction)});
        }
        return half;
    };
    if (web.goniometer == Goniometer::type_c) {
        nodes = column(std::fmod(h + kPi, 2.0 * kPi), -1.0);
        std::reverse(nodes.begin(), nodes.end());
        const std::vector<Node> near = column(h, 1.0);
        nodes.insert(nodes.end(), near.begin(), near.end());
    } else if (h < kPi / 4) {
        if (covers(web.h_rad, 0.0)) nodes = column(0.0, 1.0);
    } else if (covers(web.v_rad, 0.0)) {
        const auto [low, fraction] = locate(web.v_rad, 0.0);
        for (std::size_t j = 0; j < web.h_rad.size(); ++j) {
            nodes.push_back({web.h_rad[j], std::lerp(double{web.at(j, low)}, double{web.at(j, low + 1)}, fraction)});
        }
    }
    return nodes;
}

// The part of the profile in the hemisphere of photometric zero, cut exactly at +-90 degrees.
std::vector<Node> front_hemisphere(const std::vector<Node>& nodes) {
    std::vector<Node> result;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (i > 0) {
            for (const double cut : {-kPi / 2, kPi / 2}) {
                const Node& a = nodes[i - 1];
                const Node& b = nodes[i];
                if (a.t < cut && cut < b.t) {
                    result.push_back({cut, std::lerp(a.candela, b.candela, (cut - a.t) / (b.t - a.t))});
                }
            }
        }
        if (std::abs(nodes[i].t) <= kPi / 2 + 1e-12) result.push_back(nodes[i]);
    }
    return result;
}

double crossing(const Node& above, const Node& below, double threshold) {
    if (above.candela == below.candela) return above.t;
    return std::lerp(above.t, below.t, (above.candela - threshold) / (above.candela - below.candela));
}

// From a node at or above the threshold, step by step to where the profile first falls below it.
template <typename Step>
double edge_from(const std::vector<Node>& nodes, std::size_t start, double threshold, Step next) {
    std::size_t i = start;
    while (true) {
        const std::size_t j = next(i);
        if (j >= nodes.size()) return nodes[i].t;
        if (nodes[j].candela < threshold) return crossing(nodes[i], nodes[j], threshold);
        i = j;
    }
}

const auto kUp = [](std::size_t i) { return i + 1; };
const auto kDown = [](std::size_t i) { return i - 1; };  // wraps to the largest value below 0

Angle lobe_around(const std::vector<Node>& nodes, std::size_t start, double threshold) {
    return Angle::radians(edge_from(nodes, start, threshold, kUp) - edge_from(nodes, start, threshold, kDown));
}

Angle outermost(const std::vector<Node>& nodes, double threshold) {
    const auto bright = [&](const Node& node) { return node.candela >= threshold; };
    const auto first = std::find_if(nodes.begin(), nodes.end(), bright);
    const auto last = std::find_if(nodes.rbegin(), nodes.rend(), bright);
    const auto first_index = static_cast<std::size_t>(first - nodes.begin());
    const auto last_index = nodes.size() - 1 - static_cast<std::size_t>(last - nodes.rbegin());
    return Angle::radians(edge_from(nodes, last_index, threshold, kUp) -
                          edge_from(nodes, first_index, threshold, kDown));
}

}  // namespace

PlaneBeams plane_beams(const PhotometricWeb& web, Angle h) {
    PlaneBeams result;
    if (web.v_rad.size() < 2 || web.h_rad.size() < 2) return result;
    std::vector<Node> nodes = profile(web, std::fmod(h.radians(), 2.0 * kPi));
    const auto dimmer = [](const Node& a, const Node& b) { return a.candela < b.candela; };
    if (nodes.empty()) return result;
    auto peak = std::max_element(nodes.begin(), nodes.end(), dimmer);
    if (!(peak->candela > 0.0)) return result;
    if (std::abs(peak->t) <= kPi / 2 + 1e-12) {
        nodes = front_hemisphere(nodes);
        peak = std::max_element(nodes.begin(), nodes.end(), dimmer);
    }
    const auto peak_index = static_cast<std::size_t>(peak - nodes.begin());
    const auto zero = std::min_element(nodes.begin(), nodes.end(),
                                       [](const Node& a, const Node& b) { return std::abs(a.t) < std::abs(b.t); });
    const auto zero_index = static_cast<std::size_t>(zero - nodes.begin());
    const double maximum = peak->candela;
    result.peak = maximum * cd;
    const auto angles = [&](double fraction) {
        BeamAngles found;
        found.outermost = outermost(nodes, fraction * maximum);
        found.lobe = lobe_around(nodes, peak_index, fraction * maximum);
        if (nodes[zero_index].candela > 0.0 && std::abs(nodes[zero_index].t) < 1e-9) {
            found.centre = lobe_around(nodes, zero_index, fraction * nodes[zero_index].candela);
        }
        return found;
    };
    result.beam = angles(0.5);
    result.field = angles(0.1);
    return result;
}

}  // namespace gonio::ies
