// Which senders of sACN have a say, by E1.31 and the rules of per-address priority: sequence, priority,
// synchronization, termination, loss. Pure: packets and the time go in, universes and the source table come out. One
// thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocol/dmx/e131.h"
#include "protocol/dmx/sender_table.h"

namespace gonio {

inline constexpr std::int64_t kSacnLoss_ns = 2'500'000'000;          // E131_NETWORK_DATA_LOSS_TIMEOUT
inline constexpr std::int64_t kSacnPriorityWait_ns = 1'500'000'000;  // a new sender's 0xDD packet may come so late
inline constexpr std::int64_t kSacnDiscovery_ns = 25'000'000'000;    // 2.5 of E131_UNIVERSE_DISCOVERY_INTERVAL
inline constexpr std::size_t kMaxSyncAddresses = 64;                 // whose groups are joined; more are not
inline constexpr std::size_t kMaxDiscovered = 64;                    // senders in the discovery list; likewise
inline constexpr std::size_t kMaxDiscoveredUniverses = 4096;         // of one sender; more are left out

struct SacnSource : SenderRow {
    Cid cid{};
    std::string name, address;
    enum class State { waiting, live, lost, terminated } state = State::waiting;
    std::uint8_t priority = 100;
    std::uint16_t sync_address = 0;
    bool preview = false, force_sync = false;
    std::int64_t held_ns = 0;  // since when something is held
    std::optional<DmxSlots> slot_priority;
    std::int64_t first_ns = 0, levels_ns = 0, priorities_ns = 0;
    std::int64_t expired_ns = 0;  // when its silence became a loss; 0: it did not
    bool is_live() const { return state == State::waiting || state == State::live; }
};

class SacnSources : public SenderTable<SacnSource> {
public:
    // accept_preview: whether packets with the preview bit count; a visualiser's answer is yes.
    explicit SacnSources(bool accept_preview = true) : accept_preview_(accept_preview) {}

    // from: the sender's address as people read it. Result: false where the packet was refused for a bound.
    bool take(const E131Packet& packet, const std::string& from, std::int64_t now_ns);
    // Judges what the passing of time means. Call at least ten times a second.
    void tick(std::int64_t now_ns);
    DmxUniverse universe(std::uint16_t universe) const;
    // Result: the synchronization addresses that senders in the patched universes name, at most kMaxSyncAddresses;
    // their groups must be joined too. What foreign packets name is none of ours.
    std::set<std::uint16_t> sync_addresses() const;
    void describe(v1::Sources& table, std::int64_t now_ns) const;

private:
    using State = SacnSource::State;
    struct Sender {  // of universe discovery
        std::string name, address;
        std::vector<std::uint16_t> universes, pages;  // complete; being gathered
        std::uint8_t next_page = 0;
        std::int64_t heard_ns = 0;
    };
    struct SyncSender {
        std::uint8_t sequence = 0;
        std::int64_t heard_ns = 0;
    };
    struct SyncAddress {
        std::map<Cid, SyncSender> senders;  // at most kMaxUniverseSources; then the one silent for longest goes
        std::int64_t heard_ns = 0;
    };

    bool take_data(const E131Data& data, const std::string& from, std::int64_t now_ns);
    void take_levels(SacnSource& source, const E131Data& data, std::int64_t now_ns);
    bool take_sync(const E131Sync& sync, std::int64_t now_ns);
    bool take_discovery(const E131Discovery& discovery, const std::string& from, std::int64_t now_ns);
    SacnSource* source_of(const E131Data& data, std::int64_t now_ns);
    void begin_anew(SacnSource& source, const E131Data& data, std::int64_t now_ns);
    bool sync_is_lost(const SacnSource& source, std::int64_t now_ns) const;
    static std::uint16_t waits_for(const SacnSource& source);
    bool is_sync_address(std::uint16_t address) const;  // whether a sender in the table uses it
    void judge_losses(std::uint16_t universe, std::vector<SacnSource>& sources, std::int64_t now_ns);

    bool accept_preview_;
    std::map<std::uint16_t, SyncAddress> syncs_;
    std::map<Cid, Sender> discovered_;
};

}  // namespace gonio
