#include "server/inputs/udp_socket.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <set>

#include "protocol/schema/console.pb.h"

namespace gonio {
namespace {

sockaddr_in address_of(const UdpPeer& peer) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(peer.ip);
    address.sin_port = htons(peer.port);
    return address;
}

UdpPeer peer_of(const sockaddr_in& address) {
    return {ntohl(address.sin_addr.s_addr), ntohs(address.sin_port)};
}

Error listen_failed(const UdpPeer& at, const char* doing) {
    return {"listen_failed", "", print_peer(at), std::string(doing) + ": " + std::strerror(errno)};
}

Result<Descriptor> bind_to(Descriptor socket, const UdpPeer& at) {
    if (!socket) return listen_failed(at, "no socket");
    set_option(socket, SOL_SOCKET, SO_REUSEADDR, 1);
    const sockaddr_in address = address_of(at);
    if (bind(socket.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return listen_failed(at, "cannot bind");
    return socket;
}

}  // namespace

bool set_option(const Descriptor& socket, int level, int option, int value) {
    return setsockopt(socket.fd(), level, option, &value, sizeof value) == 0;
}

Result<UdpPeer> parse_peer(const std::string& text, std::uint16_t default_port) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    in_addr address{};
    unsigned port = default_port;
    bool good = inet_pton(AF_INET, text.substr(0, colon).c_str(), &address) == 1;
    if (colon < text.size()) {
        const char *begin = text.data() + colon + 1, *end = text.data() + text.size();
        const auto [stop, error] = std::from_chars(begin, end, port);
        good = good && error == std::errc() && stop == end && begin != end && port <= 65535;
    }
    if (!good)
        return Error{"invalid_argument", "", text, "must be ADDRESS or ADDRESS:PORT with a numeric IPv4 address"};
    return UdpPeer{ntohl(address.s_addr), static_cast<std::uint16_t>(port)};
}

Result<Descriptor> open_udp(const UdpPeer& at) {
    auto socket = bind_to(Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)), at);
    if (!socket) return socket;
    if (!set_option(*socket, SOL_SOCKET, SO_RCVBUFFORCE, kReceiveBytes))
        set_option(*socket, SOL_SOCKET, SO_RCVBUF, kReceiveBytes);
    set_option(*socket, SOL_SOCKET, SO_RXQ_OVFL, 1);
    set_option(*socket, SOL_SOCKET, SO_BROADCAST, 1);
    set_option(*socket, IPPROTO_IP, IP_PKTINFO, 1);
    // Else a socket bound to any address also hears every group that somebody on this machine has joined.
    set_option(*socket, IPPROTO_IP, IP_MULTICAST_ALL, 0);
    return socket;
}

std::vector<MulticastInterface> multicast_interfaces(std::uint32_t address) {
    if (address != 0) return {{0, address}};
    std::set<MulticastInterface> found;  // an interface is listed once for each of its addresses
    ifaddrs* list = nullptr;
    if (getifaddrs(&list) != 0) return {};
    for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
        if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
        // Linux leaves IFF_MULTICAST off on the loopback interface, where it works all the same.
        const bool able = (one->ifa_flags & (IFF_MULTICAST | IFF_LOOPBACK)) != 0;
        if ((one->ifa_flags & IFF_UP) != 0 && able) found.insert({static_cast<int>(if_nametoindex(one->ifa_name)), 0});
    }
    freeifaddrs(list);
    std::vector<MulticastInterface> interfaces(found.begin(), found.end());
    if (interfaces.size() > kMaxInterfaces) interfaces.resize(kMaxInterfaces);
    return interfaces;
}

bool join_group(const Descriptor& socket, std::uint32_t group, const MulticastInterface& interface) {
    ip_mreqn join{};
    join.imr_multiaddr.s_addr = htonl(group);
    join.imr_address.s_addr = htonl(interface.address);
    join.imr_ifindex = interface.index;
    return setsockopt(socket.fd(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &join, sizeof join) == 0 || errno == EADDRINUSE;
}

Result<Descriptor> open_multicast(std::uint32_t group, std::uint16_t port,
                                  std::span<const MulticastInterface> interfaces) {
    const UdpPeer at{group, port};
    auto socket = open_udp(at);
    if (!socket) return socket;
    errno = ENODEV;  // where there is no interface
    bool joined = false;
    for (const MulticastInterface& interface : interfaces) joined = join_group(*socket, group, interface) || joined;
    if (!joined) return listen_failed(at, "cannot join");
    return socket;
}

Result<Descriptor> open_tcp(const UdpPeer& at) {
    auto socket = bind_to(Descriptor(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)), at);
    if (socket && listen(socket->fd(), 16) != 0) return listen_failed(at, "cannot listen");
    return socket;
}

