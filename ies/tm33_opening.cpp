#include <algorithm>
#include <array>
#include <cmath>
#include <pugixml.hpp>

#include "ies/text_scan.h"
#include "ies/tm33_parts.h"
#include "ies/xml_text.h"

namespace gonio::ies::detail {

namespace {

using pugi::xml_node;
using OptionalError = std::optional<Error>;

constexpr double kMostMetres = 20.0;  // a longer luminaire is one in millimetres

// An extent of several areas along one axis: from the least to the greatest, offsets being those of their centres.
struct Extent {
    double low = 0.0;
    double high = 0.0;
    bool any = false;

    void add(double centre, double size) {
        low = any ? std::min(low, centre - size / 2) : centre - size / 2;
        high = any ? std::max(high, centre + size / 2) : centre + size / 2;
        any = true;
    }
    double size() const { return high - low; }
};

struct Box {
    Extent length, width, height;
};

OptionalError read_areas(const Tm33Document& document, const xml_node& areas, Box& box, bool& circular) {
    struct Axis {
        const char* name;
        const char* offset;
        Extent Box::*extent;
    };
    constexpr Axis kAxes[] = {{"Length", "LengthOffset", &Box::length},
                              {"Width", "WidthOffset", &Box::width},
                              {"Height", "HeightOffset", &Box::height}};
    constexpr std::array kFaces = {"TopFace", "BottomFace", "C0Face", "C90Face", "C180Face", "C270Face"};
    std::size_t flat = 0;
    for (const char* face_name : kFaces) {
        for (const xml_node& area : areas.child(face_name).children()) {
            if (!std::string_view(area.name()).ends_with("Area")) continue;
            const bool horizontal = face_name == kFaces[0] || face_name == kFaces[1];
            if (horizontal) {
                ++flat;
                circular = circular || is_true(area.child("Circular"));
            }
            for (const auto& [name, offset, extent] : kAxes) {
                const xml_node size = area.child(name);
                if (!size) continue;
                double metres = 0.0;
                double centre = 0.0;
                if (auto error = read_number(document.text, size, text_of(size), name, metres)) return error;
                if (const xml_node at = area.child(offset))
                    if (auto error = read_number(document.text, at, text_of(at), offset, centre)) return error;
                (box.*extent).add(centre, std::abs(metres));
            }
        }
    }
    if (flat > 1) {
        circular = false;
        document.report.note("several_areas", offset_of(areas),
                             "several luminous areas: the opening is the rectangle about them");
    }
    return std::nullopt;
}

}  // namespace

std::optional<Error> read_tm33_opening(const Tm33Document& document, const xml_node& root, const xml_node& emitter,
                                       Opening& opening) {
    const xml_node areas = emitter.child("EmissionAreas");
    const xml_node dimensions = root.child("Luminaire").child("Dimensions");
    Box box;
    bool circular = false;
    if (auto error = read_areas(document, areas, box, circular)) return error;
    double length = box.length.size();
    double width = box.width.size();
    double height = box.height.size();
    const bool from_areas = length > 0.0 || width > 0.0 || height > 0.0;
    if (!from_areas) {
        if (auto error = optional_number(document.text, dimensions, {"Length"}, length)) return error;
        if (auto error = optional_number(document.text, dimensions, {"Width"}, width)) return error;
        if (auto error = optional_number(document.text, dimensions, {"Height"}, height)) return error;
        if (length != 0.0 || width != 0.0)
            document.report.note("opening_from_dimensions", offset_of(dimensions),
                                 "no luminous areas are given: the opening is the luminaire's length by its width");
    }
    const bool millimetres =
        document.other_names || std::max({std::abs(length), std::abs(width), std::abs(height)}) > kMostMetres;
    if (millimetres && !document.other_names)
        document.report.warn("dimension_units", offset_of(from_areas ? areas : dimensions),
                             "a length above 20 m: lengths are taken as millimetres");
    if (!std::isfinite(length) || !std::isfinite(width) || !std::isfinite(height))
        return error_at(document.text, offset_of(areas), "not_finite", {}, "the luminous areas are not finite");
    const double metre = millimetres ? 1e-3 : 1.0;
    if (!from_areas) height = 0.0;
    opening = {OpeningShape::point, std::abs(width) * metre * m, std::abs(length) * metre * m,
               std::abs(height) * metre * m};
    if (length == 0.0 && width == 0.0 && height == 0.0) return std::nullopt;
    opening.shape = circular        ? (height != 0.0 ? OpeningShape::vertical_cylinder : OpeningShape::ellipse)
                    : height != 0.0 ? OpeningShape::box
                                    : OpeningShape::rectangle;
    return std::nullopt;
}

}  // namespace gonio::ies::detail
