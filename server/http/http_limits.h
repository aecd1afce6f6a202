// Every limit of the HTTP server with its default; docs/operations.md says what happens at each, and which option sets
// it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace gonio {

struct HttpLimits {
    // ---- connections
    unsigned clients = 64;              // WebSocket and MJPEG clients and stills under way; one more is answered 503.
                                        // As many sockets may not have identified; one more closes the oldest
    unsigned clients_per_address = 16;  // of one address that is not loopback; one more is answered 429
    unsigned local_clients = 0;         // the same of loopback addresses; 0: no limit but `clients`
    unsigned connections = 256;         // of any kind; one more is closed unanswered
    unsigned connections_per_address = 64;         // likewise
    unsigned local_connections = 0;                // 0: no limit but `connections`
    std::chrono::milliseconds header{5'000};       // from connect (or the last response) to a whole request header
    std::size_t header_bytes = 8 << 10;            // more is answered 431
    std::chrono::milliseconds identify{5'000};     // from the upgrade to Identify
    std::size_t identify_bytes = 4 << 10;          // of the message before Identify; more is closed with 1009
    std::chrono::milliseconds ping{10'000};        // silence after which the server pings
    std::chrono::milliseconds dead{30'000};        // silence after which the connection is dropped
    std::chrono::milliseconds write_stall{5'000};  // a write without progress, then the connection is dropped
    unsigned auth_failures = 5;  // wrong tokens a minute from one address; then 429 for the rest of the minute

    // ---- requests
    std::size_t message_bytes = 2 << 20;            // of one control message; more is closed with 1009
    std::size_t queued_messages = 256;              // control messages waiting for one slow client
    std::size_t queued_bytes = 64 << 20;            // of them; an answer waits alone, or must fit: else "busy" instead
    unsigned outstanding = 32;                      // requests of one client without answer sent; one more is "busy"
    double updates_per_s = 240;                     // commands, and 16 KiB, of one client; more is told "slow_down"
    double update_burst = 480;                      // that many at once
    int side_px = 4096;                             // width and height of pictures; larger ones are refused
    std::chrono::milliseconds key_interval{1'000};  // least time between two key frames that one client makes the
                                                    // encoder produce, the first apart
    std::chrono::milliseconds still{60'000};        // a still picture that is not there by then is answered 504

    std::chrono::milliseconds stuck{5'000};  // without a turn of the render thread, then /readyz is 503

    // ---- uploads
    std::uint64_t upload_bytes = std::uint64_t{256} << 20;         // of one file; more is answered 413
    std::uint64_t upload_total_bytes = std::uint64_t{1024} << 20;  // of all files; more is answered 507
    unsigned upload_files = 64;                                    // one more is answered 507
};

}  // namespace gonio
