// The patch of a show -> rows of ours: which slots drive which property of which light.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "protocol/text/shortened_text.h"
#include "server/exchange/axes.h"
#include "server/exchange/import_parts.h"
#include "server/scene/white.h"

namespace gonio::exchange {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;
struct Look {
    double pan_rad, tilt_rad;
};
// Where a head is looked at to know how it is mounted; the first has no pan, and a tilt that is not along the pan axis.
constexpr auto kLooks = std::to_array<Look>(
    {{0.0, 1.0}, {0.0, 0.0}, {0.0, -1.2}, {0.0, 2.0}, {0.7, 0.5}, {0.7, -1.2}, {-1.9, 1.0}, {-1.9, 2.0}});

constexpr int kMaxRows = 4096;                // of a patch
constexpr double kMostTurn_rad = 64.0 * kPi;  // of the properties

Driving driving(const ModeIndex& index, const FixtureBeam& beam, std::string_view attribute) {
    return driving(index, beam, [&](std::string_view one) { return one == attribute; });
}

struct Slot {
    unsigned universe = 0, address = 0;  // 0: the break is not patched
};

Slot slot_of(const mvr::Fixture& fixture, int dmx_break, int slot) {
    for (const mvr::Patch& patch : fixture.patches) {
        if (patch.dmx_break != dmx_break) continue;
        const unsigned at = patch.address - 1 + static_cast<unsigned>(slot) - 1;
        return {patch.universe + at / 512, at % 512 + 1};
    }
    return {};
}

// What the physical value would be at slot value 0 and at the highest, were the function's line to go on.
std::pair<double, double> ends_of(const Driving& by) {
    const gdtf::ChannelFunction& function = *by.function;
    const double from = function.from, to = function.to, most = gdtf::greatest_of(by.bytes);
    const double slope = to > from ? (function.physical_to - function.physical_from) / (to - from) : 0.0;
    return {function.physical_from - slope * from, function.physical_from + slope * (most - from)};
}

// What is the share 1 of a function: 1, or of one in percent what it reaches.
double whole_share(const gdtf::ChannelFunction& function) {
    const double most = std::max(std::abs(function.physical_from), std::abs(function.physical_to));
    return most > 1.5 ? most : 1.0;
}

// ends_of() as shares. Result: nothing where no straight line from 0 to 1 says it: of a function with a DMX profile,
// or with a part of its channel.
std::optional<std::pair<double, double>> shares_of(const Driving& by) {
    if (by.function->profile >= 0) return std::nullopt;
    auto [low, high] = ends_of(by);
    low /= whole_share(*by.function), high /= whole_share(*by.function);
    constexpr double kRounding = 1e-3;
    if (std::min(low, high) < -kRounding || std::max(low, high) > 1.0 + kRounding) return std::nullopt;
    return std::pair(std::clamp(low, 0.0, 1.0), std::clamp(high, 0.0, 1.0));
}

// none, all: of the property where the channel's share is 0 and 1.
void add_share(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by, const char* property,
               double none, double all) {
    const auto at = [&](double share) { return none + (all - none) * share; };
    if (const auto share = shares_of(by))
        return add_row(import, beam, by, property, at(share->first), at(share->second));
    add_ranges(import, index, beam, by, property,
               [&](const auto&, const gdtf::ChannelFunction& function, double physical) -> std::optional<double> {
                   if (function.attribute != by.function->attribute) return std::nullopt;
                   return at(std::clamp(physical / whole_share(function), 0.0, 1.0));
               });
}

void note_undriven(ShowImport& import, const FixtureBeam& beam) {
    static constexpr std::array kDriven = {"Dimmer", "Pan", "Tilt", "NoFeature"};
    std::set<std::string_view> told;
    for (const gdtf::Channel& channel : beam.mode.channels)
        for (const gdtf::ChannelFunction& function : channel.functions) {
            if (std::find(kDriven.begin(), kDriven.end(), function.attribute) != kDriven.end()) continue;
            const bool color = function.attribute.size() == 10 && (function.attribute.starts_with("ColorAdd_") ||
                                                                   function.attribute.starts_with("ColorSub_"));
            if (color && std::string_view("RGBCMY").find(function.attribute.back()) != std::string_view::npos) continue;
            if (drives_beam(function.attribute)) continue;
            if (told.insert(function.attribute).second)
                import.report.add(Outcome::left_out, "DMX of an attribute drives nothing",
                                  beam.type.name + " " + function.attribute);
        }
}

void add_colors(ShowImport& import, ModeIndex& index, const FixtureBeam& beam) {
    static constexpr std::array kProperties = {"red", "green", "blue"};
    const auto color_of = [&](const gdtf::ChannelFunction& function) {
        if (function.emitter >= 0) {
            const auto& color = beam.type.emitters[static_cast<std::size_t>(function.emitter)].color;
            if (color) return *color;
        }
        const auto own = beam.type.attribute_colors.find(function.attribute);
        if (own != beam.type.attribute_colors.end()) return own->second;
        return gdtf::standard_color(function.attribute).value_or(gdtf::Color{});
    };
    double sum = 0.0;  // of the luminances of all emitters that light this beam
    for (int at = beam.geometry; at >= 0; at = beam.mode.geometries[static_cast<std::size_t>(at)].parent) {
        const auto [first, last] = index.emitters_of.equal_range(at);
        for (auto one = first; one != last; ++one) sum += color_of(*one->second).luminance_percent;
    }
    Driving add[3], subtract[3];
    for (std::size_t i = 0; i < 3; ++i) {
        add[i] = driving(index, beam, std::string("ColorAdd_") + "RGB"[i]);
        subtract[i] = driving(index, beam, std::string("ColorSub_") + "CMY"[i]);
    }
    const auto whole = [](const Driving(&list)[3]) {
        return list[0].patched != nullptr && list[1].patched != nullptr && list[2].patched != nullptr;
    };
    const glm::dvec3 white = white_factors(
        std::clamp(beam.mode.geometries[static_cast<std::size_t>(beam.geometry)].beam->color_temperature_k.value,
                   1000.0, 15000.0),
        0.0);
    for (int i = 0; i < 3; ++i) {
        const std::size_t at = static_cast<std::size_t>(i);
        if (whole(add) && sum > 0.0) {
            const gdtf::Color color = color_of(*add[at].function);
            const double most = rgb_of_xy({color.x, color.y})[i] * color.luminance_percent / sum;
            add_share(import, index, beam, add[at], kProperties[at], 0.0, most);
        } else if (whole(subtract)) {
            add_share(import, index, beam, subtract[at], kProperties[at], white[i], 0.0);
        }
    }
    if (whole(add) || whole(subtract))
        import.report.add(Outcome::guessed, "red, green and blue of a light are its emitters or filters, each alone",
                          beam.light);
}

}  // namespace

