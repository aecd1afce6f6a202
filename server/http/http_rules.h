// What an HTTP request may ask for: hosts, origins, addresses, tokens. Also what RFC 7230 and RFC 6455 have a server
// refuse that Beast lets through, and the small tables of HTTP. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/http/sessions.h"

namespace gonio {

inline std::string_view view_of(beast::string_view text) {
    return {text.data(), text.size()};
}

// Result: the address as people write it: without the interface that a link-local one came in by, IPv4 as such where a
// listener for both saw it mapped.
asio::ip::address plain_address(const asio::ip::address& address);

// host: as of a Host header, with or without its port. A name that somebody else's DNS may point here is refused, or a
// foreign page could rebind its own name to this server and pass the Origin check. Addresses cannot be rebound:
// loopback ones and `local`, the one that the connection came in on, are allowed. So are localhost and what ends with
// .localhost, and the names that the options list. Beyond those only letters, digits and .-: stand in what is allowed.
bool allowed_host(std::string_view host, const HttpOptions& options, const asio::ip::address& local);
// host: of the same request. Without TLS an https: origin is allowed too: a proxy in front may have it.
bool allowed_origin(std::string_view origin, std::string_view host, const HttpOptions& options);

// Result: whether the picture is part of a page elsewhere, as browsers tell (Fetch Metadata: Sec-Fetch-Site), which for
// an <img> send no Origin. Not what somebody opens by a link, nor where the Referer is of an origin that the options
// list.
bool foreign_page(const HttpRequest& request, const HttpOptions& options);

// Result: the token of "Bearer TOKEN"; nothing for other schemes.
std::optional<std::string_view> bearer_token(std::string_view authorization);

// Result: the first subprotocol of the request that this server speaks.
std::optional<Encoding> chosen_encoding(const HttpRequest& request);

// Result: why the request is answered 400, one sentence; nothing where it is good. Headers that decide who may ask
// stand once: two of them are read differently by proxies and servers (Host: RFC 7230 5.4; Origin: RFC 6454 7.3).
std::optional<std::string_view> request_fault(const HttpRequest& request);

// The same of an opening handshake: Sec-WebSocket-Key is the base64 of 16 bytes (RFC 6455 4.2.1-5), and it and
// Sec-WebSocket-Version stand once (11.3.1, 11.3.5).
std::optional<std::string_view> handshake_fault(const HttpRequest& request);

// What keeps a PUT from being read as the file it means.
struct UploadFault {
    http::status status;
    const char* sentence;
};
// Result: nothing where the body is a whole file. Such a body has its length told or comes in chunks, is no part of one
// (Content-Range, RFC 9110 14.5) and is not compressed.
std::optional<UploadFault> upload_fault(const HttpRequest& request);

std::string_view content_type(std::string_view name);  // by the ending of a file's name
// Result: the status for a refusal with this code of PROTOCOL.md.
http::status status_of(std::string_view code);

}  // namespace gonio
