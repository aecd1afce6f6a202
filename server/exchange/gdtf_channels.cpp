// DMXChannels -> channels, and where each geometry of the tree has them.
#include <algorithm>
#include <charconv>

#include "server/exchange/gdtf_parts.h"

namespace gonio::gdtf {
namespace {

using exchange::attribute_of;
using exchange::Outcome;

Error too_many(const char* what, std::size_t most, std::string_view name) {
    return {"too_large", "DMXModes", std::string(name),
            "all modes together have at most " + std::to_string(most) + " " + what};
}

// "1,2", "None" or nothing.
std::vector<int> offsets_of(GdtfRead& read, std::string_view text, std::string_view channel) {
    std::vector<int> offsets;
    if (text == "None") return offsets;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const auto offset = exchange::whole_number_of(text.substr(at, end - at));
        at = end + 1;
        if (!offset || *offset < 1 || *offset > kMostSlot) {
            read.note(Outcome::left_out, "a channel's offset is no slot of a break: the channel is virtual",
                      written(channel, "Offset", text));
            return {};
        }
        if (offsets.size() == kMaxChannelBytes) {
            read.note(Outcome::left_out, "a channel has more than four bytes: its least significant ones", channel);
            return offsets;
        }
        offsets.push_back(static_cast<int>(*offset));
    }
    return offsets;
}

// Result: the attribute's DMX value; nothing where it is missing, or where it is none: that is noted with `name`.
std::optional<std::uint32_t> value_of(GdtfRead& read, const pugi::xml_node& node, const char* attribute, int bytes,
                                      std::string_view name) {
    const std::string_view text = attribute_of(node, attribute);
    if (const auto value = dmx_value(text)) return in_bytes(*value, bytes);
    if (!text.empty() && text != "None")
        read.note(Outcome::defaulted, "a value is no DMX value: its default stands", written(name, attribute, text));
    return std::nullopt;
}

int named_index(GdtfRead& read, int index, std::string_view name, const char* what, std::string_view function) {
    if (index < 0 && !name.empty() && name != "None") read.note(Outcome::left_out, what, function);
    return index;
}

// channel: its name.
ChannelFunction read_function(GdtfRead& read, const pugi::xml_node& node, int bytes, const std::string& channel) {
    ChannelFunction function;
    function.attribute = std::string(attribute_of(node, "Attribute"));
    if (function.attribute.empty()) function.attribute = "NoFeature";
    function.name = std::string(attribute_of(node, "Name"));
    const std::string path = channel + "." + (function.name.empty() ? function.attribute : function.name);
    function.from = value_of(read, node, "DMXFrom", bytes, path).value_or(0);
    function.default_value = value_of(read, node, "Default", bytes, path).value_or(0);
    function.physical_from = read.number(node, "PhysicalFrom", path).value_or(0.0);
    function.physical_to = read.number(node, "PhysicalTo", path).value_or(1.0);
    const FixtureType& type = read.type;
    const auto refer = [&](const auto& items, const char* attribute, const char* what) {
        const std::string_view name = attribute_of(node, attribute);
        return named_index(read, index_of(items, name), name, what, function.attribute);
    };
    function.wheel = refer(type.wheels, "Wheel", "a function names no wheel");
    function.emitter = refer(type.emitters, "Emitter", "a function names no emitter");
    function.filter = refer(type.filters, "Filter", "a function names no filter");
    function.profile = refer(type.profiles, "DMXProfile", "a function names no DMX profile: it is linear");
    for (const pugi::xml_node child : node.children("ChannelSet")) {
        if (++read.functions > kMaxFunctions) break;  // the caller refuses
        ChannelSet set;
        set.name = std::string(attribute_of(child, "Name"));
        const std::string set_path = path + "." + set.name;
        set.from = value_of(read, child, "DMXFrom", bytes, set_path).value_or(function.from);
        const auto from = read.number(child, "PhysicalFrom", set_path), to = read.number(child, "PhysicalTo", set_path);
        if (from && to) set.physical = {*from, *to};
        set.slot = static_cast<int>(
            std::clamp(read.whole_number(child, "WheelSlotIndex", set_path).value_or(0), 0ll, 100'000ll));
        function.sets.push_back(std::move(set));
    }
    std::stable_sort(function.sets.begin(), function.sets.end(),
                     [](const ChannelSet& a, const ChannelSet& b) { return a.from < b.from; });
    return function;
}

// Whether both can be active at one value of their channel.
bool may_meet(const ChannelFunction& a, const ChannelFunction& b) {
    if (a.master < 0 || b.master < 0 || a.master != b.master) return true;
    return a.mode_from <= b.mode_to && b.mode_from <= a.mode_to;
}

// A function ends one below the next DMXFrom of those that can be active beside it.
void set_ends(Channel& channel) {
    std::vector<ChannelFunction>& functions = channel.functions;
    std::vector<std::size_t> order(functions.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return functions[a].from < functions[b].from; });
    std::size_t above = order.size();  // the first with a greater DMXFrom
    for (std::size_t i = order.size(); i-- > 0;) {
        ChannelFunction& one = functions[order[i]];
        one.to = greatest_of(channel.bytes);
        if (i + 1 < order.size() && functions[order[i + 1]].from != one.from) above = i + 1;
        for (std::size_t k = above; k < order.size(); ++k) {
            const ChannelFunction& next = functions[order[k]];
            if (!may_meet(one, next)) continue;
            one.to = next.from - 1;
            break;
        }
    }
}

// Result: the channel that a node "Geometry_Attribute[.Attribute.Function]" begins with; -1: none. Names may hold dots.
int channel_of(const std::map<std::string_view, int>& by_name, std::string_view node) {
    for (;;) {
        if (const auto found = by_name.find(node); found != by_name.end()) return found->second;
        const std::size_t dot = node.rfind('.');
        if (dot == std::string_view::npos) return -1;
        node = node.substr(0, dot);
    }
}

Result<Channel> read_channel(GdtfRead& read, const pugi::xml_node& node) {
    Channel channel;
    channel.geometry = std::string(attribute_of(node, "Geometry"));
    const pugi::xml_node first = node.child("LogicalChannel");
    channel.name = channel.geometry + "_" + std::string(attribute_of(first, "Attribute"));
    channel.offsets = offsets_of(read, exchange::trimmed(attribute_of(node, "Offset")), channel.name);
    channel.bytes = channel.offsets.empty() ? kMaxChannelBytes : static_cast<int>(channel.offsets.size());
    const std::string_view dmx_break = attribute_of(node, "DMXBreak");
    channel.dmx_break =
        dmx_break == "Overwrite"
            ? 0
            : static_cast<int>(std::clamp(read.whole_number(node, "DMXBreak", channel.name).value_or(1), 1ll, 512ll));
    const std::string_view initial = attribute_of(node, "InitialFunction");
    int logical = 0;
    for (const pugi::xml_node one : node.children("LogicalChannel")) {
        int number = 1;
        for (const pugi::xml_node child : one.children("ChannelFunction")) {
            if (channel.functions.size() == kMaxChannelFunctions)
                return Error{"too_large", "DMXModes", channel.name,
                             "a channel has at most " + std::to_string(kMaxChannelFunctions) + " functions"};
            ++read.functions;
            ChannelFunction function = read_function(read, child, channel.bytes, channel.name);
            if (read.functions > kMaxFunctions) return too_many("functions and sets", kMaxFunctions, channel.name);
            if (function.name.empty()) function.name = function.attribute + " " + std::to_string(number);
            function.logical = logical;
            const std::string path =
                channel.name + "." + std::string(attribute_of(one, "Attribute")) + "." + function.name;
            if (path == initial) channel.initial = static_cast<int>(channel.functions.size());
            channel.functions.push_back(std::move(function));
            ++number;
        }
        ++logical;
    }
    if (channel.functions.empty()) read.note(Outcome::left_out, "a channel has no function", channel.name);
    return channel;
}

// DMXChannel@Default, of GDTF before 1.0: the default of functions that have none. Where there is no InitialFunction
// either, the function that the value lies in is the initial one, at that value.
void set_channel_default(GdtfRead& read, const pugi::xml_node& node, Channel& channel) {
    const auto value = value_of(read, node, "Default", channel.bytes, channel.name);
    if (!value) return;
    std::vector<ChannelFunction>& functions = channel.functions;
    std::size_t at = 0;
    bool counts = false;
    for (const pugi::xml_node logical : node.children("LogicalChannel"))
        for (const pugi::xml_node child : logical.children("ChannelFunction")) {
            ChannelFunction& function = functions[at++];
            if (child.attribute("Default")) continue;
            function.default_value = *value;
            counts = true;
        }
    if (attribute_of(node, "InitialFunction").empty()) {
        const auto has = [&](const ChannelFunction& one) { return one.from <= *value && *value <= one.to; };
        if (const auto found = std::find_if(functions.begin(), functions.end(), has); found != functions.end()) {
            channel.initial = static_cast<int>(found - functions.begin());
            found->default_value = *value;
            counts = true;
        }
    }
    if (counts)
        read.note(Outcome::guessed, "a channel's own Default, of GDTF before 1.0, counts",
                  written(channel.name, "Default", attribute_of(node, "Default")));
}

// In the order of the channels' functions, as read_channel has read them.
void set_masters(GdtfRead& read, const pugi::xml_node& channels, Mode& mode) {
    std::map<std::string_view, int> by_name;
    for (std::size_t i = 0; i < mode.channels.size(); ++i) by_name.emplace(mode.channels[i].name, static_cast<int>(i));
    std::size_t index = 0;
    for (const pugi::xml_node node : channels.children("DMXChannel")) {
        Channel& channel = mode.channels[index++];
        std::size_t at = 0;
        for (const pugi::xml_node logical : node.children("LogicalChannel")) {
            for (const pugi::xml_node child : logical.children("ChannelFunction")) {
                ChannelFunction& function = channel.functions[at++];
                const std::string_view master = attribute_of(child, "ModeMaster");
                if (master.empty() || master == "None") continue;
                function.master = channel_of(by_name, master);
                if (function.master < 0) {
                    read.note(Outcome::left_out, "a mode master is no channel: its function is always active",
                              channel.name + "." + function.name);
                    continue;
                }
                const int bytes = mode.channels[function.master].bytes;
                const std::string path = channel.name + "." + function.name;
                function.mode_from = value_of(read, child, "ModeFrom", bytes, path).value_or(0);
                function.mode_to = value_of(read, child, "ModeTo", bytes, path).value_or(0);
            }
        }
        set_ends(channel);
        set_channel_default(read, node, channel);
    }
}

// Where a channel's break begins inside a reference; 0: the reference has no such break. dmx_break: of the channel, 0
// is Overwrite; set to the break that it is.
int offset_within(const Mode& mode, const ReferenceBreaks& breaks, int reference, int& dmx_break) {
    int offset = 1;
    for (int at = reference; at >= 0;) {
        const std::span<const ReferenceBreak> list = breaks.at(at);
        if (list.empty()) return 0;
        const auto named = [&](const ReferenceBreak& one) { return one.dmx_break == dmx_break; };
        // The last one is for Overwrite; another of that number goes before it.
        const auto found = dmx_break == 0 ? std::prev(list.end()) : std::find_if(list.begin(), list.end(), named);
        if (found == list.end()) return 0;
        dmx_break = found->dmx_break;
        offset += found->offset - 1;
        const int parent = mode.geometries[at].parent;
        at = parent < 0 ? -1 : mode.geometries[parent].reference;
    }
    return offset;
}

std::optional<Error> patch(GdtfRead& read, Mode& mode, const ReferenceBreaks& breaks) {
    std::multimap<std::string_view, int> by_source, by_own_name;
    for (std::size_t g = 0; g < mode.geometries.size(); ++g) {
        by_source.emplace(mode.geometries[g].source, static_cast<int>(g));
        by_own_name.emplace(mode.geometries[g].name, static_cast<int>(g));
    }
    for (std::size_t c = 0; c < mode.channels.size(); ++c) {
        const Channel& channel = mode.channels[c];
        const bool by_name = !by_source.contains(channel.geometry);  // then it may be a reference's own name
        auto [at, end] = (by_name ? by_own_name : by_source).equal_range(channel.geometry);
        if (at == end) read.note(Outcome::left_out, "a channel's geometry is not in its mode", channel.name);
        for (; at != end; ++at) {
            const int geometry = at->second;
            if (++read.channels > kMaxChannels) return too_many("channels", kMaxChannels, channel.name);
            PatchedChannel one{static_cast<int>(c), geometry, channel.dmx_break, channel.offsets};
            const int reference = by_name ? -1 : mode.geometries[geometry].reference;
            if (!channel.offsets.empty() && reference >= 0) {
                const int offset = offset_within(mode, breaks, reference, one.dmx_break);
                if (offset == 0) {
                    read.note(Outcome::left_out, "a reference has no break for a channel",
                              mode.geometries[reference].name + ": " + channel.name);
                    continue;
                }
                for (int& slot : one.slots) slot += offset - 1;
            }
            if (one.dmx_break == 0) one.dmx_break = 1;  // Overwrite outside of references
            if (std::any_of(one.slots.begin(), one.slots.end(), [](int slot) { return slot > kMostSlot; })) {
                read.note(Outcome::left_out, "a channel lies beyond its break's 512 slots", channel.name);
                continue;
            }
            for (const int slot : one.slots) {
                int& most = mode.footprint[one.dmx_break];
                most = std::max(most, slot);
            }
            mode.patched.push_back(std::move(one));
        }
    }
    return std::nullopt;
}

// Two channels on one slot: both are driven by it.
void note_clashes(GdtfRead& read, const Mode& mode) {
    std::map<std::pair<int, int>, int> taken;
    for (const PatchedChannel& one : mode.patched) {
        for (const int slot : one.slots) {
            const auto [at, fresh] = taken.try_emplace({one.dmx_break, slot}, one.channel);
            if (!fresh)
                read.note(Outcome::guessed, "two channels share a slot: it drives both",
                          mode.channels[at->second].name + ", " + mode.channels[one.channel].name);
        }
    }
}

}  // namespace

std::optional<DmxValue> dmx_value(std::string_view text) {
    text = exchange::trimmed(text);
    DmxValue result;
    unsigned long long value = 0, bytes = 1;
    const char* end = text.data() + text.size();
    auto parsed = std::from_chars(text.data(), end, value);
    if (parsed.ec != std::errc()) return std::nullopt;
    if (parsed.ptr != end) {
        if (*parsed.ptr != '/') return std::nullopt;
        parsed = std::from_chars(parsed.ptr + 1, end, bytes);
        if (parsed.ec != std::errc() || bytes < 1 || bytes > 8) return std::nullopt;
        if (parsed.ptr != end) {
            if (std::string_view(parsed.ptr, static_cast<std::size_t>(end - parsed.ptr)) != "s") return std::nullopt;
            result.shifted = true;
        }
    }
    if (bytes > kMaxChannelBytes) {
        value >>= 8 * (bytes - kMaxChannelBytes);
        bytes = kMaxChannelBytes;
    }
    result.bytes = static_cast<int>(bytes);
    result.value = static_cast<std::uint32_t>(std::min<unsigned long long>(value, greatest_of(result.bytes)));
    return result;
}

std::uint32_t in_bytes(const DmxValue& value, int bytes) {
    if (bytes <= value.bytes) return value.value >> 8 * (value.bytes - bytes);
    std::uint32_t result = 0;
    for (int i = 0; i < bytes; ++i) {  // the bytes again, from the most significant one
        const int from = i % value.bytes;
        const bool filled = value.shifted && i >= value.bytes;
        const std::uint32_t byte = filled ? 0 : value.value >> 8 * (value.bytes - 1 - from) & 0xFF;
        result = result << 8 | byte;
    }
    return result;
}

std::optional<Error> read_channels(GdtfRead& read, const pugi::xml_node& node, Mode& mode,
                                   const ReferenceBreaks& breaks) {
    const pugi::xml_node channels = node.child("DMXChannels");
    for (const pugi::xml_node child : channels.children("DMXChannel")) {
        if (++read.channels > kMaxChannels) return too_many("channels", kMaxChannels, mode.name);
        auto channel = read_channel(read, child);
        if (!channel) return channel.error();
        mode.channels.push_back(std::move(*channel));
    }
    read.channels -= mode.channels.size();  // patch() counts them where they are
    set_masters(read, channels, mode);
    if (auto error = patch(read, mode, breaks)) return error;
    note_clashes(read, mode);
    return std::nullopt;
}

}  // namespace gonio::gdtf
