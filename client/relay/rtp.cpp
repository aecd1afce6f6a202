#include "client/relay/rtp.h"

#include <algorithm>

#include "client/relay/big_endian.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxPayloadBytes = kMaxRtpBytes - kRtpHeaderBytes;
constexpr unsigned kStapA = 24, kFuA = 28;
constexpr std::byte kMarker{0x80}, kFuStart{0x80}, kFuEnd{0x40};
constexpr std::byte kForbiddenAndRef{0xE0};  // forbidden_zero_bit and nal_ref_idc of a unit's first byte
constexpr std::byte kType{0x1F};

using Packets = std::vector<std::vector<std::byte>>;

std::vector<std::byte>& begin_packet(Packets& packets, std::uint32_t rtp_time, RtpStream& stream) {
    std::vector<std::byte>& packet = packets.emplace_back();
    packet.reserve(kMaxRtpBytes);
    packet.insert(packet.end(), {std::byte{0x80}, std::byte{kPayloadType}});  // version 2, no padding, no extension
    put_u16(packet, stream.sequence++);
    put_u32(packet, rtp_time);
    put_u32(packet, stream.ssrc);
    return packet;
}

void append(std::vector<std::byte>& packet, ByteSpan bytes) {
    packet.insert(packet.end(), bytes.begin(), bytes.end());
}

bool is_parameter_set(ByteSpan unit) {
    return nal_type(unit) == kNalSps || nal_type(unit) == kNalPps;
}

// Result: how many of the units share a STAP-A: parameter sets in a row that fit; less than 2: none.
std::size_t aggregated(std::span<const ByteSpan> units) {
    std::size_t count = 0, bytes = 1;
    while (count < units.size() && is_parameter_set(units[count]) &&
           bytes + 2 + units[count].size() <= kMaxPayloadBytes)
        bytes += 2 + units[count++].size();
    return count;
}

// The type byte's F bit is set where one of them has it, its NRI is the greatest (RFC 6184, 5.7).
void append_stap(std::vector<std::byte>& packet, std::span<const ByteSpan> units) {
    std::byte forbidden{0}, reference{0};
    for (const ByteSpan unit : units) {
        forbidden |= unit[0] & std::byte{0x80};
        reference = std::max(reference, unit[0] & std::byte{0x60});
    }
    packet.push_back(forbidden | reference | std::byte{kStapA});
    for (const ByteSpan unit : units) {
        put_u16(packet, static_cast<std::uint16_t>(unit.size()));
        append(packet, unit);
    }
}

}  // namespace

Packets packetise(const std::vector<ByteSpan>& units, std::uint32_t rtp_time, RtpStream& stream) {
    constexpr std::size_t kFragmentBytes = kMaxPayloadBytes - 2;  // behind FU indicator and FU header
    Packets packets;
    for (std::size_t i = 0; i < units.size();) {
        const auto left = std::span(units).subspan(i);
        if (const std::size_t count = aggregated(left); count > 1) {
            append_stap(begin_packet(packets, rtp_time, stream), left.first(count));
            i += count;
            continue;
        }
        const ByteSpan unit = units[i++];
        if (unit.empty()) continue;
        if (unit.size() <= kMaxPayloadBytes) {
            append(begin_packet(packets, rtp_time, stream), unit);
            continue;
        }
        const ByteSpan payload = unit.subspan(1);  // the unit's own first byte is told by indicator and header
        for (std::size_t at = 0; at < payload.size(); at += kFragmentBytes) {
            const std::size_t size = std::min(kFragmentBytes, payload.size() - at);
            std::vector<std::byte>& packet = begin_packet(packets, rtp_time, stream);
            packet.push_back((unit[0] & kForbiddenAndRef) | std::byte{kFuA});
            packet.push_back((unit[0] & kType) | (at == 0 ? kFuStart : std::byte{0}) |
                             (at + size == payload.size() ? kFuEnd : std::byte{0}));
            append(packet, payload.subspan(at, size));
        }
    }
    if (!packets.empty()) packets.back()[1] |= kMarker;
    return packets;
}

}  // namespace gonio
