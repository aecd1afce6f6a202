#include "server/exchange/gdtf.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <tuple>

#include "ies/core/text.h"
#include "server/exchange/gdtf_parts.h"

namespace gonio::gdtf {
namespace {

using exchange::attribute_of;
using exchange::Outcome;

struct StandardColor {
    std::string_view attribute;  // behind "ColorAdd_" or "ColorSub_"
    Color color;
};
// DIN SPEC 15800, annex A (its list of attributes), from the default colours there.
constexpr auto kStandardColors = std::to_array<StandardColor>({
    {"R", {0.64, 0.33, 21.3}},
    {"G", {0.3, 0.6, 71.5}},
    {"B", {0.15, 0.06, 7.2}},
    {"C", {0.225, 0.329, 78.7}},
    {"M", {0.321, 0.154, 28.5}},
    {"Y", {0.419, 0.505, 92.8}},
    {"RY", {0.477, 0.460, 57.0}},
    {"GY", {0.372, 0.543, 82.1}},
    {"GC", {0.250, 0.419, 75.1}},
    {"BC", {0.200, 0.239, 43.0}},
    {"BM", {0.254, 0.117, 17.9}},
    {"RM", {0.403, 0.200, 24.9}},
    {"W", {0.313, 0.329, 100.0}},
    {"WW", {0.319, 0.340, 99.3}},
    {"CW", {0.306, 0.329, 97.9}},
    {"UV", {0.176, 0.005, 0.6}},
});

constexpr std::string_view kPhotometric = "photometric/";  // the folder of Beam@Photometric
constexpr const char* kNoNumber = "a value is no number: its default stands";

bool same_letters(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(), [&](char x, char y) { return lower(x) == lower(y); });
}

std::string text_of(const pugi::xml_node& node, const char* attribute) {
    return std::string(attribute_of(node, attribute));
}

// Result: the entry of this name, whatever its case; empty: there is none.
std::string entry_of(std::span<const std::string> entries, const std::string& name) {
    for (const std::string& entry : entries)
        if (same_letters(entry, name)) return entry;
    return {};
}

std::string model_entry(std::span<const std::string> entries, const std::string& file) {
    for (const char* folder : {"models/gltf", "models/3ds"}) {
        const std::string extension = folder[7] == 'g' ? ".glb" : ".3ds";
        for (const char* detail : {"", "_high", "_low"})
            if (auto entry = entry_of(entries, folder + std::string(detail) + "/" + file + extension); !entry.empty())
                return entry;
    }
    return {};
}

void read_models(GdtfRead& read, std::span<const std::string> entries) {
    for (const pugi::xml_node node : read.root.child("Models").children("Model")) {
        Model model;
        model.name = text_of(node, "Name");
        const char* sides[] = {"Length", "Width", "Height"};
        for (int i = 0; i < 3; ++i) {
            const double side = read.number(node, sides[i], model.name).value_or(0.0);
            if (side >= 0.0 && side <= 1e4)
                model.size_m[i] = side;
            else
                read.note(Outcome::defaulted, "a model's size is out of range", model.name);
        }
        model.primitive = text_of(node, "PrimitiveType");
        if (model.primitive == "Undefined") model.primitive.clear();
        model.file = text_of(node, "File");
        if (!model.file.empty()) {
            model.entry = model_entry(entries, model.file);
            if (model.entry.empty()) read.note(Outcome::left_out, "a model's file is not in the archive", model.file);
        }
        read.type.models.push_back(std::move(model));
    }
}

void read_wheels(GdtfRead& read, std::span<const std::string> entries) {
    for (const pugi::xml_node node : read.root.child("Wheels").children("Wheel")) {
        Wheel wheel{text_of(node, "Name"), {}};
        for (const pugi::xml_node child : node.children("Slot")) {
            Slot slot;
            slot.name = text_of(child, "Name");
            slot.color = noted_color(read, child, wheel.name + ": " + slot.name);
            if (const int filter = index_of(read.type.filters, attribute_of(child, "Filter")); filter >= 0)
                slot.color = read.type.filters[filter].color;
            if (const std::string picture = text_of(child, "MediaFileName"); !picture.empty()) {
                slot.picture = entry_of(entries, "wheels/" + picture + ".png");
                if (slot.picture.empty()) slot.picture = entry_of(entries, "wheels/" + picture);
                if (slot.picture.empty())
                    read.note(Outcome::left_out, "a wheel's picture is not in the archive", picture);
            }
            if (child.child("Facet") || child.child("AnimationSystem"))
                read.note(Outcome::left_out, "prisms and animation wheels are not drawn",
                          wheel.name + ": " + slot.name);
            wheel.slots.push_back(std::move(slot));
        }
        read.type.wheels.push_back(std::move(wheel));
    }
}

void read_physics(GdtfRead& read) {
    const pugi::xml_node physics = read.root.child("PhysicalDescriptions");
    const auto add = [&](std::vector<NamedColor>& list, const pugi::xml_node& node) {
        list.push_back({text_of(node, "Name"), noted_color(read, node, text_of(node, "Name"))});
        if (!list.back().color)
            read.note(Outcome::defaulted, "an emitter or filter has no colour: that of its attribute",
                      list.back().name);
    };
    read_emitters(read, physics.child("Emitters"));
    for (const pugi::xml_node node : physics.child("Filters").children("Filter")) add(read.type.filters, node);
    for (const pugi::xml_node node : physics.child("DMXProfiles").children("DMXProfile")) {
        DmxProfile profile{text_of(node, "Name"), {}, false};
        for (const pugi::xml_node child : node.children("Point")) {
            ProfilePoint point;
            point.at = read.number(child, "DMXPercentage", profile.name).value_or(0.0);
            const char* names[] = {"CFC0", "CFC1", "CFC2", "CFC3"};
            for (std::size_t i = 0; i < 4; ++i)
                point.cubic[i] = read.number(child, names[i], profile.name).value_or(0.0);
            profile.points.push_back(point);
        }
        std::stable_sort(profile.points.begin(), profile.points.end(),
                         [](const ProfilePoint& a, const ProfilePoint& b) { return a.at < b.at; });
        // The standard calls it a percentage; files have ratios too.
        profile.percent = !profile.points.empty() && profile.points.back().at > 1.0;
        if (profile.percent) read.note(Outcome::guessed, "a DMX profile counts from 0 to 100", profile.name);
        read.type.profiles.push_back(std::move(profile));
    }
    for (const pugi::xml_node node : read.root.child("AttributeDefinitions").child("Attributes").children("Attribute"))
        if (const auto color = noted_color(read, node, text_of(node, "Name")))
            read.type.attribute_colors.emplace(text_of(node, "Name"), *color);
}

std::optional<Error> read_modes(GdtfRead& read) {
    for (const pugi::xml_node node : read.root.child("DMXModes").children("DMXMode")) {
        Mode mode;
        mode.name = text_of(node, "Name");
        mode.geometry = text_of(node, "Geometry");
        ReferenceBreaks breaks;
        if (auto error = read_tree(read, mode, breaks)) return error;
        if (mode.geometries.empty()) {
            read.note(Outcome::left_out, "a mode names no top-level geometry", mode.name);
            continue;
        }
        if (auto error = read_channels(read, node, mode, breaks)) return error;
        guess_beam(read.type, mode);
        read.type.modes.push_back(std::move(mode));
    }
    return std::nullopt;
}

}  // namespace

