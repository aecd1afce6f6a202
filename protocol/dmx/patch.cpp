#include "protocol/dmx/patch.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "ies/core/text.h"
#include "ies/synthetic.h"
#include "protocol/dmx/artnet.h"
#include "protocol/dmx/e131.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/name_list.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxNameLength = 128;

unsigned bytes_of(const v1::PatchRow& row) {
    return row.bits() == 16 ? 2 : 1;
}

Error refusal_of(std::size_t row, const char* field, std::string value, std::string message) {
    return {"invalid_argument", "set_patch.rows[" + std::to_string(row) + "]." + field, std::move(value),
            std::move(message)};
}

Result<bool> check_ranges(const v1::PatchRow& row, const PropertyRow& property, std::size_t index) {
    const auto within = [&](double value) {
        return (value >= property.least && value <= property.most) || (property.or_none && value == 0);
    };
    if (row.ranges_size() == 0) return true;
    if (property.values != 1 || property.by_list || row.has_low() || row.has_high())
        return refusal_of(index, "ranges", std::to_string(row.ranges_size()),
                          "are of a property of one number, and instead of low and high");
    if (row.ranges_size() > kMaxPatchRanges)
        return refusal_of(index, "ranges", std::to_string(row.ranges_size()), "a row has at most 256 ranges");
    const std::uint32_t most = bytes_of(row) == 2 ? 65535 : 255;
    std::int64_t last = -1;
    for (const v1::PatchRange& range : row.ranges()) {
        if (range.from() <= last || range.to() < range.from() || range.to() > most)
            return refusal_of(index, "ranges", std::to_string(range.from()) + " to " + std::to_string(range.to()),
                              "ranges follow each other, each within 0 to " + std::to_string(most));
        last = range.to();
        for (const double value : {range.low(), range.high()})
            if (!within(value))
                return refusal_of(index, "ranges", print_number(value),
                                  "must be a number from " + print_number(property.least) + " to " +
                                      print_number(property.most) + " (radians, metres)");
    }
    return true;
}

Result<bool> check_row(const v1::PatchRow& row, std::size_t index) {
    const bool sacn = row.protocol() == "sacn";
    if (!sacn && row.protocol() != "artnet")
        return refusal_of(index, "protocol", shown_text(row.protocol()), "must be sacn or artnet");
    if (sacn ? row.universe() < 1 || row.universe() > kE131MaxUniverse : row.universe() > kArtnetMaxUniverse)
        return refusal_of(index, "universe", std::to_string(row.universe()),
                          sacn ? "sACN universes are 1 to 63999" : "Art-Net port-addresses are 0 to 32767");
    const PropertyRow* property = find_property(row.property());
    if (property == nullptr || property->of_buttons)
        return refusal_of(index, "property", shown_text(row.property()),
                          "must be " + property_names([](const PropertyRow& known) { return !known.of_buttons; }));
    if (row.bits() != 0 && row.bits() != 8 && row.bits() != 16)
        return refusal_of(index, "bits", std::to_string(row.bits()), "must be 8 or 16");
    if (row.address() < 1 || row.address() > kDmxSlots)
        return refusal_of(index, "address", std::to_string(row.address()), "addresses are 1 to 512");
    const unsigned slots = property->values * bytes_of(row);
    if (row.address() - 1 + slots > kDmxSlots)
        return refusal_of(index, "address", std::to_string(row.address()),
                          "its " + std::to_string(slots) + " slots reach beyond 512");
    if (property->of_scene != row.target().empty())
        return refusal_of(
            index, "target", shown_text(row.target()),
            property->of_scene ? "a property of the scene has no target" : "must name a light or a group");
    if (row.target().size() > kMaxNameLength)
        return refusal_of(index, "target", shown_text(row.target()), "a name has at most 128 bytes");
    for (const auto& [given, value, field] :
         {std::tuple{row.has_low(), row.low(), "low"}, {row.has_high(), row.high(), "high"}}) {
        if (!given && !property->has_range)
            return refusal_of(index, field, "", "positions need the range that the slots stand for");
        if (given && !(value >= property->least && value <= property->most))
            return refusal_of(index, field, print_number(value),
                              "must be a number from " + print_number(property->least) + " to " +
                                  print_number(property->most) + " (radians, metres)");
    }
    const bool one_number = property->values == 1 && !property->by_list;
    const bool merges = row.merge().empty() || row.merge() == "latest" || (row.merge() == "highest" && property->htp) ||
                        ((row.merge() == "sum" || row.merge() == "product") && one_number);
    if (!merges)
        return refusal_of(index, "merge", shown_text(row.merge()),
                          property->htp              ? "must be highest, latest, sum or product"
                          : !one_number              ? "must be latest"
                          : row.merge() == "highest" ? "only level and master merge by the highest"
                                                     : "must be latest, sum or product");
    if (const std::string why = wrong_list(*property, row.profiles(), ies::synthetic_luminaires()); !why.empty())
        return refusal_of(index, "profiles", std::to_string(row.profiles_size()), why);
    return check_ranges(row, *property, index);
}

}  // namespace

