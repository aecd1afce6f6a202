// Which senders of sACN have a say, by E1.31 and the rules of per-address priority: sequence, priority,
// synchronization, termination, loss. Pure: packets and the time go in, universes and the source table come out. One
// thread.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocol/dmx/dmx.h"
#include "protocol/dmx/e131.h"
#include "protocol/schema/gonio.pb.h"

namespace gonio {

inline constexpr std::int64_t kSacnLoss_ns = 2'500'000'000;          // E131_NETWORK_DATA_LOSS_TIMEOUT
inline constexpr std::int64_t kSacnPriorityWait_ns = 1'500'000'000;  // a new sender's 0xDD packet may come so late
inline constexpr std::int64_t kSacnDiscovery_ns = 25'000'000'000;    // 2.5 of E131_UNIVERSE_DISCOVERY_INTERVAL
inline constexpr std::int64_t kSourceRow_ns = 60'000'000'000;        // a silent sender stays in the table for so long
inline constexpr std::size_t kMaxSourceRows = 1024;                  // senders over all universes: see prefer()
inline constexpr std::size_t kMaxUniverseSources = 16;               // senders of one universe; likewise
inline constexpr std::size_t kMaxSyncAddresses = 64;                 // whose groups are joined; more are not
inline constexpr std::size_t kMaxDiscovered = 64;                    // senders in the discovery list; likewise
inline constexpr std::size_t kMaxDiscoveredUniverses = 4096;         // of one sender; more are left out

class SacnSources {
public:
    // accept_preview: whether packets with the preview bit count; a visualiser's answer is yes.
    explicit SacnSources(bool accept_preview = true) : accept_preview_(accept_preview) {}

    // The universes that the patch uses. In a full table a sender of theirs takes the row of a lost sender or of one in
    // another universe; a sender of another universe only that of a lost one there.
    void prefer(std::set<std::uint16_t> universes);
    // from: the sender's address as people read it. Result: false where the packet was refused for a bound.
    bool take(const E131Packet& packet, const std::string& from, std::int64_t now_ns);
    // Judges what the passing of time means. Call at least ten times a second.
    void tick(std::int64_t now_ns);
    // Result: universes whose levels or senders differ since the last call, ascending.
    std::vector<std::uint16_t> take_changed();
    DmxUniverse universe(std::uint16_t universe) const;
    // Result: the synchronization addresses that senders in the patched universes name, at most kMaxSyncAddresses;
    // their groups must be joined too. What foreign packets name is none of ours.
    std::set<std::uint16_t> sync_addresses() const;
    void describe(v1::Sources& table, std::int64_t now_ns) const;

private:
    enum class State { waiting, live, lost, terminated };
    struct Frame {
        DmxSlots values{};
        unsigned slots = 0;
    };
    struct Source {
        std::uint32_t id = 0;
        Cid cid{};
        std::string name, address;
        State state = State::waiting;
        std::uint8_t sequence = 0, priority = 100;
        std::uint16_t sync_address = 0;
        bool preview = false, force_sync = false, has_levels = false;
        Frame shown;                // what counts
        std::optional<Frame> held;  // waits for its synchronization packet
        std::int64_t held_ns = 0;   // since when something is held
        std::optional<DmxSlots> slot_priority;
        std::int64_t first_ns = 0, levels_ns = 0, packet_ns = 0, priorities_ns = 0, changed_ns = 0;
        std::int64_t expired_ns = 0;  // when its silence became a loss; 0: it did not
        std::uint32_t packets = 0, lost = 0, out_of_order = 0;
        PacketRate rate;
    };
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
    void take_levels(std::uint16_t universe, Source& source, const E131Data& data, std::int64_t now_ns);
    bool take_sync(const E131Sync& sync, std::int64_t now_ns);
    bool take_discovery(const E131Discovery& discovery, const std::string& from, std::int64_t now_ns);
    Source* source_of(const E131Data& data, std::int64_t now_ns);
    void begin_anew(Source& source, std::int64_t now_ns);
    void show(std::uint16_t universe, Source& source, const Frame& frame, std::int64_t now_ns);
    bool sync_is_lost(const Source& source, std::int64_t now_ns) const;
    static std::uint16_t waits_for(const Source& source);
    bool is_sync_address(std::uint16_t address) const;  // whether a sender in the table uses it
    void judge_losses(std::uint16_t universe, std::vector<Source>& sources, std::int64_t now_ns);

    bool accept_preview_;
    std::uint32_t next_id_ = 1;
    std::map<std::uint16_t, std::vector<Source>> universes_;
    std::map<std::uint16_t, SyncAddress> syncs_;
    std::map<Cid, Sender> discovered_;
    std::set<std::uint16_t> changed_, preferred_;
    bool crowded_ = false;  // no row for a sender of another universe, until the next tick
};

}  // namespace gonio
