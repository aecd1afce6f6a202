#include "ies/quantities.h"

#include <algorithm>
#include <cmath>

namespace gonio::ies {

namespace {

double candela_at(const PhotometricWeb& web, double v, double h) {
    return intensity(web, direction_of(Goniometer::type_c, Angle::radians(v), Angle::radians(h))).in(cd);
}

// Two luminaires at spacing s and height H: at the midpoint each arrives at theta, tan theta = s / 2H, and E of both is
// (I(theta, h) + I(theta, h + pi)) cos^3(theta) / H^2; below one luminaire it is I(0) / H^2. Four in a square: the
// centre lies at tan theta = s / (sqrt 2 H). Result: the largest s/H at which the middle is as bright as below one
// luminaire.
std::optional<double> spacing(const PhotometricWeb& web, const std::vector<double>& azimuths, double spacing_per_tan) {
    const double zero = candela_at(web, 0.0, 0.0);
    if (!(zero > 0.0)) return std::nullopt;
    const auto excess = [&](double theta) {
        double sum = 0.0;
        for (const double h : azimuths) sum += candela_at(web, theta, h);
        return sum * std::pow(std::cos(theta), 3) - zero;
    };
    constexpr int kSteps = 356;  // quarter degrees up to 89
    constexpr double kStep = kPi / 720.0;
    for (int i = kSteps; i > 0; --i) {
        double dark = i * kStep;
        double bright = dark - kStep;
        if (excess(bright) < 0.0 || excess(dark) >= 0.0) continue;
        for (int k = 0; k < 40; ++k) {
            const double middle = 0.5 * (dark + bright);
            (excess(middle) >= 0.0 ? bright : dark) = middle;
        }
        return spacing_per_tan * std::tan(bright);
    }
    return std::nullopt;
}

std::vector<LuminanceRow> luminance_rows(const Photometry& photometry) {
    std::vector<LuminanceRow> rows;
    if (photometry.opening.shape == OpeningShape::point) return rows;
    for (const double v : {0.0, 45.0, 55.0, 65.0, 75.0, 85.0}) {
        LuminanceRow row;
        row.v = Angle::degrees(v);
        for (std::size_t i = 0; i < row.at_h.size(); ++i) {
            const Angle h = Angle::degrees(45.0 * static_cast<double>(i));
            row.at_h[i] = opening_luminance(photometry, direction_of(Goniometer::type_c, row.v, h));
        }
        rows.push_back(row);
    }
    return rows;
}

// LM-63 roadway files give the street side at 0, or at 90 where they are symmetric about the 90-270 plane; EULUMDAT has
// it at C90, which is the web's 0.
Angle street_side(const Provenance& provenance) {
    const bool lm63 = provenance.zero_plane_rad == 0.0;
    const bool at_90 = lm63 && provenance.symmetry == Symmetry::bilateral_90_270;
    return at_90 ? Angle::degrees(90.0) : Angle::degrees(0.0);
}

// Result: the flux within each of these angles from photometric zero.
std::vector<LuminousFlux> fluxes_within(const PhotometricWeb& web, const std::vector<Angle>& angles) {
    if (web.goniometer != Goniometer::type_c) return flux_about_zero(web, angles);
    std::vector<LuminousFlux> within;
    for (const Angle& angle : angles) within.push_back(flux_between(web, {}, angle, {}, Angle::degrees(360.0)));
    return within;
}

}  // namespace

Area projected_area(const Opening& opening, const Direction& direction) {
    const double x = std::abs(direction[0]);
    const double y = std::abs(direction[1]);
    const double z = std::abs(direction[2]);
    const double l = opening.length.in(m);
    const double w = opening.width.in(m);
    const double h = opening.height.in(m);
    const Area square_metre = m * m;
    switch (opening.shape) {
        case OpeningShape::point:
            return {};
        case OpeningShape::rectangle:
            return l * w * z * square_metre;
        case OpeningShape::box:
            return (l * w * z + l * h * y + w * h * x) * square_metre;
        case OpeningShape::ellipse:
            return kPi / 4 * l * w * z * square_metre;
        case OpeningShape::vertical_cylinder:
            return (kPi / 4 * l * w * z + h * std::hypot(l * y, w * x)) * square_metre;
        case OpeningShape::ellipsoid:
            return kPi / 4 * std::hypot(w * h * x, l * h * y, l * w * z) * square_metre;
        case OpeningShape::horizontal_cylinder_length:
            return (kPi / 4 * w * h * x + l * std::hypot(w * z, h * y)) * square_metre;
        case OpeningShape::horizontal_cylinder_width:
            return (kPi / 4 * l * h * y + w * std::hypot(l * z, h * x)) * square_metre;
        case OpeningShape::vertical_ellipse:
            return kPi / 4 * w * h * x * square_metre;
    }
    return {};
}

std::optional<Luminance> opening_luminance(const Photometry& photometry, const Direction& direction) {
    const Area area = projected_area(photometry.opening, direction);
    // Below a square millimetre the quotient says more about rounding than about the luminaire.
    if (!(area.base() > 1e-6)) return std::nullopt;
    return intensity(photometry.web, direction) / area;
}

const char* shape_name(OpeningShape shape) {
    constexpr std::array kNames = {"point",
                                   "rectangle",
                                   "box",
                                   "ellipse",
                                   "vertical_cylinder",
                                   "ellipsoid",
                                   "horizontal_cylinder_length",
                                   "horizontal_cylinder_width",
                                   "vertical_ellipse"};
    return kNames[static_cast<std::size_t>(shape)];
}

Quantities quantities(const Photometry& photometry) {
    const PhotometricWeb& web = photometry.web;
    const Provenance& provenance = photometry.provenance;
    Quantities result;
    if (web.v_rad.size() < 2 || web.h_rad.size() < 2) return result;
    result.total = total_flux(web);

    const bool type_c = web.goniometer == Goniometer::type_c;
    PhotometricWeb converted;
    if (!type_c) {
        converted = as_type_c(web, Angle::degrees(0.5));
        const double sampled = total_flux(converted).in(lm);
        const auto correction = static_cast<float>(sampled > 0.0 ? result.total.in(lm) / sampled : 1.0);
        for (float& value : converted.candela) value *= correction;
    }
    const PhotometricWeb& zones = type_c ? web : converted;
    // Within 10, 20, … 180 degrees of photometric zero, and within the cones of CIE 52: of solid angle pi/2, pi, 3
    // pi/2.
    std::vector<Angle> angles;
    for (int i = 1; i <= 18; ++i) angles.push_back(Angle::degrees(10.0 * i));
    for (int i = 1; i <= 3; ++i) angles.push_back(Angle::radians(std::acos(1.0 - 0.25 * i)));
    const std::vector<LuminousFlux> within = fluxes_within(web, angles);
    for (std::size_t i = 0; i < result.zonal.size(); ++i)
        result.zonal[i] = i == 0 ? within[0] : within[i] - within[i - 1];
    result.downward = within[8];
    result.upward = result.total - result.downward;

    const auto peak = std::max_element(web.candela.begin(), web.candela.end());
    const auto peak_index = static_cast<std::size_t>(peak - web.candela.begin());
    result.peak = double{*peak} * cd;
    result.peak_v = Angle::radians(web.v_rad[peak_index % web.v_rad.size()]);
    result.peak_h = Angle::radians(web.h_rad[peak_index / web.v_rad.size()]);
    const double first_plane = type_c ? provenance.zero_plane_rad : kPi / 2;
    const double second_plane = type_c ? provenance.zero_plane_rad + kPi / 2 : 0.0;
    result.planes = {plane_beams(web, Angle::radians(first_plane)), plane_beams(web, Angle::radians(second_plane))};
    const PlaneBeams& lit = result.planes[result.planes[0].beam.outermost ? 0 : 1];
    result.beam = lit.beam.outermost;
    result.field = lit.field.outermost;
    result.widest_beam = std::max(result.planes[0].beam.outermost, result.planes[1].beam.outermost);
    result.widest_field = std::max(result.planes[0].field.outermost, result.planes[1].field.outermost);

    if (!provenance.absolute && provenance.rated_lumens > 0.0) {
        result.light_output_ratio = result.total.in(lm) / provenance.rated_lumens;
    }
    if (provenance.input_watts > 0.0) result.efficacy_lm_per_w = result.total.in(lm) / provenance.input_watts;
    result.spacing_criterion = {spacing(web, {0.0, kPi}, 2.0), spacing(web, {kPi / 2, 3 * kPi / 2}, 2.0),
                                spacing(web, {kPi / 4, 3 * kPi / 4, 5 * kPi / 4, 7 * kPi / 4}, std::sqrt(2.0))};

    const double down = result.downward.in(lm);
    const auto percent = [](double part, double whole) { return whole > 0.0 ? 100.0 * part / whole : 0.0; };
    for (std::size_t i = 0; i < 3; ++i) result.cie_flux_code[i] = percent(within[18 + i].in(lm), down);
    result.cie_flux_code[3] = percent(down, result.total.in(lm));
    result.cie_flux_code[4] = 100.0 * result.light_output_ratio.value_or(1.0);
    result.bug = bug_rating(zones, street_side(provenance));
    result.luminance = luminance_rows(photometry);
    return result;
}

}  // namespace gonio::ies
