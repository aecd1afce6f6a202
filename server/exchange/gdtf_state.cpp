// What the values of a fixture's channels do to its beams.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "server/exchange/gdtf_dmx.h"
#include "server/scene/white.h"

namespace gonio::gdtf {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLeastCct_k = 1000.0, kMostCct_k = 15000.0;  // of white_factors()
constexpr double kLeastZoom_deg = 0.1, kMostZoom_deg = 179.0;

// What one geometry's own channels say.
struct Effects {
    std::optional<double> pan_rad, tilt_rad;
    double dimmer_ratio = 1.0;
    bool open = true;
    double strobe_hz = 0.0;
    std::optional<double> zoom_rad, cct_k;
    std::vector<std::pair<Color, double>> emitters;  // with their levels
    glm::dvec3 filter{1.0};
    std::vector<GoboState> gobos;
};

// "Gobo2Pos" -> 2 and "Pos", where prefix is "Gobo"; nothing where no number follows it.
std::optional<std::pair<int, std::string_view>> numbered(std::string_view attribute, std::string_view prefix) {
    if (!attribute.starts_with(prefix)) return std::nullopt;
    attribute.remove_prefix(prefix.size());
    int number = 0;
    std::size_t digits = 0;
    for (; digits < attribute.size() && digits < 4 && std::isdigit(static_cast<unsigned char>(attribute[digits]));
         ++digits)
        number = 10 * number + (attribute[digits] - '0');
    if (digits == 0) return std::nullopt;
    return std::pair(number, attribute.substr(digits));
}

bool never_filled_in(const ChannelFunction& function) {
    return function.physical_from == 0.0 && function.physical_to == 1.0;
}

GoboState& gobo_of(Effects& effects, int number) {
    for (GoboState& gobo : effects.gobos)
        if (gobo.number == number) return gobo;
    effects.gobos.push_back({number});
    return effects.gobos.back();
}

// Result: the slot that a set of a function chooses; nullptr: none.
const Slot* slot_of(const FixtureType& type, const ChannelFunction& function, int set) {
    if (function.wheel < 0 || set < 0) return nullptr;
    const int index = function.sets[static_cast<std::size_t>(set)].slot - 1;
    const std::vector<Slot>& slots = type.wheels[static_cast<std::size_t>(function.wheel)].slots;
    return index >= 0 && static_cast<std::size_t>(index) < slots.size() ? &slots[static_cast<std::size_t>(index)]
                                                                        : nullptr;
}

void take(const FixtureType& type, bool by_rgb, const ChannelFunction& function, const ChannelValue& value,
          Effects& effects) {
    const std::string_view attribute = function.attribute;
    const double physical = value.physical;
    const Slot* const slot = slot_of(type, function, value.set);
    if (attribute == "Dimmer") {
        effects.dimmer_ratio *= component(function, physical);
    } else if (attribute == "Pan") {
        effects.pan_rad = physical * kDegree;
    } else if (attribute == "Tilt") {
        effects.tilt_rad = physical * kDegree;
    } else if (attribute == "Zoom") {
        if (!never_filled_in(function) && physical >= kLeastZoom_deg && physical <= kMostZoom_deg)
            effects.zoom_rad = physical * kDegree;
    } else if (adds_light(attribute, by_rgb)) {
        effects.emitters.emplace_back(color_of_function(type, function), component(function, physical));
    } else if (attribute.starts_with("ColorSub_")) {
        const double level = component(function, physical);
        effects.filter *= 1.0 - level + level * rgb_of(color_of_function(type, function));
    } else if (attribute == "CTC" || attribute == "CTO" || attribute == "CTB") {
        if (!never_filled_in(function) && physical >= 500.0)
            effects.cct_k = std::clamp(physical, kLeastCct_k, kMostCct_k);
    } else if (const auto shutter = numbered(attribute, "Shutter")) {
        if (shutter->second.empty())
            effects.open = effects.open && physical >= 0.5;
        else if (shutter->second.starts_with("Strobe"))
            effects.strobe_hz = std::max(effects.strobe_hz, std::max(physical, 0.0));
    } else if (numbered(attribute, "Color") && slot != nullptr) {
        effects.filter *= slot_filter(type, function, value.set);
    } else if (const auto gobo = numbered(attribute, "Gobo")) {
        GoboState& state = gobo_of(effects, gobo->first);
        if (gobo->second == "Pos") {
            state.angle_rad = physical * kDegree;
        } else if (slot != nullptr) {
            state.wheel = function.wheel;
            state.slot = function.sets[static_cast<std::size_t>(value.set)].slot - 1;
        }
    }
}

// white_k: of BeamState.
glm::dvec3 color_of_beam(const Effects& all, double lamp_k, double& white_k) {
    glm::dvec3 color(0.0);
    double sum = 0.0;
    for (const auto& [emitter, level] : all.emitters) {
        color += level * wide_rgb_of(emitter);
        sum += emitter.luminance_percent / 100.0;
    }
    if (const double luminance = luminance_of(color); luminance > 0.0) color = in_gamut(color / luminance) * luminance;
    white_k = all.cct_k.value_or(sum > 0.0 ? 0.0 : std::clamp(lamp_k, kLeastCct_k, kMostCct_k));
    color = sum > 0.0 ? color / sum : glm::dvec3(1.0);
    if (white_k > 0.0) color *= white_factors(white_k, 0.0);
    return color * all.filter;
}

}  // namespace