Result<bool> check_patch(const v1::SetPatch& patch) {
    const auto rows = static_cast<std::size_t>(patch.rows_size());
    if (patch.use_default() && rows > 0)
        return Error{"conflict", "set_patch.use_default", std::to_string(rows) + " rows",
                     "the default patch cannot be asked for together with rows"};
    if (rows > kMaxPatchRows)
        return Error{"too_large", "set_patch.rows", std::to_string(rows), "a patch has at most 4,096 rows"};
    for (std::size_t i = 0; i < rows; ++i)
        if (auto checked = check_row(patch.rows(static_cast<int>(i)), i); !checked) return checked;
    return true;
}

v1::Patch default_patch(std::span<const std::string> lights) {
    v1::Patch patch;
    patch.set_is_default(true);
    for (const DmxKey& key : {DmxKey{DmxProtocol::sacn, 1}, DmxKey{DmxProtocol::artnet, 0}}) {
        for (std::size_t i = 0; i < lights.size() && i < kDmxSlots; ++i) {
            v1::PatchRow& row = *patch.add_rows();
            row.set_protocol(dmx_protocol_name(key.protocol));
            row.set_universe(key.universe);
            row.set_address(static_cast<std::uint32_t>(i + 1));
            row.set_target(lights[i]);
            row.set_property("level");
            row.set_bits(8);
        }
    }
    return patch;
}

std::vector<std::string> patch_limits(const v1::Patch& patch) {
    std::vector<std::uint16_t> sacn, artnet;
    for (const DmxKey& key : universes_of(patch))
        (key.protocol == DmxProtocol::sacn ? sacn : artnet).push_back(key.universe);
    std::vector<std::string> warnings;
    if (sacn.size() > kMaxJoinedUniverses)
        warnings.push_back("the patch uses " + std::to_string(sacn.size()) + " sACN universes: of those from " +
                           std::to_string(sacn[kMaxJoinedUniverses]) +
                           " on only unicast is heard, no more than 512 are joined");
    const auto pages = art_pages(artnet);
    if (pages.size() > kMaxArtPages)
        warnings.push_back("the patch uses " + std::to_string(artnet.size()) +
                           " Art-Net port-addresses: consoles that ask are not told of those from " +
                           std::to_string(pages[kMaxArtPages][0]) + " on, 255 replies are all there can be");
    return warnings;
}

DmxKey key_of(const v1::PatchRow& row) {
    return {row.protocol() == "sacn" ? DmxProtocol::sacn : DmxProtocol::artnet,
            static_cast<std::uint16_t>(row.universe())};
}

