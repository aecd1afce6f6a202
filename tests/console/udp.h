// A sender and receiver of datagrams for tests, on the loopback interface.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>

#include "tests/console/packets.h"

namespace gonio::test {

class Udp {
public:
    // address: where it sends from; 127.0.0.0/8 all are this machine.
    explicit Udp(const std::string& address = "127.0.0.1") : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        const sockaddr_in at = endpoint(address, 0);
        if (bind(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) throw std::runtime_error("bind");
        in_addr loopback{};
        inet_pton(AF_INET, "127.0.0.1", &loopback);
        setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback);
    }
    ~Udp() { close(fd_); }
    Udp(const Udp&) = delete;

    void send(const std::string& to, std::uint16_t port, const Packet& packet) const {
        const sockaddr_in at = endpoint(to, port);
        sendto(fd_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    }
    std::optional<Packet> receive(std::chrono::milliseconds time) const {
        pollfd ready{fd_, POLLIN, 0};
        if (poll(&ready, 1, static_cast<int>(time.count())) <= 0) return std::nullopt;
        Packet packet(65536);
        const ssize_t size = recv(fd_, packet.data(), packet.size(), 0);
        packet.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
        return packet;
    }
    std::uint16_t port() const {
        sockaddr_in at{};
        socklen_t size = sizeof at;
        getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size);
        return ntohs(at.sin_port);
    }

private:
    static sockaddr_in endpoint(const std::string& address, std::uint16_t port) {
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_port = htons(port);
        inet_pton(AF_INET, address.c_str(), &at.sin_addr);
        return at;
    }
    int fd_;
};

}  // namespace gonio::test
