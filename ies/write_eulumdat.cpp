#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "ies/direct_ratios.h"
#include "ies/fold.h"
#include "ies/keyword.h"
#include "ies/quantities.h"
#include "ies/writers.h"

namespace gonio::ies {

namespace {
constexpr double kMillimetre = 1e-3;

struct Writer {
    std::string text;

    void name(std::string_view value) {
        detail::append_line(text, value);
        text += "\r\n";
    }
    void number(double value) {
        detail::append_number(text, value);
        text += "\r\n";
    }
    // Nine digits: more than a float holds, so that cd/klm times the flux gives the same float again.
    void intensity(double value) {
        std::array<char, 32> buffer{};
        const auto end =
            std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 9).ptr;
        text.append(buffer.data(), end);
        text += "\r\n";
    }
};

// The web turned to EULUMDAT's azimuth, C = h + 90 degrees, with a plane at C0; 0 and 360 hold the same values.
PhotometricWeb turn_to_c(const PhotometricWeb& web) {
    constexpr double kSameRad = 1e-9;
    constexpr double kCut = 1.5 * kPi;
    if (detail::fold(web).symmetry == Symmetry::axial) return web;
    const std::size_t nv = web.v_rad.size();
    PhotometricWeb result;
    result.v_rad = web.v_rad;
    const auto add = [&](double azimuth, std::size_t h) {
        result.h_rad.push_back(azimuth);
        const auto column = detail::column(web, h);
        result.candela.insert(result.candela.end(), column.begin(), column.end());
    };
    std::size_t first = 0;
    while (web.h_rad[first] < kCut - kSameRad) ++first;
    if (std::abs(web.h_rad[first] - kCut) <= kSameRad) {
        add(0.0, first);
        ++first;
    } else {
        const double fraction = (kCut - web.h_rad[first - 1]) / (web.h_rad[first] - web.h_rad[first - 1]);
        result.h_rad.push_back(0.0);
        for (std::size_t v = 0; v < nv; ++v) {
            result.candela.push_back(
                static_cast<float>(std::lerp(double{web.at(first - 1, v)}, double{web.at(first, v)}, fraction)));
        }
    }
    for (std::size_t h = first; h + 1 < web.h_rad.size(); ++h) add(web.h_rad[h] - kCut, h);
    for (std::size_t h = 0; web.h_rad[h] < kCut - kSameRad; ++h) add(web.h_rad[h] + kPi / 2, h);
    result.h_rad.push_back(2.0 * kPi);
    for (std::size_t v = 0; v < nv; ++v) result.candela.push_back(result.candela[v]);
    return result;
}

struct Layout {
    int isym = 0;
    std::vector<std::size_t> stored;  // columns in file order
};

// The symmetry indicator whose stored planes are where EULUMDAT's fixed counts of Mc put them; 0 where they are not.
Layout choose_layout(const PhotometricWeb& web) {
    const std::size_t mc = web.h_rad.size() - 1;
    const detail::FoldedPlanes folded = detail::fold(web);
    Layout all;
    for (std::size_t i = 0; i < mc; ++i) all.stored.push_back(i);
    const auto count_is = [&](std::size_t expected) { return folded.columns.size() == expected; };
    switch (folded.symmetry) {
        case Symmetry::axial:
            return {1, {0}};
        case Symmetry::quadrant:
            return count_is(mc / 4 + 1) ? Layout{4, folded.columns} : all;
        case Symmetry::bilateral_0_180:
            return count_is(mc / 2 + 1) ? Layout{2, folded.columns} : all;
        case Symmetry::bilateral_90_270: {
            // Stored from C270 through C0 to C90; the fold names the other half, which is the mirror image.
            const std::size_t first = 3 * mc / 4;
            const bool regular = count_is(mc / 2 + 1) && std::abs(web.h_rad[first] - 1.5 * kPi) < 1e-9;
            if (!regular) return all;
            Layout layout{3, {}};
            for (std::size_t i = 0; i <= mc / 2; ++i) layout.stored.push_back((first + i) % mc);
            return layout;
        }
        default:
            return all;
    }
}

// The common step of ascending angles in degrees; 0 if there is none.
double common_step(const std::vector<double>& angles) {
    if (angles.size() < 2) return 0.0;
    const double step = detail::tidy_degrees(angles[1] - angles[0]);
    for (std::size_t i = 1; i < angles.size(); ++i) {
        if (std::abs(detail::tidy_degrees(angles[i] - angles[i - 1]) - step) > 1e-6) return 0.0;
    }
    return step;
}

// What the file says beyond the web: as read from EULUMDAT, else from LM-63's keywords and opening.
EulumdatFields make_fields(const Photometry& photometry, double reference_lm) {
    if (photometry.eulumdat) return *photometry.eulumdat;
    const Provenance& provenance = photometry.provenance;
    EulumdatFields fields;
    fields.company = keyword_of(provenance, "MANUFAC");
    fields.report = keyword_of(provenance, "TEST");
    fields.name = keyword_of(provenance, "LUMINAIRE");
    fields.number = keyword_of(provenance, "LUMCAT");
    fields.date = keyword_of(provenance, "ISSUEDATE");
    fields.length_mm = photometry.opening.length.in(m) / kMillimetre;
    fields.width_mm = photometry.opening.width.in(m) / kMillimetre;
    fields.height_mm = photometry.opening.height.in(m) / kMillimetre;
    fields.type_indicator = provenance.symmetry == Symmetry::axial ? 1 : 3;
    LampSet set;
    set.count = provenance.absolute ? -1 : std::max(1, provenance.lamps);
    set.type = keyword_of(provenance, "LAMP");
    set.total_lumens = reference_lm;
    set.colour_appearance = keyword_of(provenance, "_COLORTEMP");
    set.colour_rendering = keyword_of(provenance, "_CRI");
    set.watts = provenance.input_watts;
    fields.lamp_sets = {set};
    return fields;
}

// What is computed to four digits is written with four.
std::array<double, 10> rounded(std::array<double, 10> ratios) {
    for (double& ratio : ratios) ratio = std::round(ratio * 1e4) / 1e4;
    return ratios;
}

void append_luminous_area(Writer& out, const Opening& opening) {
    const double length = opening.length.in(m) / kMillimetre;
    const double width = opening.width.in(m) / kMillimetre;
    const bool round = (opening.shape == OpeningShape::ellipse || opening.shape == OpeningShape::vertical_cylinder) &&
                       opening.length == opening.width;
    out.number(length);
    out.number(round ? 0.0 : width);
    for (int side = 0; side < 4; ++side) out.number(opening.height.in(m) / kMillimetre);
}

void append_lamp_set(Writer& out, const LampSet& set) {
    out.number(set.count);
    out.name(set.type);
    out.number(set.total_lumens);
    out.name(set.colour_appearance);
    out.name(set.colour_rendering);
    out.number(set.watts);
}

}  // namespace

