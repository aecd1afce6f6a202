// The kinds of connection. Each session owns itself through its pending operations and ends with its socket.
#pragma once

#include "server/net/beast.h"
#include "server/net/hub.h"

namespace gonio {

using HttpRequest = http::request<http::empty_body>;

// Answers the requests of one connection; hands it over where it becomes a WebSocket or an MJPEG stream.
void start_http_session(Hub& hub, tcp::socket socket);
// The caller has checked Host, Origin, the limit of clients and the subprotocol.
void start_websocket_session(Hub& hub, beast::tcp_stream stream, HttpRequest request, Encoding encoding);
void start_mjpeg_session(Hub& hub, tcp::socket socket);

}  // namespace gonio
