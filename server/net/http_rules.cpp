#include "server/net/http_rules.h"

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

// Result: the host of a Host header without its port: "name", "1.2.3.4" or "[::1]" -> "::1".
std::string host_without_port(std::string_view header) {
    if (header.starts_with('[')) return lower(header.substr(1, std::min(header.find(']'), header.size()) - 1));
    return lower(header.substr(0, header.find(':')));
}

}  // namespace

bool allowed_host(std::string_view header, const FrontOptions& options, const asio::ip::address& local) {
    const std::string host = host_without_port(header);
    if (host == "localhost" || host.ends_with(".localhost") || host == lower(options.host)) return true;
    for (const std::string& name : options.host_names)
        if (host == lower(name)) return true;
    error_code error;
    const auto address = asio::ip::make_address(host, error);
    return !error && (address.is_loopback() || address == local);
}

bool allowed_origin(std::string_view origin, std::string_view host, const FrontOptions& options) {
    const std::string given = lower(origin), own = lower(host);
    for (const std::string& allowed : options.origins)
        if (given == lower(allowed)) return true;
    return given == "https://" + own || (options.tls_certificate.empty() && given == "http://" + own);
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
        {"bad_target", http::status::bad_request},       {"too_large", http::status::payload_too_large},
        {"full", http::status::insufficient_storage},    {"permission", http::status::forbidden},
        {"not_found", http::status::not_found}};
    for (const Row& row : rows)
        if (row.code == code) return row.status;
    return http::status::internal_server_error;
}

}  // namespace gonio
