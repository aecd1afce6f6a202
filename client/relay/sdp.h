// The description of a stream by which a receiver of RTP opens it (SDP, RFC 8866; H.264's part: RFC 6184, 8.2). Pure.
#pragma once

#include <cstdint>
#include <string>

#include "client/relay/nal_units.h"

namespace gonio {

struct StreamAddress {
    std::string host;  // an address in numbers
    std::uint16_t port = 0;
    bool ipv6 = false;
};

// Result: the text, its lines ended by CR LF; without the profile and the parameter sets where `sets` has no SPS.
std::string session_description(const StreamAddress& to, std::uint32_t session_id, const ParameterSets& sets);

std::string base64(ByteSpan bytes);

}  // namespace gonio
