// What RFC 7230 and RFC 6455 have a server refuse that Beast lets through. Pure functions.
#pragma once

#include <optional>
#include <string_view>

#include "server/http/sessions.h"

namespace gonio {

// Result: why the request is answered 400, one sentence; nothing where it is good. Headers that decide who may ask
// stand once: two of them are read differently by proxies and servers (Host: RFC 7230 5.4; Origin: RFC 6454 7.3).
std::optional<std::string_view> request_fault(const HttpRequest& request);

// The same of an opening handshake: Sec-WebSocket-Key is the base64 of 16 bytes (RFC 6455 4.2.1-5), and it and
// Sec-WebSocket-Version stand once (11.3.1, 11.3.5).
std::optional<std::string_view> handshake_fault(const HttpRequest& request);

}  // namespace gonio
