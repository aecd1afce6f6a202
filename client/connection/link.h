// A client's connection to goniod's port, plain or under TLS; the caller waits for each operation. Only for .cpp files.
#pragma once

#include <chrono>
#include <functional>

#include "client/connection/connection.h"
#include "protocol/net/net_stream.h"

namespace gonio {

inline constexpr auto kConnectTime = std::chrono::seconds(5);
inline constexpr auto kReplyTime = std::chrono::seconds(120);
inline constexpr auto kForever = std::chrono::hours(24 * 365);

// One thread at a time. What it makes must not outlive it.
class Link {
public:
    // Starts an operation on `stream` and waits until it is done; after `time` the connection is closed, which ends the
    // operation. Errors: beast::error::timeout, and the operation's own.
    error_code run(std::chrono::steady_clock::duration time, NetStream& stream,
                   const std::function<void(NetStream::Done)>& start);
    // Finds the server, connects, and shakes hands. Errors: "unreachable"; "untrusted": its certificate is not from an
    // authority that is known here, or of another name; "file_unreadable": address.ca_file.
    Result<NetStream> connect(const ServerAddress& address);
    // Does what can be done without waiting.
    void poll();

private:
    asio::io_context context_;
};

}  // namespace gonio
