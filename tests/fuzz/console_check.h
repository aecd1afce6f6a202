// What the decoders of consoles promise, whatever the bytes. Shared by the fuzz targets and their replay test.
#pragma once

#include <string_view>

#include "protocol/dmx/artnet.h"
#include "protocol/dmx/artnet_sources.h"
#include "protocol/dmx/e131.h"
#include "protocol/dmx/patch.h"
#include "protocol/dmx/patch_toml.h"
#include "protocol/dmx/sacn_sources.h"
#include "protocol/osc/osc_space.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

inline void check_error(const Error& error) {
    require(!error.code.empty() && !error.message.empty());
    for (const char c : error.value) require(c >= 0x20 && c < 0x7F);
}

// What is shown to clients must be a string that protobuf takes: a table that does not serialise cannot be parsed.
inline void check_table(const v1::Sources& table) {
    v1::Sources again;
    require(again.ParseFromString(table.SerializeAsString()));
}

// The bytes as packets, each after two bytes of length, with time passing between them.
template <typename Take>
void for_each_packet(Bytes bytes, const Take& take) {
    for (std::int64_t now_ns = 1'000'000'000; bytes.size() >= 3; now_ns += 700'000'000) {
        const std::size_t size = std::min<std::size_t>(be16(bytes, 0), bytes.size() - 2);
        take(bytes.subspan(2, size), now_ns);
        bytes = bytes.subspan(2 + size);
    }
}

inline void check_e131(Bytes bytes) {
    SacnSources sources;
    const auto take = [&](Bytes packet, std::int64_t now_ns) {
        const auto decoded = decode_e131(packet);
        if (!decoded) return check_error(decoded.error());
        if (const auto* data = std::get_if<E131Data>(&*decoded)) {
            require(data->universe >= 1 && data->universe <= kE131MaxUniverse);
            require(data->priority <= 200 && data->slots <= kDmxSlots && data->name.size() <= 4 * 63);
            for (std::size_t slot = data->slots; slot < kDmxSlots; ++slot) require(data->values[slot] == 0);
        }
        sources.prefer({1, 2, 3});
        sources.take(*decoded, "10.0.0.1:5568", now_ns);
        require(sources.sync_addresses().size() <= kMaxSyncAddresses);
        sources.tick(now_ns);
        for (const std::uint16_t universe : sources.take_changed()) {
            for (const DmxSource& source : sources.universe(universe).sources)
                for (const std::uint8_t rank : source.rank) require(rank <= 201);
        }
        v1::Sources table;
        sources.describe(table, now_ns);
        require(table.sources_size() <= static_cast<int>(kMaxSourceRows));
        check_table(table);
    };
    take(bytes, 1);
    for_each_packet(bytes, take);
}

inline void check_artnet(Bytes bytes) {
    ArtnetSources sources;
    const auto take = [&](Bytes packet, std::int64_t now_ns) {
        const auto decoded = decode_artnet(packet);
        if (!decoded) return check_error(decoded.error());
        if (const auto* dmx = std::get_if<ArtDmx>(&*decoded)) {
            require(dmx->universe <= kArtnetMaxUniverse && dmx->slots <= kDmxSlots);
            sources.take(*dmx, {dmx->physical, 6454}, now_ns);
        } else if (const auto* time = std::get_if<ArtTimeCode>(&*decoded)) {
            require(is_timecode(time->timecode));
        } else if (std::holds_alternative<ArtSync>(*decoded)) {
            sources.take_sync({packet.back(), 6454}, now_ns);
        }
        sources.tick(now_ns);
        for (const std::uint16_t universe : sources.take_changed())
            require(sources.universe(universe).sources.size() <= kArtnetMergeSources);
        v1::Sources table;
        sources.describe(table, now_ns);
        check_table(table);
    };
    take(bytes, 1);
    for_each_packet(bytes, take);
}

inline void check_set(const OscSet& set) {
    require(!set.empty());
    for (const PropertyValue& value : set) {
        require(value.name.size() <= 128);
        if (value.pattern) osc_matches(value.target, "front%20wash");
    }
}

inline void check_query(const std::string& address) {
    static const OscValues values = [] {
        v1::State state;
        for (const char* name : {"front wash", "spot1"}) {
            v1::Light& light = *state.add_lights();
            light.set_name(name);
            for (int i = 0; i < 3; ++i) light.add_color_rgb(1), light.add_position(1), light.add_aim(1);
        }
        return osc_values(state);
    }();
    std::size_t budget = kOscPatternBudget;
    const auto selected = osc_select(values, address, budget);
    require(selected.ok() && budget <= kOscPatternBudget);
    for (const auto& [name, arguments] : *selected) require(values.contains(name));
}

inline void check_osc(Bytes bytes) {
    const auto decoded = decode_osc(bytes);
    if (!decoded) check_error(decoded.error());
    for (std::size_t i = 0; decoded && i < decoded->size(); ++i) {
        const OscMessage& message = (*decoded)[i];
        require(message.address.starts_with('/') && message.address.size() <= kOscMaxAddress);
        require(message.arguments.size() <= kOscMaxArguments);
        const auto packet = encode_osc(message);
        require(packet.size() % 4 == 0 && decode_osc(packet).ok());
        const auto action = osc_action(message, true);
        if (!action)
            check_error(action.error());
        else if (const auto* set = std::get_if<OscSet>(&*action))
            check_set(*set);
        else if (std::holds_alternative<OscQuery>(*action))
            check_query(message.address);
    }
    // The same bytes as a stream, whole and in two parts.
    OscStream whole, parts;
    const auto all = whole.feed(bytes);
    const auto first = parts.feed(bytes.first(bytes.size() / 2));
    if (!first) return;
    const auto second = parts.feed(bytes.subspan(bytes.size() / 2));
    require(all.ok() == second.ok());
    if (all) require(all->size() == first->size() + second->size());
}

inline void check_patch_file(std::string_view text) {
    const auto patch = read_patch_toml(text);
    if (!patch) return require(!patch.error().code.empty() && !patch.error().message.empty());
    require(check_patch(*patch).ok());
    v1::Patch written;
    *written.mutable_rows() = patch->rows();
    const auto again = read_patch_toml(write_patch_toml(written));
    require(again.ok() && again->rows_size() == patch->rows_size());
    PatchReader reader(written);
    DmxUniverse universe;
    universe.sources.emplace_back();
    universe.sources[0].rank.fill(101);
    for (const DmxKey& key : universes_of(written))
        for (const PropertyValue& value : reader.read(key, universe)) require(value.value[0] == value.value[0]);
}

}  // namespace gonio::fuzz
