// A stream of pictures to one receiver of RTP: packets, reports, and what the receiver asks for. One thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/relay/nal_units.h"
#include "client/relay/rtp.h"
#include "client/relay/udp.h"

namespace gonio {

class RtpOutput {
public:
    struct Counts {
        std::uint64_t packets = 0, payload_bytes = 0, unsent = 0, asked = 0;  // asked: datagrams that want a key frame
    };

    // Source, numbers and times begin at random, as RFC 3550 wants.
    explicit RtpOutput(std::unique_ptr<RtpSockets> sockets);

    // Sends a picture that is shown at media_ns. A packet that cannot be sent is counted. Of a long picture not all
    // packets leave at once: receivers have room for some hundred KB.
    void picture(const std::vector<ByteSpan>& units, std::uint64_t media_ns);
    // Sends a report where one is due, every 5 s; media_ns: what a picture of this moment would have.
    void report(std::uint64_t media_ns, std::uint64_t now_ns);
    void leave(std::uint64_t media_ns);
    // Result: whether a receiver asked for a key frame since the last call.
    bool key_frame_wanted();

    // Result: the SDP for a receiver.
    std::string description(const ParameterSets& sets) const;
    const Counts& counts() const { return counts_; }
    const RtpSockets& sockets() const { return *sockets_; }

private:
    void send_report(std::uint64_t media_ns, bool bye);

    std::unique_ptr<RtpSockets> sockets_;
    RtpStream stream_;
    std::uint32_t first_time_;
    Counts counts_;
    std::uint64_t reported_ns_ = 0;
    bool reported_ = false;
};

}  // namespace gonio
