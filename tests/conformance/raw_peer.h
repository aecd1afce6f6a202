// A client on a raw socket that says exactly the bytes it is given, and what it hears taken apart into frames. Shared
// by the RFC 6455 cases and the faults of HTTP.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace gonio::conformance {

using Clock = std::chrono::steady_clock;

// One frame as RFC 6455 5.2 lays it out. The mask is written and applied if `masked`.
struct FrameShape {
    bool fin = true;
    int rsv = 0;  // RSV1 = 4, RSV2 = 2, RSV3 = 1
    bool masked = true;
    int length_bytes = -1;                            // of the extended length: 0, 2 or 8; -1: the fewest that do
    std::optional<std::uint64_t> announced_length{};  // else the payload's
    std::uint32_t mask = 0x37fa213d;
};
std::string frame(int opcode, std::string_view payload, const FrameShape& shape = {});

inline constexpr int kContinuation = 0, kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10;

// A message in frames of `bytes` payload each.
std::string fragments(int opcode, std::string_view payload, std::size_t bytes);
// The payload of a Close frame.
std::string close_payload(int code, std::string_view reason = "");

struct HeardFrame {
    int opcode = -1;  // -1: none came in time
    bool fin = false, masked = false;
    int rsv = 0;
    std::string payload;
};

class RawPeer {
public:
    // Connects to 127.0.0.1. receive_buffer_bytes: SO_RCVBUF before connecting; 0: the system's.
    explicit RawPeer(std::uint16_t port, int receive_buffer_bytes = 0);
    ~RawPeer();
    RawPeer(const RawPeer&) = delete;

    bool connected() const { return socket_ >= 0; }
    int socket() const { return socket_; }
    // Result: false where the other end no longer takes it (within 5 s).
    bool send(std::string_view bytes);
    void send_slowly(std::string_view bytes);  // a segment for each byte
    void send_end();                           // no more from here: FIN
    void reset();                              // RST, and the socket is gone
    // Result: the HTTP head with its empty line; "" where none came in time.
    std::string read_head(Clock::time_point until);
    // Result: that many bytes, fewer at the end of the connection or time.
    std::string read_bytes(std::size_t count, Clock::time_point until);
    HeardFrame read_frame(Clock::time_point until);
    // Whether the other end closes, whatever comes before.
    bool read_end(Clock::time_point until);
    bool ended() const { return ended_; }
    // For whoever reads on by itself: what was received and not yet taken; the socket, which is then the caller's.
    std::string take_heard() { return std::exchange(heard_, {}); }
    int release() { return std::exchange(socket_, -1); }

private:
    bool fill(Clock::time_point until);

    int socket_ = -1;
    bool ended_ = false;
    std::string heard_;
};

// The request of a correct opening handshake for `subprotocol`; `key` is 16 bytes in base64.
std::string handshake(std::uint16_t port, std::string_view subprotocol,
                      std::string_view key = "dGhlIHNhbXBsZSBub25jZQ==");

}  // namespace gonio::conformance