std::vector<DmxKey> universes_of(const v1::Patch& patch) {
    std::vector<DmxKey> keys;
    for (const v1::PatchRow& row : patch.rows()) keys.push_back(key_of(row));
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys;
}

PatchReader::PatchReader(const v1::Patch& patch) {
    for (const v1::PatchRow& row : patch.rows())
        rows_[key_of(row)].push_back({row, find_property(row.property()), bytes_of(row), {}, 0, {}});
    std::map<std::tuple<std::string, Property, Merge>, std::pair<std::vector<Row*>, std::set<DmxKey>>> same;
    for (auto& [key, rows] : rows_) {
        for (Row& row : rows) {
            if (merge_of(row) == Merge::latest) continue;
            auto& [together, universes] = same[{row.row.target(), row.property->property, merge_of(row)}];
            together.push_back(&row);
            universes.insert(key);
        }
    }
    for (const auto& [target, found] : same) {
        const auto& [together, universes] = found;
        const Merge merge = std::get<Merge>(target);
        // Levels of one universe speak one after the other.
        if (merge == Merge::highest ? universes.size() < 2 : together.size() < 2) continue;
        for (Row* row : together) row->joint = joints_.size();
        joints_.push_back({{together.begin(), together.end()}, merge, {}, false});
    }
}

PatchReader::Merge PatchReader::merge_of(const Row& row) {
    const std::string& merge = row.row.merge();
    if (merge == "sum") return Merge::sum;
    if (merge == "product") return Merge::product;
    return row.property->htp && merge != "latest" ? Merge::highest : Merge::latest;
}

void PatchReader::forget(std::string_view target) {
    for (auto& [key, rows] : rows_)
        for (Row& row : rows)
            if (row.row.target() == target) unsay(row);
}

void PatchReader::forget(Property property) {
    for (auto& [key, rows] : rows_)
        for (Row& row : rows)
            if (row.property->property == property) unsay(row);
}

void PatchReader::unsay(Row& row) {
    row.said.reset();
    if (row.joint != SIZE_MAX) joints_[row.joint].said.reset();
}

std::optional<double> PatchReader::value_of(const Row& row, std::uint32_t raw) {
    if (row.row.ranges_size() > 0) {
        for (const v1::PatchRange& range : row.row.ranges())
            if (raw >= range.from() && raw <= range.to())
                return range.low() +
                       (range.high() - range.low()) * (raw - range.from()) / std::max(range.to() - range.from(), 1u);
        return std::nullopt;
    }
    const double low = row.row.has_low() ? row.row.low() : row.property->low;
    const double high = row.row.has_high() ? row.row.high() : row.property->high;
    return low + (high - low) * (raw / (row.bytes == 2 ? 65535.0 : 255.0));
}

// Of several rows for one property one value is said, where it differs from before.
void PatchReader::say_joint(Joint& joint, std::vector<PropertyValue>& values) {
    const PropertyRow& property = *joint.rows.front()->property;
    std::optional<double> all;
    bool controlled = false;
    for (const Row* row : joint.rows) {
        controlled = controlled || row->controlled;
        if (!row->stands || (joint.merge == Merge::highest && !row->controlled)) continue;
        const double own = *row->stands;
        all = !all                            ? own
              : joint.merge == Merge::sum     ? *all + own
              : joint.merge == Merge::product ? *all * own
                                              : std::max(*all, own);
    }
    joint.read = false;
    if (!all || !controlled) return;  // where all senders are gone the last look stays
    all = std::clamp(*all, property.least, property.most);
    if (all == joint.said) return;
    joint.said = all;
    PropertyValue& value = values.emplace_back();
    value.target = joint.rows.front()->row.target();
    value.property = property.property;
    value.value[0] = *all;
}

