#include "protocol/surface/surface_map.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "ies/core/text.h"
#include "ies/synthetic.h"
#include "protocol/schema/cue_number.h"
#include "protocol/schema/name_list.h"
#include "protocol/schema/property.h"
#include "protocol/schema/surface.pb.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxNameLength = 128;

struct Curve {
    std::string_view name;
    double (*forward)(double);
    double (*back)(double);
};
// "s" is 3v² − 2v³; its inverse is 1/2 − sin(asin(1 − 2v) / 3).
constexpr Curve kCurves[] = {
    {"linear", [](double v) { return v; }, [](double v) { return v; }},
    {"square", [](double v) { return v * v; }, [](double v) { return std::sqrt(v); }},
    {"cube", [](double v) { return v * v * v; }, [](double v) { return std::cbrt(v); }},
    {"s", [](double v) { return v * v * (3.0 - 2.0 * v); },
     [](double v) { return 0.5 - std::sin(std::asin(1.0 - 2.0 * v) / 3.0); }},
};

const Curve* find_curve(std::string_view name) {
    for (const Curve& curve : kCurves)
        if (curve.name == name || (name.empty() && curve.name == "linear")) return &curve;
    return nullptr;
}

bool one_of(std::string_view value, std::initializer_list<std::string_view> known) {
    return std::find(known.begin(), known.end(), value) != known.end();
}

Error refusal_of(const std::string& place, const char* field, std::string value, std::string message) {
    return {"invalid_argument", place + field, std::move(value), std::move(message)};
}

Result<bool> check_range(const v1::SurfaceRow& row, const PropertyRow& property, const std::string& place) {
    for (const auto& [given, value, field] :
         {std::tuple{row.has_low(), row.low(), "low"}, {row.has_high(), row.high(), "high"}}) {
        if (!given && !property.has_range)
            return refusal_of(place, field, "", "positions and distances need the range that the control stands for");
        if (given && !(value >= property.least && value <= property.most))
            return refusal_of(place, field, print_number(value),
                              "must be a number from " + print_number(property.least) + " to " +
                                  print_number(property.most) + " (radians, metres)");
    }
    return true;
}

Result<bool> check_names(const v1::SurfaceRow& row, const PropertyRow& property, const std::string& place) {
    if (const std::string why = wrong_list(property, row.profiles(), ies::synthetic_luminaires()); !why.empty())
        return refusal_of(place, "profiles", std::to_string(row.profiles_size()), why);
    const bool preset = property.property == Property::preset;
    if (preset == row.preset().empty() || row.preset().size() > kMaxNameLength)
        return refusal_of(place, "preset", shown_text(row.preset()),
                          preset ? "must name a preset in 1 to 128 bytes" : "only the property preset names a preset");
    const bool cue = property.property == Property::cue;
    const bool known = one_of(row.cue(), {"go", "back", "stop"}) || parse_cue_number(row.cue());
    if (cue ? !known : !row.cue().empty())
        return refusal_of(place, "cue", shown_text(row.cue()),
                          cue ? "must be go, back, stop or the number of a cue" : "only the property cue has one");
    if (!(row.fade_s() >= 0 && row.fade_s() <= 3600))
        return refusal_of(place, "fade_s", print_number(row.fade_s()), "must be a number from 0 to 3600");
    return true;
}

Result<bool> check_page_row(const v1::SurfaceRow& row, const std::string& place) {
    if (!row.target().empty()) return refusal_of(place, "target", shown_text(row.target()), "a page has no target");
    if (row.has_high() == row.has_step())
        return refusal_of(place, "step", "", "a page button has either a page (high) or pages to turn (step)");
    const double value = row.has_high() ? row.high() : row.step();
    const double least = row.has_high() ? 1 : -static_cast<double>(kMaxSurfacePages);
    if (!(value >= least && value <= kMaxSurfacePages) || value != std::floor(value) || value == 0)
        return refusal_of(place, row.has_high() ? "high" : "step", print_number(value), "pages are 1 to 64");
    return true;
}

}  // namespace

