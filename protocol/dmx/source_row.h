// Parts of a row of the source table that sACN and Art-Net share.
#pragma once

#include <cstdint>
#include <set>
#include <tuple>

#include "protocol/dmx/dmx.h"
#include "protocol/schema/gonio.pb.h"

namespace gonio {

// Result: the wins of the source in the view; 0 where it has no say.
inline unsigned wins_of(const DmxUniverse& view, const std::vector<unsigned>& wins, std::uint32_t id) {
    for (std::size_t i = 0; i < view.sources.size(); ++i)
        if (view.sources[i].id == id) return wins[i];
    return 0;
}

// slots: how many of `levels` the packet held; the zeros at the end are left out.
inline void put_levels(v1::SourceRow& row, const DmxSlots& levels, unsigned slots) {
    row.set_slots(slots);
    unsigned used = slots;
    while (used > 0 && levels[used - 1] == 0) --used;
    for (unsigned slot = 0; slot < used; ++slot) row.add_levels(levels[slot]);
}

// Takes one row out of a full table (universe -> rows), the oldest of a kind first. First go rows of lost senders in
// universes that nobody patched. Where the newcomer's universe is patched, live rows of such universes go next, then
// lost ones in patched universes. The call is_live tells of a row. Result: whether there was one; its universe joins
// `changed`.
template <typename Universes, typename IsLive>
bool drop_row(Universes& universes, const std::set<std::uint16_t>& patched, bool newcomer_is_patched,
              const IsLive& is_live, std::set<std::uint16_t>& changed) {
    auto of = universes.end();
    std::size_t victim = 0;
    std::tuple<bool, bool, std::int64_t> first;
    for (auto universe = universes.begin(); universe != universes.end(); ++universe) {
        const bool is_patched = patched.contains(universe->first);
        for (std::size_t i = 0; i < universe->second.size(); ++i) {
            const auto& row = universe->second[i];
            const bool live = is_live(row);
            if (newcomer_is_patched ? is_patched && live : is_patched || live) continue;
            const std::tuple order(is_patched, live, row.packet_ns);
            if (of != universes.end() && !(order < first)) continue;
            of = universe;
            victim = i;
            first = order;
        }
    }
    if (of == universes.end()) return false;
    changed.insert(of->first);
    of->second.erase(of->second.begin() + static_cast<std::ptrdiff_t>(victim));
    if (of->second.empty()) universes.erase(of);
    return true;
}

// Result: how many rows there are.
template <typename Universes>
std::size_t count_rows(const Universes& universes) {
    std::size_t rows = 0;
    for (const auto& [number, sources] : universes) rows += sources.size();
    return rows;
}

}  // namespace gonio
