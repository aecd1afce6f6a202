// The patch of a show -> rows of ours: which slots drive which property of which light.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "protocol/dmx/patch.h"
#include "protocol/schema/console.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/exchange/axes.h"
#include "server/exchange/import_parts.h"
#include "server/scene/white.h"

namespace gonio::exchange {
namespace {

struct Look {
    double pan_rad, tilt_rad;
};
// Where a head is looked at to know how it is mounted; the first ones have no pan.
constexpr std::size_t kHome = 1;
constexpr auto kLooks = std::to_array<Look>(
    {{0.0, 1.0}, {0.0, 0.0}, {0.0, -1.2}, {0.0, 2.0}, {0.7, 0.5}, {0.7, -1.2}, {-1.9, 1.0}, {-1.9, 2.0}});

constexpr double kMostTurn_rad = 64.0 * std::numbers::pi;  // of the properties

Wanted is(std::string_view attribute) {
    return [attribute](std::string_view one) { return one == attribute; };
}
Wanted begins(std::string_view prefix) {
    return [prefix](std::string_view one) { return one.starts_with(prefix); };
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

// none, all: of the property where the channel's share is 0 and 1.
void add_share(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by, const Drive& drive) {
    const auto at = [&](double share) { return drive.low + (drive.high - drive.low) * share; };
    const Wanted wanted = is(by.function->attribute);
    if (is_line(beam, by)) {
        const auto share = [&](double physical) { return gdtf::component(*by.function, physical); };
        return add_row(import, beam, by, wanted,
                       {drive.property,
                        at(share(by.function->physical_from)),
                        at(share(by.function->physical_to)),
                        {},
                        drive.merge});
    }
    add_ranges(
        import, index, beam, by, wanted, drive.property,
        [&](const gdtf::ChannelFunction& function, double physical) -> std::optional<double> {
            if (!wanted(function.attribute)) return std::nullopt;
            return at(gdtf::component(function, physical));
        },
        drive.merge);
}

// A component of the light's colour, of one emitter, filter or wheel.
struct Share {
    const Driving* by;
    double none, all;    // of the component where it is dark or out, and where it is full or in
    double purity;       // what it does to this component, of what it does to all three
    bool wheel = false;  // its slots say it instead
};

// Whether the attribute chooses a slot of a wheel of colours: "Color1".
bool is_color_wheel(std::string_view attribute) {
    return attribute.starts_with("Color") && attribute.size() > 5 && attribute.size() < 9 &&
           std::ranges::all_of(attribute.substr(5), [](char c) { return c >= '0' && c <= '9'; });
}

// Adds a row of what each value of a wheel's channel leaves of a component.
void add_wheel(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by, const Drive& drive,
               int component) {
    const auto& functions = beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions;
    add_channel_ranges(
        import, index, beam, by, is_color_wheel, drive.property,
        [&](const gdtf::ChannelValue& value) -> std::optional<double> {
            const gdtf::ChannelFunction& function = functions[static_cast<std::size_t>(value.function)];
            if (!is_color_wheel(function.attribute)) return std::nullopt;
            return gdtf::slot_filter(beam.type, function, value.set)[component];
        },
        drive.merge);
}

// Adds the rows of each component's shares, the purest first: what has one row for each takes these.
void add_components(ShowImport& import, ModeIndex& index, const FixtureBeam& beam,
                    std::array<std::vector<Share>, 3>& shares, const char* merge) {
    static constexpr std::array kProperties = {"red", "green", "blue"};
    for (std::size_t k = 0; k < 3; ++k)
        std::ranges::stable_sort(shares[k], [](const Share& a, const Share& b) { return a.purity > b.purity; });
    for (const bool first : {true, false})
        for (std::size_t k = 0; k < 3; ++k)
            for (const Share& share : shares[k]) {
                if ((&share == &shares[k].front()) != first) continue;
                const Drive drive{kProperties[k], share.none, share.all, {}, shares[k].size() > 1 ? merge : ""};
                if (share.wheel)
                    add_wheel(import, index, beam, *share.by, drive, static_cast<int>(k));
                else
                    add_share(import, index, beam, *share.by, drive);
            }
}

// What each emitter adds to the light at full, as Rec.709 has it: its own luminance, and a hue as near as there is.
// Where Rec.709 lacks a hue, the emitters of which some is left make up for it, so that all together have the colour
// that the sum of their true hues has: white stays white.
std::vector<glm::dvec3> emitter_shares(const std::vector<gdtf::Color>& colors, double sum_percent) {
    std::vector<glm::dvec3> shares;
    glm::dvec3 wanted(0.0), given(0.0);
    for (const gdtf::Color& color : colors) {
        shares.push_back(gdtf::rgb_of(color) * (100.0 / sum_percent));
        wanted += gdtf::wide_rgb_of(color) * (100.0 / sum_percent);
        given += shares.back();
    }
    if (const double luminance = luminance_of(wanted); luminance > 0.0)
        wanted = in_gamut(wanted / luminance) * luminance;
    const glm::dvec3 missing = wanted - given;
    std::vector<double> rooms;  // how often each can take what is missing and stay a colour
    double room = 0.0;
    for (const glm::dvec3& share : shares) {
        double own = 1.0;
        for (int k = 0; k < 3; ++k)
            if (missing[k] < 0.0) own = std::min(own, share[k] / -missing[k]);
        rooms.push_back(own);
        room += own;
    }
    for (std::size_t i = 0; i < shares.size(); ++i)
        shares[i] = glm::max(shares[i] + missing * (rooms[i] / std::max(room, 1.0)), 0.0);
    return shares;
}

// Emitters are terms of red, green and blue, as gdtf::beam_states has them; a share of less than kLeastShare of a
// component's change has no row.
constexpr double kLeastShare = 0.005;
void add_emitters(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const std::vector<Driving>& emitters,
                  double sum_percent) {
    std::vector<gdtf::Color> colors;
    for (const Driving& by : emitters) colors.push_back(gdtf::color_of_function(beam.type, *by.function));
    const std::vector<glm::dvec3> rgb = emitter_shares(colors, sum_percent);
    std::array<std::vector<Share>, 3> shares;
    for (int k = 0; k < 3; ++k) {
        double whole = 0.0;
        for (const glm::dvec3& one : rgb) whole += one[k];
        for (std::size_t i = 0; i < rgb.size(); ++i)
            if (rgb[i][k] > kLeastShare * whole)
                shares[static_cast<std::size_t>(k)].push_back(
                    {&emitters[i], 0.0, rgb[i][k], rgb[i][k] / (rgb[i].r + rgb[i].g + rgb[i].b)});
    }
    add_components(import, index, beam, shares, "sum");
}

// Filters and wheels are factors, likewise, of the lamp's white: the light's cct has that.
void add_colors(ShowImport& import, ModeIndex& index, const FixtureBeam& beam) {
    double sum_percent = 0.0;  // of the luminances of all emitters that light this beam
    for (int at = beam.geometry; at >= 0; at = beam.mode.geometries[static_cast<std::size_t>(at)].parent) {
        const auto [first, last] = index.emitters_of.equal_range(at);
        for (auto one = first; one != last; ++one)
            sum_percent += gdtf::color_of_function(beam.type, *one->second).luminance_percent;
    }
    const bool by_rgb = gdtf::mix_by_rgb(beam.mode);
    const auto emitters = all_driving(index, beam, [&](std::string_view one) { return gdtf::adds_light(one, by_rgb); });
    if (!emitters.empty() && sum_percent > 0.0) return add_emitters(import, index, beam, emitters, sum_percent);
    std::array<std::vector<Share>, 3> shares;
    const auto filters = all_driving(index, beam, begins("ColorSub_"));
    for (const Driving& by : filters) {
        const glm::dvec3 passed = gdtf::rgb_of(gdtf::color_of_function(beam.type, *by.function));
        const glm::dvec3 stopped = 1.0 - passed;
        for (int k = 0; k < 3; ++k)
            if (std::abs(stopped[k]) > kLeastShare)
                shares[static_cast<std::size_t>(k)].push_back(
                    {&by, 1.0, passed[k],
                     std::abs(stopped[k]) / (std::abs(stopped.r) + std::abs(stopped.g) + std::abs(stopped.b))});
    }
    const auto wheels = all_driving(index, beam, is_color_wheel);
    for (const Driving& by : wheels)
        for (auto& own : shares)
            if (by.function->wheel >= 0) own.push_back({&by, 1.0, 1.0, 0.0, true});
    add_components(import, index, beam, shares, "product");
}

void add_temperature(ShowImport& import, ModeIndex& index, const FixtureBeam& beam) {
    const Wanted wanted = [](std::string_view one) { return one == "CTO" || one == "CTC" || one == "CTB"; };
    const auto all = all_driving(index, beam, wanted);
    if (all.empty()) return;
    Driving by = all.front();
    for (const Driving& one : all)  // of several at one geometry the last counts, as in gdtf::beam_states
        if (one.patched->geometry == by.patched->geometry) by = one;
    const auto& functions = beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions;
    const bool filled_in = std::ranges::any_of(functions, [&](const gdtf::ChannelFunction& one) {
        return wanted(one.attribute) && std::max(one.physical_from, one.physical_to) >= 500.0;
    });
    if (!filled_in) {
        import.report.add(Outcome::left_out, "the colour temperatures of a fixture type were never filled in",
                          beam.type.name + " " + by.function->attribute);
        index.driven.emplace(by.patched->channel, by.function->attribute);  // it has its line
        return;
    }
    add_state_ranges(import, index, beam, by, wanted, "cct",
                     [](const gdtf::BeamState& state) { return state.white_k; });
}

// The ranges of a channel's functions that turn about an axis, ascending; of those that overlap the first counts.
std::vector<v1::PatchRange> turns_of(const FixtureBeam& beam, const Driving& by, const Wanted& wanted, double offset,
                                     double sign, bool wide) {
    std::vector<const gdtf::ChannelFunction*> functions;
    for (const gdtf::ChannelFunction& one : beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions)
        if (wanted(one.attribute)) functions.push_back(&one);
    std::ranges::stable_sort(functions, {}, [](const gdtf::ChannelFunction* one) { return one->from; });
    std::vector<v1::PatchRange> ranges;
    const int shift = 8 * (by.bytes - (wide ? 2 : 1));
    for (const gdtf::ChannelFunction* const one : functions) {
        const std::uint32_t begin = one->from >> shift, end = one->to >> shift;
        const std::uint32_t from = ranges.empty() ? begin : std::max(begin, ranges.back().to() + 1);
        if (from > end || ranges.size() == kMaxPatchRanges) continue;
        const double skipped = end > begin ? static_cast<double>(from - begin) / (end - begin) : 0.0;
        const double first = one->physical_from + skipped * (one->physical_to - one->physical_from);
        v1::PatchRange& range = ranges.emplace_back();
        range.set_from(from);
        range.set_to(end);
        range.set_low(offset + sign * first * kDegree);
        range.set_high(offset + sign * one->physical_to * kDegree);
    }
    return ranges;
}

// Whether the channel's second slot follows the first, so that a row has both.
bool is_wide(const FixtureBeam& beam, const Driving& by) {
    if (by.patched->slots.size() < 2) return false;
    const Slot coarse = slot_of(beam.fixture, by.patched->dmx_break, by.patched->slots[0]),
               next = slot_of(beam.fixture, by.patched->dmx_break, by.patched->slots[1]);
    return next.universe == coarse.universe && next.address == coarse.address + 1;
}

// A channel without slots turns too, as its default says.
Head head_of(ModeIndex& index, const FixtureBeam& beam) {
    int pan = -1, tilt = -1;
    for (const Turn& turn : turns_of(index, beam.mode)[static_cast<std::size_t>(beam.geometry)])
        (turn.tilt ? tilt : pan) = turn.geometry;
    Head head{glm::dmat4(1.0), pan >= 0, tilt >= 0};
    for (int at = head.has_pan ? pan : tilt; at >= 0;) {
        const gdtf::Geometry& geometry = beam.mode.geometries[static_cast<std::size_t>(at)];
        head.fixture_from_mount = geometry.parent_from_geometry * head.fixture_from_mount;
        at = geometry.parent;
    }
    return head;
}

std::optional<HeadAxes> add_turns(ShowImport& import, ModeIndex& index, const FixtureBeam& beam) {
    const Driving pan = driving(index, beam, is("Pan")), tilt = driving(index, beam, is("Tilt"));
    if (pan.patched == nullptr && tilt.patched == nullptr) return std::nullopt;
    // They have rows or a line.
    if (pan.patched != nullptr) index.driven.emplace(pan.patched->channel, "Pan");
    if (tilt.patched != nullptr) index.driven.emplace(tilt.patched->channel, "Tilt");
    const auto never_filled_in = [&](const Driving& by) {
        return by.patched == nullptr || !is_filled_in(beam, by, is(by.function->attribute));
    };
    if (never_filled_in(pan) && never_filled_in(tilt)) {
        import.report.add(Outcome::left_out, "pan and tilt of a fixture type were never filled in", beam.type.name);
        return std::nullopt;
    }
    auto& directions = index.directions[{beam.fixture.invert_pan, beam.fixture.invert_tilt}];
    if (directions.empty())
        directions = head_directions(beam.type, beam.mode, beam.fixture.invert_pan, beam.fixture.invert_tilt);
    const auto axes = head_axes(directions, beam.geometry, beam.world_from_fixture, head_of(index, beam));
    if (!axes) {
        import.report.add(Outcome::left_out, "pan and tilt of a fixture whose axes are no tilt below a pan",
                          beam.light);
        return std::nullopt;
    }
    const auto add = [&](const Driving& by, const char* attribute, const char* property, double offset, double sign) {
        if (by.patched == nullptr) return;
        if (never_filled_in(by)) {
            import.report.add(Outcome::left_out, "pan or tilt of a fixture type was never filled in", beam.type.name);
            return;
        }
        const bool wide = is_wide(beam, by);
        const auto ranges = turns_of(beam, by, is(attribute), offset, sign, wide);
        for (const v1::PatchRange& range : ranges)
            if (!(std::abs(range.low()) <= kMostTurn_rad && std::abs(range.high()) <= kMostTurn_rad)) {
                import.report.add(Outcome::left_out, "a turn of more than 32 rounds", beam.light);
                return;
            }
        if (ranges.empty()) return;
        const bool whole =
            ranges.size() == 1 && by.function->from == 0 && by.function->to == gdtf::greatest_of(by.bytes);
        if (whole)
            add_row(import, beam, by, is(attribute), {property, ranges[0].low(), ranges[0].high()});
        else
            add_row(import, beam, by, is(attribute), {property, 0.0, 0.0, ranges, "", wide});
    };
    add(pan, "Pan", "pan", axes->pan_offset_rad, axes->pan_sign);
    add(tilt, "Tilt", "tilt", axes->tilt_offset_rad, axes->tilt_sign);
    return axes;
}

}  // namespace

std::vector<Driving> all_driving(const ModeIndex& index, const FixtureBeam& beam, const Wanted& wanted) {
    std::vector<Driving> found;
    for (int at = beam.geometry; at >= 0; at = beam.mode.geometries[static_cast<std::size_t>(at)].parent) {
        const auto [first, last] = index.channels_of.equal_range(at);
        for (auto one = first; one != last; ++one) {
            const gdtf::Channel& channel = beam.mode.channels[static_cast<std::size_t>(one->second->channel)];
            const auto function = std::ranges::find_if(
                channel.functions, [&](const gdtf::ChannelFunction& own) { return wanted(own.attribute); });
            if (function != channel.functions.end()) found.push_back({one->second, &*function, channel.bytes});
        }
    }
    return found;
}

Driving driving(const ModeIndex& index, const FixtureBeam& beam, const Wanted& wanted) {
    const auto found = all_driving(index, beam, wanted);
    return found.empty() ? Driving{} : found.front();
}

void add_row(ShowImport& import, const FixtureBeam& beam, const Driving& by, const Wanted& wanted, const Drive& drive) {
    ModeIndex& index = index_of(import, beam.mode);
    for (const auto& function : beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions)
        if (wanted(function.attribute)) index.driven.emplace(by.patched->channel, function.attribute);
    const Slot coarse = slot_of(beam.fixture, by.patched->dmx_break, by.patched->slots[0]);
    if (coarse.universe == 0 || coarse.universe > mvr::kMostUniverse) {
        import.report.add(Outcome::left_out,
                          coarse.universe == 0 ? "a channel's break is not patched" : "a slot beyond the last universe",
                          beam.light + " " + drive.property);
        return;
    }
    if (import.patch.rows_size() >= static_cast<int>(kMaxPatchRows)) {
        import.report.add(Outcome::left_out, "a property beyond the 4,096 rows of a patch", beam.light);
        return;
    }
    const bool wide = is_wide(beam, by);
    if (by.patched->slots.size() > 1 && !wide)
        import.report.add(Outcome::guessed, "a channel's bytes are not neighbours: the most significant one counts",
                          beam.light);
    v1::PatchRow& row = *import.patch.add_rows();
    row.set_protocol("sacn");
    row.set_universe(coarse.universe);
    row.set_address(coarse.address);
    row.set_target(beam.light);
    row.set_property(drive.property);
    row.set_bits(wide && (drive.ranges.empty() || drive.wide_ranges) ? 16 : 8);
    row.set_merge(drive.merge);
    if (drive.ranges.empty()) {
        row.set_low(drive.low);
        row.set_high(drive.high);
    }
    row.mutable_ranges()->Add(drive.ranges.begin(), drive.ranges.end());
    v1::SetPatch alone;
    *alone.add_rows() = row;
    if (const auto checked = check_patch(alone); !checked) {
        import.report.add(Outcome::left_out, "a row that a patch does not take",
                          shortened_text(beam.light + " " + drive.property + ": " + checked.error().text(), 200));
        import.patch.mutable_rows()->RemoveLast();
    }
}

ModeIndex& index_of(ShowImport& import, const gdtf::Mode& mode) {
    const auto [at, fresh] = import.modes.try_emplace(&mode);
    ModeIndex& index = at->second;
    if (!fresh) return index;
    index.has_beam = std::any_of(mode.geometries.begin(), mode.geometries.end(),
                                 [](const gdtf::Geometry& one) { return one.beam.has_value(); });
    const bool by_rgb = gdtf::mix_by_rgb(mode);
    for (const gdtf::PatchedChannel& patched : mode.patched) {
        const auto& functions = mode.channels[static_cast<std::size_t>(patched.channel)].functions;
        if (!patched.slots.empty()) index.channels_of.emplace(patched.geometry, &patched);
        const auto emitter = std::find_if(functions.begin(), functions.end(), [&](const gdtf::ChannelFunction& one) {
            return gdtf::adds_light(one.attribute, by_rgb);
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
                                  const glm::dmat4& world_from_fixture, const Head& head) {
    const glm::dmat4 fixture_from_mount = glm::mat4_cast(turn_of(head.fixture_from_mount));
    const glm::dmat3 mount_from_fixture = glm::dmat3(y_up_from_z_up()) * glm::transpose(glm::dmat3(fixture_from_mount));
    const auto seen_at = [&](std::size_t look) {
        return glm::normalize(mount_from_fixture * directions.at(look).at(beam_geometry));
    };
    const double home = std::acos(std::clamp(-seen_at(kHome).y, -1.0, 1.0));  // the tilt, but for its sign
    for (const double tilt_offset : {home, -home})
        for (const double tilt_sign : {1.0, -1.0})
            for (const double pan_sign : {1.0, -1.0}) {
                const auto tilt_at = [&](std::size_t look) {
                    return tilt_offset + (head.has_tilt ? tilt_sign * kLooks[look].tilt_rad : 0.0);
                };
                // aim = (-sin t sin p, -cos t, -sin t cos p), as orientation.h has pan and tilt.
                const std::size_t from =
                    std::abs(std::sin(tilt_at(0))) > 0.1 ? 0 : 2;  // where it is not along the pan axis
                const double sine = std::sin(tilt_at(from));
                const glm::dvec3 seen = seen_at(from);
                const double pan_offset = std::abs(sine) > 1e-3 ? std::atan2(-seen.x / sine, -seen.z / sine) : 0.0;
                const HeadAxes axes{pan_offset, pan_sign, tilt_offset, tilt_sign,
                                    turn_of(world_from_fixture * fixture_from_mount * z_up_from_y_up())};
                bool fits = true;
                for (std::size_t look = 0; look < kLooks.size() && fits; ++look) {
                    if (kLooks[look].pan_rad != 0.0 && !head.has_pan) continue;
                    const double p = axes.pan_offset_rad + pan_sign * kLooks[look].pan_rad, t = tilt_at(look);
                    const glm::dvec3 aim(-std::sin(t) * std::sin(p), -std::cos(t), -std::sin(t) * std::cos(p));
                    fits = glm::length(aim - seen_at(look)) < 1e-4;
                }
                if (fits) return axes;
            }
    return std::nullopt;
}

void note_undriven(ShowImport& import) {
    for (const auto& [mode, index] : import.modes) {
        if (index.patched_type == nullptr) continue;
        std::set<int> with_slots;
        std::set<std::pair<std::string, bool>> told;  // attributes
        for (const auto& [geometry, patched] : index.channels_of) with_slots.insert(patched->channel);
        for (const int channel : with_slots)
            for (const auto& function : mode->channels[static_cast<std::size_t>(channel)].functions) {
                const std::string what = index.patched_type->name + " " + function.attribute;
                const bool driven = index.driven.contains({channel, function.attribute});
                if (function.attribute.empty() || function.attribute == "NoFeature") continue;
                if (!told.emplace(function.attribute, driven).second) continue;
                if (!driven)
                    import.report.add(Outcome::left_out, "DMX of an attribute drives nothing", what);
                else if (function.master >= 0)
                    import.report.add(Outcome::guessed,
                                      "what depends on another channel is driven as at that channel's default", what);
            }
    }
}

std::optional<HeadAxes> add_patch_rows(ShowImport& import, const FixtureBeam& beam) {
    if (beam.fixture.patches.empty()) return {};
    ModeIndex& index = index_of(import, beam.mode);
    index.patched_type = &beam.type;
    const auto dimmers = all_driving(index, beam, is("Dimmer"));
    for (const Driving& dimmer : dimmers)
        add_share(import, index, beam, dimmer, {"level", 0.0, 1.0, {}, dimmers.size() > 1 ? "product" : ""});
    add_temperature(import, index, beam);
    add_colors(import, index, beam);
    add_beam_rows(import, index, beam);
    return add_turns(import, index, beam);
}

}  // namespace gonio::exchange
