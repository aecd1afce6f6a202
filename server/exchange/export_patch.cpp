// The patch -> channels of a fixture.
#include <algorithm>
#include <map>

#include "protocol/schema/console.pb.h"
#include "protocol/schema/property.h"
#include "server/exchange/export_parts.h"
#include "server/exchange/mvr.h"
#include "server/scene/scene.h"

namespace gonio::exchange {
namespace {

struct DrivenRow {
    Property property;
    const char* attribute;  // in the unit that people write the property in
};
constexpr DrivenRow kDriven[] = {
    {Property::level, "Dimmer"},   {Property::pan, "Pan"},          {Property::tilt, "Tilt"},
    {Property::red, "ColorAdd_R"}, {Property::green, "ColorAdd_G"}, {Property::blue, "ColorAdd_B"},
};

// MVR's universe 1 is sACN's, and port-address 0 of Art-Net.
unsigned universe_of(const v1::PatchRow& row) {
    return row.protocol() == "artnet" ? row.universe() + 1 : row.universe();
}

}  // namespace

LightPatch patch_of(const Scene& scene, const Light& light) {
    LightPatch patch;
    std::map<unsigned, unsigned> first;  // of each universe: the least address
    std::map<std::string, const v1::PatchRow*> rows;
    if (scene.patch)
        for (const v1::PatchRow& row : scene.patch->rows()) {
            if (row.target() != light.name || universe_of(row) > mvr::kMostUniverse || row.ranges_size() > 0) continue;
            if (std::ranges::none_of(kDriven,
                                     [&](const DrivenRow& one) { return row.property() == row_of(one.property).name; }))
                continue;
            if (!rows.emplace(row.property(), &row).second) continue;  // a second one of the same has no channel
            patch.rows.push_back(&row);
            auto& least = first.try_emplace(universe_of(row), row.address()).first->second;
            least = std::min(least, row.address());
        }
    for (const auto& [universe, address] : first) patch.breaks.push_back({universe, address});
    patch.swings = rows.contains("pan") || rows.contains("tilt");
    for (const DrivenRow& one : kDriven) {
        gdtf::WrittenChannel channel{one.attribute};
        const bool turns = one.property == Property::pan || one.property == Property::tilt;
        const PropertyRow& property = row_of(one.property);
        channel.from = property.low / property.unit;
        channel.to = property.high / property.unit;
        if (const auto at = rows.find(std::string(property.name)); at != rows.end()) {
            const v1::PatchRow& row = *at->second;
            const auto start = first.find(universe_of(row));
            channel.dmx_break = static_cast<int>(std::distance(first.begin(), start)) + 1;
            channel.slot = static_cast<int>(row.address() - start->second) + 1;
            channel.bytes = row.bits() == 16 ? 2 : 1;
            if (row.has_low()) channel.from = row.low() / property.unit;
            if (row.has_high()) channel.to = row.high() / property.unit;
        } else if (turns && patch.swings) {
            channel.bytes = 2;  // its axis is there all the same
        } else if (one.property == Property::level && rows.empty()) {
            channel.slot = 1;
        } else {
            continue;
        }
        // Until a console speaks: dark, all emitters on, at home.
        channel.value = turns ? 0.0 : one.property == Property::level ? channel.from : channel.to;
        patch.channels.push_back(channel);
    }
    return patch;
}

}  // namespace gonio::exchange
