#include <algorithm>
#include <array>
#include <cmath>
#include <pugixml.hpp>

#include "ies/grid.h"
#include "ies/text_scan.h"
#include "ies/tm33_parts.h"
#include "ies/xml_text.h"

namespace gonio::ies::detail {

namespace {

using pugi::xml_node;
using OptionalError = std::optional<Error>;

// The schema's names were scanned as "CIE _ C": blanks do not count.
std::string without_blanks(std::string_view text) {
    std::string result;
    for (const char c : text)
        if (c != ' ' && c != '_') result.push_back(c);
    return to_upper(result);
}

struct Point {
    double h = 0.0;
    double v = 0.0;
    double value = 0.0;
    std::size_t offset = 0;
};

OptionalError read_points(const Tm33Document& document, const xml_node& data, std::vector<Point>& points) {
    for (const xml_node& element : data.children()) {
        const std::string_view name = element.name();
        if (name != "IntData" && name != "IntensityData") continue;
        if (points.size() == kMaxGridValues)
            return error_at(document.text, offset_of(element), "grid_too_large", {},
                            "the grid has more than 4194304 values");
        Point point;
        point.offset = offset_of(element);
        for (const auto& [names, angle] : {std::pair{std::array{"h", "horz", "horizontal"}, &point.h},
                                           std::pair{std::array{"v", "vert", "vertical"}, &point.v}}) {
            pugi::xml_attribute attribute;
            for (const char* spelling : names)
                if (!attribute) attribute = element.attribute(spelling);
            if (!attribute)
                return error_at(document.text, point.offset, "missing_angle", names[0],
                                "an intensity has no horizontal or no vertical angle");
            if (auto error = read_number(document.text, element, attribute.value(), names[0], *angle)) return error;
        }
        if (auto error = read_number(document.text, element, element.child_value(), name, point.value)) return error;
        points.push_back(point);
    }
    if (points.empty())
        return error_at(document.text, offset_of(data), "no_intensities", {}, "there is no intensity (IntData)");
    return std::nullopt;
}

// Result: the angles of the points, each once, ascending.
std::vector<double> angles_of(const std::vector<Point>& points, double Point::*angle) {
    std::vector<double> angles;
    angles.reserve(points.size());
    for (const Point& point : points) angles.push_back(point.*angle + 0.0);
    std::ranges::sort(angles);
    angles.erase(std::unique(angles.begin(), angles.end()), angles.end());
    return angles;
}

std::size_t index_of(const std::vector<double>& angles, double angle) {
    return static_cast<std::size_t>(std::ranges::lower_bound(angles, angle + 0.0) - angles.begin());
}

// Points in any order -> a full grid. At a pole of Type C one value may stand for all planes.
OptionalError fill_grid(const Tm33Document& document, const xml_node& data, const std::vector<Point>& points,
                        double scale, FileGrid& grid) {
    const std::string_view text = document.text;
    grid.h_deg = angles_of(points, &Point::h);
    grid.v_deg = angles_of(points, &Point::v);
    const std::size_t nv = grid.v_deg.size();
    if (static_cast<double>(grid.h_deg.size()) * static_cast<double>(nv) > static_cast<double>(kMaxGridValues))
        return error_at(text, offset_of(data), "grid_too_large",
                        std::to_string(grid.h_deg.size()) + " x " + std::to_string(nv),
                        "the grid has more than 4194304 values");
    constexpr float kMissing = -1.0F;
    grid.candela.assign(grid.h_deg.size() * nv, kMissing);
    bool any = false;
    for (const Point& point : points) {
        const double scaled = point.value * scale;
        if (!(std::abs(scaled) <= kMaxCandela))
            return error_at(text, point.offset, "candela_too_large", print_number(point.value),
                            "more than 1e12 cd, with the multiplier");
        if (point.value < 0.0)
            document.report.warn("negative_candela", point.offset, "an intensity is negative; 0 is used");
        const auto kept = static_cast<float>(point.value > 0.0 && scaled > 0.0 ? scaled : 0.0);
        any = any || kept > 0.0F;
        float& cell = grid.candela[index_of(grid.h_deg, point.h) * nv + index_of(grid.v_deg, point.v)];
        if (cell != kMissing && cell != kept)
            return error_at(text, point.offset, "duplicate_value",
                            "h " + print_number(point.h) + " v " + print_number(point.v),
                            "the direction has two different intensities");
        cell = kept;
    }
    for (std::size_t v = 0; v < nv; ++v) {
        const bool pole = grid.goniometer == Goniometer::type_c && (grid.v_deg[v] == 0.0 || grid.v_deg[v] == 180.0);
        float of_pole = kMissing;
        for (std::size_t h = 0; pole && h < grid.h_deg.size(); ++h)
            of_pole = std::max(of_pole, grid.candela[h * nv + v]);
        for (std::size_t h = 0; h < grid.h_deg.size(); ++h) {
            float& cell = grid.candela[h * nv + v];
            if (cell != kMissing) continue;
            if (of_pole == kMissing)
                return error_at(text, offset_of(data), "incomplete_grid",
                                "h " + print_number(grid.h_deg[h]) + " v " + print_number(grid.v_deg[v]),
                                "the direction has no intensity, but others at these angles have");
            document.report.warn("pole_once", offset_of(data), "a pole's value is not given for each plane");
            cell = of_pole;
        }
    }
    if (!any) document.report.warn("all_dark", offset_of(data), "no intensity is above 0");
    return std::nullopt;
}

// Symm_Bi_90 with the planes 0–90 and 270–360: those of the second part become negative.
void turn_back(const std::vector<double>& h_deg, std::size_t nv, FileGrid& grid) {
    const auto in_gap = [](double h) { return h > 90.0 + 1e-3 && h < 270.0 - 1e-3; };
    if (h_deg.back() < 270.0 - 1e-3 || h_deg.front() < -1e-3 || std::ranges::any_of(h_deg, in_gap)) return;
    std::vector<double> turned;
    std::vector<float> candela;
    const auto take = [&](std::size_t h, double deg) {
        if (!turned.empty() && deg - turned.back() < 1e-3) return;
        turned.push_back(deg);
        const auto column = grid.candela.begin() + static_cast<std::ptrdiff_t>(h * nv);
        candela.insert(candela.end(), column, column + static_cast<std::ptrdiff_t>(nv));
    };
    for (std::size_t h = 0; h < h_deg.size(); ++h)
        if (h_deg[h] > 180.0) take(h, h_deg[h] - 360.0);
    for (std::size_t h = 0; h < h_deg.size(); ++h)
        if (h_deg[h] < 180.0) take(h, h_deg[h]);
    grid.h_deg = std::move(turned);
    grid.candela = std::move(candela);
}

struct SymmName {
    const char* name;
    Symmetry symmetry;
};
constexpr SymmName kSymmNames[] = {{"SYMMNONE", Symmetry::none},           {"SYMMARBITRARY", Symmetry::none},
                                   {"SYMMFULL", Symmetry::axial},          {"SYMMQUAD", Symmetry::quadrant},
                                   {"SYMMBI0", Symmetry::bilateral_0_180}, {"SYMMBI90", Symmetry::bilateral_90_270}};

Result<std::optional<Symmetry>> read_symmetry(const Tm33Document& document, const xml_node& data) {
    const xml_node element = child_of(data, {"Symm", "SymmType"});
    if (!element) return std::optional<Symmetry>();
    const std::string wanted = without_blanks(text_of(element));
    for (const auto& [name, symmetry] : kSymmNames) {
        const std::string_view full = name;
        if (wanted == full || wanted == full.substr(4)) return std::optional(symmetry);
    }
    return error_at(document.text, offset_of(element), "bad_symmetry", text_of(element),
                    "the symmetry is none of Symm_None, Symm_Bi_0, Symm_Bi_90, Symm_Quad, Symm_Full, Symm_Arbitrary");
}

// The goniometer's type; along: the C0 plane lies along the luminaire's length.
OptionalError read_goniometer(const Tm33Document& document, const xml_node& root, const xml_node& data,
                              FileGrid& grid) {
    xml_node element = root.child("Equipment").child("Gonioradiometer").child("Type");
    if (!element) element = child_of(root.child("Equipment").child("Goniometer"), {"GoniometerType", "Type"});
    if (const xml_node own = data.child("PhotometryType")) element = own;
    const std::string name = without_blanks(text_of(element));
    bool along = false;
    if (name == "IESC") {
        along = true;
    } else if (name == "CIEA" || name == "IESA" || name == "A" || name == "TYPEA") {
        grid.goniometer = Goniometer::type_a;
    } else if (name == "CIEB" || name == "IESB" || name == "B" || name == "TYPEB") {
        grid.goniometer = Goniometer::type_b;
    } else if (!name.empty() && name != "CIEC" && name != "C" && name != "TYPEC" && name != "CUSTOM") {
        if (!document.other_names)
            return error_at(document.text, offset_of(element), "bad_type", text_of(element),
                            "the gonioradiometer is none of CIE_A, CIE_B, CIE_C, IES_A, IES_B, IES_C and CUSTOM");
        document.report.warn("goniometer_type", offset_of(element), "no such gonioradiometer; CIE_C is assumed");
    }
    if (name.empty() || name == "CUSTOM")
        document.report.note("goniometer_type", offset_of(element ? element : data),
                             "the gonioradiometer's type is not stated; CIE_C is assumed");
    if (grid.goniometer == Goniometer::type_c && !along) grid.zero_plane_deg = -90.0;
    return std::nullopt;
}

void compare_count(const Tm33Document& document, const xml_node& data, const char* name, std::size_t count) {
    const xml_node element = data.child(name);
    if (element && text_of(element) != std::to_string(count))
        document.report.warn("count_mismatch", offset_of(element),
                             std::string(name) + " is not the number that the file holds, " + std::to_string(count));
}

}  // namespace

std::optional<Error> read_tm33_web(const Tm33Document& document, const xml_node& root, const xml_node& data,
                                   Photometry& result) {
    const auto declared = read_symmetry(document, data);
    if (!declared) return declared.error();
    FileGrid grid;
    grid.v_offset = grid.h_offset = grid.candela_offset = offset_of(data);
    if (auto error = read_goniometer(document, root, data, grid)) return error;
    std::vector<Point> points;
    if (auto error = read_points(document, data, points)) return error;
    if (auto error = fill_grid(document, data, points, result.provenance.scale, grid)) return error;
    compare_count(document, data, "NumberMeasured", points.size());
    compare_count(document, data, "NumberHorz", grid.h_deg.size());
    compare_count(document, data, "NumberVert", grid.v_deg.size());
    result.provenance.file_vertical_angles = static_cast<int>(grid.v_deg.size());
    result.provenance.file_horizontal_angles = static_cast<int>(grid.h_deg.size());
    const bool type_c = grid.goniometer == Goniometer::type_c;
    if (type_c && *declared == Symmetry::bilateral_90_270) turn_back(std::vector(grid.h_deg), grid.v_deg.size(), grid);
    const std::vector<double> v_deg = grid.v_deg;
    const std::vector<double> h_deg = grid.h_deg;
    const double zero_plane_deg = grid.zero_plane_deg;
    Unfolded unfolded = unfold(std::move(grid), document.report);
    if (const auto& fault = unfolded.fault) {
        const std::vector<double>& angles = fault->vertical ? v_deg : h_deg;
        return error_at(document.text, offset_of(data), fault->code, print_number(angles[fault->index]),
                        (fault->vertical ? "vertical: " : "horizontal: ") + fault->message);
    }
    if (type_c && *declared && **declared != unfolded.symmetry)
        document.report.warn("symm_mismatch", offset_of(data),
                             "the horizontal angles are not those of the symmetry that is stated; the angles count");
    result.web = std::move(unfolded.web);
    result.provenance.symmetry = unfolded.symmetry;
    if (zero_plane_deg != 0.0) result.provenance.zero_plane_rad = Angle::degrees(360.0 + zero_plane_deg).radians();
    return std::nullopt;
}

}  // namespace gonio::ies::detail
