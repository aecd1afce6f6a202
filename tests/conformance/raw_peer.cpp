#include "tests/conformance/raw_peer.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

namespace gonio::conformance {
namespace {

std::string big_endian(std::uint64_t value, int bytes) {
    std::string text;
    for (int byte = bytes - 1; byte >= 0; --byte) text += static_cast<char>(value >> (8 * byte) & 0xff);
    return text;
}

int milliseconds_to(Clock::time_point until) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

}  // namespace

std::string frame(int opcode, std::string_view payload, const FrameShape& shape) {
    const std::uint64_t length = shape.announced_length.value_or(payload.size());
    int length_bytes = shape.length_bytes;
    if (length_bytes < 0) length_bytes = length < 126 ? 0 : length <= 0xffff ? 2 : 8;
    std::string bytes(1, static_cast<char>((shape.fin ? 0x80 : 0) | shape.rsv << 4 | opcode));
    const int code = length_bytes == 0 ? static_cast<int>(length) : length_bytes == 2 ? 126 : 127;
    bytes += static_cast<char>((shape.masked ? 0x80 : 0) | code);
    bytes += big_endian(length, length_bytes);
    if (!shape.masked) return bytes + std::string(payload);
    const std::string mask = big_endian(shape.mask, 4);
    bytes += mask;
    for (std::size_t i = 0; i < payload.size(); ++i) bytes += static_cast<char>(payload[i] ^ mask[i % 4]);
    return bytes;
}

std::string fragments(int opcode, std::string_view payload, std::size_t bytes) {
    std::string result;
    for (std::size_t at = 0; at == 0 || at < payload.size(); at += bytes) {
        FrameShape shape;
        shape.fin = at + bytes >= payload.size();
        shape.mask = static_cast<std::uint32_t>(0x01020304 * (at + 1));
        result += frame(at == 0 ? opcode : kContinuation, payload.substr(at, bytes), shape);
    }
    return result;
}

std::string close_payload(int code, std::string_view reason) {
    return big_endian(static_cast<std::uint64_t>(code), 2) + std::string(reason);
}

std::string handshake(std::uint16_t port, std::string_view subprotocol, std::string_view key) {
    return "GET /v1/ws HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
           "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " +
           std::string(key) + "\r\nSec-WebSocket-Protocol: " + std::string(subprotocol) + "\r\n\r\n";
}

RawPeer::RawPeer(std::uint16_t port, int receive_buffer_bytes) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (receive_buffer_bytes > 0)
        ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    const int on = 1;
    ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (socket_ >= 0 && ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
        ::close(socket_);
        socket_ = -1;
    }
}

RawPeer::~RawPeer() {
    if (socket_ >= 0) ::close(socket_);
}

bool RawPeer::send(std::string_view bytes) {
    const auto until = Clock::now() + std::chrono::seconds(5);
    while (!bytes.empty()) {
        pollfd ready{socket_, POLLOUT, 0};
        if (::poll(&ready, 1, milliseconds_to(until)) <= 0) return false;
        const ssize_t n = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n < 0 && errno != EAGAIN) return false;
        if (n > 0) bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
}

void RawPeer::send_slowly(std::string_view bytes) {
    for (const char byte : bytes)
        if (!send({&byte, 1})) return;
}

void RawPeer::send_end() {
    ::shutdown(socket_, SHUT_WR);
}

void RawPeer::reset() {
    const linger now{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    ::close(socket_);
    socket_ = -1;
}

bool RawPeer::fill(Clock::time_point until) {
    if (ended_) return false;
    pollfd ready{socket_, POLLIN, 0};
    if (::poll(&ready, 1, milliseconds_to(until)) <= 0) return false;
    char bytes[65536];
    const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
    if (n <= 0) {
        ended_ = true;
        return false;
    }
    heard_.append(bytes, static_cast<std::size_t>(n));
    return true;
}

std::string RawPeer::read_head(Clock::time_point until) {
    std::size_t end;
    while ((end = heard_.find("\r\n\r\n")) == std::string::npos)
        if (!fill(until)) return {};
    std::string head = heard_.substr(0, end + 4);
    heard_.erase(0, end + 4);
    return head;
}

std::string RawPeer::read_bytes(std::size_t count, Clock::time_point until) {
    while (heard_.size() < count && fill(until)) {
    }
    std::string bytes = heard_.substr(0, count);
    heard_.erase(0, bytes.size());
    return bytes;
}

HeardFrame RawPeer::read_frame(Clock::time_point until) {
    const auto at = [&](std::size_t i) { return static_cast<unsigned char>(heard_[i]); };
    while (heard_.size() < 2)
        if (!fill(until)) return {};
    const std::size_t extra = (at(1) & 0x7f) == 126 ? 2 : (at(1) & 0x7f) == 127 ? 8 : 0;
    while (heard_.size() < 2 + extra)
        if (!fill(until)) return {};
    std::uint64_t length = at(1) & 0x7f;
    if (extra > 0) length = 0;
    for (std::size_t i = 0; i < extra; ++i) length = length << 8 | at(2 + i);
    while (heard_.size() < 2 + extra + length)
        if (!fill(until)) return {};
    HeardFrame result{at(0) & 0x0f, (at(0) & 0x80) != 0, (at(1) & 0x80) != 0, at(0) >> 4 & 7,
                      heard_.substr(2 + extra, length)};
    heard_.erase(0, 2 + extra + length);
    return result;
}

bool RawPeer::read_end(Clock::time_point until) {
    while (fill(until)) heard_.clear();
    return ended_;
}

}  // namespace gonio::conformance
