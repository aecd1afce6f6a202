// Shutter, strobe, zoom and gobo of a show's fixtures: which slots drive them, and the wheels' pictures.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/core/printed.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/property.h"
#include "server/assets/gltf_import.h"
#include "server/exchange/beam_web.h"
#include "server/exchange/gobo_image.h"
#include "server/exchange/import_parts.h"
#include "server/scene/light_tables.h"
#include "server/scene/limits.h"
#include "server/scene/packed_gobo.h"
#include "server/scene/shaped_profile.h"

namespace gonio::exchange {
namespace {

constexpr std::size_t kMostSlots = 255, kMostPictures = 64;
// Of a web behind a gobo, with what lighting makes of it: four numbers for each of its angles.
constexpr std::size_t kBytesOfGoboWeb = std::size_t{kGoboPlanes + 1} * (kGoboRings + 1) * 16;

// "Gobo2Pos" -> 2, where `end` is "Pos"; 0 where the attribute is another one.
int number_in(std::string_view attribute, std::string_view begin, std::string_view end) {
    if (!attribute.starts_with(begin)) return 0;
    attribute.remove_prefix(begin.size());
    if (attribute.size() <= end.size() || !attribute.ends_with(end)) return 0;
    attribute.remove_suffix(end.size());
    if (attribute.size() > 3) return 0;
    int number = 0;
    for (const char digit : attribute) {
        if (digit < '0' || digit > '9') return 0;
        number = 10 * number + (digit - '0');
    }
    return number;
}

bool is_shutter(std::string_view attribute) {
    if (!attribute.starts_with("Shutter")) return false;
    const std::size_t at = attribute.find("Strobe");
    return number_in(attribute.substr(0, at), "Shutter", "") > 0;
}

// values: of slot values 0 to 255. Result: runs of equal values, or of equal steps.
std::vector<v1::PatchRange> ranges_of(const std::vector<std::optional<double>>& values) {
    std::vector<v1::PatchRange> ranges;
    const auto near = [](double a, double b) { return std::abs(a - b) < 1e-6 * std::max(1.0, std::abs(a)); };
    for (std::size_t begin = 0; begin < values.size();) {
        std::size_t end = begin + 1;
        if (values[begin]) {
            const auto goes_on = [&] {
                return end < values.size() && values[end] &&
                       near(*values[end],
                            *values[begin] + static_cast<double>(end - begin) * (*values[begin + 1] - *values[begin]));
            };
            while (goes_on()) ++end;
            v1::PatchRange& range = ranges.emplace_back();
            range.set_from(static_cast<std::uint32_t>(begin));
            range.set_to(static_cast<std::uint32_t>(end - 1));
            range.set_low(*values[begin]);
            range.set_high(*values[end - 1]);
        }
        begin = end;
    }
    return ranges;
}

// The channel's values where its most significant slot is 0 to 255; the less significant ones follow it.
std::vector<gdtf::ChannelValue> values_of(ModeIndex& index, const FixtureBeam& beam, const Driving& by) {
    if (index.defaults.empty()) index.defaults = gdtf::default_values(beam.type, beam.mode);
    std::vector<std::uint32_t> dmx;
    for (std::uint32_t coarse = 0; coarse < 256; ++coarse)
        dmx.push_back(gdtf::in_bytes({.value = coarse, .bytes = 1}, by.bytes));
    return gdtf::values_of_channel(beam.type, beam.mode, static_cast<int>(by.patched - beam.mode.patched.data()), dmx,
                                   index.defaults);
}

// values: of a property, by slot value; what it does not take is left out or bounded.
std::vector<v1::PatchRange> ranges_of(const char* property, std::vector<std::optional<double>> values) {
    const PropertyRow& row = *find_property(property);
    for (std::optional<double>& value : values) {
        if (value && !std::isfinite(*value)) value.reset();
        if (value && !(row.or_none && *value == 0.0)) value = std::clamp(*value, row.least, row.most);
    }
    return ranges_of(values);
}

}  // namespace

bool is_line(const FixtureBeam& beam, const Driving& by) {
    const auto& functions = beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions;
    return functions.size() == 1 && functions[0].from == 0 && functions[0].profile < 0 && functions[0].master < 0 &&
           std::ranges::none_of(functions[0].sets,
                                [](const gdtf::ChannelSet& one) { return one.physical.has_value(); });
}

bool is_filled_in(const FixtureBeam& beam, const Driving& by, const Wanted& wanted) {
    return std::ranges::any_of(
        beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions,
        [&](const gdtf::ChannelFunction& one) {
            return wanted(one.attribute) &&
                   !(one.physical_from == 0.0 && (one.physical_to == 1.0 || one.physical_to == 0.0));
        });
}

void add_channel_ranges(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by,
                        const Wanted& wanted, const char* property, const ReadChannel& read, const char* merge) {
    std::vector<std::optional<double>> values;
    for (const gdtf::ChannelValue& value : values_of(index, beam, by))
        values.push_back(value.function < 0 ? std::nullopt : read(value));
    const auto ranges = ranges_of(property, std::move(values));
    if (!ranges.empty()) add_row(import, beam, by, wanted, {property, 0.0, 0.0, ranges, merge});
}

void add_ranges(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by, const Wanted& wanted,
                const char* property, const ReadValue& read, const char* merge) {
    const auto& functions = beam.mode.channels[static_cast<std::size_t>(by.patched->channel)].functions;
    add_channel_ranges(
        import, index, beam, by, wanted, property,
        [&](const gdtf::ChannelValue& value) {
            return read(functions[static_cast<std::size_t>(value.function)], value.physical);
        },
        merge);
}

void add_state_ranges(ShowImport& import, ModeIndex& index, const FixtureBeam& beam, const Driving& by,
                      const Wanted& wanted, const char* property, const ReadState& read) {
    const auto [at, fresh] = index.ranges.try_emplace({by.patched, beam.geometry, property});
    std::vector<v1::PatchRange>& ranges = at->second;
    if (fresh) {  // else of another fixture of this mode
        const std::size_t steps = 256 * (beam.mode.patched.size() + beam.mode.geometries.size());
        if (import.state_steps + steps > kMostStateSteps) {
            index.ranges.erase(at);
            import.report.add(Outcome::left_out, "a row of the patch that takes an import too long",
                              beam.light + " " + property);
            return;
        }
        import.state_steps += steps;
        std::vector<std::optional<double>> values;
        const auto own = static_cast<std::size_t>(by.patched - beam.mode.patched.data());
        const auto said = values_of(index, beam, by);
        std::vector<gdtf::ChannelValue> all = index.defaults;
        for (const gdtf::ChannelValue& value : said) {
            all[own] = value;
            std::optional<double>& found = values.emplace_back();
            if (value.function < 0) continue;
            for (const gdtf::BeamState& state : gdtf::beam_states(beam.type, beam.mode, all))
                if (state.geometry == beam.geometry) found = read(state);
        }
        ranges = ranges_of(property, std::move(values));
    }
    if (!ranges.empty()) add_row(import, beam, by, wanted, {property, 0.0, 0.0, ranges});
}

void read_gobos(ShowImport& import, const ZipArchive& archive, const gdtf::FixtureType& type) {
    std::set<int> wheels;
    for (const gdtf::Mode& mode : type.modes)
        for (const gdtf::Channel& channel : mode.channels)
            for (const gdtf::ChannelFunction& function : channel.functions)
                if (function.wheel >= 0 && number_in(function.attribute, "Gobo", "") > 0) wheels.insert(function.wheel);
    std::size_t pictures = 0;
    for (const int wheel : wheels) {
        auto gobos = std::make_shared<Gobos>();
        for (const gdtf::Slot& slot : type.wheels[static_cast<std::size_t>(wheel)].slots) {
            if (gobos->size() >= kMostSlots) break;
            Gobo& gobo = gobos->emplace_back();
            if (!slot.picture.empty()) {
                const auto bytes =
                    pictures++ < kMostPictures
                        ? archive.read(slot.picture)
                        : Result<std::string>(Error{"too_large", slot.picture, "", "a fixture has 64 gobos at most"});
                auto packed = bytes ? packed_gobo(*bytes, slot.picture) : Result<Gobo>(bytes.error());
                if (packed)
                    if (auto full = take_memory(
                            import.room, 2 * std::size_t{kMostGobo_px} * kMostGobo_px + bytes->size(), 1, slot.picture))
                        packed = *full;
                if (packed)
                    gobo = std::move(*packed);
                else
                    import.report.add(Outcome::left_out, "a gobo's picture cannot be read: " + packed.error().code,
                                      named(slot.picture, packed.error()));
            }
            gobo.name = shortened_text(slot.name, kMaxNameBytes);
        }
        if (std::ranges::any_of(*gobos, [](const Gobo& one) { return one.size_px > 0; }))
            import.gobos[&type][wheel] = std::move(gobos);
    }
}

GoboChannel gobo_channel(const ShowImport& import, const ModeIndex& index, const FixtureBeam& beam) {
    GoboChannel found;
    const auto known = import.gobos.find(&beam.type);
    if (known == import.gobos.end()) return found;
    for (int at = beam.geometry; at >= 0; at = beam.mode.geometries[static_cast<std::size_t>(at)].parent) {
        const auto [first, last] = index.channels_of.equal_range(at);
        for (auto one = first; one != last; ++one)
            for (const gdtf::ChannelFunction& function :
                 beam.mode.channels[static_cast<std::size_t>(one->second->channel)].functions) {
                const int number = number_in(function.attribute, "Gobo", "");
                if (number > 0 && known->second.contains(function.wheel) && (found.wheel < 0 || number < found.number))
                    found = {number, function.wheel};
            }
    }
    return found;
}

std::shared_ptr<const Profile> with_own_gobo(ShowImport& import, const std::shared_ptr<const Profile>& profile,
                                             const mvr::Fixture& fixture) {
    if (fixture.gobo.empty()) return profile;
    const std::string key =
        printed("own gobo %zu %.9g ", reinterpret_cast<std::uintptr_t>(profile.get()), fixture.gobo_rad) + fixture.gobo;
    const auto [at, fresh] = import.profiles.try_emplace(key);
    if (!fresh) return at->second ? at->second : profile;
    const auto bytes = import.archive.read(fixture.gobo);
    auto gobo = bytes ? packed_gobo(*bytes, fixture.gobo) : Result<Gobo>(bytes.error());
    if (gobo && transmission_of(*gobo).empty()) gobo = Error{"bad_image", fixture.gobo, "", gobo->packed->failed};
    if (gobo)
        if (auto full = take_memory(import.room, 1, kBytesOfProfile + kBytesOfGoboWeb, fixture.gobo)) gobo = *full;
    if (!gobo) {
        import.report.add(Outcome::left_out, "a gobo's picture cannot be read: " + gobo.error().code,
                          named(fixture.gobo, gobo.error()));
        return profile;
    }
    ies::Photometry photometry = profile->photometry;
    photometry.web = gobo_web(profile->photometry.web, *gobo, Angle::radians(fixture.gobo_rad));
    auto made = std::make_shared<Profile>(*make_profile(profile->name, std::move(photometry)));
    made->open_width_rad = beam_width(profile->photometry.web);
    tables_of(*made);
    at->second = std::move(made);
    return at->second;
}

std::shared_ptr<const Profile> with_gobos(ShowImport& import, const std::shared_ptr<const Profile>& profile,
                                          const gdtf::FixtureType& type, int wheel) {
    if (wheel < 0) return profile;
    const auto& gobos = import.gobos.at(&type).at(wheel);
    const auto key = [](const void* at) { return std::to_string(reinterpret_cast<std::uintptr_t>(at)); };
    auto& made = import.profiles["gobos " + key(profile.get()) + " " + key(gobos.get())];
    if (!made) {
        if (take_memory(import.room, 1, kBytesOfProfile, type.name)) return profile;
        auto own = std::make_shared<Profile>(*profile);
        own->gobos = gobos;
        share_tables(*profile, *own);
        made = std::move(own);
    }
    return made;
}

void add_beam_rows(ShowImport& import, ModeIndex& index, const FixtureBeam& beam) {
    if (const Driving shutter = driving(index, beam, is_shutter); shutter.patched != nullptr) {
        add_state_ranges(import, index, beam, shutter, is_shutter, "shutter",
                         [](const gdtf::BeamState& state) { return state.shutter_open ? 1.0 : 0.0; });
        const auto& functions = beam.mode.channels[static_cast<std::size_t>(shutter.patched->channel)].functions;
        const auto strobes = [](std::string_view attribute) {
            return is_shutter(attribute) && attribute.find("Strobe") != std::string_view::npos;
        };
        const bool same = std::ranges::any_of(
            functions, [&](const gdtf::ChannelFunction& function) { return strobes(function.attribute); });
        const Driving strobe = same ? shutter : driving(index, beam, strobes);
        if (strobe.patched != nullptr)
            add_state_ranges(import, index, beam, strobe, strobes, "strobe",
                             [](const gdtf::BeamState& state) { return state.strobe_hz; });
    }
    const auto zooms = [](std::string_view attribute) { return attribute == "Zoom"; };
    const gdtf::Beam& own = *beam.mode.geometries[static_cast<std::size_t>(beam.geometry)].beam;
    if (const Driving zoom = driving(index, beam, zooms); zoom.patched != nullptr && !gdtf::glows(own.type.value)) {
        const PropertyRow& row = *find_property("zoom");
        const double from = zoom.function->physical_from * kDegree, to = zoom.function->physical_to * kDegree;
        const bool filled_in = is_filled_in(beam, zoom, zooms);
        const auto within = [&](double value) { return value >= row.least && value <= row.most; };
        if (!filled_in) {
            import.report.add(Outcome::left_out, "the zoom of a fixture type was never filled in", beam.type.name);
            index.driven.emplace(zoom.patched->channel, "Zoom");  // it has its line
        } else if (is_line(beam, zoom) && within(from) && within(to))
            add_row(import, beam, zoom, zooms, {"zoom", from, to});
        else
            add_state_ranges(import, index, beam, zoom, zooms, "zoom",
                             [](const gdtf::BeamState& state) { return state.zoom_rad; });
    }
    const GoboChannel gobo = gobo_channel(import, index, beam);
    if (gobo.wheel < 0) return;
    const auto chooses = [&](std::string_view attribute) { return number_in(attribute, "Gobo", "") == gobo.number; };
    const Driving wheel = driving(index, beam, chooses);
    add_state_ranges(import, index, beam, wheel, chooses, "gobo",
                     [&](const gdtf::BeamState& state) -> std::optional<double> {
                         for (const gdtf::GoboState& one : state.gobos)
                             if (one.number == gobo.number && one.wheel == gobo.wheel)
                                 return std::min(one.slot + 1.0, static_cast<double>(kMostSlots));
                         return std::nullopt;
                     });
    const auto turns = [&](std::string_view attribute) { return number_in(attribute, "Gobo", "Pos") == gobo.number; };
    const Driving turn = driving(index, beam, turns);
    if (turn.patched == nullptr) return;
    const double from = turn.function->physical_from * kDegree, to = turn.function->physical_to * kDegree;
    const double most = find_property("gobo-turn")->most;
    if (is_line(beam, turn) && std::abs(from) <= most && std::abs(to) <= most)
        add_row(import, beam, turn, turns, {"gobo-turn", from, to});
    else
        add_ranges(import, index, beam, turn, turns, "gobo-turn",
                   [&](const gdtf::ChannelFunction& function, double physical) -> std::optional<double> {
                       if (!turns(function.attribute)) return std::nullopt;
                       return physical * kDegree;
                   });
}

}  // namespace gonio::exchange
