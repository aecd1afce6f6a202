// Geometries -> the tree of a mode, references expanded.
#include <algorithm>
#include <array>

#include "server/exchange/axes.h"
#include "server/exchange/gdtf_parts.h"

namespace gonio::gdtf {
namespace {

using exchange::MatrixState;
using exchange::Outcome;

constexpr auto kOthers =
    std::to_array<std::string_view>({"FilterBeam", "FilterColor", "FilterGobo", "FilterShaper", "WiringObject",
                                     "Inventory", "Structure", "Support", "Magnet"});

std::optional<GeometryKind> kind_of(std::string_view element) {
    if (element == "Geometry" || element == "GeometryReference") return GeometryKind::plain;
    if (element == "Axis") return GeometryKind::axis;
    if (element == "Beam") return GeometryKind::beam;
    if (element.starts_with("MediaServer")) return GeometryKind::media_server;
    if (element == "Display") return GeometryKind::display;
    if (element == "Laser") return GeometryKind::laser;
    if (std::find(kOthers.begin(), kOthers.end(), element) != kOthers.end()) return GeometryKind::other;
    return std::nullopt;  // Break, Protocol, PinPatch: no geometry
}

pugi::xml_node top_level(const GdtfRead& read, std::string_view name) {
    const auto found = read.top_level.find(name);
    return found == read.top_level.end() ? pugi::xml_node() : found->second;
}

// Reads the breaks of each reference once, however often it is expanded.
Result<std::span<const ReferenceBreak>> breaks_of(GdtfRead& read, const pugi::xml_node& reference) {
    const auto [at, fresh] = read.breaks.try_emplace(reference);
    std::vector<ReferenceBreak>& breaks = at->second;
    if (!fresh) return std::span<const ReferenceBreak>(breaks);
    const std::string_view name = exchange::attribute_of(reference, "Name");
    for (const pugi::xml_node node : reference.children("Break")) {
        if (breaks.size() == kMaxBreaks)
            return Error{"too_large", "Geometries", std::string(name),
                         "a reference has at most " + std::to_string(kMaxBreaks) + " breaks"};
        ReferenceBreak one;
        const auto number = [&](const char* attribute) {
            return static_cast<int>(std::clamp(read.whole_number(node, attribute, name).value_or(1), 1ll, 512ll));
        };
        one.dmx_break = number("DMXBreak");
        one.offset = number("DMXOffset");
        breaks.push_back(one);
    }
    return std::span<const ReferenceBreak>(breaks);
}

// Finds the geometries below each geometry once, however often it is expanded.
const std::vector<pugi::xml_node>& geometries_of(GdtfRead& read, const pugi::xml_node& geometry) {
    const auto [at, fresh] = read.children.try_emplace(geometry);
    if (fresh)
        for (const pugi::xml_node child : geometry.children())
            if (kind_of(child.name())) at->second.push_back(child);
    return at->second;
}

glm::dmat4 position_of(GdtfRead& read, const pugi::xml_node& node, std::string_view name) {
    const std::string_view text = exchange::attribute_of(node, "Position");
    const auto position = exchange::gdtf_matrix(text);
    if (position.state == MatrixState::bad)
        read.note(Outcome::defaulted, "a position is no matrix: there is no offset", written(name, "Position", text));
    if (position.state == MatrixState::singular)
        read.note(Outcome::guessed, "a position's axes span no space: it does not turn", name);
    return position.matrix;
}

struct Expansion {
    GdtfRead& read;
    Mode& mode;
    ReferenceBreaks& breaks;
    std::vector<std::string_view> open;  // top-level geometries being expanded

    // Adds the element and what lies below it. Result: nothing, or "too_large".
    std::optional<Error> add(const pugi::xml_node& node, int parent, int reference, int depth) {
        const std::string_view name = exchange::attribute_of(node, "Name");
        if (depth >= kMaxDepth) {
            read.note(Outcome::left_out, "a geometry lies too deep", name);
            return std::nullopt;
        }
        if (++read.geometries > kMaxGeometries)
            return Error{"too_large", "Geometries", std::string(name),
                         "all modes together have at most " + std::to_string(kMaxGeometries) + " geometries"};
        Geometry made;
        made.name = made.source = std::string(name);
        made.parent = parent;
        made.reference = reference;
        made.parent_from_geometry = position_of(read, node, name);
        pugi::xml_node content = node;
        const bool refers = std::string_view(node.name()) == "GeometryReference";
        if (refers) {
            made.source = std::string(exchange::attribute_of(node, "Geometry"));
            content = top_level(read, made.source);
            if (!content) {
                read.note(Outcome::left_out, "a reference names no top-level geometry", name);
                return std::nullopt;
            }
            if (std::find(open.begin(), open.end(), made.source) != open.end()) {
                read.note(Outcome::left_out, "a reference contains itself", name);
                return std::nullopt;
            }
            made.reference = static_cast<int>(mode.geometries.size());
        }
        made.kind = *kind_of(content.name());
        if (made.kind == GeometryKind::beam) made.beam = read_beam(read, content);
        std::string_view model = exchange::attribute_of(node, "Model");
        if (refers && model.empty()) model = exchange::attribute_of(content, "Model");
        made.model = index_of(read.type.models, model);
        if (made.model < 0 && !model.empty() && model != "None")
            read.note(Outcome::left_out, "a geometry names no model", name);
        const int here = static_cast<int>(mode.geometries.size());
        const int inside = made.reference;
        mode.geometries.push_back(std::move(made));
        if (refers) {
            const auto own = breaks_of(read, node);
            if (!own) return own.error();
            breaks[here] = *own;
            open.push_back(exchange::attribute_of(content, "Name"));
        }
        for (const pugi::xml_node child : geometries_of(read, content)) {
            if (auto error = add(child, here, inside, depth + 1)) return error;
        }
        if (refers) open.pop_back();
        return std::nullopt;
    }
};

}  // namespace

void find_top_level(GdtfRead& read) {
    for (const pugi::xml_node node : read.root.child("Geometries").children())
        if (kind_of(node.name())) read.top_level.emplace(exchange::attribute_of(node, "Name"), node);
}

std::optional<Error> read_tree(GdtfRead& read, Mode& mode, ReferenceBreaks& breaks) {
    const pugi::xml_node node = top_level(read, mode.geometry);
    if (!node) return std::nullopt;  // the caller leaves the mode out
    return Expansion{read, mode, breaks, {exchange::attribute_of(node, "Name")}}.add(node, -1, -1, 0);
}

}  // namespace gonio::gdtf
