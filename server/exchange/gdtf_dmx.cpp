#include "server/exchange/gdtf_dmx.h"

#include <algorithm>
#include <cmath>

namespace gonio::gdtf {
namespace {

// Which value of the patched ones is a master channel's, as a channel at `reference` sees it: that of the same
// reference, else the first.
struct Masters {
    std::map<std::pair<int, int>, int> of_reference;  // channel and reference -> patched
    std::map<int, int> first;

    explicit Masters(const Mode& mode) {
        for (std::size_t i = 0; i < mode.patched.size(); ++i) {
            const PatchedChannel& one = mode.patched[i];
            first.emplace(one.channel, static_cast<int>(i));
            of_reference.emplace(std::pair(one.channel, mode.geometries[one.geometry].reference), static_cast<int>(i));
        }
    }
    int find(int channel, int reference) const {
        if (const auto at = of_reference.find({channel, reference}); at != of_reference.end()) return at->second;
        const auto at = first.find(channel);
        return at == first.end() ? -1 : at->second;
    }
};

std::uint32_t default_of(const Channel& channel) {
    if (channel.functions.empty()) return 0;
    return channel.functions[static_cast<std::size_t>(channel.initial)].default_value;
}

std::uint32_t raw_of(const Channel& channel, const PatchedChannel& patched, const DmxBytes& bytes) {
    const auto found = bytes.find(patched.dmx_break);
    if (patched.slots.empty() || found == bytes.end()) return default_of(channel);
    std::uint32_t value = 0;
    for (const int slot : patched.slots) {
        if (static_cast<std::size_t>(slot) > found->second.size()) return default_of(channel);
        value = value << 8 | found->second[static_cast<std::size_t>(slot) - 1];
    }
    return value;
}

double share(std::uint32_t value, std::uint32_t low, std::uint32_t high) {
    return high > low ? (static_cast<double>(value) - low) / (static_cast<double>(high) - low) : 0.0;
}

void set_physical(const FixtureType& type, const ChannelFunction& function, ChannelValue& value) {
    value.ratio = share(value.dmx, function.from, function.to);
    if (function.profile >= 0) value.ratio = profile_output(type.profiles[function.profile], value.ratio);
    value.physical = function.physical_from + value.ratio * (function.physical_to - function.physical_from);
    for (std::size_t i = 0; i < function.sets.size(); ++i)
        if (function.sets[i].from <= value.dmx) value.set = static_cast<int>(i);
    if (value.set < 0) return;
    const std::size_t at = static_cast<std::size_t>(value.set);
    if (!function.sets[at].physical) return;
    const std::uint32_t end = at + 1 < function.sets.size() ? function.sets[at + 1].from - 1 : function.to;
    const auto [from, to] = *function.sets[at].physical;
    value.physical = from + share(value.dmx, function.sets[at].from, end) * (to - from);
}

// Sets the active function of a value and what it says. masters: null where no function of the channel has one.
void set_function(const FixtureType& type, const Mode& mode, const Masters* masters,
                  const std::vector<ChannelValue>& all, ChannelValue& value) {
    const PatchedChannel& patched = mode.patched[static_cast<std::size_t>(value.patched)];
    const Channel& channel = mode.channels[static_cast<std::size_t>(patched.channel)];
    const auto let = [&](const ChannelFunction& function) {
        if (function.master < 0) return true;
        const int at = masters->find(function.master, mode.geometries[patched.geometry].reference);
        if (at < 0) return false;
        const std::uint32_t master = all[static_cast<std::size_t>(at)].dmx;
        return master >= function.mode_from && master <= function.mode_to;
    };
    for (std::size_t f = 0; f < channel.functions.size(); ++f) {
        const ChannelFunction& function = channel.functions[f];
        if (function.from > value.dmx || !let(function)) continue;
        if (value.function < 0 || channel.functions[static_cast<std::size_t>(value.function)].from < function.from)
            value.function = static_cast<int>(f);
    }
    if (value.function >= 0) set_physical(type, channel.functions[static_cast<std::size_t>(value.function)], value);
}

std::vector<ChannelValue> values_of(const FixtureType& type, const Mode& mode, const DmxBytes& bytes) {
    const Masters masters(mode);
    std::vector<ChannelValue> values(mode.patched.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i].patched = static_cast<int>(i);
        values[i].dmx = raw_of(mode.channels[mode.patched[i].channel], mode.patched[i], bytes);
    }
    for (ChannelValue& value : values) set_function(type, mode, &masters, values, value);
    return values;
}

}  // namespace

double profile_output(const DmxProfile& profile, double x) {
    const double scale = profile.percent ? 100.0 : 1.0;
    x *= scale;
    const ProfilePoint* piece = nullptr;
    for (const ProfilePoint& point : profile.points)
        if (point.at <= x) piece = &point;
    if (piece == nullptr) return 0.0;
    const double t = x - piece->at;
    const auto& [c0, c1, c2, c3] = piece->cubic;
    const double output = (c0 + t * (c1 + t * (c2 + t * c3))) / scale;
    return std::isfinite(output) ? std::clamp(output, 0.0, 1.0) : 0.0;
}

std::vector<ChannelValue> channel_values(const FixtureType& type, const Mode& mode, const DmxBytes& bytes) {
    return values_of(type, mode, bytes);
}

std::vector<ChannelValue> values_of_channel(const FixtureType& type, const Mode& mode, int patched,
                                            std::span<const std::uint32_t> dmx,
                                            const std::vector<ChannelValue>& others) {
    const auto& functions =
        mode.channels[static_cast<std::size_t>(mode.patched[static_cast<std::size_t>(patched)].channel)].functions;
    const bool asks = std::ranges::any_of(functions, [](const ChannelFunction& one) { return one.master >= 0; });
    const auto masters = asks ? std::optional<Masters>(mode) : std::nullopt;
    std::vector<ChannelValue> values;
    for (const std::uint32_t one : dmx) {
        ChannelValue& value = values.emplace_back();
        value.patched = patched;
        value.dmx = one;
        set_function(type, mode, masters ? &*masters : nullptr, others, value);
    }
    return values;
}

std::vector<ChannelValue> default_values(const FixtureType& type, const Mode& mode) {
    return values_of(type, mode, {});
}

}  // namespace gonio::gdtf
