#include "server/http/http_rules.h"

#include <algorithm>

namespace gonio {
namespace {

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

// Result: the host of a Host header without its port: "name", "1.2.3.4" or "[::1]" -> "::1"; empty where something else
// than a port follows it.
std::string host_without_port(std::string_view header) {
    const bool bracket = header.starts_with('[');
    const std::size_t end = bracket ? header.find(']') : header.find(':');
    if (bracket && end == std::string_view::npos) return {};
    const std::string_view host = bracket ? header.substr(1, end - 1) : header.substr(0, end);
    std::string_view rest = end == std::string_view::npos ? std::string_view() : header.substr(end + (bracket ? 1 : 0));
    if (!rest.empty() && rest.front() != ':') return {};
    if (!rest.empty()) rest.remove_prefix(1);
    if (!std::all_of(rest.begin(), rest.end(), [](char c) { return c >= '0' && c <= '9'; })) return {};
    return lower(host);
}

// Whether nothing stands in it that could mean something where it is repeated, in a header or a page.
bool is_plain_host(std::string_view host) {
    return std::all_of(host.begin(), host.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == ':';
    });
}

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

asio::ip::address plain_address(const asio::ip::address& address) {
    if (!address.is_v6()) return address;
    asio::ip::address_v6 v6 = address.to_v6();
    if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6);
    v6.scope_id(0);
    return v6;
}

bool allowed_host(std::string_view header, const HttpOptions& options, const asio::ip::address& local) {
    const std::string host = host_without_port(header);
    if (host.empty()) return false;
    if (host == lower(options.host)) return true;
    for (const std::string& name : options.host_names)
        if (host == lower(name)) return true;
    if (!is_plain_host(host)) return false;
    if (host == "localhost" || host.ends_with(".localhost")) return true;  // RFC 6761 6.3: never of a foreign DNS
    error_code error;
    const auto address = asio::ip::make_address(host, error);
    return !error && (plain_address(address).is_loopback() || plain_address(address) == plain_address(local));
}

static bool listed_origin(std::string_view origin, const HttpOptions& options) {
    const std::string given = lower(origin);
    return std::any_of(options.origins.begin(), options.origins.end(),
                       [&](const std::string& allowed) { return given == lower(allowed); });
}

bool allowed_origin(std::string_view origin, std::string_view host, const HttpOptions& options) {
    if (listed_origin(origin, options)) return true;
    const std::string given = lower(origin), own = lower(host);
    return given == "https://" + own || (options.tls_certificate.empty() && given == "http://" + own);
}

bool foreign_page(const HttpRequest& request, const HttpOptions& options) {
    const std::string_view site = view_of(request["Sec-Fetch-Site"]);
    if (site != "cross-site" && site != "same-site") return false;
    // By a link, that is, and not ahead of it.
    if (view_of(request["Sec-Fetch-Dest"]) == "document" && !request.count("Sec-Purpose")) return false;
    const std::string_view page = view_of(request[http::field::referer]);
    const std::size_t host = page.find("://");
    const std::size_t path = host == page.npos ? host : page.find('/', host + 3);
    return !listed_origin(page.substr(0, path), options);
}

std::optional<std::string_view> bearer_token(std::string_view authorization) {
    constexpr std::string_view scheme = "bearer ";
    if (lower(authorization.substr(0, scheme.size())) != scheme) return std::nullopt;
    return trimmed(authorization.substr(scheme.size()));
}

std::optional<Encoding> chosen_encoding(const HttpRequest& request) {
    const auto [begin, end] = request.equal_range(http::field::sec_websocket_protocol);
    for (auto field = begin; field != end; ++field) {
        std::string_view rest = view_of(field->value());
        while (!rest.empty()) {
            const std::size_t comma = std::min(rest.find(','), rest.size());
            const std::string_view name = trimmed(rest.substr(0, comma));
            if (name == kSubprotocolProto) return Encoding::proto;
            if (name == kSubprotocolJson) return Encoding::json;
            rest.remove_prefix(std::min(comma + 1, rest.size()));
        }
    }
    return std::nullopt;
}

std::optional<std::string_view> request_fault(const HttpRequest& request) {
    if (stands_twice(request, http::field::host)) return "The request names two Hosts.";
    if (stands_twice(request, http::field::origin)) return "The request names two Origins.";
    return std::nullopt;
}

std::optional<std::string_view> handshake_fault(const HttpRequest& request) {
    if (stands_twice(request, http::field::sec_websocket_key) ||
        stands_twice(request, http::field::sec_websocket_version))
        return "Sec-WebSocket-Key and Sec-WebSocket-Version stand once in a handshake.";
    if (!is_websocket_key(view_of(request[http::field::sec_websocket_key])))
        return "Sec-WebSocket-Key must be 16 bytes in base64.";
    return std::nullopt;
}

std::optional<UploadFault> upload_fault(const HttpRequest& request) {
    if (request.count(http::field::content_range))
        return UploadFault{http::status::bad_request, "A part of a file is not taken: send all of it."};
    const std::string_view coding = view_of(request[http::field::content_encoding]);
    if (!coding.empty() && lower(coding) != "identity")
        return UploadFault{http::status::unsupported_media_type, "Files are sent without a Content-Encoding."};
    const std::string_view transfer = view_of(request[http::field::transfer_encoding]);
    if (!transfer.empty() && lower(trimmed(transfer)) != "chunked")
        return UploadFault{http::status::bad_request, "The only Transfer-Encoding taken is chunked."};
    if (transfer.empty() && !request.count(http::field::content_length))
        return UploadFault{http::status::length_required, "A file comes with its Content-Length, or in chunks."};
    return std::nullopt;
}

std::string_view content_type(std::string_view name) {
    struct Row {
        std::string_view ending, type;
    };
    constexpr Row rows[] = {{".html", "text/html; charset=utf-8"},
                            {".js", "text/javascript; charset=utf-8"},
                            {".mjs", "text/javascript; charset=utf-8"},
                            {".css", "text/css; charset=utf-8"},
                            {".json", "application/json"},
                            {".svg", "image/svg+xml"},
                            {".png", "image/png"},
                            {".jpg", "image/jpeg"},
                            {".exr", "image/x-exr"},
                            {".glb", "model/gltf-binary"},
                            {".mvr", "application/zip"},
                            {".ico", "image/x-icon"},
                            {".txt", "text/plain; charset=utf-8"}};
    for (const Row& row : rows)
        if (name.ends_with(row.ending)) return row.type;
    return "application/octet-stream";
}

http::status status_of(std::string_view code) {
    struct Row {
        std::string_view code;
        http::status status;
    };
    constexpr Row rows[] = {
        {"busy", http::status::service_unavailable},     {"unavailable", http::status::service_unavailable},
        {"slow_down", http::status::too_many_requests},  {"timeout", http::status::gateway_timeout},
        {"invalid_argument", http::status::bad_request}, {"unsupported", http::status::bad_request},
        {"bad_message", http::status::bad_request},      {"bad_target", http::status::bad_request},
        {"too_large", http::status::payload_too_large},  {"full", http::status::insufficient_storage},
        {"permission", http::status::forbidden},         {"not_found", http::status::not_found}};
    for (const Row& row : rows)
        if (row.code == code) return row.status;
    return http::status::internal_server_error;
}

}  // namespace gonio
