#include "client/cli/photometry.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "ies/curves.h"
#include "ies/glare.h"
#include "ies/lamp_colour.h"
#include "ies/photometry_file.h"
#include "ies/quantities.h"
#include "protocol/schema/upload_name.h"

namespace gonio {

namespace {

using Json = nlohmann::ordered_json;
using ies::Photometry;
using ies::Quantities;

// The shortest decimal that names the same float: 1028.2, not 1028.199951171875.
double shortest_decimal(double value) {
    std::array<char, 64> buffer{};
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), static_cast<float>(value)).ptr;
    std::from_chars(buffer.data(), end, value);
    return value;
}

// Angles for people and scripts: without the rounding noise of radians.
double tidy_degrees(Angle angle) {
    return std::round(angle.degrees() * 1e6) / 1e6;
}

Json degrees_or_null(const std::optional<Angle>& angle) {
    return angle ? Json(tidy_degrees(*angle)) : Json(nullptr);
}
Json number_or_null(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

const char* type_name(ies::Goniometer goniometer) {
    constexpr std::array kNames = {"C", "B", "A"};
    return kNames[static_cast<std::size_t>(goniometer)];
}

const char* symmetry_name(ies::Symmetry symmetry) {
    constexpr std::array kNames = {"axial", "quadrant", "bilateral_0_180", "bilateral_90_270", "none", "lateral"};
    return kNames[static_cast<std::size_t>(symmetry)];
}

std::array<std::string, 2> plane_names(const Photometry& photometry) {
    if (photometry.web.goniometer == ies::Goniometer::type_c) return {"C0-C180", "C90-C270"};
    return {"V=0", "H=0"};
}

std::string bug_text(const ies::BugRating& bug) {
    return "B" + std::to_string(bug.backlight) + "-U" + std::to_string(bug.uplight) + "-G" + std::to_string(bug.glare);
}

Json beam_json(const ies::BeamAngles& angles) {
    return {{"outermost", degrees_or_null(angles.outermost)},
            {"lobe", degrees_or_null(angles.lobe)},
            {"centre", degrees_or_null(angles.centre)}};
}

Json bug_json(const ies::BugRating& bug) {
    return {{"rating", bug_text(bug)},
            {"type_v", bug.quadrilateral},
            {"zones_lm",
             {{"FL", bug.forward_low.in(lm)},
              {"FM", bug.forward_medium.in(lm)},
              {"FH", bug.forward_high.in(lm)},
              {"FVH", bug.forward_very_high.in(lm)},
              {"BL", bug.back_low.in(lm)},
              {"BM", bug.back_medium.in(lm)},
              {"BH", bug.back_high.in(lm)},
              {"BVH", bug.back_very_high.in(lm)},
              {"UL", bug.up_low.in(lm)},
              {"UH", bug.up_high.in(lm)}}}};
}

Json luminance_json(const std::vector<ies::LuminanceRow>& rows) {
    Json result = Json::array();
    for (const ies::LuminanceRow& row : rows) {
        Json values = Json::array();
        for (const auto& value : row.at_h) values.push_back(value ? Json(value->in(nit)) : Json(nullptr));
        result.push_back({{"v_deg", tidy_degrees(row.v)}, {"h0_h45_h90_cd_m2", values}});
    }
    return result;
}

Json provenance_json(const Photometry& photometry) {
    const ies::Provenance& p = photometry.provenance;
    Json keywords = Json::array();
    for (const auto& [key, value] : p.keywords) keywords.push_back({key, value});
    Json result = {{"format", p.format},
                   {"scale", p.scale},
                   {"multiplier", p.multiplier},
                   {"ballast_factor", p.ballast_factor},
                   {"ballast_lamp_factor", p.ballast_lamp_factor},
                   {"lamps", p.lamps},
                   {"lumens_per_lamp", p.lumens_per_lamp},
                   {"rated_lm", p.rated_lumens},
                   {"input_w", p.input_watts},
                   {"keywords", keywords}};
    if (!photometry.file_generation_type.empty()) result["file_generation_type"] = photometry.file_generation_type;
    if (photometry.tilt) {
        Json angles = Json::array();
        for (const double angle : photometry.tilt->angle_rad) angles.push_back(tidy_degrees(Angle::radians(angle)));
        result["tilt"] = {{"lamp_geometry", photometry.tilt->lamp_geometry},
                          {"angles_deg", angles},
                          {"factors", photometry.tilt->factor}};
    }
    return result;
}

Json diagnostics_json(const std::vector<ies::Diagnostic>& diagnostics) {
    Json result = Json::array();
    for (const ies::Diagnostic& d : diagnostics) {
        result.push_back({{"code", d.code},
                          {"severity", d.severity},
                          {"line", d.line},
                          {"column", d.column},
                          {"message", d.message}});
    }
    return result;
}

Json colour_json(const ies::LampColour& colour) {
    return {{"cct_k", number_or_null(colour.cct_k)},
            {"cri", number_or_null(colour.cri)},
            {"cri_is_least", colour.cri_is_least}};
}

Json file_json(const std::string& file, const Photometry& photometry) {
    const Quantities q = ies::quantities(photometry);
    const auto names = plane_names(photometry);
    Json planes = Json::array();
    for (std::size_t i = 0; i < q.planes.size(); ++i) {
        planes.push_back({{"plane", names[i]},
                          {"peak_cd", shortest_decimal(q.planes[i].peak.in(cd))},
                          {"beam_deg", beam_json(q.planes[i].beam)},
                          {"field_deg", beam_json(q.planes[i].field)}});
    }
    Json zonal = Json::array();
    for (const LuminousFlux& flux : q.zonal) zonal.push_back(flux.in(lm));
    const ies::Opening& opening = photometry.opening;
    return {{"file", file},
            {"type", type_name(photometry.web.goniometer)},
            {"symmetry", symmetry_name(photometry.provenance.symmetry)},
            {"n_vertical", photometry.provenance.file_vertical_angles},
            {"n_horizontal", photometry.provenance.file_horizontal_angles},
            {"absolute", photometry.provenance.absolute},
            {"radiometric", photometry.provenance.radiometric},
            {"max_cd", shortest_decimal(q.peak.in(cd))},
            {"max_direction_deg", {{"v", tidy_degrees(q.peak_v)}, {"h", tidy_degrees(q.peak_h)}}},
            {"flux_lm", q.total.in(lm)},
            {"flux_down_lm", q.downward.in(lm)},
            {"flux_up_lm", q.upward.in(lm)},
            {"zonal_10deg_lm", zonal},
            {"beam_deg", degrees_or_null(q.beam)},
            {"field_deg", degrees_or_null(q.field)},
            {"widest_beam_deg", degrees_or_null(q.widest_beam)},
            {"widest_field_deg", degrees_or_null(q.widest_field)},
            {"planes", planes},
            {"light_output_ratio", number_or_null(q.light_output_ratio)},
            {"efficacy_lm_per_w", number_or_null(q.efficacy_lm_per_w)},
            {"colour", colour_json(ies::lamp_colour(photometry))},
            {"spacing_criterion",
             {{"h0_h180", number_or_null(q.spacing_criterion[0])},
              {"h90_h270", number_or_null(q.spacing_criterion[1])},
              {"diagonal", number_or_null(q.spacing_criterion[2])}}},
            {"cie_flux_code", q.cie_flux_code},
            {"bug", bug_json(q.bug)},
            {"opening",
             {{"shape", ies::shape_name(opening.shape)},
              {"width_m", opening.width.in(m)},
              {"length_m", opening.length.in(m)},
              {"height_m", opening.height.in(m)}}},
            {"luminance", luminance_json(q.luminance)},
            {"provenance", provenance_json(photometry)},
            {"diagnostics", diagnostics_json(photometry.diagnostics)}};
}

Json ratings_json(const std::array<std::optional<double>, 5>& ratings) {
    Json result = Json::array();
    for (const std::optional<double>& rating : ratings) result.push_back(number_or_null(rating));
    return result;
}

Json glare_json(const ies::GlareTable& table) {
    Json rows = Json::array();
    for (const ies::GlareTable::Row& row : table.rows) {
        Json background = Json::array();
        for (const Luminance& luminance : row.background) background.push_back(luminance.in(nit));
        rows.push_back({{"x_h", row.x_h},
                        {"y_h", row.y_h},
                        {"background_cd_m2", background},
                        {"crosswise", ratings_json(row.crosswise)},
                        {"endwise", ratings_json(row.endwise)}});
    }
    return {{"spacing_to_height", table.spacing_to_height},
            {"regular", table.regular},
            {"ceiling_walls_floor_percent", ies::kGlareReflectances},
            {"rows", rows}};
}

// "line 12 column 7", "product.xml line 12 column 7" -> 12; 0 where the place is no line.
int line_of(std::string_view where) {
    constexpr std::string_view kLine = "line ";
    int line = 0;
    const std::size_t at = where.rfind(kLine);
    if (at != std::string_view::npos) {
        std::from_chars(where.data() + at + kLine.size(), where.data() + where.size(), line);
    }
    return line;
}

Json error_json(const std::string& file, const Error& error) {
    return {
        {"file", file},
        {"error", {{"code", error.code}, {"where", error.where}, {"value", error.value}, {"message", error.message}}},
        {"diagnostics",
         {{{"code", error.code}, {"severity", "error"}, {"line", line_of(error.where)}, {"message", error.message}}}}};
}

template <typename... Values>
std::string format_text(const char* format, Values... values) {
    std::array<char, 512> buffer{};
    const int length = std::snprintf(buffer.data(), buffer.size(), format, values...);
    return {buffer.data(), static_cast<std::size_t>(std::clamp(length, 0, static_cast<int>(buffer.size()) - 1))};
}

std::string angle_text(const std::optional<Angle>& angle) {
    return angle ? format_text("%.1f", angle->degrees()) : std::string("-");
}

void print_text(const std::string& file, const Photometry& photometry, std::ostream& out) {
    const Quantities q = ies::quantities(photometry);
    const ies::Provenance& p = photometry.provenance;
    const auto names = plane_names(photometry);
    out << file << '\n';
    out << format_text("  %s, type %s, %s, %d x %d angles, %s%s\n", p.format.c_str(),
                       type_name(photometry.web.goniometer), symmetry_name(p.symmetry), p.file_vertical_angles,
                       p.file_horizontal_angles, p.absolute ? "absolute" : "relative",
                       p.radiometric ? ", radiometric: W/sr, read as cd" : "");
    out << format_text("  scale %g = multiplier %g x ballast %g x ballast-lamp %g\n", p.scale, p.multiplier,
                       p.ballast_factor, p.ballast_lamp_factor);
    out << format_text("  flux %.2f lm (down %.2f, up %.2f), peak %g cd at V %g H %g\n", q.total.in(lm),
                       q.downward.in(lm), q.upward.in(lm), shortest_decimal(q.peak.in(cd)), tidy_degrees(q.peak_v),
                       tidy_degrees(q.peak_h));
    for (std::size_t i = 0; i < q.planes.size(); ++i) {
        const auto& plane = q.planes[i];
        out << format_text("  %-8s beam 50 %%: %s outermost, %s lobe, %s centre; field 10 %%: %s, %s, %s degrees\n",
                           names[i].c_str(), angle_text(plane.beam.outermost).c_str(),
                           angle_text(plane.beam.lobe).c_str(), angle_text(plane.beam.centre).c_str(),
                           angle_text(plane.field.outermost).c_str(), angle_text(plane.field.lobe).c_str(),
                           angle_text(plane.field.centre).c_str());
    }
    if (q.light_output_ratio)
        out << format_text("  light output ratio %.3f of %g lm\n", *q.light_output_ratio, p.rated_lumens);
    if (q.efficacy_lm_per_w) out << format_text("  efficacy %.1f lm/W at %g W\n", *q.efficacy_lm_per_w, p.input_watts);
    if (const ies::LampColour colour = ies::lamp_colour(photometry); colour.cct_k || colour.cri) {
        std::string text;
        if (colour.cct_k) text = format_text("colour temperature %g K", *colour.cct_k);
        if (colour.cri)
            text += format_text("%sCRI %s%g", text.empty() ? "" : ", ", colour.cri_is_least ? "at least " : "",
                                *colour.cri);
        out << "  " << text << '\n';
    }
    const auto spacing = [&](std::size_t i) {
        return q.spacing_criterion[i] ? format_text("%.2f", *q.spacing_criterion[i]) : std::string("-");
    };
    out << format_text("  spacing criterion %s, %s, diagonal %s; CIE flux code %.0f %.0f %.0f %.0f %.0f; BUG %s\n",
                       spacing(0).c_str(), spacing(1).c_str(), spacing(2).c_str(), q.cie_flux_code[0],
                       q.cie_flux_code[1], q.cie_flux_code[2], q.cie_flux_code[3], q.cie_flux_code[4],
                       bug_text(q.bug).c_str());
    const ies::Opening& opening = photometry.opening;
    out << format_text("  opening %s, width %g m, length %g m, height %g m\n", ies::shape_name(opening.shape),
                       opening.width.in(m), opening.length.in(m), opening.height.in(m));
    for (const ies::Diagnostic& d : photometry.diagnostics) {
        out << "  " << d.severity << " " << d.code << ", line " << d.line << ": " << d.message << '\n';
    }
    out << ies::curves_text(photometry) << '\n';
}

void print_glare(const ies::GlareTable& table, std::ostream& out) {
    out << format_text(
        "  UGR (CIE 190), spacing %g of the height%s\n", table.spacing_to_height,
        table.regular ? "" : "; the light is not mirrored about both planes: for this way of hanging only");
    out << "  ceiling/walls/floor, %:  crosswise";
    out << format_text("%*s endwise\n", 31, "");
    out << "      room   ";
    for (int way = 0; way < 2; ++way) {
        for (const auto& set : ies::kGlareReflectances) out << format_text(" %d/%d/%d", set[0], set[1], set[2]);
        out << "  ";
    }
    out << '\n';
    for (const ies::GlareTable::Row& row : table.rows) {
        out << format_text("  %3gH x %2gH  ", row.x_h, row.y_h);
        for (const auto* ratings : {&row.crosswise, &row.endwise}) {
            for (const std::optional<double>& rating : *ratings)
                out << (rating ? format_text("%9.1f", *rating) : std::string("        -"));
            out << "  ";
        }
        out << '\n';
    }
}

// The bytes of a stream, at most one more than any reader takes: enough for it to refuse the file by its size.
std::string read_bounded(std::istream& stream) {
    std::string bytes;
    std::array<char, 65536> chunk{};
    while (bytes.size() <= ies::kMaxFileBytes) {
        stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
        if (stream.gcount() == 0) break;
        bytes.append(chunk.data(), static_cast<std::size_t>(stream.gcount()));
    }
    return bytes;
}

// A file that is of another format than its name says is read all the same; other programs may not.
void compare_ending(const std::string& file, Photometry& photometry) {
    struct Ending {
        const char* ending;
        const char* format;
    };
    constexpr Ending kEndings[] = {
        {".ies", "LM-63"}, {".ldt", "EULUMDAT"}, {".xml", "TM-33"}, {".iesxml", "TM-33"}, {".gldf", "GLDF"}};
    const std::string ending = ending_of(file);
    const auto* const said = std::ranges::find(kEndings, ending, &Ending::ending);
    const std::string& format = photometry.provenance.format;
    if (said == std::end(kEndings) || format.starts_with(said->format)) return;
    photometry.diagnostics.insert(
        photometry.diagnostics.begin(),
        {"other_ending", "warning", 0, 0,
         "the name ends in " + ending + ", but the file is " + format + "; other programs may refuse it by this name"});
}

}  // namespace