// Result: the row's raw values by the winning sender; nothing where no sender controls all of its slots.
std::optional<PatchReader::Raw> PatchReader::decide(Row& row, const DmxUniverse& universe) {
    const std::size_t first = row.row.address() - 1, count = row.property->values * row.bytes;
    candidates_.clear();
    std::uint8_t rank = 1;
    for (const DmxSource& source : universe.sources) {
        const auto begin = source.rank.begin() + static_cast<std::ptrdiff_t>(first);
        const auto end = begin + static_cast<std::ptrdiff_t>(count);
        if (std::find(begin, end, 0) != end || *begin < rank) continue;
        if (*begin > rank) candidates_.clear();
        rank = *begin;
        Raw raw{};
        for (std::size_t slot = 0; slot < count; ++slot)
            raw[slot / row.bytes] = raw[slot / row.bytes] << 8 | source.levels[first + slot];
        candidates_.push_back({&source, raw});
    }
    const Candidate* winner = nullptr;
    if (row.property->htp) {
        for (const Candidate& candidate : candidates_)
            if (winner == nullptr || candidate.raw[0] > winner->raw[0]) winner = &candidate;
    } else {
        winner = moved_last(row);
    }
    if (winner == nullptr) return std::nullopt;
    row.holder = winner->source->id;
    return winner->raw;
}

// Result: the candidate that moved the row's slots last; where nobody did now, the holder, or, if it has gone, whoever
// changed last. The row remembers what each said.
const PatchReader::Candidate* PatchReader::moved_last(Row& row) const {
    const Candidate* winner = nullptr;
    for (const Candidate& candidate : candidates_) {
        const auto last = std::find_if(row.last.begin(), row.last.end(),
                                       [&](const auto& one) { return one.first == candidate.source->id; });
        const bool moved = last == row.last.end() || last->second != candidate.raw;
        const bool later = winner == nullptr || candidate.source->changed_ns > winner->source->changed_ns;
        if (moved && later) winner = &candidate;
    }
    for (const Candidate& candidate : candidates_)
        if (winner == nullptr && candidate.source->id == row.holder) winner = &candidate;
    if (winner == nullptr) {
        for (const Candidate& candidate : candidates_)
            if (winner == nullptr || candidate.source->changed_ns > winner->source->changed_ns) winner = &candidate;
    }
    row.last.clear();
    for (const Candidate& candidate : candidates_) row.last.emplace_back(candidate.source->id, candidate.raw);
    return winner;
}

std::vector<PropertyValue> PatchReader::read(const DmxKey& key, const DmxUniverse& universe) {
    std::vector<PropertyValue> values;
    read(key, universe, values);
    return values;
}

void PatchReader::read(const DmxKey& key, const DmxUniverse& universe, std::vector<PropertyValue>& values) {
    const auto found = rows_.find(key);
    if (found == rows_.end()) return;
    for (Row& row : found->second) {
        std::optional<Raw> raw = decide(row, universe);
        if (row.joint != SIZE_MAX) {
            row.controlled = raw.has_value();
            if (raw)
                if (const auto value = value_of(row, (*raw)[0])) row.stands = value;  // else of no range: as it was
            joints_[row.joint].read = true;
            continue;
        }
        if (!raw) continue;
        const PropertyRow& property = *row.property;
        if (property.by_list)  // most steps of the slot choose the same one
            (*raw)[0] =
                (*raw)[0] * static_cast<std::uint32_t>(row.row.profiles_size()) / (row.bytes == 2 ? 65536 : 256);
        if (row.said == raw) continue;
        row.said = raw;
        if (!value_of(row, (*raw)[0])) continue;  // of no range
        PropertyValue& value = values.emplace_back();
        value.target = row.row.target();
        value.property = property.property;
        if (property.by_list) value.name = row.row.profiles(static_cast<int>((*raw)[0]));
        for (unsigned i = 0; i < property.values; ++i) value.value[i] = *value_of(row, (*raw)[i]);
    }
    for (const Row& row : found->second)
        if (row.joint != SIZE_MAX && joints_[row.joint].read) say_joint(joints_[row.joint], values);
}

}  // namespace gonio
