#include "ies/eulumdat.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "ies/grid.h"
#include "ies/plausible.h"
#include "ies/quantities.h"
#include "ies/text_encoding.h"
#include "ies/text_scan.h"

namespace gonio::ies {

namespace {

using detail::error_at;
using detail::FileGrid;
using detail::NumberStatus;
using detail::Report;

constexpr int kMaxLampSets = 1000;  // the format says 20

// The file's lines in order. The format has one value per line, in a fixed order.
struct Lines {
    std::string_view text;
    Report& report;
    detail::Encoding encoding = detail::Encoding::utf8;
    std::size_t at = 0;
    std::size_t begin = 0;  // of the last line

    bool next(std::string_view& line) {
        begin = at;
        if (at >= text.size()) return false;
        line = detail::trim(detail::take_line(text, at));
        return true;
    }

    // A line of text; empty at the end of the file (the numbers that follow report the truncation).
    std::string name() {
        std::string_view line;
        return next(line) ? detail::to_utf8(line, encoding) : std::string{};
    }

    // The number on the next line. An empty line counts as 0, a comma as the decimal point.
    NumberStatus parse(double& value, std::string_view& line) {
        value = 0.0;
        if (!next(line)) return NumberStatus::end;
        if (line.empty()) {
            report.warn("empty_number", begin, "a line without its number counts as 0");
            return NumberStatus::ok;
        }
        const auto [stop, status] = std::from_chars(line.data(), line.data() + line.size(), value);
        if (status == std::errc{} && stop == line.data() + line.size() && std::isfinite(value)) return NumberStatus::ok;
        std::string copy(line.substr(0, 64));
        if (line.size() > copy.size()) return NumberStatus::not_a_number;
        if (std::count(copy.begin(), copy.end(), ',') == 1) {
            report.warn("decimal_comma", begin, "numbers are written with a decimal comma");
            std::replace(copy.begin(), copy.end(), ',', '.');
        }
        detail::NumberStream stream{copy};
        const NumberStatus first = stream.next(value);
        double extra = 0.0;
        const bool alone = first == NumberStatus::ok && stream.next(extra) == NumberStatus::end;
        return first == NumberStatus::not_finite ? first : alone ? NumberStatus::ok : NumberStatus::not_a_number;
    }

    std::optional<Error> number(double& value, std::string_view what) {
        std::string_view line;
        const NumberStatus status = parse(value, line);
        if (status == NumberStatus::ok) return std::nullopt;
        return detail::number_error(text, begin, status, line, what, "one number");
    }

    std::optional<Error> integer(int& value, std::string_view what) {
        double read = 0.0;
        if (auto error = number(read, what)) return error;
        if (read != std::floor(read) || std::abs(read) > 1e9) {
            return error_at(text, begin, "not_an_integer", std::to_string(read),
                            "the " + std::string(what) + " must be a whole number");
        }
        value = static_cast<int>(read);
        return std::nullopt;
    }

