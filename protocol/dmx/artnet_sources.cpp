#include "protocol/dmx/artnet_sources.h"

#include <algorithm>

#include "protocol/dmx/source_row.h"

namespace gonio {

std::string print_peer(const UdpPeer& peer) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8)
        text += std::to_string(peer.ip >> shift & 0xFF) + (shift > 0 ? "." : ":");
    return text + std::to_string(peer.port);
}

ArtnetSources::Source* ArtnetSources::source_of(const ArtDmx& dmx, const UdpPeer& from, std::int64_t now_ns) {
    const auto live = [](const Source& s) { return s.live; };
    if (const auto found = universes_.find(dmx.universe); found != universes_.end()) {
        std::vector<Source>& there = found->second;
        const auto at = std::find_if(there.begin(), there.end(),
                                     [&](const Source& s) { return s.ip == from.ip && s.physical == dmx.physical; });
        if (at != there.end()) return &*at;
        if (std::count_if(there.begin(), there.end(), live) >= static_cast<std::ptrdiff_t>(kArtnetMergeSources))
            return nullptr;
    }
    const bool wanted = preferred_.contains(dmx.universe);
    if (crowded_ && !wanted) return nullptr;
    if (count_rows(universes_) >= kMaxSourceRows && !drop_row(universes_, preferred_, wanted, live, changed_)) {
        crowded_ = true;
        return nullptr;
    }
    std::vector<Source>& sources = universes_[dmx.universe];
    if (sources.size() >= kMaxUniverseSources) sources.erase(std::find_if_not(sources.begin(), sources.end(), live));
    Source source;
    source.id = next_id_++;
    source.ip = from.ip;
    source.physical = dmx.physical;
    source.packet_ns = now_ns;
    source.changed_ns = now_ns;
    sources.push_back(std::move(source));
    changed_.insert(dmx.universe);
    return &sources.back();
}

void ArtnetSources::prefer(std::set<std::uint16_t> universes) {
    preferred_ = std::move(universes);
    crowded_ = false;
}

bool ArtnetSources::synchronised(std::uint32_t ip, std::int64_t now_ns) const {
    const auto sync = syncs_.find(ip);
    return sync != syncs_.end() && now_ns - sync->second <= kArtnetSync_ns;
}

void ArtnetSources::show(std::uint16_t universe, Source& source, const Frame& frame, std::int64_t now_ns) {
    if (source.shown.slots == frame.slots && source.shown.values == frame.values) return;
    source.shown = frame;
    source.changed_ns = now_ns;
    changed_.insert(universe);
}

bool ArtnetSources::take(const ArtDmx& dmx, const UdpPeer& from, std::int64_t now_ns) {
    Source* found = source_of(dmx, from, now_ns);
    if (found == nullptr) return false;
    Source& source = *found;
    if (!source.live) {  // it comes back: its numbers begin anew, and it needs a free place in the merge
        const auto& sources = universes_[dmx.universe];
        const auto others = std::count_if(sources.begin(), sources.end(), [](const Source& s) { return s.live; });
        if (others >= static_cast<std::ptrdiff_t>(kArtnetMergeSources)) return false;
        source.live = true;
        source.sequence = 0;
        source.changed_ns = now_ns;
        changed_.insert(dmx.universe);
    }
    ++source.packets;
    source.rate.count(now_ns);
    const SequenceStep step = artnet_sequence(source.sequence, dmx.sequence);
    if (step.verdict == SequenceVerdict::discard) {
        ++source.out_of_order;
        return true;
    }
    source.lost += step.lost;
    source.sequence = dmx.sequence;
    source.peer = from;
    source.packet_ns = now_ns;
    const auto& sources = universes_[dmx.universe];
    const bool merging = std::count_if(sources.begin(), sources.end(), [](const Source& s) { return s.live; }) > 1;
    const Frame frame{dmx.values, dmx.slots};
    if (!merging && synchronised(from.ip, now_ns)) {
        source.held = frame;
        return true;
    }
    source.held.reset();
    show(dmx.universe, source, frame, now_ns);
    return true;
}

void ArtnetSources::take_sync(const UdpPeer& from, std::int64_t now_ns) {
    for (auto& [universe, sources] : universes_) {
        for (Source& source : sources) {
            if (source.ip != from.ip) continue;
            syncs_[from.ip] = now_ns;
            if (!source.held) continue;
            const Frame frame = *source.held;
            source.held.reset();
            show(universe, source, frame, now_ns);
        }
    }
}

void ArtnetSources::tick(std::int64_t now_ns) {
    crowded_ = false;
    for (auto& [universe, sources] : universes_) {
        for (Source& source : sources) {
            if (source.held && !synchronised(source.ip, now_ns)) {
                const Frame frame = *source.held;
                source.held.reset();
                show(universe, source, frame, now_ns);
            }
            if (source.live && now_ns - source.packet_ns > kArtnetMerge_ns) {
                source.live = false;
                source.held.reset();
                changed_.insert(universe);
            }
        }
        std::erase_if(sources, [&](const Source& s) { return !s.live && now_ns - s.packet_ns > kSourceRow_ns; });
    }
    std::erase_if(universes_, [](const auto& entry) { return entry.second.empty(); });
    std::erase_if(syncs_, [&](const auto& entry) { return now_ns - entry.second > kArtnetSync_ns; });
}

std::vector<std::uint16_t> ArtnetSources::take_changed() {
    std::vector<std::uint16_t> changed(changed_.begin(), changed_.end());
    changed_.clear();
    return changed;
}

DmxUniverse ArtnetSources::universe(std::uint16_t universe) const {
    DmxUniverse result;
    const auto found = universes_.find(universe);
    if (found == universes_.end()) return result;
    for (const Source& source : found->second) {
        if (!source.live) continue;
        DmxSource view;
        view.id = source.id;
        view.levels = source.shown.values;
        view.changed_ns = source.changed_ns;
        std::fill_n(view.rank.begin(), source.shown.slots, std::uint8_t{101});  // Art-Net knows no priority
        result.sources.push_back(std::move(view));
    }
    return result;
}

void ArtnetSources::describe(v1::Sources& table, std::int64_t now_ns) const {
    for (const auto& [number, sources] : universes_) {
        const DmxUniverse view = universe(number);
        const std::vector<unsigned> wins = winning_slots(view);
        for (const Source& source : sources) {
            v1::SourceRow& row = *table.add_sources();
            row.set_protocol("artnet");
            row.set_universe(number);
            if (source.physical != 0) row.set_name("physical port " + std::to_string(source.physical));
            row.set_address(print_peer(source.peer));
            row.set_rate_hz(source.rate.per_second(now_ns));
            row.set_packets(source.packets);
            row.set_lost(source.lost);
            row.set_out_of_order(source.out_of_order);
            row.set_state(source.live ? "live" : "lost");
            row.set_winning_slots(wins_of(view, wins, source.id));
            row.set_age_s(static_cast<double>(now_ns - source.packet_ns) * 1e-9);
            put_levels(row, source.shown.values, source.shown.slots);
        }
    }
}

}  // namespace gonio
