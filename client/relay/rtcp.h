// What goes with RTP: what receivers ask for (RFC 4585 and 5104), and what a sender reports (RFC 3550, 6.4.1). Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace gonio {

// Result: whether a datagram of RTCP asks the source `ssrc` for a key frame. A PLI (RFC 4585, 6.3.1) for it does, or
// for source 0, which some receivers leave unset; so does a FIR (RFC 5104, 4.3.1) with an entry for it. Reduced-size
// packets (RFC 5506) count too. A datagram that is malformed anywhere asks for nothing.
bool asks_for_key_frame(std::span<const std::byte> datagram, std::uint32_t ssrc);

// What a sender counts, and two clocks of one instant.
struct SenderState {
    std::uint32_t ssrc = 0;
    std::uint64_t ntp = 0;  // 32.32 s since 1900-01-01
    std::uint32_t rtp_time = 0;
    std::uint32_t packets = 0, payload_bytes = 0;  // wrap; without headers
};

// Result: a compound packet of sender report and canonical name; with `bye` it says that the source leaves.
// cname: at most 255 bytes count.
std::vector<std::byte> sender_report(const SenderState& state, std::string_view cname, bool bye);

// Result: the NTP time of `unix_ns` after 1970-01-01.
std::uint64_t ntp_time(std::uint64_t unix_ns);

}  // namespace gonio