    // A number that the web does not depend on: what is no number counts as 0.
    void lenient(double& value, std::string_view what) {
        std::string_view line;
        const NumberStatus status = parse(value, line);
        if (status == NumberStatus::ok) return;
        value = 0.0;
        if (status == NumberStatus::end) return;  // the numbers that follow report the truncation
        report.warn("bad_field", begin, "the " + std::string(what) + " is no number");
    }
};

struct Counts {
    int isym = 0;
    int planes = 0;         // Mc
    int gammas = 0;         // Ng
    int stored_planes = 0;  // those whose values the file holds
    std::size_t first_plane = 0;
};

// Which of the Mc planes are stored: all, one, C0-C180, C270-C90 or C0-C90.
void count_stored(Counts& counts) {
    const int all = counts.planes, half = all / 2 + 1, quarter = all / 4 + 1;
    const std::array by_isym = {all, 1, half, half, quarter};
    counts.stored_planes = std::min(by_isym[static_cast<std::size_t>(counts.isym)], all);
    if (counts.isym == 3) counts.first_plane = static_cast<std::size_t>(3 * static_cast<long>(all) / 4);
}

// The lines before the lamp sets, in their order.
std::optional<Error> read_head(Lines& lines, EulumdatFields& fields, Counts& counts, Opening& opening, double& lor) {
    fields.company = lines.name();
    double type_indicator = 0.0;
    lines.lenient(type_indicator, "type indicator");
    fields.type_indicator = static_cast<int>(std::clamp(type_indicator, 0.0, 9.0));
    if (auto error = lines.integer(counts.isym, "symmetry indicator")) return error;
    fields.isym = counts.isym;
    if (counts.isym < 0 || counts.isym > 4) {
        return error_at(lines.text, lines.begin, "bad_symmetry", std::to_string(counts.isym),
                        "the symmetry indicator must be 0 to 4");
    }
    if (auto error = lines.integer(counts.planes, "number of C-planes")) return error;
    const std::size_t planes_offset = lines.begin;
    if (counts.planes < 1) {
        return error_at(lines.text, planes_offset, "bad_count", std::to_string(counts.planes), "no C-plane");
    }
    lines.lenient(fields.plane_step_deg, "distance of the C-planes");
    if (auto error = lines.integer(counts.gammas, "number of intensities per plane")) return error;
    if (counts.gammas < 1) {
        return error_at(lines.text, lines.begin, "bad_count", std::to_string(counts.gammas), "no gamma angle");
    }
    count_stored(counts);
    if (static_cast<double>(counts.planes) * counts.gammas > static_cast<double>(kMaxGridValues)) {
        return error_at(lines.text, planes_offset, "grid_too_large", std::to_string(counts.planes),
                        "the grid has more than 4194304 values");
    }
    lines.lenient(fields.gamma_step_deg, "distance of the gamma angles");
    for (std::string* name : {&fields.report, &fields.name, &fields.number, &fields.file_name, &fields.date}) {
        *name = lines.name();
    }
    lines.lenient(fields.length_mm, "length");
    lines.lenient(fields.width_mm, "width");
    lines.lenient(fields.height_mm, "height");

    // Luminous area: length along C90-C270, which is LM-63's 0-180 plane; width 0 makes the length a diameter.
    double length = 0.0;
    double width = 0.0;
    lines.lenient(length, "luminous length");
    lines.lenient(width, "luminous width");
    double height = 0.0;
    for (const char* side : {"C0", "C90", "C180", "C270"}) {
        double value = 0.0;
        lines.lenient(value, std::string("luminous height at ") + side);
        height = std::max(height, std::abs(value));
    }
    const bool round = width == 0.0;
    const double metre = 1e-3;
    opening.length = std::abs(length) * metre * m;
    opening.width = (round ? std::abs(length) : std::abs(width)) * metre * m;
    opening.height = height * metre * m;
    if (length == 0.0 && width == 0.0 && height == 0.0) {
        opening = {};
    } else if (round) {
        opening.shape = height > 0.0 ? OpeningShape::vertical_cylinder : OpeningShape::ellipse;
    } else {
        opening.shape = height > 0.0 ? OpeningShape::box : OpeningShape::rectangle;
    }
    lines.lenient(fields.downward_flux_percent, "downward flux fraction");
    lines.lenient(lor, "light output ratio");
    fields.light_output_ratio_percent = lor;
    lines.lenient(fields.conversion_factor, "conversion factor");
    if (fields.conversion_factor != 1.0) {
        lines.report.warn("conversion_factor", lines.begin, "the conversion factor is not 1; it is not applied");
    }
    lines.lenient(fields.tilt_deg, "tilt during measurement");
    return std::nullopt;
}

std::optional<Error> read_lamp_sets(Lines& lines, EulumdatFields& fields, std::size_t wanted) {
    int count = 0;
    if (auto error = lines.integer(count, "number of lamp sets")) return error;
    const std::size_t count_offset = lines.begin;
    if (count < 1 || count > kMaxLampSets) {
        return error_at(lines.text, count_offset, "bad_count", std::to_string(count),
                        "the number of lamp sets must be 1 to 1000");
    }
    for (int i = 0; i < count; ++i) {
        LampSet set;
        double lamps = 0.0;
        lines.lenient(lamps, "number of lamps");
        set.count = static_cast<int>(std::clamp(lamps, -1e9, 1e9));
        set.type = lines.name();
        if (auto error = lines.number(set.total_lumens, "total luminous flux")) return error;
        if (static_cast<std::size_t>(i) == wanted && !(set.total_lumens > 0.0)) {
            lines.report.warn("zero_lumens", lines.begin, "the lamps' luminous flux is not positive: it is dark");
        }
        set.colour_appearance = lines.name();
        set.colour_rendering = lines.name();
        lines.lenient(set.watts, "wattage");
        fields.lamp_sets.push_back(std::move(set));
    }
    if (wanted >= fields.lamp_sets.size()) {
        return error_at(lines.text, count_offset, "no_such_lamp_set", std::to_string(wanted),
                        "the file has fewer lamp sets");
    }
    if (count > 1) lines.report.note("lamp_sets", count_offset, "the file has several lamp sets");
    fields.lamp_set = wanted;
    for (double& ratio : fields.direct_ratios) lines.lenient(ratio, "direct ratio");
    return std::nullopt;
}

// C-angles, gamma angles and intensities in cd/klm.
std::optional<Error> read_grid(Lines& lines, const Counts& counts, double scale, std::vector<double>& c_deg,
                               FileGrid& grid) {
    for (int i = 0; i < counts.planes; ++i) {
        double value = 0.0;
        if (auto error = lines.number(value, "C-angle")) return error;
        if (i == 0) grid.h_offset = lines.begin;
        c_deg.push_back(value);
    }
    for (int i = 0; i < counts.gammas; ++i) {
        double value = 0.0;
        if (auto error = lines.number(value, "gamma angle")) return error;
        if (i == 0) grid.v_offset = lines.begin;
        grid.v_deg.push_back(value);
    }
    const std::size_t total = static_cast<std::size_t>(counts.stored_planes) * static_cast<std::size_t>(counts.gammas);
    bool any = false;
    for (std::size_t i = 0; i < total; ++i) {
        double value = 0.0;
        if (auto error = lines.number(value, "luminous intensity")) {
            error->message += " (number " + std::to_string(i + 1) + " of " + std::to_string(total) + ")";
            return error;
        }
        if (i == 0) grid.candela_offset = lines.begin;
        const double scaled = value * scale;
        if (!(std::abs(scaled) <= kMaxCandela)) {
            return error_at(lines.text, lines.begin, "candela_too_large", std::to_string(value), "more than 1e12 cd");
        }
        if (value < 0.0) lines.report.warn("negative_candela", lines.begin, "an intensity is negative; 0 is used");
        const double kept = value > 0.0 && scaled > 0.0 ? scaled : 0.0;
        any = any || kept > 0.0;
        grid.candela.push_back(static_cast<float>(kept));
    }
    if (!any) lines.report.warn("all_dark", grid.candela_offset, "no intensity is above 0");
    std::string_view rest;
    while (lines.next(rest)) {
        if (rest.empty() || rest == "\x1a") continue;
        lines.report.warn("trailing_data", lines.begin, "lines after the last intensity are ignored");
        break;
    }
    return std::nullopt;
}

// Offset of the index-th line from offset.
std::size_t line_from(std::string_view text, std::size_t offset, std::size_t index) {
    for (std::size_t i = 0; i < index && offset < text.size(); ++i) detail::take_line(text, offset);
    return offset;
}

// The stored planes as one full turn in LM-63's azimuth, h = C - 90 degrees; the columns keep their order.
std::optional<Error> place_planes(const Lines& lines, const Counts& counts, const std::vector<double>& c_deg,
                                  FileGrid& grid) {
    if (counts.stored_planes == 1) {
        grid.planes = {{0.0, 0}, {360.0, 0}};
        grid.symmetry = Symmetry::axial;
        return std::nullopt;
    }
    std::vector<double> angles;
    for (int i = 0; i < counts.stored_planes; ++i) {
        const std::size_t index = (counts.first_plane + static_cast<std::size_t>(i)) % c_deg.size();
        double angle = c_deg[index];
        // C270 to C90 runs through C0: the first part is taken as negative.
        if (counts.first_plane != 0 && index >= counts.first_plane) angle -= 360.0;
        const bool first = angles.empty();
        if (!(angle >= -360.0 && angle <= 360.0) || (!first && !(angle - angles.back() >= 1e-6))) {
            const std::size_t place = line_from(lines.text, grid.h_offset, index);
            return error_at(lines.text, place, "angles_not_monotone", std::to_string(c_deg[index]),
                            "the C-angles do not ascend within a turn");
        }
        angles.push_back(angle);
    }
    const double wanted_first = counts.isym == 3 ? -90.0 : 0.0;
    const double wanted_span = counts.isym == 4 ? 90.0 : 180.0;
    const double span = angles.back() - angles.front();
    const auto same = [](double a, double b) { return std::abs(a - b) < 1e-3; };
    for (std::size_t i = 0; i < angles.size(); ++i) grid.planes.push_back({angles[i] - 90.0, i});
    if (counts.isym == 0) {
        if (span > 360.0 + 1e-3) {
            return error_at(lines.text, grid.h_offset, "angles_not_monotone", std::to_string(span),
                            "the C-angles span more than a turn");
        }
        if (!same(span, 360.0)) grid.planes.push_back({grid.planes.front().deg + 360.0, 0});
        detail::snap_ends(grid.planes, grid.planes.front().deg, grid.planes.front().deg + 360.0);
        grid.symmetry = Symmetry::none;
    } else if (same(span, wanted_span) && same(angles.front(), wanted_first)) {
        detail::snap_ends(grid.planes, wanted_first - 90.0, wanted_first + wanted_span - 90.0);
        detail::mirror_about_last(grid.planes);
        if (counts.isym == 4) detail::mirror_about_last(grid.planes);
        // Symmetric about C0-C180 is about 90-270 in LM-63's azimuth and the other way round; the names are the file's.
        grid.symmetry = counts.isym == 2   ? Symmetry::bilateral_0_180
                        : counts.isym == 3 ? Symmetry::bilateral_90_270
                                           : Symmetry::quadrant;
    } else {
        return error_at(lines.text, grid.h_offset, "angles_not_monotone", std::to_string(span),
                        "the stored C-planes do not span what the symmetry indicator says");
    }
    return std::nullopt;
}

void cross_check(const Photometry& photometry, LuminousFlux total, const EulumdatFields& fields, double rated_lumens,
                 Report& report) {
    constexpr double kTolerancePercent = 3.0;
    const double flux = total.in(lm);
    if (!(rated_lumens > 0.0) || !(flux > 0.0)) return;
    const double lor = 100.0 * flux / rated_lumens;
    if (std::abs(lor - fields.light_output_ratio_percent) > kTolerancePercent) {
        report.warn("lorl_mismatch", 0, "the light output ratio of the file is not what its intensities give");
    }
    const LuminousFlux down = flux_between(photometry.web, {}, Angle::degrees(90.0), {}, Angle::degrees(360.0));
    const double dff = 100.0 * down.in(lm) / flux;
    if (std::abs(dff - fields.downward_flux_percent) > kTolerancePercent) {
        report.warn("dff_mismatch", 0, "the downward flux fraction of the file is not what its intensities give");
    }
}

Provenance make_provenance(const EulumdatFields& fields, const Counts& counts) {
    const LampSet& set = fields.lamp_sets[fields.lamp_set];
    Provenance p;
    p.format = "EULUMDAT";
    p.multiplier = set.total_lumens / 1000.0;
    p.scale = p.multiplier;
    p.absolute = set.count < 0;
    p.lamps = std::abs(set.count);
    p.lumens_per_lamp = p.absolute ? -1.0 : set.total_lumens / std::max(1, p.lamps);
    p.rated_lumens = p.absolute ? 0.0 : set.total_lumens;
    p.input_watts = set.watts;
    p.zero_plane_rad = Angle::degrees(270.0).radians();
    p.file_vertical_angles = counts.gammas;
    p.file_horizontal_angles = counts.stored_planes;
    for (const auto& [key, value] : {std::pair<const char*, const std::string&>{"MANUFAC", fields.company},
                                     {"LUMINAIRE", fields.name},
                                     {"LUMCAT", fields.number},
                                     {"TEST", fields.report},
                                     {"ISSUEDATE", fields.date},
                                     {"LAMP", set.type},
                                     {"_COLORTEMP", set.colour_appearance},
                                     {"_CRI", set.colour_rendering}}) {
        if (!value.empty()) p.keywords.emplace_back(key, value);
    }
    return p;
}

Result<Photometry> read_text(std::string_view text, std::size_t lamp_set, bool was_utf16) {
    Report report(text);
    if (was_utf16) report.warn("utf16", 0, "the file is UTF-16");
    if (detail::trim(text).empty()) return error_at(text, 0, "empty_file", {}, "the file is empty");
    Lines lines{text, report, detail::guess_encoding(text)};
    if (lines.encoding == detail::Encoding::code_page_850) report.note("code_page", 0, "names are in code page 850");

    Photometry result;
    EulumdatFields fields;
    Counts counts;
    double lor = 0.0;
    if (auto error = read_head(lines, fields, counts, result.opening, lor)) return *error;
    if (auto error = read_lamp_sets(lines, fields, lamp_set)) return *error;
    result.provenance = make_provenance(fields, counts);

    FileGrid grid;
    std::vector<double> c_deg;
    if (auto error = read_grid(lines, counts, result.provenance.scale, c_deg, grid)) return *error;
    if (auto error = place_planes(lines, counts, c_deg, grid)) return *error;
    const std::size_t v_offset = grid.v_offset;
    const std::vector<double> v_deg = grid.v_deg;
    detail::Unfolded unfolded = unfold(std::move(grid), report);
    if (unfolded.fault) {
        const std::size_t place = line_from(text, v_offset, unfolded.fault->index);
        return error_at(text, place, unfolded.fault->code, std::to_string(v_deg[unfolded.fault->index]),
                        "gamma: " + unfolded.fault->message);
    }
    result.web = std::move(unfolded.web);
    result.provenance.symmetry = unfolded.symmetry;
    const LuminousFlux total = total_flux(result.web);
    cross_check(result, total, fields, fields.lamp_sets[lamp_set].total_lumens, report);
    detail::check_plausible(result, total, 0, report);
    result.eulumdat = std::move(fields);
    result.diagnostics = report.take();
    return result;
}

bool is_whole_number(std::string_view line, double low, double high) {
    detail::NumberStream stream{line};
    double value = 0.0;
    double extra = 0.0;
    return stream.next(value) == NumberStatus::ok && stream.next(extra) == NumberStatus::end && value >= low &&
           value <= high && value == std::floor(value);
}

}  // namespace

bool looks_like_eulumdat(std::string_view text) {
    std::array<std::string_view, 6> lines;
    std::size_t at = 0;
    for (std::string_view& line : lines) {
        if (at >= text.size()) return false;
        line = detail::trim(detail::take_line(text, at)).substr(0, 64);
    }
    return is_whole_number(lines[1], 0, 9) && is_whole_number(lines[2], -9, 9) &&
           is_whole_number(lines[3], -1e9, 1e9) && is_whole_number(lines[5], -1e9, 1e9);
}

Result<Photometry> read_eulumdat(std::string_view text, std::size_t lamp_set) {
    if (text.size() > kMaxFileBytes) {
        return Error{"too_large", "byte " + std::to_string(kMaxFileBytes), std::to_string(text.size()),
                     "the file is larger than 64 MiB"};
    }
    const std::string decoded = detail::decode_utf16(text);
    if (!decoded.empty()) return read_text(decoded, lamp_set, true);
    return read_text(detail::without_mark(text), lamp_set, false);
}

}  // namespace gonio::ies
