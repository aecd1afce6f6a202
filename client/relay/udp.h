// Two UDP sockets to one receiver: RTP to its port, RTCP to the next (RFC 3550, 11). One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "client/relay/sdp.h"
#include "ies/core/result.h"

namespace gonio {

class RtpSockets {
public:
    // receiver: "HOST:PORT", an address of IPv6 in brackets; a name is looked up once. rtcp_port: of this machine, 0:
    // any free one. Where the receiver is on this machine, nobody else can send RTCP.
    // Errors: "usage", with `receiver` or the port as value.
    static Result<std::unique_ptr<RtpSockets>> open(const std::string& receiver, std::uint16_t rtcp_port);
    virtual ~RtpSockets() = default;

    virtual const StreamAddress& to() const = 0;
    virtual std::uint16_t rtcp_port() const = 0;
    // Result: whether the packet went out; it does not wait.
    virtual bool send(std::span<const std::byte> rtp_packet) = 0;
    virtual bool send_report(std::span<const std::byte> rtcp_packet) = 0;
    // Hands over what arrived, at either socket as some receivers answer to the first; at most 64 datagrams a call.
    virtual void receive(const std::function<void(std::span<const std::byte>)>& take) = 0;
    // For poll().
    virtual int rtp_descriptor() const = 0;
    virtual int rtcp_descriptor() const = 0;
};

}  // namespace gonio