Driving driving(const ModeIndex& index, const FixtureBeam& beam, const std::function<bool(std::string_view)>& wanted) {
    for (int at = beam.geometry; at >= 0; at = beam.mode.geometries[static_cast<std::size_t>(at)].parent) {
        const auto [first, last] = index.channels_of.equal_range(at);
        for (auto one = first; one != last; ++one) {
            const gdtf::Channel& channel = beam.mode.channels[static_cast<std::size_t>(one->second->channel)];
            for (const gdtf::ChannelFunction& function : channel.functions)
                if (wanted(function.attribute)) return {one->second, &function, channel.bytes};
        }
    }
    return {};
}

void add_row(ShowImport& import, const FixtureBeam& beam, const Driving& by, const char* property, double low,
             double high, const std::vector<v1::PatchRange>& ranges) {
    const Slot coarse = slot_of(beam.fixture, by.patched->dmx_break, by.patched->slots[0]);
    if (coarse.universe == 0 || coarse.universe > mvr::kMostUniverse) {
        import.report.add(Outcome::left_out,
                          coarse.universe == 0 ? "a channel's break is not patched" : "a slot beyond the last universe",
                          beam.light + " " + property);
        return;
    }
    if (import.patch.rows_size() >= kMaxRows) {
        import.report.add(Outcome::left_out, "a property beyond the 4,096 rows of a patch", beam.light);
        return;
    }
    bool fine = by.patched->slots.size() > 1 && ranges.empty();
    if (fine) {
        const Slot next = slot_of(beam.fixture, by.patched->dmx_break, by.patched->slots[1]);
        fine = next.universe == coarse.universe && next.address == coarse.address + 1;
        if (!fine)
            import.report.add(Outcome::guessed, "a channel's bytes are not neighbours: the most significant one counts",
                              beam.light);
    }
    v1::PatchRow& row = *import.patch.add_rows();
    row.set_protocol("sacn");
    row.set_universe(coarse.universe);
    row.set_address(coarse.address);
    row.set_target(beam.light);
    row.set_property(property);
    row.set_bits(fine ? 16 : 8);
    if (ranges.empty()) {
        row.set_low(low);
        row.set_high(high);
    }
    row.mutable_ranges()->Add(ranges.begin(), ranges.end());
}

ModeIndex& index_of(ShowImport& import, const gdtf::Mode& mode) {
    const auto [at, fresh] = import.modes.try_emplace(&mode);
    ModeIndex& index = at->second;
    if (!fresh) return index;
    index.has_beam = std::any_of(mode.geometries.begin(), mode.geometries.end(),
                                 [](const gdtf::Geometry& one) { return one.beam.has_value(); });
    for (const gdtf::PatchedChannel& patched : mode.patched) {
        const auto& functions = mode.channels[static_cast<std::size_t>(patched.channel)].functions;
        if (!patched.slots.empty()) index.channels_of.emplace(patched.geometry, &patched);
        const auto emitter = std::find_if(functions.begin(), functions.end(), [](const gdtf::ChannelFunction& one) {
            return one.attribute.starts_with("ColorAdd_");
        });
        if (emitter != functions.end()) index.emitters_of.emplace(patched.geometry, &*emitter);
    }
    return index;
}

