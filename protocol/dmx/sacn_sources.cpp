#include "protocol/dmx/sacn_sources.h"

#include <algorithm>
#include <functional>

#include "protocol/schema/console.pb.h"

namespace gonio {
namespace {

std::string hex(const Cid& cid) {
    static const char* digits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : cid) {
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

}  // namespace

bool SacnSources::take(const E131Packet& packet, const std::string& from, std::int64_t now_ns) {
    if (const auto* data = std::get_if<E131Data>(&packet)) return take_data(*data, from, now_ns);
    if (const auto* sync = std::get_if<E131Sync>(&packet)) return take_sync(*sync, now_ns);
    return take_discovery(std::get<E131Discovery>(packet), from, now_ns);
}

// Result: the sender's entry, new where it had none; nothing at the bounds.
SacnSource* SacnSources::source_of(const E131Data& data, std::int64_t now_ns) {
    if (const auto found = universes_.find(data.universe); found != universes_.end())
        for (SacnSource& known : found->second)
            if (known.cid == data.cid) return &known;
    if (!make_room(data.universe)) return nullptr;
    std::vector<SacnSource>& sources = universes_[data.universe];
    if (sources.size() >= kMaxUniverseSources) {
        // One that has gone gives its row to the newcomer.
        const auto gone = std::find_if_not(sources.begin(), sources.end(), std::mem_fn(&SacnSource::is_live));
        if (gone == sources.end()) return nullptr;
        sources.erase(gone);
    }
    SacnSource source;
    source.cid = data.cid;
    begin_anew(source, data, now_ns);
    sources.push_back(std::move(source));
    return &sources.back();
}

void SacnSources::begin_anew(SacnSource& source, const E131Data& data, std::int64_t now_ns) {
    source.id = next_id_++;
    source.sequence = static_cast<std::uint8_t>(data.sequence - 1);
    source.state = State::waiting;
    source.first_ns = now_ns;
    source.expired_ns = 0;
    source.has_levels = false;
    source.held.reset();
    source.held_ns = 0;
    source.slot_priority.reset();
}

bool SacnSources::take_data(const E131Data& data, const std::string& from, std::int64_t now_ns) {
    if (data.preview && !accept_preview_) return true;
    if (data.terminated && !universes_.contains(data.universe)) return true;
    SacnSource* found = source_of(data, now_ns);
    if (found == nullptr) return false;
    SacnSource& source = *found;
    const bool was_gone = !source.is_live();
    // What was under way when the sender said its end comes too late; a sender that starts again counts on.
    if (source.state == State::terminated && !data.terminated &&
        sacn_sequence(source.sequence, data.sequence).verdict == SequenceVerdict::discard) {
        ++source.out_of_order;
        return true;
    }
    if (was_gone && !data.terminated) begin_anew(source, data, now_ns);
    if (!source.take(sacn_sequence(source.sequence, data.sequence), data.sequence, now_ns)) return true;
    source.name = data.name;
    source.address = from;
    source.preview = data.preview;
    if (data.terminated) {  // its slots are to be ignored, there may be none (E1.31 6.2.6)
        if (!was_gone) changed_.insert(data.universe);
        source.state = State::terminated;
        source.held.reset();
        return true;
    }
    if (source.priority != data.priority) {
        source.priority = data.priority;
        changed_.insert(data.universe);
    }
    if (data.start_code == kStartCodeLevels) {
        take_levels(source, data, now_ns);
    } else if (data.start_code == kStartCodePriorities) {
        source.priorities_ns = now_ns;
        DmxSlots priorities = data.values;
        for (std::uint8_t& priority : priorities)
            priority = std::min(priority, kE131MaxPriority);  // others are reserved
        if (source.slot_priority != priorities) {
            source.slot_priority = priorities;  // slots that the packet lacks are 0: not controlled
            changed_.insert(data.universe);
        }
        if (source.state == State::waiting && source.has_levels) source.state = State::live;
    }
    return true;
}

void SacnSources::take_levels(SacnSource& source, const E131Data& data, std::int64_t now_ns) {
    source.levels_ns = now_ns;
    source.expired_ns = 0;
    source.sync_address = data.sync_address;
    source.force_sync = data.force_sync;
    if (!source.has_levels && source.slot_priority) source.state = State::live;
    source.held = {data.values, data.slots};
    if (data.sync_address == 0)
        source.held_ns = 0;
    else if (source.held_ns == 0)
        source.held_ns = now_ns;
    if (data.sync_address == 0 || sync_is_lost(source, now_ns)) show_held(data.universe, source, now_ns);
}

// Whether what the source holds may be shown without a synchronization packet: none came for 2.5 s, and the sender
// allows it (Force_Synchronization set; else levels stay until synchronization resumes, E1.31-2018 clause 6.2.6).
bool SacnSources::sync_is_lost(const SacnSource& source, std::int64_t now_ns) const {
    const auto sync = syncs_.find(source.sync_address);
    const bool ever = sync != syncs_.end() && sync->second.heard_ns > 0;
    if (ever && !source.force_sync) return false;
    return now_ns - std::max(ever ? sync->second.heard_ns : 0, source.held_ns) > kSacnLoss_ns;
}

bool SacnSources::take_sync(const E131Sync& sync, std::int64_t now_ns) {
    // Only addresses that a universe names are kept.
    if (!is_sync_address(sync.address)) return true;
    SyncAddress& address = syncs_[sync.address];
    const auto last = address.senders.find(sync.cid);
    if (last != address.senders.end()) {
        if (now_ns - last->second.heard_ns <= kSacnLoss_ns &&
            sacn_sequence(last->second.sequence, sync.sequence).verdict == SequenceVerdict::discard) {
            return true;
        }
    } else if (address.senders.size() >= kMaxUniverseSources) {
        address.senders.erase(
            std::min_element(address.senders.begin(), address.senders.end(),
                             [](const auto& a, const auto& b) { return a.second.heard_ns < b.second.heard_ns; }));
    }
    address.senders[sync.cid] = {sync.sequence, now_ns};
    address.heard_ns = now_ns;
    for (auto& [universe, sources] : universes_) {
        for (SacnSource& source : sources) {
            if (source.sync_address != sync.address) continue;
            source.held_ns = 0;
            show_held(universe, source, now_ns);
        }
    }
    return true;
}

bool SacnSources::take_discovery(const E131Discovery& discovery, const std::string& from, std::int64_t now_ns) {
    if (!discovered_.contains(discovery.cid) && discovered_.size() >= kMaxDiscovered) return false;
    Sender& sender = discovered_[discovery.cid];
    sender.name = discovery.name;
    sender.address = from;
    sender.heard_ns = now_ns;
    if (discovery.page == 0) {
        sender.pages.clear();
        sender.next_page = 0;
    }
    if (discovery.page != sender.next_page) return true;  // a page went missing: the next round brings all again
    for (const std::uint16_t universe : discovery.universes)
        if (sender.pages.size() < kMaxDiscoveredUniverses) sender.pages.push_back(universe);
    if (discovery.page == discovery.last_page) {
        sender.universes = std::move(sender.pages);
        sender.pages.clear();
        sender.next_page = 0;
    } else {
        ++sender.next_page;
    }
    return true;
}

// A sender that falls silent goes when every other one has either been heard since, or fallen silent too: when a cable
// is pulled all go together, and none of lower priority takes over for the moment between two timers.
void SacnSources::judge_losses(std::uint16_t universe, std::vector<SacnSource>& sources, std::int64_t now_ns) {
    for (SacnSource& source : sources) {
        const std::int64_t heard_ns = std::max(source.levels_ns, source.first_ns);
        if (source.is_live() && source.expired_ns == 0 && now_ns - heard_ns > kSacnLoss_ns)
            source.expired_ns = heard_ns + kSacnLoss_ns;
    }
    std::vector<SacnSource*> lost;
    for (SacnSource& source : sources) {
        if (!source.is_live() || source.expired_ns == 0) continue;
        const bool judged = std::all_of(sources.begin(), sources.end(), [&](const SacnSource& other) {
            return &other == &source || !other.is_live() || other.expired_ns != 0 ||
                   other.levels_ns > source.expired_ns;
        });
        if (judged) lost.push_back(&source);
    }
    for (SacnSource* source : lost) {
        source->state = State::lost;
        source->held.reset();
        changed_.insert(universe);
    }
}

void SacnSources::tick(std::int64_t now_ns) {
    crowded_ = false;
    for (auto& [universe, sources] : universes_) {
        for (SacnSource& source : sources) {
            if (source.state == State::waiting && source.has_levels &&
                now_ns - source.first_ns >= kSacnPriorityWait_ns) {
                source.state = State::live;
                changed_.insert(universe);
            }
            if (source.slot_priority && now_ns - source.priorities_ns > kSacnLoss_ns) {
                source.slot_priority.reset();
                changed_.insert(universe);
            }
            if (sync_is_lost(source, now_ns)) show_held(universe, source, now_ns);
        }
        judge_losses(universe, sources, now_ns);
    }
    drop_silent(now_ns);
    std::erase_if(discovered_, [&](const auto& entry) { return now_ns - entry.second.heard_ns > kSacnDiscovery_ns; });
    std::erase_if(syncs_, [&](const auto& entry) { return !is_sync_address(entry.first); });
}

DmxUniverse SacnSources::universe(std::uint16_t universe) const {
    DmxUniverse result;
    const auto found = universes_.find(universe);
    if (found == universes_.end()) return result;
    for (const SacnSource& source : found->second) {
        if (source.state != State::live || !source.has_levels) continue;
        DmxSource view{source.id, source.shown.values, {}, source.changed_ns};
        for (std::size_t slot = 0; slot < source.shown.slots; ++slot) {
            // A universe priority of 0 is the lowest (E1.31 6.2.3), a slot priority of 0 "not controlled".
            const std::uint8_t own = source.slot_priority ? (*source.slot_priority)[slot] : 0;
            view.rank[slot] = static_cast<std::uint8_t>(!source.slot_priority ? source.priority + 1
                                                        : own                 ? own + 1
                                                                              : 0);
        }
        result.sources.push_back(view);
    }
    return result;
}

std::set<std::uint16_t> SacnSources::sync_addresses() const {
    std::set<std::uint16_t> addresses;
    for (const auto& [universe, sources] : universes_) {
        if (!preferred_.contains(universe)) continue;
        for (const SacnSource& source : sources)
            if (waits_for(source) != 0 && addresses.size() < kMaxSyncAddresses) addresses.insert(waits_for(source));
    }
    return addresses;
}

// Result: the synchronization address that a sender in the table uses; 0: none.
std::uint16_t SacnSources::waits_for(const SacnSource& source) {
    return source.is_live() ? source.sync_address : 0;
}

bool SacnSources::is_sync_address(std::uint16_t address) const {
    return std::any_of(universes_.begin(), universes_.end(), [&](const auto& entry) {
        return std::any_of(entry.second.begin(), entry.second.end(),
                           [&](const SacnSource& source) { return waits_for(source) == address; });
    });
}

void SacnSources::describe(v1::Sources& table, std::int64_t now_ns) const {
    static constexpr const char* kStates[] = {"waiting", "live", "lost", "terminated"};
    for (const auto& [number, sources] : universes_) {
        const DmxUniverse view = universe(number);
        const std::vector<unsigned> wins = winning_slots(view);
        for (const SacnSource& source : sources) {
            v1::SourceRow& row = *table.add_sources();
            row.set_protocol("sacn");
            row.set_universe(number);
            row.set_name(source.name);
            row.set_address(source.address);
            row.set_cid(hex(source.cid));
            row.set_priority(source.priority);
            row.set_slot_priorities(source.slot_priority.has_value());
            row.set_state(kStates[static_cast<int>(source.state)]);
            row.set_sync_universe(source.sync_address);
            row.set_preview(source.preview);
            source.describe(row, view, wins, now_ns);
        }
    }
    for (const auto& [cid, sender] : discovered_) {
        v1::DiscoveredSource& row = *table.add_discovered();
        row.set_name(sender.name);
        row.set_address(sender.address);
        for (const std::uint16_t universe : sender.universes) row.add_universes(universe);
    }
}

}  // namespace gonio
