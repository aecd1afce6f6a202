#include "tests/throttle/throttle_proxy.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <list>
#include <stdexcept>
#include <string>
#include <vector>

namespace gonio::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kPieceBytes = 1400;  // as packets of a network

// Bytes that arrive at the far end at a time.
struct Piece {
    Clock::time_point arrival;
    std::string bytes;
};

// One direction: bytes are read while the queue has room, leave at the line's rate and arrive after the delay.
struct Way {
    int from = -1, to = -1;
    std::deque<Piece> pieces;
    Clock::time_point free_at{};  // when the line is done with what was read
    bool ended = false;           // from has no more

    bool has_room(const LineOptions& options, Clock::time_point now) const {
        // What has left the queue is on the line.
        const double queued_s = std::chrono::duration<double>(free_at - now).count();
        return !ended && queued_s * options.bits_per_s / 8 < options.queue_bytes;
    }
    void read(const LineOptions& options, Clock::time_point now) {
        char buffer[kPieceBytes];
        const ssize_t count = ::recv(from, buffer, sizeof buffer, MSG_DONTWAIT);
        if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) ended = true;
        if (count <= 0) return;
        free_at = std::max(now, free_at) + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                                               static_cast<double>(count) * 8 / options.bits_per_s));
        pieces.push_back({free_at + options.delay, std::string(buffer, static_cast<std::size_t>(count))});
    }
    bool due(Clock::time_point now) const { return !pieces.empty() && pieces.front().arrival <= now; }
    // Result: false where the far end has gone.
    bool write() {
        std::string& piece = pieces.front().bytes;
        const ssize_t count = ::send(to, piece.data(), piece.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
        if (count < 0) return errno == EAGAIN || errno == EINTR;
        piece.erase(0, static_cast<std::size_t>(count));
        if (piece.empty()) pieces.pop_front();
        return true;
    }
};

struct Line {
    int client = -1, server = -1;
    Way up, down;
};

void small_buffers(int socket) {
    const int bytes = 8 << 10, on = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
}

}  // namespace

ThrottleProxy::ThrottleProxy(std::uint16_t server_port, const LineOptions& options)
    : options_(options), server_port_(server_port) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    small_buffers(listener_);  // before accept: the window is agreed on in the handshake
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0)
        throw std::runtime_error("the proxy finds no port");
    ::listen(listener_, 16);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
}

ThrottleProxy::~ThrottleProxy() {
    stop_ = true;
    thread_.join();
    ::close(listener_);
}

void ThrottleProxy::run() {
    std::list<Line> lines;
    while (!stop_) {
        auto now = Clock::now();
        std::vector<pollfd> polls{{listener_, POLLIN, 0}};
        auto wake = now + std::chrono::milliseconds(50);
        for (const Line& line : lines) {
            for (const Way* way : {&line.up, &line.down}) {
                short events = 0;
                if (way->has_room(options_, now))
                    polls.push_back({way->from, POLLIN, 0});
                else if (!way->ended)
                    wake = std::min(wake, now + std::chrono::milliseconds(1));
                if (way->due(now))
                    events = POLLOUT;
                else if (!way->pieces.empty())
                    wake = std::min(wake, way->pieces.front().arrival);
                if (events) polls.push_back({way->to, events, 0});
            }
        }
        const auto sleep = std::max<Clock::duration>(wake - now, Clock::duration::zero());
        const timespec time{std::chrono::duration_cast<std::chrono::seconds>(sleep).count(),
                            std::chrono::duration_cast<std::chrono::nanoseconds>(sleep).count() % 1'000'000'000};
        ::ppoll(polls.data(), polls.size(), &time, nullptr);
        now = Clock::now();
        if (polls[0].revents & POLLIN) {
            Line line;
            line.client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
            line.server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
            small_buffers(line.client);
            small_buffers(line.server);
            const sockaddr_in address = loopback(server_port_);
            // Where nobody listens the first write fails.
            static_cast<void>(::connect(line.server, reinterpret_cast<const sockaddr*>(&address), sizeof address));
            line.up.from = line.down.to = line.client;
            line.up.to = line.down.from = line.server;
            lines.push_back(std::move(line));
        }
        for (auto line = lines.begin(); line != lines.end();) {
            bool broken = false;
            for (Way* way : {&line->up, &line->down}) {
                if (way->has_room(options_, now)) way->read(options_, now);
                while (way->due(now) && !broken) {
                    const std::size_t before = way->pieces.front().bytes.size(), pieces = way->pieces.size();
                    broken = !way->write();
                    if (way->pieces.size() == pieces && way->pieces.front().bytes.size() == before) break;
                }
                broken = broken || (way->ended && way->pieces.empty());
            }
            if (broken) {
                ::close(line->client);
                ::close(line->server);
                line = lines.erase(line);
            } else {
                ++line;
            }
        }
    }
    for (const Line& line : lines) {
        ::close(line.client);
        ::close(line.server);
    }
}

}  // namespace gonio::test
