// What the tables of sACN's and of Art-Net's senders share: rows of universes, and which of them go at the bounds.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "protocol/dmx/dmx.h"
#include "protocol/schema/console.pb.h"

namespace gonio {

inline constexpr std::int64_t kSourceRow_ns = 60'000'000'000;  // a silent sender stays in the table for so long
inline constexpr std::size_t kMaxSourceRows = 1024;            // senders over all universes: see prefer()
inline constexpr std::size_t kMaxUniverseSources = 16;         // senders of one universe; likewise

struct SenderRow {
    struct Frame {
        DmxSlots values{};
        unsigned slots = 0;  // how many of them the packet held
        bool operator==(const Frame&) const = default;
    };
    std::uint32_t id = 0;
    std::uint8_t sequence = 0;
    bool has_levels = false;
    Frame shown;                // what counts
    std::optional<Frame> held;  // waits for its synchronization packet
    std::int64_t packet_ns = 0, changed_ns = 0;
    std::uint32_t packets = 0, lost = 0, out_of_order = 0;
    PacketRate rate;

    // Counts a packet. Result: whether it is to be used.
    bool take(const SequenceStep& step, std::uint8_t number, std::int64_t now_ns) {
        ++packets;
        rate.count(now_ns);
        if (step.verdict == SequenceVerdict::discard) {
            ++out_of_order;
            return false;
        }
        lost += step.lost;
        sequence = number;
        packet_ns = now_ns;
        return true;
    }

    // wins: the winning slots of the view's sources. Zeros at the end of the levels are left out.
    void describe(v1::SourceRow& row, const DmxUniverse& view, const std::vector<unsigned>& wins,
                  std::int64_t now_ns) const {
        row.set_rate_hz(rate.per_second(now_ns));
        row.set_packets(packets);
        row.set_lost(lost);
        row.set_out_of_order(out_of_order);
        for (std::size_t i = 0; i < view.sources.size(); ++i)
            if (view.sources[i].id == id) row.set_winning_slots(wins[i]);
        row.set_age_s(static_cast<double>(now_ns - packet_ns) * 1e-9);
        row.set_slots(shown.slots);
        unsigned used = shown.slots;
        while (used > 0 && shown.values[used - 1] == 0) --used;
        for (unsigned slot = 0; slot < used; ++slot) row.add_levels(shown.values[slot]);
    }
};

// Row: a SenderRow with is_live(): it has not been lost, nor has it ended.
template <typename Row>
class SenderTable {
public:
    // The universes that the patch uses. In a full table a sender of theirs takes the row of a lost sender or of one in
    // another universe. A sender of another universe takes only that of a lost one there.
    void prefer(std::set<std::uint16_t> universes) {
        preferred_ = std::move(universes);
        crowded_ = false;
    }
    // Result: universes whose levels or senders differ since the last call, ascending.
    std::vector<std::uint16_t> take_changed() {
        const std::set<std::uint16_t> changed = std::exchange(changed_, {});
        return {changed.begin(), changed.end()};
    }

protected:
    // Result: whether there may be one row more for the universe.
    bool make_room(std::uint16_t universe) {
        const bool wanted = preferred_.contains(universe);
        if (crowded_ && !wanted) return false;
        std::size_t rows = 0;
        for (const auto& [number, sources] : universes_) rows += sources.size();
        if (rows < kMaxSourceRows || drop_row(wanted)) return true;
        crowded_ = true;
        return false;
    }

    void show(std::uint16_t universe, Row& row, const SenderRow::Frame& frame, std::int64_t now_ns) {
        if (row.has_levels && row.shown == frame) return;
        row.has_levels = true;
        row.shown = frame;
        row.changed_ns = now_ns;
        changed_.insert(universe);
    }
    void show_held(std::uint16_t universe, Row& row, std::int64_t now_ns) {
        if (row.held) show(universe, row, *std::exchange(row.held, std::nullopt), now_ns);
    }

    // Rows that have been silent for long go.
    void drop_silent(std::int64_t now_ns) {
        for (auto& [universe, rows] : universes_)
            std::erase_if(rows, [&](const Row& r) { return !r.is_live() && now_ns - r.packet_ns > kSourceRow_ns; });
        std::erase_if(universes_, [](const auto& entry) { return entry.second.empty(); });
    }

    std::uint32_t next_id_ = 1;
    std::map<std::uint16_t, std::vector<Row>> universes_;
    std::set<std::uint16_t> changed_, preferred_;
    bool crowded_ = false;  // no row for a sender of another universe, until the next tick

private:
    // Takes one row out of a full table, the oldest of a kind first. First go rows of lost senders in universes that
    // nobody patched. Where the newcomer's universe is patched, live rows of such universes go next, then lost ones in
    // patched universes. Result: whether there was one; its universe has changed.
    bool drop_row(bool newcomer_is_patched) {
        auto of = universes_.end();
        std::size_t victim = 0;
        std::tuple<bool, bool, std::int64_t> first;
        for (auto universe = universes_.begin(); universe != universes_.end(); ++universe) {
            const bool is_patched = preferred_.contains(universe->first);
            for (std::size_t i = 0; i < universe->second.size(); ++i) {
                const Row& row = universe->second[i];
                const bool live = row.is_live();
                if (newcomer_is_patched ? is_patched && live : is_patched || live) continue;
                const std::tuple order(is_patched, live, row.packet_ns);
                if (of != universes_.end() && !(order < first)) continue;
                of = universe;
                victim = i;
                first = order;
            }
        }
        if (of == universes_.end()) return false;
        changed_.insert(of->first);
        of->second.erase(of->second.begin() + static_cast<std::ptrdiff_t>(victim));
        if (of->second.empty()) universes_.erase(of);
        return true;
    }
};

}  // namespace gonio
