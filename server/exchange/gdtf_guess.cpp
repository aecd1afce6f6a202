// Which modes without a beam light something, and with what.
#include <algorithm>
#include <array>

#include "server/exchange/gdtf_parts.h"

namespace gonio::gdtf {
namespace {

// Beginnings of attributes that only what has light in it can have.
constexpr auto kColors = std::to_array<std::string_view>({"Color", "HSB_", "CIE_", "CTO", "CTC", "CTB"});
constexpr auto kOfLight =
    std::to_array<std::string_view>({"Dimmer", "Shutter", "Strobe", "Zoom", "Iris", "Gobo", "Frost", "Prism", "Lamp"});
constexpr auto kOfHaze = std::to_array<std::string_view>({"Fog", "Haze"});

bool has_attribute(const Mode& mode, std::span<const std::string_view> beginnings) {
    const auto begins = [&](const ChannelFunction& function) {
        return std::ranges::any_of(beginnings,
                                   [&](std::string_view one) { return function.attribute.starts_with(one); });
    };
    return std::ranges::any_of(mode.channels,
                               [&](const Channel& channel) { return std::ranges::any_of(channel.functions, begins); });
}

bool has_kind(const Mode& mode, GeometryKind kind) {
    return std::ranges::any_of(mode.geometries, [&](const Geometry& one) { return one.kind == kind; });
}

}  // namespace

const char* why_dark(const FixtureType& type, const Mode& mode) {
    if (has_kind(mode, GeometryKind::media_server)) return "a fixture has no beam: it is a media server";
    if (has_kind(mode, GeometryKind::display)) return "a fixture has no beam: it is a display";
    if (has_kind(mode, GeometryKind::laser)) return "a fixture has no beam: it is a laser";
    const bool colored = has_attribute(mode, kColors) || !type.emitters.empty();
    if (!colored && has_attribute(mode, kOfHaze)) return "a fixture has no beam: it makes fog or haze";
    if (!colored && !has_attribute(mode, kOfLight))
        return "a fixture has no beam: its type has no dimmer, shutter, colour or emitter";
    return nullptr;
}

void guess_beam(const FixtureType& type, Mode& mode) {
    if (std::ranges::any_of(mode.geometries, [](const Geometry& one) { return one.beam.has_value(); })) return;
    if (why_dark(type, mode) != nullptr) return;
    std::vector<int> depths;
    Geometry* innermost = nullptr;
    int most = -1;
    for (Geometry& one : mode.geometries) {
        const int depth = one.parent < 0 ? 0 : depths[static_cast<std::size_t>(one.parent)] + 1;
        depths.push_back(depth);
        if (depth <= most || (one.kind != GeometryKind::plain && one.kind != GeometryKind::axis)) continue;
        most = depth;
        innermost = &one;
    }
    if (innermost == nullptr) return;
    innermost->beam.emplace();
    innermost->beam->guessed = true;
}

}  // namespace gonio::gdtf