std::optional<double> GdtfRead::number(const pugi::xml_node& node, const char* attribute, std::string_view name) {
    const std::string_view text = attribute_of(node, attribute);
    const auto value = exchange::number_of(text);
    if (!value && !text.empty()) note(Outcome::defaulted, kNoNumber, written(name, attribute, text));
    return value;
}

std::optional<long long> GdtfRead::whole_number(const pugi::xml_node& node, const char* attribute,
                                                std::string_view name) {
    const std::string_view text = attribute_of(node, attribute);
    const auto value = exchange::whole_number_of(text);
    if (!value && !text.empty()) note(Outcome::defaulted, kNoNumber, written(name, attribute, text));
    return value;
}

std::optional<Color> noted_color(GdtfRead& read, const pugi::xml_node& node, const std::string& name) {
    const std::string_view text = attribute_of(node, "Color");
    const auto color = color_of(text);
    if (!color && !text.empty() && text != "None")
        read.note(Outcome::left_out, "a colour is none", written(name, "Color", text));
    return color;
}

std::optional<Color> color_of(std::string_view text) {
    double numbers[3];
    std::size_t count = 0;
    for (std::size_t at = 0; at <= text.size(); ++count) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const auto number = exchange::number_of(text.substr(at, end - at));
        if (!number || count == 3) return std::nullopt;
        numbers[count] = *number;
        at = end + 1;
    }
    const auto [x, y, luminance] = std::tuple(numbers[0], numbers[1], numbers[2]);
    if (count != 3 || !(x >= 0.0 && x <= 1.0 && y > 0.0 && y <= 1.0 && luminance >= 0.0 && luminance <= 1e4))
        return std::nullopt;
    return Color{x, y, luminance};
}

