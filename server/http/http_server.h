// The one HTTP port, plain or under TLS: page, health and metrics, stills, uploads, MJPEG and the WebSocket. Runs its
// own thread; knows messages and encoded frames, never the scene. Boost.Beast stays in the .cpp files.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cmake/embedded_file.h"
#include "ies/core/result.h"
#include "protocol/schema/codec.h"
#include "protocol/schema/messages.h"
#include "server/base/metrics.h"
#include "server/http/http_limits.h"
#include "server/http/tokens.h"
#include "server/stream/encoder.h"
#include "server/stream/lanes.h"

namespace gonio {

struct Blob;
using Blobs = std::map<std::string, Blob, std::less<>>;  // blobs.h
class UploadStore;
struct TlsContext;

using SessionId = std::uint32_t;  // 0: nobody

// What the viewers want now; changes are told through Callbacks::demand.
struct Demand {
    std::vector<LaneRequest> lanes;  // those that have viewers
    bool jpeg = false;               // at least one MJPEG client that took the last part
    unsigned jpeg_clients = 0;       // MJPEG clients, with or without a request for the next part
    unsigned clients = 0;
    bool operator==(const Demand&) const = default;
    bool h264() const { return std::ranges::any_of(lanes, &LaneRequest::credit); }
    bool key() const { return std::ranges::any_of(lanes, &LaneRequest::key); }
};

struct HttpOptions {
    std::string host = "127.0.0.1";
    std::uint16_t port = 8080;             // 0: any free one
    Tokens tokens;                         // that clients must show
    std::string tls_certificate, tls_key;  // PEM files; both or none: then plain HTTP
    std::vector<std::string> host_names;   // that the Host header may have, beside localhost and addresses
    std::vector<std::string> origins;      // of pages elsewhere that may use this server
    std::string leader;                    // address of the server that this one follows; empty: none
    UploadStore* uploads = nullptr;        // outlives the HTTP server; null: there are none
    std::string server_name;               // for Hello
    std::string renderer;
    std::string encoder;                 // likewise; "mjpeg": there is no H.264
    unsigned private_lanes = 0;          // viewers that have an encoder of their own; all others share one
    std::span<const EmbeddedFile> page;  // "index.html", "main.js", …
    HttpLimits limits;
    std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>();
};

class HttpServer {
public:
    struct Callbacks {
        // All called on the net thread; they must not block. `request` returns false when the render queue is full: the
        // client is then answered "busy".
        std::function<bool(SessionId, v1::ClientMessage)> request;
        std::function<void(Demand)> demand;
        std::function<void(SessionId)> closed;  // the session has gone: nobody waits for its replies
        // A WebSocket client has shown itself (no token any more). Result: false when the render queue is full; the
        // client is then closed.
        std::function<bool(SessionId, v1::Identify)> identified;
    };

    // Binds and starts the thread. Errors: "listen_failed" with the address; "bad_certificate".
    static Result<std::unique_ptr<HttpServer>> start(const HttpOptions& options, Callbacks callbacks);
    virtual ~HttpServer() = default;  // closes all connections and joins

    virtual std::uint16_t port() const = 0;
    virtual bool secure() const = 0;                 // https
    virtual std::uint32_t packets_sent() const = 0;  // video messages and MJPEG parts
    // Any thread. `state` is the whole state for `Ready` of clients that come later, encoded when one comes. Publish it
    // before the StateChanged that leads to it, so that a client that joins in between misses nothing.
    virtual void publish_state(v1::State state) = 0;
    virtual void broadcast(v1::StateChanged change) = 0;
    virtual void reply(SessionId session, v1::ServerMessage message) = 0;
    // What GET /v1/blobs serves from now on.
    virtual void publish_blobs(std::shared_ptr<const Blobs> blobs) = 0;
    // The encoder of a lane makes such frames from now on; the first one is a key frame.
    virtual void publish_video_config(v1::VideoConfig config, LaneId lane = kSharedLane) = 0;
    // Of the lane frame.lane.
    virtual void publish_h264(EncodedFrame frame, bool final) = 0;
    virtual void publish_jpeg(EncodedFrame frame) = 0;
    // Any thread. From now on nobody new is let in.
    virtual void stop_accepting() = 0;
    // Any thread. Says goodbye behind all answers given so far and closes all connections, within half a second.
    virtual void stop(std::uint32_t reconnect_after_ms) = 0;
    // Any thread. Says goodbye to all clients of now, whose state is another server's; they may come again.
    virtual void send_away(std::uint32_t reconnect_after_ms) = 0;
    // No encoder of H.264 works any more: viewers are told to use MJPEG.
    virtual void stop_h264() = 0;
    // Calls it on the net thread.
    virtual void post(std::function<void()> call) = 0;
    // What /readyz answers: pictures come. False until it is told.
    virtual void set_ready(bool ready) = 0;
    // The render thread has come by; where it does not for HttpLimits::stuck, /readyz says so. Any thread; costs a
    // store.
    virtual void came_by() = 0;
    // From now on clients must show one of these; who showed another, or has less right by it now, is closed.
    virtual void set_tokens(Tokens tokens) = 0;
    // For connections that come from now on, where secure(); others keep what they have.
    virtual void set_tls(std::shared_ptr<TlsContext> tls) = 0;
};

}  // namespace gonio