Result<Photometry> read_photometric_file(const std::string& file, const ies::Choice& choice) {
    if (file == "-") return ies::read_photometry(read_bounded(std::cin), choice);
    std::ifstream stream(file, std::ios::binary);
    if (stream.is_open()) {
        const std::string bytes = read_bounded(stream);
        if (!stream.bad()) {
            auto read = ies::read_photometry(bytes, choice);
            if (read) compare_ending(file, *read);
            return read;
        }
    }
    return Error{"unreadable", file, {}, "the file cannot be read"};
}

int run_photometry(std::span<const std::string> files, PhotometryFormat format, std::ostream& out, std::ostream& err,
                   std::optional<double> ugr_spacing, const ies::Choice& choice) {
    if (files.empty()) return 2;
    bool refused = false;
    Json list = Json::array();
    std::string drawings;
    int drawn = 0;
    for (const std::string& file : files) {
        const auto refuse = [&](const Error& error) {
            refused = true;
            if (format == PhotometryFormat::json) {
                list.push_back(error_json(file, error));
            } else {
                err << file << ": " << error.text() << '\n';
            }
        };
        const Result<Photometry> photometry = read_photometric_file(file, choice);
        std::optional<Result<ies::GlareTable>> glare;
        if (photometry && ugr_spacing) glare = ies::glare_table(*photometry, *ugr_spacing);
        if (!photometry || (glare && !*glare)) {
            refuse(photometry ? glare->error() : photometry.error());
            continue;
        }
        if (format == PhotometryFormat::json) {
            list.push_back(file_json(file, *photometry));
            if (glare) list.back()["ugr"] = glare_json(**glare);
        } else if (format == PhotometryFormat::text) {
            print_text(file, *photometry, out);
            if (glare) print_glare(**glare, out);
        } else {
            drawings += "<g transform=\"translate(0," + std::to_string(drawn * ies::kCurvesHeight) + ")\">\n" +
                        ies::curves_svg(*photometry, file.substr(file.find_last_of('/') + 1)) + "</g>\n";
            ++drawn;
        }
    }
    if (format == PhotometryFormat::json) {
        // File names may hold any bytes; what is not UTF-8 is replaced.
        const Json& printed = files.size() == 1 ? list.front() : list;
        out << printed.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else if (format == PhotometryFormat::svg) {
        out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << ies::kCurvesWidth << "\" height=\""
            << std::max(1, drawn) * ies::kCurvesHeight << "\">\n"
            << drawings << "</svg>\n";
    }
    return refused ? 1 : 0;
}

}  // namespace gonio