std::vector<std::map<int, glm::dvec3>> head_directions(const gdtf::FixtureType& type, const gdtf::Mode& mode,
                                                       bool invert_pan, bool invert_tilt) {
    std::vector<std::map<int, glm::dvec3>> directions;
    const auto values = gdtf::default_values(type, mode);
    for (const auto& [pan, tilt] : kLooks) {
        std::map<int, glm::dvec3>& here = directions.emplace_back();
        for (const gdtf::BeamState& state : gdtf::beam_states(type, mode, values, {invert_pan, invert_tilt, pan, tilt}))
            here.emplace(state.geometry, glm::dvec3(state.fixture_from_beam * glm::dvec4(0, 0, -1, 0)));
    }
    return directions;
}

std::optional<HeadAxes> head_axes(const std::vector<std::map<int, glm::dvec3>>& directions, int beam_geometry,
                                  const glm::dmat4& world_from_fixture, bool has_pan) {
    const auto seen_at = [&](std::size_t look) {
        return glm::normalize(glm::dmat3(y_up_from_z_up()) * directions.at(look).at(beam_geometry));
    };
    const glm::dvec3 seen = seen_at(0);
    for (const double tilt_offset : {0.0, kPi})
        for (const double tilt_sign : {1.0, -1.0})
            for (const double pan_sign : {1.0, -1.0}) {
                // aim = (-sin t sin p, -cos t, -sin t cos p), as orientation.h has pan and tilt.
                const double sine = std::sin(tilt_offset + tilt_sign * kLooks[0].tilt_rad);
                const HeadAxes axes{std::atan2(-seen.x / sine, -seen.z / sine), pan_sign, tilt_offset, tilt_sign,
                                    turn_of(world_from_fixture * z_up_from_y_up())};
                bool fits = true;
                for (std::size_t look = 0; look < kLooks.size() && fits; ++look) {
                    if (kLooks[look].pan_rad != 0.0 && !has_pan) continue;
                    const double p = axes.pan_offset_rad + pan_sign * kLooks[look].pan_rad,
                                 t = tilt_offset + tilt_sign * kLooks[look].tilt_rad;
                    const glm::dvec3 aim(-std::sin(t) * std::sin(p), -std::cos(t), -std::sin(t) * std::cos(p));
                    fits = glm::length(aim - seen_at(look)) < 1e-4;
                }
                if (fits) return axes;
            }
    return std::nullopt;
}

std::optional<HeadAxes> add_patch_rows(ShowImport& import, const FixtureBeam& beam) {
    if (beam.fixture.patches.empty()) return std::nullopt;
    ModeIndex& index = index_of(import, beam.mode);
    if (!index.told_undriven) note_undriven(import, beam);
    index.told_undriven = true;
    if (const Driving dimmer = driving(index, beam, "Dimmer"); dimmer.patched != nullptr)
        add_share(import, index, beam, dimmer, "level", 0.0, 1.0);
    add_colors(import, index, beam);
    add_beam_rows(import, index, beam);
    const Driving pan = driving(index, beam, "Pan"), tilt = driving(index, beam, "Tilt");
    if (pan.patched == nullptr && tilt.patched == nullptr) return std::nullopt;
    const auto never_filled_in = [](const Driving& by) {
        return by.function == nullptr || (by.function->physical_from == 0.0 && by.function->physical_to == 1.0);
    };
    if (never_filled_in(pan) && never_filled_in(tilt)) {
        import.report.add(Outcome::left_out, "pan and tilt of a fixture type were never filled in", beam.type.name);
        return std::nullopt;
    }
    auto& directions = index.directions[{beam.fixture.invert_pan, beam.fixture.invert_tilt}];
    if (directions.empty())
        directions = head_directions(beam.type, beam.mode, beam.fixture.invert_pan, beam.fixture.invert_tilt);
    const auto axes = head_axes(directions, beam.geometry, beam.world_from_fixture, pan.patched != nullptr);
    if (!axes) {
        import.report.add(Outcome::left_out, "pan and tilt of a fixture whose axes are no tilt below a pan",
                          beam.light);
        return std::nullopt;
    }
    const auto add = [&](const Driving& by, const char* property, double offset, double sign) {
        if (never_filled_in(by)) return;
        const auto [from, to] = ends_of(by);
        const double low = offset + sign * from * kDegree, high = offset + sign * to * kDegree;
        if (std::abs(low) <= kMostTurn_rad && std::abs(high) <= kMostTurn_rad)
            add_row(import, beam, by, property, low, high);
        else
            import.report.add(Outcome::left_out, "a turn of more than 32 rounds", beam.light);
    };
    add(pan, "pan", axes->pan_offset_rad, axes->pan_sign);
    add(tilt, "tilt", axes->tilt_offset_rad, axes->tilt_sign);
    return axes;
}

}  // namespace gonio::exchange