std::string write_eulumdat(const Photometry& photometry) {
    const bool type_c = photometry.web.goniometer == Goniometer::type_c;
    const PhotometricWeb web = turn_to_c(type_c ? photometry.web : as_type_c(photometry.web, Angle::degrees(1.0)));
    const double flux = total_flux(web).in(lm);
    double reference_lm = photometry.provenance.rated_lumens;
    if (photometry.eulumdat) reference_lm = photometry.eulumdat->lamp_sets[photometry.eulumdat->lamp_set].total_lumens;
    if (!(reference_lm > 0.0)) reference_lm = flux > 0.0 ? flux : 1000.0;
    EulumdatFields fields = make_fields(photometry, reference_lm);
    // The set that the candela are for comes first: it is the one that readers take.
    std::rotate(fields.lamp_sets.begin(), fields.lamp_sets.begin() + static_cast<std::ptrdiff_t>(fields.lamp_set),
                fields.lamp_sets.end());
    fields.lamp_sets.front().total_lumens = reference_lm;
    const Layout layout = choose_layout(web);
    const std::size_t planes = layout.isym == 1 ? 1 : web.h_rad.size() - 1;

    Writer out;
    out.name(fields.company);
    out.number(fields.type_indicator);
    out.number(layout.isym);
    out.number(static_cast<double>(planes));
    out.number(planes > 1 ? common_step(web.h_rad) : 0.0);
    out.number(static_cast<double>(web.v_rad.size()));
    out.number(common_step(web.v_rad));
    for (const std::string& name : {fields.report, fields.name, fields.number, fields.file_name, fields.date}) {
        out.name(name);
    }
    for (const double size : {fields.length_mm, fields.width_mm, fields.height_mm}) out.number(size);
    append_luminous_area(out, photometry.opening);
    const LuminousFlux down = flux_between(web, {}, Angle::degrees(90.0), {}, Angle::degrees(360.0));
    out.number(flux > 0.0 ? 100.0 * down.in(lm) / flux : 0.0);
    out.number(100.0 * flux / reference_lm);
    out.number(1.0);
    out.number(fields.tilt_deg);
    out.number(static_cast<double>(fields.lamp_sets.size()));
    for (const LampSet& set : fields.lamp_sets) append_lamp_set(out, set);
    // A file that came without them gets them, as one that was read from another format does.
    const bool given = std::ranges::any_of(fields.direct_ratios, [](double ratio) { return ratio != 0.0; });
    const std::array<double, 10> ratios = given ? fields.direct_ratios : rounded(direct_ratios(web));
    for (const double ratio : ratios) out.number(ratio);
    for (std::size_t i = 0; i < planes; ++i) out.number(detail::tidy_degrees(web.h_rad[i]));
    for (const double gamma : web.v_rad) out.number(detail::tidy_degrees(gamma));
    for (const std::size_t h : layout.stored) {
        for (const float candela : detail::column(web, h)) out.intensity(double{candela} * 1000.0 / reference_lm);
    }
    return out.text;
}

}  // namespace gonio::ies