Result<bool> check_surface_row(const v1::SurfaceRow& row, const std::string& place) {
    const auto text = [](const std::string& value, std::size_t most) {
        return !value.empty() && value.size() <= most &&
               std::none_of(value.begin(), value.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; });
    };
    if (!text(row.device(), kMaxNameLength))
        return refusal_of(place, "device", shown_text(row.device()), "must name a box, or be * for any");
    if (!text(row.control(), kMaxNameLength))
        return refusal_of(place, "control", shown_text(row.control()), "must name a control");
    if (row.page() > kMaxSurfacePages)
        return refusal_of(place, "page", std::to_string(row.page()), "pages are 1 to 64, 0 means every page");
    if (row.stride() > kMaxSurfacePages)
        return refusal_of(place, "stride", std::to_string(row.stride()), "must be 0 to 64 lights");
    if (!one_of(row.mode(), {"", "rate", "toggle", "flash", "set", "save"}))
        return refusal_of(place, "mode", shown_text(row.mode()), "must be rate, toggle, flash, set or save");
    if (find_curve(row.curve()) == nullptr)
        return refusal_of(place, "curve", shown_text(row.curve()), "must be linear, square, cube or s");
    if (!one_of(row.takeover(), {"", "pickup", "jump"}))
        return refusal_of(place, "takeover", shown_text(row.takeover()), "must be pickup or jump");
    if (!(row.smooth_s() >= 0 && row.smooth_s() <= 2))
        return refusal_of(place, "smooth_s", print_number(row.smooth_s()), "must be a number from 0 to 2");
    if (!(row.deadband_ratio() >= 0 && row.deadband_ratio() <= 0.5))
        return refusal_of(place, "deadband_ratio", print_number(row.deadband_ratio()),
                          "must be a number from 0 to 0.5");
    if (row.property() == kPageProperty) return check_page_row(row, place);
    if (row.has_step() && !(std::abs(row.step()) <= 10))
        return refusal_of(place, "step", print_number(row.step()), "must be a number from -10 to 10");
    const PropertyRow* property = find_property(row.property());
    if (property == nullptr || property->values != 1)
        return refusal_of(
            place, "property", shown_text(row.property()),
            "must be page, " + property_names([](const PropertyRow& known) { return known.values == 1; }));
    if (property->of_scene != row.target().empty() || row.target().size() > kMaxNameLength)
        return refusal_of(
            place, "target", shown_text(row.target()),
            property->of_scene ? "a property of the scene has no target" : "must name a light or a group");
    if (row.target().starts_with('#') && !light_number(row.target()))
        return refusal_of(place, "target", shown_text(row.target()), "#n is the nth light, 1 to 4096");
    if (row.mode() == "save" && property->property != Property::preset)
        return refusal_of(place, "mode", "save", "only a preset is saved");
    if (auto checked = check_range(row, *property, place); !checked) return checked;
    return check_names(row, *property, place);
}

Result<bool> check_surfaces(const v1::SetSurfaces& set) {
    if (static_cast<std::size_t>(set.rows_size()) > kMaxSurfaceRows)
        return Error{"too_large", "set_surfaces.rows", std::to_string(set.rows_size()), "there are at most 4,096 rows"};
    for (int i = 0; i < set.rows_size(); ++i) {
        auto checked = check_surface_row(set.rows(i), "set_surfaces.rows[" + std::to_string(i) + "].");
        if (!checked) return checked;
    }
    return true;
}

Result<v1::SetSurfaces> mapped(const v1::SetSurfaces& rows, const v1::MapControl& change) {
    const v1::SurfaceRow& row = change.row();
    if (!change.remove())
        if (auto checked = check_surface_row(row, "map_control.row."); !checked) return checked.error();
    v1::SetSurfaces result;
    result.set_with_default(rows.with_default());
    for (const v1::SurfaceRow& known : rows.rows())
        if (!same_control(known, row)) *result.add_rows() = known;
    if (change.remove()) {
        if (result.rows_size() == rows.rows_size())
            return Error{"not_found", "map_control.row.control", shown_text(row.control()),
                         "there is no row for this control on this page"};
        return result;
    }
    if (static_cast<std::size_t>(result.rows_size()) >= kMaxSurfaceRows)
        return Error{"too_large", "map_control", std::to_string(result.rows_size()), "there are at most 4,096 rows"};
    *result.add_rows() = row;
    return result;
}

std::optional<std::uint32_t> light_number(std::string_view target) {
    if (!target.starts_with('#')) return std::nullopt;
    std::uint32_t number = 0;
    const auto [end, error] = std::from_chars(target.data() + 1, target.data() + target.size(), number);
    if (error != std::errc() || end != target.data() + target.size() || number < 1 || number > 4096)
        return std::nullopt;
    return number;
}

bool means_box(std::string_view device, std::string_view identity) {
    if (device == "*" || device == identity) return true;
    return identity.starts_with(device) && identity.size() > device.size() &&
           (identity[device.size()] == ':' || identity[device.size()] == '@') && device.find(':') != device.npos;
}

bool same_control(const v1::SurfaceRow& a, const v1::SurfaceRow& b) {
    return a.device() == b.device() && a.control() == b.control() && a.page() == b.page();
}

std::uint32_t light_index(const v1::SurfaceRow& row, std::uint32_t number, std::uint32_t page) {
    return number - 1 + row.stride() * (page - 1);
}

double curve_of(std::string_view name, double v) {
    return find_curve(name)->forward(std::clamp(v, 0.0, 1.0));
}

double position_of(std::string_view name, double share) {
    return find_curve(name)->back(std::clamp(share, 0.0, 1.0));
}

}  // namespace gonio
