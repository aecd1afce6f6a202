// The kinds of connection. Each session owns itself through its pending operations and ends with its socket.
#pragma once

#include "protocol/net/net_stream.h"

#include <boost/beast/http/parser.hpp>

#include "server/http/session_registry.h"

namespace gonio {

using HttpRequest = http::request<http::empty_body>;

// A connection as it passes from one session to the next.
struct Accepted {
    NetStream stream;
    std::shared_ptr<const Admission> admission;
};

// The TLS handshake, then the requests; a client that speaks plain HTTP is told so and closed.
void start_secure_session(SessionRegistry& registry, Accepted accepted);
// Answers the requests of one connection; hands it over where it becomes a WebSocket, an upload or an MJPEG stream.
void start_http_session(SessionRegistry& registry, Accepted accepted);
// The caller has checked Host, Origin, the limits of clients and the subprotocol.
void start_websocket_session(SessionRegistry& registry, Accepted accepted, HttpRequest request, Encoding encoding);
void start_mjpeg_session(SessionRegistry& registry, Accepted accepted, std::string token);
// A PUT whose header was read, and checked like the others; ends the connection. buffer: what came behind the header.
void start_upload_session(SessionRegistry& registry, Accepted accepted, beast::flat_buffer buffer,
                          http::request_parser<http::empty_body>&& header, std::string name, std::string token);
// A GET of what lies in a file, checked like the others; ends the connection.
void start_blob_session(SessionRegistry& registry, Accepted accepted, Blob blob);

}  // namespace gonio
