// Parts of a row of the source table that sACN and Art-Net share.
#pragma once

#include "protocol/dmx.h"
#include "protocol/gonio.pb.h"

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

}  // namespace gonio
