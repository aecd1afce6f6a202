#include "client/relay/nal_units.h"

#include <algorithm>

namespace gonio {
namespace {

constexpr std::byte kZero{0}, kOne{1};

// Result: where 00 00 01 begins at `from` or later; bytes.size() where it does not.
std::size_t start_code(ByteSpan bytes, std::size_t from) {
    for (std::size_t i = from; i + 3 <= bytes.size(); ++i)
        if (bytes[i] == kZero && bytes[i + 1] == kZero && bytes[i + 2] == kOne) return i;
    return bytes.size();
}

}  // namespace

std::vector<ByteSpan> nal_units(ByteSpan access_unit) {
    std::vector<ByteSpan> units;
    for (std::size_t at = start_code(access_unit, 0); at < access_unit.size();) {
        const std::size_t begin = at + 3;
        at = start_code(access_unit, begin);
        std::size_t end = at;
        while (end > begin && access_unit[end - 1] == kZero) --end;  // of a longer start code, or trailing_zero_8bits
        if (end > begin) units.push_back(access_unit.subspan(begin, end - begin));
    }
    return units;
}

unsigned nal_type(ByteSpan unit) {
    return unit.empty() ? 0 : std::to_integer<unsigned>(unit[0]) & 31u;
}

bool is_idr(const std::vector<ByteSpan>& units) {
    return std::ranges::any_of(units, [](ByteSpan unit) { return nal_type(unit) == kNalIdrSlice; });
}

std::vector<ByteSpan> with_parameter_sets(std::vector<ByteSpan> units, ParameterSets& sets) {
    bool has_sps = false, has_pps = false;
    for (const ByteSpan unit : units) {
        has_sps = has_sps || nal_type(unit) == kNalSps;
        has_pps = has_pps || nal_type(unit) == kNalPps;
        if (nal_type(unit) == kNalSps) sets.sps.assign(unit.begin(), unit.end());
        if (nal_type(unit) == kNalPps) sets.pps.assign(unit.begin(), unit.end());
    }
    if (!is_idr(units)) return units;
    auto first = std::ranges::find_if(units, [](ByteSpan unit) { return nal_type(unit) == kNalIdrSlice; });
    if (!has_pps && !sets.pps.empty()) first = units.insert(first, sets.pps);
    if (!has_sps && !sets.sps.empty()) {
        const auto pps = std::ranges::find_if(units, [](ByteSpan unit) { return nal_type(unit) == kNalPps; });
        units.insert(pps == units.end() ? first : pps, sets.sps);
    }
    return units;
}

std::vector<std::byte> annex_b(const std::vector<ByteSpan>& units) {
    std::vector<std::byte> bytes;
    for (const ByteSpan unit : units) {
        bytes.insert(bytes.end(), {kZero, kZero, kZero, kOne});
        bytes.insert(bytes.end(), unit.begin(), unit.end());
    }
    return bytes;
}

}  // namespace gonio
