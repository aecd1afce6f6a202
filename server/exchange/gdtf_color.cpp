// Emitters -> colours: of their spectrum, their own colour, or their wavelength.
#include <algorithm>
#include <array>
#include <cmath>

#include "server/exchange/gdtf_parts.h"

namespace gonio::gdtf {
namespace {

using exchange::attribute_of;
using exchange::Outcome;

// CIE 1931 standard observer (ISO/CIE 11664-1) in steps of 10 nm.
constexpr double kFirst_nm = 380.0, kStep_nm = 10.0;
constexpr double kLastHue_nm = 700.0;  // beyond it the hue stays
constexpr auto kObserver = std::to_array<std::array<double, 3>>(
    {{0.001368, 0.000039, 0.006450}, {0.004243, 0.000120, 0.020050}, {0.014310, 0.000396, 0.067850},
     {0.043510, 0.001210, 0.207400}, {0.134380, 0.004000, 0.645600}, {0.283900, 0.011600, 1.385600},
     {0.348280, 0.023000, 1.747060}, {0.336200, 0.038000, 1.772110}, {0.290800, 0.060000, 1.669200},
     {0.195360, 0.090980, 1.287640}, {0.095640, 0.139020, 0.812950}, {0.032010, 0.208020, 0.465180},
     {0.004900, 0.323000, 0.272000}, {0.009300, 0.503000, 0.158200}, {0.063270, 0.710000, 0.078250},
     {0.165500, 0.862000, 0.042160}, {0.290400, 0.954000, 0.020300}, {0.433450, 0.994950, 0.008750},
     {0.594500, 0.995000, 0.003900}, {0.762100, 0.952000, 0.002100}, {0.916300, 0.870000, 0.001650},
     {1.026300, 0.757000, 0.001100}, {1.062200, 0.631000, 0.000800}, {1.002600, 0.503000, 0.000340},
     {0.854450, 0.381000, 0.000190}, {0.642400, 0.265000, 0.000050}, {0.447900, 0.175000, 0.000020},
     {0.283500, 0.107000, 0.000000}, {0.164900, 0.061000, 0.000000}, {0.087400, 0.032000, 0.000000},
     {0.046770, 0.017000, 0.000000}, {0.022700, 0.008210, 0.000000}, {0.011359, 0.004102, 0.000000},
     {0.005790, 0.002091, 0.000000}, {0.002899, 0.001047, 0.000000}, {0.001440, 0.000520, 0.000000},
     {0.000690, 0.000249, 0.000000}, {0.000332, 0.000120, 0.000000}, {0.000166, 0.000060, 0.000000},
     {0.000083, 0.000030, 0.000000}, {0.000042, 0.000015, 0.000000}});
constexpr double kLast_nm = kFirst_nm + kStep_nm * (static_cast<double>(kObserver.size()) - 1.0);

glm::dvec3 observed(double wavelength_nm) {
    if (!(wavelength_nm >= kFirst_nm && wavelength_nm <= kLast_nm)) return glm::dvec3(0.0);
    const double at = (wavelength_nm - kFirst_nm) / kStep_nm;
    const auto low = std::min(static_cast<std::size_t>(at), kObserver.size() - 2);
    const auto row = [](std::size_t i) { return glm::dvec3(kObserver[i][0], kObserver[i][1], kObserver[i][2]); };
    return glm::mix(row(low), row(low + 1), at - static_cast<double>(low));
}

std::optional<Color> color_of_sum(const glm::dvec3& sum, double luminance_percent) {
    const double whole = sum.x + sum.y + sum.z;
    if (!(whole > 0.0 && sum.y > 0.0 && std::isfinite(whole))) return std::nullopt;
    return Color{sum.x / whole, sum.y / whole, luminance_percent};
}

// Points of a measurement; between them the energy is a straight line, and sums are of the observer's own steps too.
std::optional<Color> color_of_spectrum(GdtfRead& read, const pugi::xml_node& measurement, std::string_view name) {
    std::vector<std::array<double, 2>> points;
    for (const pugi::xml_node node : measurement.children("MeasurementPoint")) {
        const auto wavelength_nm = read.number(node, "WaveLength", name), energy = read.number(node, "Energy", name);
        if (wavelength_nm && energy && *energy >= 0.0) points.push_back({*wavelength_nm, *energy});
    }
    std::ranges::sort(points);
    if (points.size() == 1) return color_of_sum(observed(points[0][0]) * points[0][1], -1.0);
    glm::dvec3 sum(0.0);
    for (std::size_t i = 1; i < points.size(); ++i) {
        const auto [begin, first] = points[i - 1];
        const auto [end, last] = points[i];
        const double from = std::max(begin, kFirst_nm), to = std::min(end, kLast_nm);
        if (!(to > from)) continue;
        const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / (0.5 * kStep_nm))));
        for (int k = 0; k < steps; ++k) {
            const double at = from + (to - from) * (k + 0.5) / steps;
            sum += observed(at) * std::lerp(first, last, (at - begin) / (end - begin)) * ((to - from) / steps);
        }
    }
    return color_of_sum(sum, -1.0);
}

struct Measured {
    std::optional<Color> color;
    double intensity_cd = 0.0;  // 0: not told
};

// Of the measurement at the greatest share of the emitter's light.
Measured measured_of(GdtfRead& read, const pugi::xml_node& emitter, std::string_view name) {
    pugi::xml_node brightest;
    double most = -1.0;
    for (const pugi::xml_node node : emitter.children("Measurement")) {
        const double share = read.number(node, "Physical", name).value_or(0.0);
        if (share <= most) continue;
        most = share;
        brightest = node;
    }
    if (!brightest) return {};
    const double intensity_cd = read.number(brightest, "LuminousIntensity", name).value_or(0.0);
    return {color_of_spectrum(read, brightest, name), intensity_cd > 0.0 && intensity_cd < 1e12 ? intensity_cd : 0.0};
}

std::optional<Color> color_of_wavelength(GdtfRead& read, const pugi::xml_node& emitter, std::string_view name) {
    const auto wavelength_nm = read.number(emitter, "DominantWaveLength", name);
    if (!wavelength_nm || !(*wavelength_nm >= kFirst_nm && *wavelength_nm <= kLast_nm)) return std::nullopt;
    return color_of_sum(observed(std::min(*wavelength_nm, kLastHue_nm)), -1.0);
}

}  // namespace

void read_emitters(GdtfRead& read, const pugi::xml_node& list) {
    std::vector<double> intensities_cd;
    for (const pugi::xml_node node : list.children("Emitter")) {
        const std::string name(attribute_of(node, "Name"));
        const Measured measured = measured_of(read, node, name);
        const auto own = noted_color(read, node, name);
        std::optional<Color> color = measured.color;
        if (color && own) color->luminance_percent = own->luminance_percent;
        if (!color) color = own;
        if (!color) color = color_of_wavelength(read, node, name);
        if (!color) read.note(Outcome::defaulted, "an emitter or filter has no colour: that of its attribute", name);
        read.type.emitters.push_back({name, color});
        intensities_cd.push_back(measured.intensity_cd);
    }
    // Measured intensities weigh emitters against each other, where all of them have one.
    double sum_cd = 0.0;
    for (const double one : intensities_cd) sum_cd += one;
    if (std::ranges::any_of(intensities_cd, [](double one) { return one <= 0.0; })) return;
    for (std::size_t i = 0; i < intensities_cd.size(); ++i)
        if (auto& color = read.type.emitters[i].color) color->luminance_percent = 100.0 * intensities_cd[i] / sum_cd;
}

}  // namespace gonio::gdtf
