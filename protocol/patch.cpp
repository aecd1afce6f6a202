#include "protocol/patch.h"

#include <algorithm>
#include <cmath>

#include "ies/synthetic.h"
#include "protocol/artnet.h"
#include "protocol/e131.h"
#include "protocol/text_bytes.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxProfiles = 256;
constexpr std::size_t kMaxNameLength = 128;

unsigned bytes_of(const v1::PatchRow& row) {
    return row.bits() == 16 ? 2 : 1;
}

Error refusal_of(std::size_t row, const char* field, std::string value, std::string message) {
    return {"invalid_argument", "set_patch.rows[" + std::to_string(row) + "]." + field, std::move(value),
            std::move(message)};
}

Result<bool> check_row(const v1::PatchRow& row, std::size_t index) {
    const bool sacn = row.protocol() == "sacn";
    if (!sacn && row.protocol() != "artnet")
        return refusal_of(index, "protocol", shown_text(row.protocol()), "must be sacn or artnet");
    if (sacn ? row.universe() < 1 || row.universe() > kE131MaxUniverse : row.universe() > kArtnetMaxUniverse)
        return refusal_of(index, "universe", std::to_string(row.universe()),
                          sacn ? "sACN universes are 1 to 63999" : "Art-Net port-addresses are 0 to 32767");
    const PropertyRow* property = find_property(row.property());
    if (property == nullptr || property->property == Property::preset)
        return refusal_of(index, "property", shown_text(row.property()),
                          "must be level, red, green, blue, color, pan, tilt, roll, x, y, z, position, aim, profile, "
                          "master, exposure, orbit, elevation or distance");
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
    const bool selects = property->property == Property::profile;
    if (selects != (row.profiles_size() > 0) || static_cast<std::size_t>(row.profiles_size()) > kMaxProfiles)
        return refusal_of(index, "profiles", std::to_string(row.profiles_size()),
                          selects ? "must list 1 to 256 profiles" : "only the property profile has a list of profiles");
    const auto luminaires = ies::synthetic_luminaires();
    for (const std::string& name : row.profiles()) {
        const bool known = std::any_of(luminaires.begin(), luminaires.end(),
                                       [&](const auto& luminaire) { return luminaire.name == name; });
        if (!known) return refusal_of(index, "profiles", shown_text(name), "is not the name of a built-in luminaire");
    }
    return true;
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
}

// Result: the row's raw values by the winning sender; nothing where no sender controls all of its slots.
std::optional<PatchReader::Raw> PatchReader::decide(Row& row, const DmxUniverse& universe) {
    const std::size_t first = row.row.address() - 1, count = row.property->values * row.bytes;
    struct Candidate {
        const DmxSource* source;
        Raw raw;
    };
    std::vector<Candidate> candidates;
    std::uint8_t priority = 1;
    for (const DmxSource& source : universe.sources) {
        const auto begin = source.priority.begin() + static_cast<std::ptrdiff_t>(first);
        if (std::find(begin, begin + static_cast<std::ptrdiff_t>(count), 0) !=
            begin + static_cast<std::ptrdiff_t>(count))
            continue;
        if (*begin < priority) continue;
        if (*begin > priority) candidates.clear();
        priority = *begin;
        Raw raw{};
        for (std::size_t slot = 0; slot < count; ++slot)
            raw[slot / row.bytes] = raw[slot / row.bytes] << 8 | source.levels[first + slot];
        candidates.push_back({&source, raw});
    }
    std::map<std::uint32_t, Raw> now;
    const Candidate* winner = nullptr;
    for (const Candidate& candidate : candidates) {
        now[candidate.source->id] = candidate.raw;
        if (row.property->htp) {
            if (winner == nullptr || candidate.raw[0] > winner->raw[0]) winner = &candidate;
            continue;
        }
        const auto last = row.last.find(candidate.source->id);
        const bool moved = last == row.last.end() || last->second != candidate.raw;
        const bool later = winner == nullptr || candidate.source->changed_ns > winner->source->changed_ns;
        if (moved && later) winner = &candidate;
    }
    if (winner == nullptr) {  // nobody moved: the holder goes on, or, if it has gone, whoever changed last
        for (const Candidate& candidate : candidates) {
            if (candidate.source->id == row.holder) {
                winner = &candidate;
                break;
            }
            if (winner == nullptr || candidate.source->changed_ns > winner->source->changed_ns) winner = &candidate;
        }
    }
    row.last = std::move(now);
    if (winner == nullptr) return std::nullopt;
    row.holder = winner->source->id;
    return winner->raw;
}

std::vector<PropertyValue> PatchReader::read(const DmxKey& key, const DmxUniverse& universe) {
    std::vector<PropertyValue> values;
    const auto found = rows_.find(key);
    if (found == rows_.end()) return values;
    for (Row& row : found->second) {
        const std::optional<Raw> raw = decide(row, universe);
        if (!raw || row.said == raw) continue;
        row.said = raw;
        const PropertyRow& property = *row.property;
        const double low = row.row.has_low() ? row.row.low() : property.low;
        const double high = row.row.has_high() ? row.row.high() : property.high;
        const double top = row.bytes == 2 ? 65535.0 : 255.0;
        PropertyValue value;
        value.target = row.row.target();
        value.property = property.property;
        if (property.property == Property::profile) {
            const auto count = static_cast<std::size_t>(row.row.profiles_size());
            const std::size_t index = static_cast<std::size_t>((*raw)[0]) * count / (row.bytes == 2 ? 65536 : 256);
            value.profile = row.row.profiles(static_cast<int>(index));
        }
        for (unsigned i = 0; i < property.values; ++i) value.value[i] = low + (high - low) * ((*raw)[i] / top);
        values.push_back(std::move(value));
    }
    return values;
}

}  // namespace gonio
