#include "protocol/dmx/artnet_sources.h"

#include <algorithm>
#include <functional>

#include "protocol/schema/console.pb.h"

namespace gonio {
namespace {

std::size_t live_count(const std::vector<ArtnetSource>& sources) {
    return static_cast<std::size_t>(std::count_if(sources.begin(), sources.end(), std::mem_fn(&ArtnetSource::live)));
}

}  // namespace

std::string print_peer(const UdpPeer& peer) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8)
        text += std::to_string(peer.ip >> shift & 0xFF) + (shift > 0 ? "." : ":");
    return text + std::to_string(peer.port);
}

ArtnetSource* ArtnetSources::source_of(const ArtDmx& dmx, const UdpPeer& from, std::int64_t now_ns) {
    if (const auto found = universes_.find(dmx.universe); found != universes_.end()) {
        for (ArtnetSource& known : found->second)
            if (known.ip == from.ip && known.physical == dmx.physical) return &known;
        if (live_count(found->second) >= kArtnetMergeSources) return nullptr;
    }
    if (!make_room(dmx.universe)) return nullptr;
    std::vector<ArtnetSource>& sources = universes_[dmx.universe];
    if (sources.size() >= kMaxUniverseSources)
        sources.erase(std::find_if_not(sources.begin(), sources.end(), std::mem_fn(&ArtnetSource::live)));
    ArtnetSource source;
    source.id = next_id_++;
    source.has_levels = true;  // zeros, until the first packet
    source.ip = from.ip;
    source.physical = dmx.physical;
    source.packet_ns = now_ns;
    source.changed_ns = now_ns;
    sources.push_back(source);
    changed_.insert(dmx.universe);
    return &sources.back();
}

bool ArtnetSources::synchronised(std::uint32_t ip, std::int64_t now_ns) const {
    const auto sync = syncs_.find(ip);
    return sync != syncs_.end() && now_ns - sync->second <= kArtnetSync_ns;
}

bool ArtnetSources::take(const ArtDmx& dmx, const UdpPeer& from, std::int64_t now_ns) {
    ArtnetSource* found = source_of(dmx, from, now_ns);
    if (found == nullptr) return false;
    ArtnetSource& source = *found;
    const std::vector<ArtnetSource>& sources = universes_[dmx.universe];
    if (!source.live) {  // it comes back: its numbers begin anew, and it needs room in the merge
        if (live_count(sources) >= kArtnetMergeSources) return false;
        source.live = true;
        source.sequence = 0;
        source.changed_ns = now_ns;
        changed_.insert(dmx.universe);
    }
    if (!source.take(artnet_sequence(source.sequence, dmx.sequence), dmx.sequence, now_ns)) return true;
    source.peer = from;
    source.held = {dmx.values, dmx.slots};
    const bool merging = live_count(sources) > 1;
    if (merging || !synchronised(from.ip, now_ns)) show_held(dmx.universe, source, now_ns);
    return true;
}

void ArtnetSources::take_sync(const UdpPeer& from, std::int64_t now_ns) {
    for (auto& [universe, sources] : universes_) {
        for (ArtnetSource& source : sources) {
            if (source.ip != from.ip) continue;
            syncs_[from.ip] = now_ns;
            show_held(universe, source, now_ns);
        }
    }
}

void ArtnetSources::tick(std::int64_t now_ns) {
    crowded_ = false;
    for (auto& [universe, sources] : universes_) {
        for (ArtnetSource& source : sources) {
            if (!synchronised(source.ip, now_ns)) show_held(universe, source, now_ns);
            if (source.live && now_ns - source.packet_ns > kArtnetMerge_ns) {
                source.live = false;
                source.held.reset();
                changed_.insert(universe);
            }
        }
    }
    drop_silent(now_ns);
    std::erase_if(syncs_, [&](const auto& entry) { return now_ns - entry.second > kArtnetSync_ns; });
}

DmxUniverse ArtnetSources::universe(std::uint16_t universe) const {
    DmxUniverse result;
    const auto found = universes_.find(universe);
    if (found == universes_.end()) return result;
    for (const ArtnetSource& source : found->second) {
        if (!source.live) continue;
        DmxSource view{source.id, source.shown.values, {}, source.changed_ns};
        std::fill_n(view.rank.begin(), source.shown.slots, std::uint8_t{101});  // Art-Net knows no priority
        result.sources.push_back(view);
    }
    return result;
}

void ArtnetSources::describe(v1::Sources& table, std::int64_t now_ns) const {
    for (const auto& [number, sources] : universes_) {
        const DmxUniverse view = universe(number);
        const std::vector<unsigned> wins = winning_slots(view);
        for (const ArtnetSource& source : sources) {
            v1::SourceRow& row = *table.add_sources();
            row.set_protocol("artnet");
            row.set_universe(number);
            if (source.physical != 0) row.set_name("physical port " + std::to_string(source.physical));
            row.set_address(print_peer(source.peer));
            row.set_state(source.live ? "live" : "lost");
            source.describe(row, view, wins, now_ns);
        }
    }
}

}  // namespace gonio
