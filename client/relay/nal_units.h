// The NAL units of an H.264 access unit in Annex B (ITU-T H.264, B.1). Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gonio {

using ByteSpan = std::span<const std::byte>;

inline constexpr unsigned kNalSlice = 1, kNalIdrSlice = 5, kNalSps = 7, kNalPps = 8;  // nal_unit_type, Table 7-1

// Result: what lies between the start codes, without zeros that trail; empty units are left out. The spans point into
// `access_unit`.
std::vector<ByteSpan> nal_units(ByteSpan access_unit);

// Result: nal_unit_type, 0 to 31; 0 of an empty unit.
unsigned nal_type(ByteSpan unit);

// The last sequence and picture parameter set that a stream had.
struct ParameterSets {
    std::vector<std::byte> sps, pps;
    bool operator==(const ParameterSets&) const = default;
};

// Keeps the sets among `units`, and puts those that are known before an IDR picture that comes without.
// Result: the units to send; the spans point to what `units` did, or into `sets`.
std::vector<ByteSpan> with_parameter_sets(std::vector<ByteSpan> units, ParameterSets& sets);

// Result: whether a unit is a slice of an IDR picture: decoding can begin here.
bool is_idr(const std::vector<ByteSpan>& units);

// Result: the units as a byte stream, each behind a start code of four bytes.
std::vector<std::byte> annex_b(const std::vector<ByteSpan>& units);

}  // namespace gonio
