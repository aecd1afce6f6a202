#include "client/relay/sdp.h"

#include <openssl/evp.h>

#include <cstdio>
#include <cstdlib>

#include "client/relay/rtp.h"

namespace gonio {

std::string base64(ByteSpan bytes) {
    std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');  // and the 0 that it ends with
    const int length =
        EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                        reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
    text.resize(static_cast<std::size_t>(length));
    return text;
}

std::string session_description(const StreamAddress& to, std::uint32_t session_id, const ParameterSets& sets) {
    const std::string family = to.ipv6 ? "IN IP6 " : "IN IP4 ";
    const std::string type = std::to_string(kPayloadType);
    const int first = std::atoi(to.host.c_str());
    const char* const ttl =
        !to.ipv6 && first >= 224 && first <= 239 ? "/1" : "";  // multicast (RFC 8866 5.7), as it is sent
    std::string format = "packetization-mode=1";
    if (sets.sps.size() >= 4) {
        char profile[16];  // profile_idc, constraint flags and level_idc, as in the SPS
        std::snprintf(profile, sizeof profile, "%02x%02x%02x", std::to_integer<unsigned>(sets.sps[1]),
                      std::to_integer<unsigned>(sets.sps[2]), std::to_integer<unsigned>(sets.sps[3]));
        format += std::string(";profile-level-id=") + profile;
        if (!sets.pps.empty()) format += ";sprop-parameter-sets=" + base64(sets.sps) + "," + base64(sets.pps);
    }
    return "v=0\r\no=- " + std::to_string(session_id) + " 1 " + family + to.host + "\r\ns=Gonio\r\nc=" + family +
           to.host + ttl + "\r\nt=0 0\r\nm=video " + std::to_string(to.port) + " RTP/AVPF " + type +
           "\r\na=rtpmap:" + type + " H264/" + std::to_string(kRtpClockHz) + "\r\na=fmtp:" + type + " " + format +
           "\r\na=rtcp-fb:" + type + " nack pli\r\na=rtcp-fb:" + type + " ccm fir\r\na=recvonly\r\n";
}

}  // namespace gonio
