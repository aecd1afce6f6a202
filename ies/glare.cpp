#include "ies/glare.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/glare_tables.h"
#include "ies/quantities.h"

namespace gonio::ies {
namespace {

using std::numbers::pi;

constexpr double kHeight_m = 2.0;       // CIE 190: luminaires above the eye
constexpr double kMostGammaDeg = 85.0;  // beyond it the tabular method counts none
constexpr double kTableStep = 0.1;      // of T/R and H/R
constexpr double kLeastSpacing = 0.1, kMostSpacing = 2.0;
constexpr Angle kWebStep = Angle::degrees(1.0);  // of webs of Types A and B as Type C
constexpr double kSymmetric = 0.01;              // of the peak: what mirrored directions may differ by

// Fluxes of CIE 190's multipliers, from photometric zero: to 40 degrees with 0.130 of the zone from there to 50, to 60,
// to 70 with 0.547 of the zone from there to 80, to 90.
std::array<LuminousFlux, 4> cumulative_fluxes(const Quantities& q) {
    constexpr double kPartOfFifth = 0.130, kPartOfEighth = 0.547;
    const auto until = [&](std::size_t zones) {
        LuminousFlux sum;
        for (std::size_t i = 0; i < zones; ++i) sum = sum + q.zonal[i];
        return sum;
    };
    return {until(4) + q.zonal[4] * kPartOfFifth, until(6), until(7) + q.zonal[7] * kPartOfEighth, until(9)};
}

// Σ L² ω / p², (cd/m²)² sr, over the luminaires of a room; view: azimuth in which the observer is, seen from a
// luminaire straight ahead.
double sum_of_sources(const Photometry& photometry, const detail::BackgroundFactors& room, double spacing, Angle view) {
    const auto count = [&](double side) { return std::max(1, static_cast<int>(std::lround(side / spacing))); };
    const int across = count(room.x_h), along = count(room.y_h);
    double sum = 0.0;
    for (int j = 0; j < along; ++j) {
        for (int i = 0; i < across; ++i) {
            const double r = (j + 0.5) * spacing, t = (i + 0.5 - 0.5 * across) * spacing;  // in heights
            const std::optional<double> p = position_index(std::abs(t) / r, 1.0 / r);
            const double horizontal = std::hypot(r, t), gamma = std::atan(horizontal);
            if (!p || gamma > kMostGammaDeg * pi / 180.0) continue;
            const double azimuth = view.radians() + std::atan2(t, r);
            const Direction to_eye = {std::sin(gamma) * std::cos(azimuth), std::sin(gamma) * std::sin(azimuth),
                                      -std::cos(gamma)};
            const double area = projected_area(photometry.opening, to_eye).in(m * m);
            if (area <= 0.0) continue;
            const double intensity_cd = intensity(photometry.web, to_eye).in(cd);
            const double distance_m = kHeight_m * std::hypot(1.0, horizontal);
            sum += intensity_cd * intensity_cd / (area * distance_m * distance_m) / (*p * *p);
        }
    }
    return sum;
}

std::optional<double> rating(double background_nit, double sum) {
    if (background_nit <= 0.0 || sum <= 0.0) return std::nullopt;
    return 8.0 * std::log10(0.25 / background_nit * sum);
}

// Whether the web is the same, mirrored about both planes.
bool is_regular(const PhotometricWeb& web, LuminousIntensity peak) {
    for (int v = 5; v < 90; v += 5) {
        for (int h = 0; h < 90; h += 5) {
            const auto at = [&](int azimuth) {
                return intensity_at(web, Angle::degrees(v), Angle::degrees(azimuth)).in(cd);
            };
            const double first = at(h);
            for (const int mirrored : {180 - h, 180 + h, (360 - h) % 360})
                if (std::abs(at(mirrored) - first) > kSymmetric * peak.in(cd)) return false;
        }
    }
    return true;
}

}  // namespace

std::optional<double> position_index(double t_over_r, double h_over_r) {
    const auto& table = detail::kPositionIndex;
    const double t = t_over_r / kTableStep, h = h_over_r / kTableStep;
    constexpr double kRounding = 1e-9;  // 1.9 / 0.1 is a little above 19
    if (!(t <= static_cast<double>(table.size() - 1) + kRounding) ||
        !(h <= static_cast<double>(table[0].size() - 1) + kRounding) || t < 0.0 || h < 0.0)
        return std::nullopt;
    const auto row = std::min(static_cast<std::size_t>(t), table.size() - 2);
    const auto column = std::min(static_cast<std::size_t>(h), table[0].size() - 2);
    const double a = t - static_cast<double>(row), b = h - static_cast<double>(column);
    double p = 0.0;
    for (const std::size_t i : {0u, 1u}) {
        for (const std::size_t j : {0u, 1u}) {
            const double weight = (i ? a : 1.0 - a) * (j ? b : 1.0 - b);
            const double value = table[row + i][column + j];
            if (weight <= kRounding) continue;
            if (value == 0.0) return std::nullopt;
            p += weight * value;
        }
    }
    return p;
}

std::optional<double> unified_glare_rating(Luminance background, std::span<const GlareSource> sources) {
    double sum = 0.0;
    for (const GlareSource& source : sources) {
        const double luminance_nit = source.luminance.in(nit), p = source.position_index;
        sum += luminance_nit * luminance_nit * source.solid_angle.in(sr) / (p * p);
    }
    return rating(background.in(nit), sum);
}

Result<GlareTable> glare_table(const Photometry& photometry, double spacing_to_height) {
    if (!(spacing_to_height >= kLeastSpacing && spacing_to_height <= kMostSpacing))
        return Error{"out_of_range", "spacing", print_number(spacing_to_height),
                     "The spacing is a share of the height, 0.1 to 2."};
    if (photometry.opening.shape == OpeningShape::point)
        return Error{"no_opening", "luminous opening", "point",
                     "Without a luminous opening the luminance, and so the UGR, is not defined."};
    Photometry luminaire = photometry;
    if (luminaire.web.goniometer != Goniometer::type_c) luminaire.web = as_type_c(luminaire.web, kWebStep);
    const Quantities q = quantities(luminaire);
    if (q.total.in(lm) <= 0.0) return Error{"all_dark", "intensities", "0", "The luminaire gives no light."};

    const std::array<LuminousFlux, 4> fluxes = cumulative_fluxes(q);
    // The length lies along h = 0 and 180 degrees (ies/README.md): it is seen crosswise from h = 90 or 270.
    const Angle crosswise = Angle::degrees(270.0), endwise = Angle::degrees(0.0);
    GlareTable table;
    table.spacing_to_height = spacing_to_height;
    table.regular = is_regular(luminaire.web, q.peak);
    for (const detail::BackgroundFactors& room : detail::kBackgroundFactors) {
        const double luminaires = room.x_h * room.y_h / (spacing_to_height * spacing_to_height);
        const double walls_m2 = 2.0 * kHeight_m * kHeight_m * (room.x_h + room.y_h);
        LuminousFlux on_floor;
        for (std::size_t i = 0; i < fluxes.size(); ++i) on_floor = on_floor + fluxes[i] * room.cumulative[i];
        const LuminousFlux on_walls = q.downward - on_floor;
        const double across = sum_of_sources(luminaire, room, spacing_to_height, crosswise);
        const double along = sum_of_sources(luminaire, room, spacing_to_height, endwise);
        GlareTable::Row row{room.x_h, room.y_h, {}, {}, {}};
        for (std::size_t i = 0; i < room.sets.size(); ++i) {
            const auto& factor = room.sets[i];
            const LuminousFlux reflected =
                on_floor * factor.floor + on_walls * factor.wall + q.upward * factor.ceiling;  // from the walls
            const double background_nit = luminaires / walls_m2 * reflected.in(lm) / pi;
            row.background[i] = background_nit * nit;
            row.crosswise[i] = rating(background_nit, across);
            row.endwise[i] = rating(background_nit, along);
        }
        table.rows.push_back(row);
    }
    return table;
}

}  // namespace gonio::ies
