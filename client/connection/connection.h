// A client's connection to goniod: one WebSocket, binary protobuf; files over HTTP beside it. Boost stays in the .cpp
// files.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/frame_header.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/messages.h"

namespace gonio {

struct ServerAddress {
    std::string host;  // name or address, without brackets
    std::string port = "8080";
    bool secure = false;  // https
    std::string ca_file;  // PEM: authorities that are trusted instead of the system's
    std::string host_header() const {
        return (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + port;
    }
    std::string url() const { return (secure ? "https://" : "http://") + host_header(); }
};

// "http://host:port", "https://host:port", "host:port" or "host" -> address. Errors: "usage".
Result<ServerAddress> parse_server_url(std::string_view url);

// What the server sent: a message, or a frame where `access_unit` is not empty.
struct ServerEvent {
    v1::ServerMessage message;
    FrameHeader header;
    std::vector<std::byte> access_unit;
};

class Connection {
public:
    struct Wanted {
        std::string token;
        bool video = false;
        bool state = false;
        std::string role;              // empty: controller
        std::string client = "gonio";  // its name in the server's log
    };
    // Connects, upgrades, identifies and waits for Ready. Errors: "unreachable", "untrusted" (its certificate),
    // "refused" (the server is there but says no).
    static Result<std::unique_ptr<Connection>> open(const ServerAddress& address, const Wanted& wanted);
    virtual ~Connection() = default;
    // What the server said of itself when it let this client in.
    virtual const v1::Ready& ready() const = 0;

    // Result: the answer to `message`, at most 120 s after it was sent or after the server last told of its progress.
    // Errors: "unreachable"; what the server refuses: a Result other than "ok".
    using OnProgress = std::function<void(const v1::Progress&)>;
    virtual Result<v1::ServerMessage> ask(v1::ClientMessage message, const OnProgress& on_progress) = 0;
    virtual Result<bool> say(const v1::ClientMessage& message) = 0;
    // Result: the next event, however long it takes. Errors: "unreachable".
    virtual Result<ServerEvent> next() = 0;
    // Result: the next event, where it has arrived whole; it does not wait. From the first call on neither `ask` nor
    // `next` can be called. Errors: "unreachable".
    virtual Result<std::optional<ServerEvent>> next_arrived() = 0;
    // For poll(): readable when more arrives. The one who polls has called next_arrived() until there was nothing.
    virtual int descriptor() = 0;
};

// A machine or a network that is gone ends the connection after some 25 s, although it closes nothing.
void end_when_silent(int descriptor);

// Sends the file to the server under the name, for `load scene upload:NAME`. Errors: "file_unreadable", "unreachable",
// "untrusted", "refused".
Result<bool> upload(const ServerAddress& address, const std::string& token, const std::string& file,
                    const std::string& name);

// Gets what lies at a path of the server, at most most_bytes, and gives it to `take` as it comes; false ends it.
// Errors: "unreachable", "untrusted", "refused" (with the HTTP status as place), "too_large", "given_up".
Result<bool> fetch(const ServerAddress& address, const std::string& token, const std::string& path,
                   std::uint64_t most_bytes, const std::function<bool(std::string_view)>& take);

}  // namespace gonio
