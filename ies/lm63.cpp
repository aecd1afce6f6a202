#include "ies/lm63.h"

#include <algorithm>
#include <cmath>

#include "ies/grid.h"
#include "ies/lm63_header.h"
#include "ies/opening.h"
#include "ies/plausible.h"
#include "ies/text_encoding.h"
#include "ies/text_scan.h"

namespace gonio::ies {

namespace {

using detail::error_at;
using detail::FileGrid;
using detail::Lm63Header;
using detail::NumberStatus;
using detail::NumberStream;
using detail::Report;

constexpr double kMetrePerFoot = 0.3048;

// Everything of the body but the grid: LM-63-2002 clauses 5.7-5.12, in file order.
struct BodyNumbers {
    double lamps, lumens_per_lamp, multiplier, vertical_count, horizontal_count, type, units, width, length, height;
    double ballast_factor, field12, input_watts;
    std::size_t count_offset = 0;  // where the vertical count stands
    std::size_t size_offset = 0;   // where the width stands
    std::size_t ballast_offset = 0, field12_offset = 0;
    std::string field12_text;
};

// Reads one body number or says why not; what names it in the message.
std::optional<Error> read_number(NumberStream& stream, double& value, std::string_view what) {
    const NumberStatus status = stream.next(value);
    if (status == NumberStatus::ok) return std::nullopt;
    return detail::number_error(stream.text, stream.token_begin, status, stream.token(), what, "a number");
}

// Reads a number that must be whole. "19.0" is taken with a warning, "19.5" is refused.
std::optional<Error> read_integer(NumberStream& stream, double& value, std::string_view what, Report& report) {
    if (auto error = read_number(stream, value, what)) return error;
    if (value != std::floor(value) || std::abs(value) > 1e15) {
        return error_at(stream.text, stream.token_begin, "not_an_integer", stream.token(),
                        "the " + std::string(what) + " must be a whole number");
    }
    if (stream.token().find_first_not_of("+-0123456789") != std::string_view::npos) {
        report.warn("integer_with_point", stream.token_begin, "a whole number is written with a decimal point");
    }
    return std::nullopt;
}

std::optional<Error> read_numbers(NumberStream& stream, std::size_t count, std::string_view what,
                                  std::vector<double>& values) {
    // Two bytes is the least that a number takes: a count that the file cannot hold allocates nothing.
    values.reserve(std::min(count, (stream.text.size() - stream.at) / 2 + 1));
    for (std::size_t i = 0; i < count; ++i) {
        double value = 0.0;
        if (auto error = read_number(stream, value, what)) {
            error->message += " (number " + std::to_string(i + 1) + " of " + std::to_string(count) + ")";
            return error;
        }
        values.push_back(value);
    }
    return std::nullopt;
}

// LM-63-2002 clause 5.6: lamp-to-luminaire geometry, count, angles in degrees, factors.
std::optional<Error> read_tilt_table(NumberStream& stream, Report& report, std::optional<TiltTable>& result) {
    TiltTable table;
    double geometry = 0.0;
    double count = 0.0;
    if (auto error = read_integer(stream, geometry, "lamp-to-luminaire geometry", report)) return error;
    const std::size_t geometry_offset = stream.token_begin;
    if (auto error = read_integer(stream, count, "number of tilt angles", report)) return error;
    const std::size_t count_offset = stream.token_begin;
    if (count < 0.0) {
        return error_at(stream.text, count_offset, "bad_count", stream.token(),
                        "the number of tilt angles is negative");
    }
    if (count > static_cast<double>(kMaxTiltPairs)) {
        return error_at(stream.text, count_offset, "tilt_too_long", stream.token(), "more than 10000 tilt angles");
    }
    if (geometry < 1.0 || geometry > 3.0) {
        report.warn("tilt_geometry", geometry_offset,
                    "the lamp-to-luminaire geometry is none of 1, 2, 3; 1 is assumed");
        geometry = 1.0;
    }
    const std::string_view between = stream.text.substr(geometry_offset, count_offset - geometry_offset);
    if (between.find_first_of("\r\n") == std::string_view::npos) {
        report.warn("tilt_records_joined", geometry_offset, "the records of the tilt table share a line");
    }
    const auto pairs = static_cast<std::size_t>(count);
    std::vector<double> degrees;
    const std::size_t angles_offset = stream.at;
    if (auto error = read_numbers(stream, pairs, "tilt angle", degrees)) return error;
    if (auto error = read_numbers(stream, pairs, "tilt factor", table.factor)) return error;
    for (std::size_t i = 1; i < pairs; ++i) {
        if (!(degrees[i] > degrees[i - 1])) {
            NumberStream again{stream.text, angles_offset};
            double value = 0.0;
            for (std::size_t k = 0; k <= i; ++k) again.next(value);
            return error_at(stream.text, again.token_begin, "tilt_angles_not_ascending", again.token(),
                            "the tilt angles do not ascend");
        }
    }
    for (double& factor : table.factor) {
        if (factor < 0.0) {
            report.warn("negative_tilt_factor", angles_offset, "a tilt factor is negative; 0 is used");
            factor = 0.0;
        }
    }
    if (pairs == 0) {
        report.warn("tilt_empty", count_offset, "TILT=INCLUDE without a tilt angle has no effect");
        return std::nullopt;
    }
    report.note("tilt_table", geometry_offset, "the candela change with the luminaire's tilt by the table in the file");
    table.lamp_geometry = static_cast<int>(geometry);
    for (const double angle : degrees) table.angle_rad.push_back(Angle::degrees(angle).radians());
    result = std::move(table);
    return std::nullopt;
}

std::optional<Error> read_body_numbers(NumberStream& stream, Report& report, BodyNumbers& body) {
    if (auto error = read_integer(stream, body.lamps, "number of lamps", report)) return error;
    if (auto error = read_number(stream, body.lumens_per_lamp, "lumens per lamp")) return error;
    if (auto error = read_number(stream, body.multiplier, "candela multiplier")) return error;
    if (auto error = read_integer(stream, body.vertical_count, "number of vertical angles", report)) return error;
    body.count_offset = stream.token_begin;
    if (body.vertical_count < 1.0) {
        return error_at(stream.text, stream.token_begin, "bad_count", stream.token(), "no vertical angle");
    }
    if (auto error = read_integer(stream, body.horizontal_count, "number of horizontal angles", report)) return error;
    if (body.horizontal_count < 1.0) {
        return error_at(stream.text, stream.token_begin, "bad_count", stream.token(), "no horizontal angle");
    }
    if (body.vertical_count * body.horizontal_count > static_cast<double>(kMaxGridValues)) {
        return error_at(stream.text, body.count_offset, "grid_too_large", stream.token(),
                        "the grid has more than 4194304 values");
    }
    if (auto error = read_integer(stream, body.type, "photometric type", report)) return error;
    if (body.type < 1.0 || body.type > 3.0) {
        return error_at(stream.text, stream.token_begin, "bad_type", stream.token(),
                        "the photometric type must be 1 (C), 2 (B) or 3 (A)");
    }
    if (auto error = read_integer(stream, body.units, "units type", report)) return error;
    if (auto error = read_number(stream, body.width, "opening width")) return error;
    body.size_offset = stream.token_begin;
    if (auto error = read_number(stream, body.length, "opening length")) return error;
    if (auto error = read_number(stream, body.height, "opening height")) return error;
    if (auto error = read_number(stream, body.ballast_factor, "ballast factor")) return error;
    body.ballast_offset = stream.token_begin;
    if (auto error = read_number(stream, body.field12, "twelfth number")) return error;
    body.field12_offset = stream.token_begin;
    body.field12_text = std::string(stream.token().substr(0, 16));
    return read_number(stream, body.input_watts, "input watts");
}

// LM-63-2019 table 2; the ten types differ by digits of the fraction.
bool known_file_generation_type(double value) {
    for (const double known : {1.00001, 1.0001, 1.0, 1.001, 1.01, 1.011, 1.1, 1.101, 1.11, 1.111}) {
        if (std::abs(value - known) < 5e-7) return true;
    }
    return false;
}

Provenance make_provenance(const Lm63Header& header, const BodyNumbers& body, std::size_t body_offset, Report& report) {
    Provenance p;
    p.format = "LM-63-" + std::to_string(header.year);
    p.multiplier = body.multiplier;
    p.ballast_factor = body.ballast_factor;
    p.ballast_lamp_factor = header.year <= 1991 ? body.field12 : 1.0;
    p.scale = p.multiplier * p.ballast_factor * p.ballast_lamp_factor;
    p.lumens_per_lamp = body.lumens_per_lamp;
    p.absolute = body.lumens_per_lamp <= 0.0;
    p.rated_lumens = p.absolute ? 0.0 : body.lamps * body.lumens_per_lamp;
    p.lamps = static_cast<int>(std::clamp(body.lamps, -1e9, 1e9));
    p.input_watts = body.input_watts;
    p.file_vertical_angles = static_cast<int>(body.vertical_count);
    p.file_horizontal_angles = static_cast<int>(body.horizontal_count);
    p.keywords = header.keywords;
    if (body.lamps < 1.0) report.warn("no_lamps", body_offset, "the number of lamps is not positive");
    if (body.lumens_per_lamp == 0.0) {
        report.warn("zero_lumens", body_offset, "the lumens per lamp are 0; the candela are taken as absolute");
    } else if (body.lumens_per_lamp < 0.0 && body.lumens_per_lamp != -1.0) {
        report.warn("negative_lumens", body_offset,
                    "the lumens per lamp are negative; the candela are taken as absolute");
    }
    if (!(p.scale > 0.0)) {
        report.warn("scale_not_positive", body_offset, "multiplier times ballast factors is not positive: it is dark");
    }
    if (body.input_watts <= 0.0) report.note("no_watts", body.field12_offset, "the input watts are not positive");
    if ((header.year == 1995 || header.year == 2002) && body.field12 != 1.0) {
        report.warn("future_use", body.field12_offset, "the number kept for future use is not 1; it does not scale");
    }
    if (header.year >= 2019 && !known_file_generation_type(body.field12)) {
        report.warn("file_generation_type", body.field12_offset, "no such file generation type; it does not scale");
    }
    if (header.year == 1986 && body.type == 1.0) {
        report.note("type_1_of_1986", body.count_offset, "LM-63-1986 used type 1 for Type A too; Type C is assumed");
    }
    return p;
}

// nV * nH candela, h-major, scaled. Negative ones become 0, those that no lamp reaches are refused.
std::optional<Error> read_candela(NumberStream& stream, std::size_t count, double scale, Report& report,
                                  std::vector<float>& candela) {
    candela.reserve(std::min(count, (stream.text.size() - stream.at) / 2 + 1));
    bool any = false;
    for (std::size_t i = 0; i < count; ++i) {
        double value = 0.0;
        if (auto error = read_number(stream, value, "candela value")) {
            error->message += " (number " + std::to_string(i + 1) + " of " + std::to_string(count) + ")";
            return error;
        }
        const double scaled = value * scale;
        if (!(std::abs(scaled) <= kMaxCandela)) {
            return error_at(stream.text, stream.token_begin, "candela_too_large", stream.token(),
                            "more than 1e12 cd, with the multiplier and the ballast factor");
        }
        if (value < 0.0) {
            report.warn("negative_candela", stream.token_begin, "a candela value is negative; 0 is used");
        }
        const double kept = value > 0.0 && scaled > 0.0 ? scaled : 0.0;
        any = any || kept > 0.0;
        candela.push_back(static_cast<float>(kept));
    }
    if (!any) report.warn("all_dark", stream.token_begin, "no candela value is above 0");
    return std::nullopt;
}

// The file ends three candela values early, and what stands where ballast factor, twelfth number and input watts belong
// begins as vertical angles do.
bool lacks_ballast_line(const BodyNumbers& body, std::size_t missing_candela) {
    const double first = std::abs(body.ballast_factor);
    return missing_candela == 3 && (first == 0.0 || first == 90.0) && body.ballast_factor < body.field12 &&
           body.field12 < body.input_watts;
}

// A comma directly between two digits of one line that elsewhere separates by blanks: "22,5 45 67,5".
bool looks_like_decimal_comma(std::string_view numbers) {
    std::size_t at = 0;
    while (at < numbers.size()) {
        const std::string_view line = detail::trim(detail::take_line(numbers, at));
        const bool blanks = line.find_first_of(" \t") != std::string_view::npos;
        for (std::size_t i = 1; blanks && i + 1 < line.size(); ++i) {
            const auto digit = [&](std::size_t k) { return line[k] >= '0' && line[k] <= '9'; };
            if (line[i] == ',' && digit(i - 1) && digit(i + 1)) return true;
        }
    }
    return false;
}

// What follows the last candela value. Harmless as a rule; with a sign that the grid was misread it is an error.
std::optional<Error> check_trailing(NumberStream& stream, std::size_t body_offset, bool irregular_h, Report& report) {
    double value = 0.0;
    const NumberStatus status = stream.next(value);
    if (status == NumberStatus::end) return std::nullopt;
    const std::string_view read = stream.text.substr(body_offset, stream.token_begin - body_offset);
    if (looks_like_decimal_comma(read)) {
        return error_at(stream.text, stream.token_begin, "decimal_comma", stream.token(),
                        "more numbers than the grid takes, and commas inside numbers: LM-63 commas separate");
    }
    if (status == NumberStatus::ok && irregular_h) {
        return error_at(stream.text, stream.token_begin, "trailing_data", stream.token(),
                        "numbers are left over and the horizontal angles span no allowed range");
    }
    report.warn("trailing_data", stream.token_begin, "text after the last candela value is ignored");
    return std::nullopt;
}

void report_number_styles(const NumberStream& stream, std::size_t begin, std::size_t end, Report& report) {
    const std::string_view numbers = stream.text.substr(begin, end - begin);
    const std::size_t exponent = std::min(numbers.find('e'), numbers.find('E'));
    if (exponent != std::string_view::npos) {
        report.warn("scientific_notation", begin + exponent, "numbers are written with an exponent");
    }
    if (stream.fortran) report.warn("fortran_exponent", begin, "numbers are written with Fortran's D exponent");
    const std::size_t semicolon = numbers.find(';');
    if (semicolon != std::string_view::npos) {
        report.warn("semicolon", begin + semicolon, "semicolons are taken as separators");
    }
}

// Where the index-th angle of the list at offset stands, for a fault found after the numbers were read.
Error angle_error(std::string_view text, std::size_t offset, const detail::GridFault& fault) {
    NumberStream stream{text, offset};
    double value = 0.0;
    for (std::size_t i = 0; i <= fault.index; ++i) stream.next(value);
    return error_at(text, stream.token_begin, fault.code, stream.token(),
                    (fault.vertical ? "vertical: " : "horizontal: ") + fault.message);
}

Result<Photometry> read_text(std::string_view text, bool was_utf16) {
    Report report(text);
    if (was_utf16) report.warn("utf16", 0, "the file is UTF-16");
    Result<Lm63Header> header = read_lm63_header(text, report);
    if (!header) return header.error();
    const detail::Encoding encoding = detail::guess_encoding(text.substr(0, header->body_offset));
    for (auto& [key, value] : header->keywords) {
        key = detail::to_utf8(key, encoding);
        value = detail::to_utf8(value, encoding);
    }

    Photometry result;
    NumberStream stream{text, header->body_offset};
    if (header->tilt == detail::TiltKind::include) {
        if (auto error = read_tilt_table(stream, report, result.tilt)) return *error;
    }
    const std::size_t body_offset = stream.at;
    BodyNumbers body{};
    if (auto error = read_body_numbers(stream, report, body)) return *error;
    result.provenance = make_provenance(*header, body, body_offset, report);
    if (header->year >= 2019) result.file_generation_type = body.field12_text;
    if (body.units == 1.0 || body.units == 2.0) {
        const double metre = body.units == 1.0 ? kMetrePerFoot : 1.0;
        result.opening = detail::decode_opening(header->year, body.width * metre, body.length * metre,
                                                body.height * metre, body.size_offset, report);
    } else {
        report.warn("unknown_units", body.size_offset,
                    "the units are neither feet (1) nor metres (2); opening unknown");
    }

    FileGrid grid;
    grid.goniometer = static_cast<Goniometer>(static_cast<int>(body.type) - 1);  // in the order of LM-63's numbers
    const auto nv = static_cast<std::size_t>(body.vertical_count);
    const auto nh = static_cast<std::size_t>(body.horizontal_count);
    grid.v_offset = stream.at;
    if (auto error = read_numbers(stream, nv, "vertical angle", grid.v_deg)) return *error;
    grid.h_offset = stream.at;
    if (auto error = read_numbers(stream, nh, "horizontal angle", grid.h_deg)) return *error;
    grid.candela_offset = stream.at;
    if (auto error = read_candela(stream, nv * nh, result.provenance.scale, report, grid.candela)) {
        if (!lacks_ballast_line(body, nv * nh - grid.candela.size())) return *error;
        return error_at(text, body.ballast_offset, "missing_ballast_line", "",
                        "the line of ballast factor, twelfth number and input watts is missing: angles stand there");
    }
    report_number_styles(stream, body_offset, stream.at, report);

    const std::size_t v_offset = grid.v_offset, h_offset = grid.h_offset;
    detail::Unfolded unfolded = unfold(std::move(grid), report);
    if (unfolded.fault) return angle_error(text, unfolded.fault->vertical ? v_offset : h_offset, *unfolded.fault);
    if (auto error = check_trailing(stream, body_offset, unfolded.irregular_h, report)) return *error;
    result.web = std::move(unfolded.web);
    result.provenance.symmetry = unfolded.symmetry;
    detail::check_plausible(result, total_flux(result.web), body_offset, report);
    result.diagnostics = report.take();
    return result;
}

}  // namespace

double tilt_factor(const TiltTable& table, Angle tilt) {
    const auto& angles = table.angle_rad;
    if (angles.empty() || angles.size() != table.factor.size()) return 1.0;
    const double t = std::abs(tilt.radians());
    const auto above = std::upper_bound(angles.begin(), angles.end(), t);
    if (above == angles.begin()) return table.factor.front();
    if (above == angles.end()) return table.factor.back();
    const auto i = static_cast<std::size_t>(above - angles.begin());
    return std::lerp(table.factor[i - 1], table.factor[i], (t - angles[i - 1]) / (angles[i] - angles[i - 1]));
}

Result<Photometry> read_lm63(std::string_view text) {
    if (text.size() > kMaxFileBytes) {
        return Error{"too_large", "byte " + std::to_string(kMaxFileBytes), std::to_string(text.size()),
                     "the file is larger than 64 MiB"};
    }
    const std::string decoded = detail::decode_utf16(text);
    if (!decoded.empty()) return read_text(decoded, true);
    return read_text(detail::without_mark(text), false);
}

}  // namespace gonio::ies
