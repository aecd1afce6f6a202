// The messages of a WebSocket connection that the HTTP server itself reads and writes. Pure.
#pragma once

#include <chrono>
#include <string_view>

#include "server/http/http_server.h"

namespace gonio {

v1::ServerMessage hello_message(const HttpOptions& options, bool has_h264);
v1::ServerMessage goodbye_message(std::uint32_t reconnect_after_ms);
// retry: when the client may try again.
v1::ServerMessage refusal_message(std::uint32_t request_id, const Error& error, std::chrono::milliseconds retry);

// Result: the message without the kind byte of proto.
std::string_view body_of(Encoding encoding, std::string_view bytes);
// Errors: "bad_message", also where the kind of frame is not the encoding's.
Result<v1::ClientMessage> decode_frame(Encoding encoding, std::string_view bytes, bool is_text);

}  // namespace gonio
