// H.264 in RTP packets: RFC 6184, packetization-mode 1; the header is RFC 3550's, 5.1. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/relay/nal_units.h"

namespace gonio {

inline constexpr std::size_t kRtpHeaderBytes = 12;
inline constexpr std::size_t kMaxRtpBytes = 1200;  // of a packet with its header: fits every path with IPv6 and tunnels
inline constexpr std::uint8_t kPayloadType = 96;   // dynamic, as the SDP says
inline constexpr std::uint32_t kRtpClockHz = 90'000;

// What goes on from packet to packet. RFC 3550 wants both random at the start.
struct RtpStream {
    std::uint32_t ssrc = 0;
    std::uint16_t sequence = 0;  // of the next packet; wraps
};

// Result: the packets of one picture, each of at most kMaxRtpBytes, in order; none of no units. A unit that fits is a
// packet of its own (5.6); parameter sets that follow one another share a STAP-A (5.7.1); what is longer is cut into
// FU-A (5.8). All have the time `rtp_time` (90 kHz, wraps), the last one the marker.
std::vector<std::vector<std::byte>> packetise(const std::vector<ByteSpan>& units, std::uint32_t rtp_time,
                                              RtpStream& stream);

}  // namespace gonio
