#include "client/relay/udp.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <string_view>

namespace gonio {
namespace {

struct Address {
    sockaddr_storage bytes{};
    socklen_t size = 0;
    bool ipv6() const { return bytes.ss_family == AF_INET6; }
    const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&bytes); }
    sockaddr* get() { return reinterpret_cast<sockaddr*>(&bytes); }

    std::uint16_t port() const {
        return ntohs(ipv6() ? reinterpret_cast<const sockaddr_in6*>(&bytes)->sin6_port
                            : reinterpret_cast<const sockaddr_in*>(&bytes)->sin_port);
    }
    void set_port(std::uint16_t port) {
        if (ipv6())
            reinterpret_cast<sockaddr_in6*>(&bytes)->sin6_port = htons(port);
        else
            reinterpret_cast<sockaddr_in*>(&bytes)->sin_port = htons(port);
    }
    bool loopback() const {
        if (ipv6()) return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6*>(&bytes)->sin6_addr);
        return ntohl(reinterpret_cast<const sockaddr_in*>(&bytes)->sin_addr.s_addr) >> 24 == 127;
    }
    std::string host() const {
        std::array<char, NI_MAXHOST> text{};
        getnameinfo(get(), size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST);
        return text.data();
    }
};

class Descriptor {
public:
    explicit Descriptor(int value) : value_(value) {}
    ~Descriptor() {
        if (value_ >= 0) ::close(value_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return value_; }

private:
    int value_;
};

// Result: a socket that does not wait, bound to the port of this machine; -1 where it cannot be.
int bound(const Address& to, std::uint16_t port) {
    const int descriptor = ::socket(to.bytes.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (descriptor < 0) return -1;
    Address from = to;
    if (!to.loopback()) {
        from.bytes = {};
        from.bytes.ss_family = to.bytes.ss_family;
    }
    from.set_port(port);
    constexpr int kSendBytes = 1 << 20;  // a key frame leaves at once; less where the system allows less
    ::setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &kSendBytes, sizeof kSendBytes);
    if (::bind(descriptor, from.get(), from.size) == 0) return descriptor;
    ::close(descriptor);
    return -1;
}

class UdpSockets final : public RtpSockets {
public:
    UdpSockets(const Address& rtp_to, const Address& rtcp_to, int rtp, int rtcp)
        : rtp_to_(rtp_to),
          rtcp_to_(rtcp_to),
          rtp_(rtp),
          rtcp_(rtcp),
          to_{rtp_to.host(), rtp_to.port(), rtp_to.ipv6()} {}

    const StreamAddress& to() const override { return to_; }
    std::uint16_t rtcp_port() const override {
        Address own;
        own.size = sizeof own.bytes;
        ::getsockname(rtcp_.get(), own.get(), &own.size);
        return own.port();
    }
    bool send(std::span<const std::byte> packet) override { return sent(rtp_, rtp_to_, packet); }
    bool send_report(std::span<const std::byte> packet) override { return sent(rtcp_, rtcp_to_, packet); }
    void receive(const std::function<void(std::span<const std::byte>)>& take) override {
        constexpr int kMost = 64;
        std::array<std::byte, 1500> datagram;
        for (const Descriptor* socket : {&rtp_, &rtcp_}) {
            for (int i = 0; i < kMost / 2; ++i) {
                const ssize_t size =
                    ::recv(socket->get(), datagram.data(), datagram.size(), MSG_TRUNC);  // its real size, even if cut
                if (size < 0) break;
                if (static_cast<std::size_t>(size) <= datagram.size())
                    take(std::span(datagram).first(static_cast<std::size_t>(size)));
            }
        }
    }
    int rtp_descriptor() const override { return rtp_.get(); }
    int rtcp_descriptor() const override { return rtcp_.get(); }

private:
    static bool sent(const Descriptor& from, const Address& to, std::span<const std::byte> packet) {
        return ::sendto(from.get(), packet.data(), packet.size(), MSG_NOSIGNAL, to.get(), to.size) ==
               static_cast<ssize_t>(packet.size());
    }

    Address rtp_to_, rtcp_to_;
    Descriptor rtp_, rtcp_;
    StreamAddress to_;
};

}  // namespace

Result<std::unique_ptr<RtpSockets>> RtpSockets::open(const std::string& receiver, std::uint16_t rtcp_port) {
    const Error malformed{"usage", "--rtp", receiver, "This must be HOST:PORT, an address of IPv6 in brackets."};
    const std::size_t colon = receiver.rfind(':');
    if (colon == std::string::npos) return malformed;
    std::string host = receiver.substr(0, colon);
    const std::string port = receiver.substr(colon + 1);
    const bool bracketed = host.starts_with('[') && host.ends_with(']');
    if (bracketed) host = host.substr(1, host.size() - 2);
    if (host.empty() || (!bracketed && host.find(':') != std::string::npos)) return malformed;
    if (port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos) return malformed;
    const int number = std::stoi(port);
    if (number < 1 || number > 65534)  // RTCP goes to the next
        return Error{"usage", "--rtp", receiver, "The port must be 1 to 65534."};

    addrinfo hints{};
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (const int failed = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); failed != 0)
        return Error{"usage", "--rtp", receiver, std::string("The host is not found: ") + gai_strerror(failed) + "."};
    Address to;
    std::memcpy(&to.bytes, found->ai_addr, found->ai_addrlen);
    to.size = found->ai_addrlen;
    ::freeaddrinfo(found);
    Address report_to = to;
    report_to.set_port(static_cast<std::uint16_t>(number + 1));

    const int rtp = bound(to, 0), rtcp = bound(to, rtcp_port);
    if (rtp < 0 || rtcp < 0) {
        const Error taken{"usage", "--rtcp", std::to_string(rtcp_port),
                          std::string("This port cannot be listened at: ") + std::strerror(errno) + "."};
        for (const int descriptor : {rtp, rtcp})
            if (descriptor >= 0) ::close(descriptor);
        return taken;
    }
    return std::unique_ptr<RtpSockets>(std::make_unique<UdpSockets>(to, report_to, rtp, rtcp));
}

}  // namespace gonio