std::optional<Color> standard_color(std::string_view attribute) {
    for (const auto& [name, same] : {std::pair<std::string_view, std::string_view>{"ColorRGB_Red", "ColorAdd_R"},
                                     {"ColorRGB_Green", "ColorAdd_G"},
                                     {"ColorRGB_Blue", "ColorAdd_B"}})
        if (attribute == name) attribute = same;
    if (!attribute.starts_with("ColorAdd_") && !attribute.starts_with("ColorSub_")) return std::nullopt;
    for (const StandardColor& one : kStandardColors)
        if (attribute.substr(9) == one.attribute) return one.color;
    return std::nullopt;
}

FoundMode find_mode(const FixtureType& type, std::string_view name) {
    for (std::size_t i = 0; i < type.modes.size(); ++i)
        if (type.modes[i].name == name) return {i, true};
    for (std::size_t i = 0; i < type.modes.size(); ++i)
        if (same_letters(exchange::trimmed(type.modes[i].name), exchange::trimmed(name))) return {i, true};
    return {0, false};
}

Result<FixtureType> read_description(std::string_view xml, std::span<const std::string> entries) {
    pugi::xml_document document;
    if (auto read = exchange::read_xml(xml, "bad_gdtf", document); !read) return read.error();
    const pugi::xml_node root = document.child("GDTF");
    if (!root || !root.child("FixtureType"))
        return Error{"bad_gdtf", "GDTF", shown_text(document.first_child().name()), "there is no fixture type"};
    FixtureType type;
    GdtfRead read{type, root.child("FixtureType")};
    type.data_version = text_of(root, "DataVersion");
    type.name = text_of(read.root, "Name");
    type.manufacturer = text_of(read.root, "Manufacturer");
    type.id = text_of(read.root, "FixtureTypeID");
    for (const char* list : {"PhysicalDescriptions", "Wheels", "Models"}) {
        // Found by name from every geometry or function.
        std::size_t items = 0;
        for (const pugi::xml_node node : read.root.child(list).children())
            items += 1 + static_cast<std::size_t>(std::distance(node.begin(), node.end()));
        if (items > kMaxItems)
            return Error{"too_large", list, std::to_string(items),
                         "there are at most " + std::to_string(kMaxItems) + " of them"};
    }
    for (const std::string& entry : entries)
        if (entry.size() > kPhotometric.size() && same_letters(entry.substr(0, kPhotometric.size()), kPhotometric))
            type.photometric.push_back(entry);
    find_photometric(read);
    find_top_level(read);
    read_physics(read);
    read_wheels(read, entries);
    read_models(read, entries);
    if (auto error = read_modes(read)) return *error;
    if (type.modes.empty())
        return Error{"bad_gdtf", "DMXModes", shown_text(type.name), "there is no mode whose geometry exists"};
    return type;
}

Result<FixtureType> read_gdtf(const ZipArchive& archive) {
    std::vector<std::string> entries;
    std::string description = "description.xml";
    for (const ZipEntry& entry : archive.entries()) {
        if (!entry.is_folder()) entries.push_back(entry.name);
        if (same_letters(entry.name, description)) description = entry.name;
    }
    const auto xml = archive.read(description);
    if (!xml) return xml.error();
    return read_description(*xml, entries);
}

}  // namespace gonio::gdtf