UdpPeer bound_to(const Descriptor& socket) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&address), &size);
    return peer_of(address);
}

std::optional<std::uint32_t> broadcast_of(std::uint32_t wanted) {
    ifaddrs* list = nullptr;
    if (getifaddrs(&list) != 0) return std::nullopt;
    std::optional<std::uint32_t> found;
    for (const ifaddrs* one = list; one != nullptr; one = one->ifa_next) {
        if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || one->ifa_broadaddr == nullptr) continue;
        const std::uint32_t address = peer_of(*reinterpret_cast<const sockaddr_in*>(one->ifa_addr)).ip;
        const std::uint32_t broadcast = peer_of(*reinterpret_cast<const sockaddr_in*>(one->ifa_broadaddr)).ip;
        if (address == wanted && broadcast != 0 && broadcast != address) found = broadcast;
    }
    freeifaddrs(list);
    return found;
}

Receiver::Receiver(std::size_t bytes)
    : bytes_(bytes), buffer_(kBatch * bytes), control_(kBatch * 128), datagrams_(kBatch) {}

std::span<const Datagram> Receiver::receive(const Descriptor& socket, std::uint32_t& drops) {
    std::array<mmsghdr, kBatch> headers{};
    std::array<iovec, kBatch> vectors;
    std::array<sockaddr_in, kBatch> from{};
    for (std::size_t i = 0; i < kBatch; ++i) {
        vectors[i] = {buffer_.data() + i * bytes_, bytes_};
        headers[i].msg_hdr.msg_iov = &vectors[i];
        headers[i].msg_hdr.msg_iovlen = 1;
        headers[i].msg_hdr.msg_name = &from[i];
        headers[i].msg_hdr.msg_namelen = sizeof from[i];
        headers[i].msg_hdr.msg_control = control_.data() + i * 128;
        headers[i].msg_hdr.msg_controllen = 128;
    }
    const int received = recvmmsg(socket.fd(), headers.data(), kBatch, MSG_DONTWAIT, nullptr);
    const auto count = static_cast<std::size_t>(std::max(received, 0));
    for (std::size_t i = 0; i < count; ++i) {
        msghdr& header = headers[i].msg_hdr;
        Datagram& datagram = datagrams_[i];
        datagram.bytes = Bytes(buffer_).subspan(i * bytes_, headers[i].msg_len);
        datagram.from = peer_of(from[i]);
        datagram.truncated = (header.msg_flags & MSG_TRUNC) != 0;
        datagram.local_ip = 0;
        for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
            if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SO_RXQ_OVFL) {
                std::memcpy(&drops, CMSG_DATA(c), sizeof drops);
            } else if (c->cmsg_level == IPPROTO_IP && c->cmsg_type == IP_PKTINFO) {
                in_pktinfo info{};
                std::memcpy(&info, CMSG_DATA(c), sizeof info);
                datagram.local_ip = ntohl(info.ipi_spec_dst.s_addr);
            }
        }
    }
    return std::span(datagrams_).first(count);
}

void Endpoint::forget_socket(int fd) {
    drops_before += drops[fd];
    drops.erase(fd);
}

void Endpoint::bad_packet(const Error& error) {
    ++bad;
    last_error = error.text();
}

bool Endpoint::whole(const Datagram& datagram) {
    if (datagram.truncated)
        bad_packet({"too_large", "", "over " + std::to_string(datagram.bytes.size()) + " bytes",
                    "the datagram is longer than any of its protocol"});
    return !datagram.truncated;
}

v1::InputEndpoint& Endpoint::describe(v1::Sources& table, const char* protocol) const {
    v1::InputEndpoint& row = *table.add_endpoints();
    row.set_protocol(protocol);
    row.set_address(print_peer(at));
    row.set_packets(packets);
    row.set_bad_packets(bad);
    std::uint32_t dropped = drops_before;
    for (const auto& [fd, count] : drops) dropped += count;
    row.set_kernel_drops(dropped);
    row.set_refused_sources(refused);
    row.set_last_error(last_error);
    return row;
}

void send_datagram(const Descriptor& socket, const UdpPeer& to, Bytes bytes) {
    const sockaddr_in address = address_of(to);
    (void)sendto(socket.fd(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                 reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

}  // namespace gonio