bool adds_light(std::string_view attribute, bool by_rgb) {
    return attribute.starts_with("ColorAdd_") ||
           (by_rgb && attribute.starts_with("ColorRGB_") && standard_color(attribute).has_value());
}

bool mix_by_rgb(const Mode& mode) {
    return std::ranges::none_of(mode.channels, [](const Channel& channel) {
        return std::ranges::any_of(channel.functions, [](const ChannelFunction& function) {
            return function.attribute.starts_with("ColorAdd_");
        });
    });
}

Color color_of_function(const FixtureType& type, const ChannelFunction& function) {
    if (function.emitter >= 0 && type.emitters[function.emitter].color) {
        Color color = *type.emitters[function.emitter].color;
        if (color.luminance_percent < 0.0) {
            ChannelFunction plain;
            plain.attribute = function.attribute;
            color.luminance_percent = color_of_function(type, plain).luminance_percent;
        }
        return color;
    }
    if (function.filter >= 0 && type.filters[function.filter].color) return *type.filters[function.filter].color;
    if (const auto own = type.attribute_colors.find(function.attribute); own != type.attribute_colors.end())
        return own->second;
    return standard_color(function.attribute).value_or(Color{});
}

glm::dvec3 rgb_of(const Color& color) {
    return rgb_of_xy({color.x, color.y}) * (color.luminance_percent / 100.0);
}

glm::dvec3 wide_rgb_of(const Color& color) {
    constexpr double kLeastY = 1e-6;  // no light has less: the locus ends at 0.005
    return wide_rgb_of_xy({color.x, std::max(color.y, kLeastY)}) * (color.luminance_percent / 100.0);
}

glm::dvec3 slot_filter(const FixtureType& type, const ChannelFunction& function, int set) {
    const Slot* const slot = slot_of(type, function, set);
    return slot != nullptr && slot->color ? rgb_of(*slot->color) : glm::dvec3(1.0);
}

double component(const ChannelFunction& function, double physical) {
    const double most = std::max(std::abs(function.physical_from), std::abs(function.physical_to));
    return std::clamp(most > 1.5 ? physical / most : physical, 0.0, 1.0);
}

std::vector<BeamState> beam_states(const FixtureType& type, const Mode& mode, const std::vector<ChannelValue>& values,
                                   const StateOptions& options) {
    std::map<int, Effects> own;
    const bool by_rgb = mix_by_rgb(mode);
    for (const ChannelValue& value : values) {
        if (value.function < 0) continue;
        const PatchedChannel& patched = mode.patched[static_cast<std::size_t>(value.patched)];
        take(type, by_rgb,
             mode.channels[static_cast<std::size_t>(patched.channel)]
                 .functions[static_cast<std::size_t>(value.function)],
             value, own[patched.geometry]);
    }
    for (const PatchedChannel& patched : mode.patched)  // also where another function of the channel is active
        for (const ChannelFunction& function : mode.channels[static_cast<std::size_t>(patched.channel)].functions) {
            if (function.attribute == "Pan" && options.pan_rad) own[patched.geometry].pan_rad = options.pan_rad;
            if (function.attribute == "Tilt" && options.tilt_rad) own[patched.geometry].tilt_rad = options.tilt_rad;
        }
    std::vector<glm::dmat4> fixture_from(mode.geometries.size());
    std::vector<BeamState> states;
    for (std::size_t g = 0; g < mode.geometries.size(); ++g) {
        const Geometry& geometry = mode.geometries[g];
        glm::dmat4& here = fixture_from[g];
        here = geometry.parent_from_geometry;
        if (geometry.parent >= 0) here = fixture_from[static_cast<std::size_t>(geometry.parent)] * here;
        if (const auto at = own.find(static_cast<int>(g)); at != own.end()) {
            const double pan = at->second.pan_rad.value_or(0.0) * (options.invert_pan ? -1.0 : 1.0);
            const double tilt = at->second.tilt_rad.value_or(0.0) * (options.invert_tilt ? -1.0 : 1.0);
            here = glm::rotate(here, pan, glm::dvec3(0, 0, 1));
            here = glm::rotate(here, tilt, glm::dvec3(1, 0, 0));
        }
        if (!geometry.beam) continue;
        BeamState state;
        state.geometry = static_cast<int>(g);
        state.fixture_from_beam = here;
        Effects all;
        for (int at = state.geometry; at >= 0; at = mode.geometries[static_cast<std::size_t>(at)].parent) {
            const auto found = own.find(at);
            if (found == own.end()) continue;
            const Effects& one = found->second;
            all.dimmer_ratio *= one.dimmer_ratio;
            all.open = all.open && one.open;
            all.strobe_hz = std::max(all.strobe_hz, one.strobe_hz);
            if (!all.zoom_rad) all.zoom_rad = one.zoom_rad;  // the nearest one counts
            if (!all.cct_k) all.cct_k = one.cct_k;
            all.emitters.insert(all.emitters.end(), one.emitters.begin(), one.emitters.end());
            all.filter *= one.filter;
            for (const GoboState& gobo : one.gobos)
                if (gobo.wheel >= 0) all.gobos.push_back(gobo);
        }
        state.dimmer_ratio = all.dimmer_ratio;
        state.shutter_open = all.open;
        state.strobe_hz = all.strobe_hz;
        state.zoom_rad = all.zoom_rad;
        state.gobos = std::move(all.gobos);
        state.color = color_of_beam(all, geometry.beam->color_temperature_k.value, state.white_k);
        states.push_back(std::move(state));
    }
    return states;
}

}  // namespace gonio::gdtf
