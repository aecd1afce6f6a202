// Beam -> value, with the standard's defaults where the file is silent.
#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>

#include "server/exchange/gdtf_parts.h"

namespace gonio::gdtf {
namespace {

constexpr auto kTypes =
    std::to_array<const char*>({"Wash", "Spot", "None", "Rectangle", "PC", "Fresnel", "Glow"});  // as BeamType

std::string in_lower_case(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return result;
}

// Result: the entry that Beam@Photometric names, with or without its extension; empty: there is none.
std::string photometric_entry(const GdtfRead& read, std::string_view file) {
    const std::string wanted = "photometric/" + in_lower_case(file);
    for (const char* extension : {"", ".ies", ".ldt"})
        if (const auto at = read.photometric.find(wanted + extension); at != read.photometric.end()) return at->second;
    return {};
}

}  // namespace

void find_photometric(GdtfRead& read) {
    for (const std::string& entry : read.type.photometric) read.photometric.emplace(in_lower_case(entry), entry);
}

Beam read_beam(GdtfRead& read, const pugi::xml_node& node) {
    Beam beam;
    const std::string_view name = exchange::attribute_of(node, "Name");
    // Takes a number from low to high; `factor` brings it to the value's unit.
    const auto take = [&](Given<double>& value, const char* attribute, double low, double high, double factor = 1.0) {
        const auto number = read.number(node, attribute, name);
        if (number && *number >= low && *number <= high) {
            value = {*number * factor, false};
        } else if (number) {
            read.note(exchange::Outcome::defaulted, "a beam's value is out of range",
                      written(name, attribute, exchange::attribute_of(node, attribute)));
        }
    };
    constexpr double kDegree = std::numbers::pi / 180.0;
    take(beam.flux_lm, "LuminousFlux", 0.0, 1e9);
    take(beam.beam_angle_rad, "BeamAngle", 0.01, 360.0, kDegree);
    take(beam.field_angle_rad, "FieldAngle", 0.01, 360.0, kDegree);
    take(beam.color_temperature_k, "ColorTemperature", 500.0, 100000.0);
    take(beam.radius_m, "BeamRadius", 0.0, 100.0);
    take(beam.throw_ratio, "ThrowRatio", 1e-3, 1e3);
    take(beam.rectangle_ratio, "RectangleRatio", 1e-3, 1e3);
    take(beam.color_rendering_index, "ColorRenderingIndex", 0.0, 100.0);
    take(beam.power_w, "PowerConsumption", 0.0, 1e9);
    const std::string_view type = exchange::attribute_of(node, "BeamType");
    if (const auto at = std::find(kTypes.begin(), kTypes.end(), type); at != kTypes.end())
        beam.type = {static_cast<BeamType>(at - kTypes.begin()), false};
    if (const std::string_view lamp = exchange::attribute_of(node, "LampType"); !lamp.empty())
        beam.lamp_type = {std::string(lamp), false};
    if (const std::string_view file = exchange::attribute_of(node, "Photometric"); !file.empty()) {
        beam.photometric = photometric_entry(read, file);
        if (beam.photometric.empty())
            read.note(exchange::Outcome::left_out,
                      "a beam's photometric file is not in the archive: its flux and angles count", file);
        else
            return beam;
    }
    // Editors write the defaults out: a beam that has all of them was not described.
    if (beam.flux_lm.defaulted || (beam.flux_lm.value == 10000.0 && beam.beam_angle_rad.value == 25.0 * kDegree &&
                                   beam.field_angle_rad.value == 25.0 * kDegree))
        read.note(exchange::Outcome::defaulted, "a beam has only default photometry", name);
    return beam;
}

}  // namespace gonio::gdtf
