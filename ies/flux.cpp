// Fluxes over parts of the sphere: zones, azimuth sectors, BUG rating.
#include <algorithm>
#include <cmath>

#include "ies/quantities.h"

namespace gonio::ies {

namespace {

// Integral of the linear function (y0 at a, y1 at b) times sin x over lo..hi within a..b.
double clipped_linear_times_sin(double a, double b, double y0, double y1, double lo, double hi) {
    const double slope = (y1 - y0) / (b - a);
    const double from = std::max(a, lo);
    const double to = std::min(b, hi);
    if (!(to > from)) return 0.0;
    const double start = y0 + slope * (from - a);
    return start * (std::cos(from) - std::cos(to)) +
           slope * ((std::sin(to) - std::sin(from)) - (to - from) * std::cos(to));
}

// Integral over h0..h1 of I(v, h) dh for each v of the grid; exact, since I is linear in h between planes.
std::vector<double> azimuth_integral(const PhotometricWeb& web, double h0, double h1) {
    std::vector<double> result(web.v_rad.size(), 0.0);
    for (std::size_t j = 0; j + 1 < web.h_rad.size(); ++j) {
        const double a = web.h_rad[j];
        const double b = web.h_rad[j + 1];
        const double from = std::max(a, h0);
        const double to = std::min(b, h1);
        if (!(to > from)) continue;
        const double middle = (0.5 * (from + to) - a) / (b - a);
        for (std::size_t i = 0; i < result.size(); ++i) {
            result[i] += (to - from) * std::lerp(double{web.at(j, i)}, double{web.at(j + 1, i)}, middle);
        }
    }
    return result;
}

double band_flux(const PhotometricWeb& web, const std::vector<double>& sector, double v0, double v1) {
    double flux = 0.0;
    for (std::size_t i = 0; i + 1 < web.v_rad.size(); ++i) {
        flux += clipped_linear_times_sin(web.v_rad[i], web.v_rad[i + 1], sector[i], sector[i + 1], v0, v1);
    }
    return flux;
}

double degrees(double value) {
    return value * kPi / 180.0;
}

// The sector of a quarter or half turn that starts at h0 (radians, any turn).
std::vector<double> sector_from(const PhotometricWeb& web, double h0, double width) {
    double begin = std::fmod(h0, 2.0 * kPi);
    if (begin < 0.0) begin += 2.0 * kPi;
    std::vector<double> sector = azimuth_integral(web, begin, std::min(begin + width, 2.0 * kPi));
    if (begin + width > 2.0 * kPi) {
        const std::vector<double> rest = azimuth_integral(web, 0.0, begin + width - 2.0 * kPi);
        for (std::size_t i = 0; i < sector.size(); ++i) sector[i] += rest[i];
    }
    return sector;
}

// The rating whose limits the flux keeps: limits are the largest lumens of ratings 0..4.
int rate(double flux, const std::array<double, 5>& limits) {
    // A file's flux is known to a few tenths of a lumen at best: "0 lm" upward means none was measured.
    constexpr double kSlackLm = 0.05;
    int rating = 0;
    while (rating < 5 && flux > limits[static_cast<std::size_t>(rating)] + kSlackLm) ++rating;
    return rating;
}

// Whether the high-angle flux is the same on all four sides (within 10 %): roadway distribution type V.
bool is_quadrilateral(const PhotometricWeb& web, double street) {
    std::array<double, 4> sides{};
    for (std::size_t i = 0; i < 4; ++i) {
        const auto sector = sector_from(web, street + degrees(90.0 * static_cast<double>(i) - 45.0), degrees(90.0));
        sides[i] = band_flux(web, sector, degrees(30.0), degrees(80.0));
    }
    const auto [low, high] = std::minmax_element(sides.begin(), sides.end());
    return *low >= 0.9 * *high;
}

// Of a step of the grid.
struct Part {
    std::size_t cell;      // the step's index
    double along, cosine;  // of the part's middle: 0..1 of the step; cos of its angle
    double weight;         // integral over it of 1, or of the cosine
};

std::vector<Part> parts_of(const std::vector<double>& angles, bool is_latitude) {
    constexpr double kWidest = kPi / 720.0;  // a quarter of a degree
    std::vector<Part> parts;
    for (std::size_t i = 0; i + 1 < angles.size(); ++i) {
        const double step = angles[i + 1] - angles[i];
        const double count = std::max(1.0, std::ceil(step / kWidest));
        for (double k = 0; k < count; ++k) {
            const double from = angles[i] + step * k / count, to = angles[i] + step * (k + 1) / count;
            parts.push_back({i, (k + 0.5) / count, std::cos(0.5 * (from + to)),
                             is_latitude ? std::sin(to) - std::sin(from) : to - from});
        }
    }
    return parts;
}

}  // namespace

PhotometricWeb as_type_c(const PhotometricWeb& web, Angle step) {
    const double wanted = std::clamp(step.degrees(), 0.25, 30.0);
    const auto rows = static_cast<std::size_t>(std::lround(180.0 / wanted));
    PhotometricWeb result;
    for (std::size_t i = 0; i <= rows; ++i)
        result.v_rad.push_back(kPi * static_cast<double>(i) / static_cast<double>(rows));
    for (std::size_t j = 0; j <= 2 * rows; ++j) {
        result.h_rad.push_back(kPi * static_cast<double>(j) / static_cast<double>(rows));
    }
    result.h_rad.back() = 2.0 * kPi;
    result.candela.reserve(result.v_rad.size() * result.h_rad.size());
    for (std::size_t j = 0; j + 1 < result.h_rad.size(); ++j) {
        for (const double v : result.v_rad) {
            const Direction direction =
                direction_of(Goniometer::type_c, Angle::radians(v), Angle::radians(result.h_rad[j]));
            result.candela.push_back(static_cast<float>(intensity(web, direction).in(cd)));
        }
    }
    for (std::size_t i = 0; i <= rows; ++i) result.candela.push_back(result.candela[i]);
    return result;
}

LuminousFlux flux_between(const PhotometricWeb& web, Angle v0, Angle v1, Angle h0, Angle h1) {
    if (web.goniometer != Goniometer::type_c || web.v_rad.size() < 2 || web.h_rad.size() < 2) return {};
    return band_flux(web, azimuth_integral(web, h0.radians(), h1.radians()), v0.radians(), v1.radians()) * lm;
}

std::vector<LuminousFlux> flux_about_zero(const PhotometricWeb& web, std::span<const Angle> angles) {
    std::vector<LuminousFlux> result(angles.size());
    if (web.goniometer == Goniometer::type_c || web.v_rad.size() < 2 || web.h_rad.size() < 2) return result;
    // dΩ = cos h dh dv (Type B), cos v dv dh (Type A); cosine from photometric zero: cos v cos h of both.
    const bool h_is_latitude = web.goniometer == Goniometer::type_b;
    const std::vector<Part> v_parts = parts_of(web.v_rad, !h_is_latitude), h_parts = parts_of(web.h_rad, h_is_latitude);
    std::vector<double> cosines;
    for (const Angle& angle : angles) cosines.push_back(std::cos(std::min(angle.radians(), kPi)));
    std::vector<double> within(angles.size(), 0.0);
    double sum = 0.0;
    for (const Part& h : h_parts) {
        for (const Part& v : v_parts) {
            const double low = std::lerp(double{web.at(h.cell, v.cell)}, double{web.at(h.cell, v.cell + 1)}, v.along),
                         high = std::lerp(double{web.at(h.cell + 1, v.cell)}, double{web.at(h.cell + 1, v.cell + 1)},
                                          v.along),
                         flux = std::lerp(low, high, h.along) * v.weight * h.weight;
            sum += flux;
            for (std::size_t i = 0; i < within.size(); ++i)
                if (v.cosine * h.cosine >= cosines[i]) within[i] += flux;
        }
    }
    const double scale = sum > 0.0 ? total_flux(web).in(lm) / sum : 0.0;
    for (std::size_t i = 0; i < within.size(); ++i) result[i] = scale * within[i] * lm;
    return result;
}

BugRating bug_rating(const PhotometricWeb& original, Angle street_side) {
    BugRating bug;
    if (original.v_rad.size() < 2 || original.h_rad.size() < 2) return bug;
    PhotometricWeb converted;
    if (original.goniometer != Goniometer::type_c) converted = as_type_c(original, Angle::degrees(0.5));
    const PhotometricWeb& web = original.goniometer == Goniometer::type_c ? original : converted;
    const double street = street_side.radians();
    const std::vector<double> front = sector_from(web, street - kPi / 2, kPi);
    const std::vector<double> back = sector_from(web, street + kPi / 2, kPi);
    const auto zone = [&](const std::vector<double>& sector, double v0_deg, double v1_deg) {
        return band_flux(web, sector, degrees(v0_deg), degrees(v1_deg)) * lm;
    };
    bug.forward_low = zone(front, 0, 30);
    bug.forward_medium = zone(front, 30, 60);
    bug.forward_high = zone(front, 60, 80);
    bug.forward_very_high = zone(front, 80, 90);
    bug.back_low = zone(back, 0, 30);
    bug.back_medium = zone(back, 30, 60);
    bug.back_high = zone(back, 60, 80);
    bug.back_very_high = zone(back, 80, 90);
    bug.up_low = zone(front, 90, 100) + zone(back, 90, 100);
    bug.up_high = zone(front, 100, 180) + zone(back, 100, 180);
    bug.quadrilateral = is_quadrilateral(web, street);

    // TM-15-11 addendum A, tables A-1 (backlight), A-2 (uplight), A-3 (glare); lumens allowed for ratings 0..4.
    constexpr std::array<double, 5> kBackHigh = {110, 500, 1000, 2500, 5000};
    constexpr std::array<double, 5> kBackMedium = {220, 1000, 2500, 5000, 8500};
    constexpr std::array<double, 5> kBackLow = {110, 500, 1000, 2500, 5000};
    constexpr std::array<double, 5> kUp = {0, 10, 50, 500, 1000};
    constexpr std::array<double, 5> kVeryHigh = {10, 100, 225, 500, 750};
    constexpr std::array<double, 5> kForwardHigh = {660, 1800, 5000, 7500, 12000};
    const auto in_lm = [](LuminousFlux flux) { return flux.in(lm); };
    bug.backlight = std::max({rate(in_lm(bug.back_high), kBackHigh), rate(in_lm(bug.back_medium), kBackMedium),
                              rate(in_lm(bug.back_low), kBackLow)});
    bug.uplight = std::max(rate(in_lm(bug.up_high), kUp), rate(in_lm(bug.up_low), kUp));
    bug.glare = std::max({rate(in_lm(bug.forward_very_high), kVeryHigh), rate(in_lm(bug.back_very_high), kVeryHigh),
                          rate(in_lm(bug.forward_high), kForwardHigh),
                          rate(in_lm(bug.back_high), bug.quadrilateral ? kForwardHigh : kBackHigh)});
    return bug;
}

}  // namespace gonio::ies
