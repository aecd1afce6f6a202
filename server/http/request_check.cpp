#include "server/http/request_check.h"

#include <algorithm>

namespace gonio {
namespace {

bool stands_twice(const HttpRequest& request, http::field field) {
    return request.count(field) > 1;
}

// 16 bytes are 21 whole digits, one of 2 bits (the other 4 are 0: RFC 4648 3.5, not insisted on), and "==".
bool is_websocket_key(std::string_view key) {
    const auto is_digit = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
    };
    return key.size() == 24 && std::all_of(key.begin(), key.begin() + 22, is_digit) && key.ends_with("==");
}

}  // namespace

std::optional<std::string_view> request_fault(const HttpRequest& request) {
    if (stands_twice(request, http::field::host)) return "The request names two Hosts.";
    if (stands_twice(request, http::field::origin)) return "The request names two Origins.";
    return std::nullopt;
}

std::optional<std::string_view> handshake_fault(const HttpRequest& request) {
    if (stands_twice(request, http::field::sec_websocket_key) ||
        stands_twice(request, http::field::sec_websocket_version))
        return "Sec-WebSocket-Key and Sec-WebSocket-Version stand once in a handshake.";
    const beast::string_view key = request[http::field::sec_websocket_key];
    if (!is_websocket_key({key.data(), key.size()})) return "Sec-WebSocket-Key must be 16 bytes in base64.";
    return std::nullopt;
}

}  // namespace gonio
