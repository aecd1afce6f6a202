// IPv4 sockets as the inputs use them: non-blocking, closed with their owner, with the kernel's count of what it
// dropped.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/dmx/artnet_sources.h"
#include "protocol/schema/messages.h"
#include "protocol/text/byte_order.h"
#include "server/base/descriptor.h"

namespace gonio {

// "ADDRESS" or "ADDRESS:PORT", numeric IPv4. Errors: "invalid_argument".
Result<UdpPeer> parse_peer(const std::string& text, std::uint16_t default_port);

inline constexpr int kReceiveBytes = 4 << 20;  // asked of the kernel, which may give less (net.core.rmem_max)

// Result: a bound socket; other programs on this machine may share the port. It hears a multicast group only after
// join(). Errors: "listen_failed" with the address.
Result<Descriptor> open_udp(const UdpPeer& at);
// Where a group is joined: an interface by its number, or by an address of it.
struct MulticastInterface {
    int index = 0;              // 0: by the address
    std::uint32_t address = 0;  // host byte order
    auto operator<=>(const MulticastInterface&) const = default;
};
inline constexpr std::size_t kMaxInterfaces = 16;  // a socket joins a group on; the kernel allows 20
// Result: the interface of that address; of 0.0.0.0 the loopback and all others that are up and know multicast and
// IPv4, ascending, at most kMaxInterfaces.
std::vector<MulticastInterface> multicast_interfaces(std::uint32_t address);
// Result: a socket bound to the group and joined on those of the interfaces that take it, at least one.
Result<Descriptor> open_multicast(std::uint32_t group, std::uint16_t port,
                                  std::span<const MulticastInterface> interfaces);
// Joins on one more interface. Result: whether the group is joined there now.
bool join_group(const Descriptor& socket, std::uint32_t group, const MulticastInterface& interface);
// Result: a listening TCP socket.
Result<Descriptor> open_tcp(const UdpPeer& at);
// Result: the address that the socket is bound to.
UdpPeer bound_to(const Descriptor& socket);
// Result: the broadcast address of the interface that has this address, if it has one.
std::optional<std::uint32_t> broadcast_of(std::uint32_t address);

// Result: whether the kernel took it.
bool set_option(const Descriptor& socket, int level, int option, int value);

struct Datagram {
    Bytes bytes;  // until the next receive()
    UdpPeer from;
    std::uint32_t local_ip = 0;  // the address of ours that it came to
    bool truncated = false;      // it was longer than the buffer
};

// A listening endpoint and what is counted there.
struct Endpoint {
    UdpPeer at;
    std::uint32_t packets = 0, bad = 0, refused = 0;
    std::map<int, std::uint32_t> drops;  // the kernel's count per socket
    std::uint32_t drops_before = 0;      // of sockets that were closed
    std::string last_error;

    void forget_socket(int fd);
    void bad_packet(const Error& error);
    // Result: whether the datagram is whole; else it is a bad packet.
    bool whole(const Datagram& datagram);
    // Result: its row in the table.
    v1::InputEndpoint& describe(v1::Sources& table, const char* protocol) const;
};

// Buffers for reading up to 64 datagrams at a time.
class Receiver {
public:
    explicit Receiver(std::size_t bytes);
    // Result: datagrams that were waiting; empty: none. `drops` gets the kernel's count for this socket, where told.
    std::span<const Datagram> receive(const Descriptor& socket, std::uint32_t& drops);

private:
    static constexpr std::size_t kBatch = 64;
    std::size_t bytes_;
    std::vector<std::uint8_t> buffer_, control_;
    std::vector<Datagram> datagrams_;
};

// Sends and forgets: nobody waits for a datagram that does not fit.
void send_datagram(const Descriptor& socket, const UdpPeer& to, Bytes bytes);

}  // namespace gonio
