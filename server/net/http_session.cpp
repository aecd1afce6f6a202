#include "server/net/request_check.h"
#include "server/net/sessions.h"

#include <netinet/tcp.h>

#include <algorithm>
#include <array>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>

namespace gonio {
namespace {

constexpr std::uint32_t kMaxHeaderBytes = 8 << 10;

using Response = http::response<http::string_body>;

std::string_view view_of(beast::string_view text) {
    return {text.data(), text.size()};
}

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

// A name that somebody else's DNS may point here is refused, or a foreign page could rebind its own name to this server
// and pass the Origin check. Addresses cannot be rebound: those that this connection really has are allowed.
bool allowed_host(std::string_view header, const FrontOptions& options, const asio::ip::address& local) {
    const std::string host = host_without_port(header);
    if (host == "localhost" || host.ends_with(".localhost") || host == lower(options.host)) return true;
    error_code error;
    const auto address = asio::ip::make_address(host, error);
    return !error && (address.is_loopback() || address == local);
}

bool allowed_origin(std::string_view origin, std::string_view host) {
    const std::string given = lower(origin), own = lower(host);
    return given == "http://" + own || given == "https://" + own;
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
                            {".ico", "image/x-icon"},
                            {".txt", "text/plain; charset=utf-8"}};
    for (const Row& row : rows)
        if (name.ends_with(row.ending)) return row.type;
    return "application/octet-stream";
}

// Result: the first subprotocol of the request that this server speaks.
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

class HttpSession final : public Peer, public std::enable_shared_from_this<HttpSession> {
public:
    HttpSession(Hub& hub, tcp::socket socket)
        : hub_(hub), stream_(std::move(socket)), still_timer_(stream_.get_executor()) {
        ++hub_.connections;
    }
    ~HttpSession() override {
        --hub_.connections;
        hub_.remove(still_id_);
    }
    HttpSession(const HttpSession&) = delete;
    HttpSession& operator=(const HttpSession&) = delete;

    void start() {
        error_code ignored;
        tcp::socket& socket = stream_.socket();
        socket.set_option(tcp::no_delay(true), ignored);
        // A small send buffer: what lies in the kernel is lag that no pacing can take back.
        socket.set_option(asio::socket_base::send_buffer_size(128 << 10), ignored);
        socket.set_option(asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>(64 << 10), ignored);
        read();
    }

    void on_reply(v1::ServerMessage message) override { answer_still(std::move(message)); }
    void on_shutdown() override {
        still_timer_.cancel();
        stream_.close();
        hub_.remove(still_id_);
    }

private:
    void read() {
        parser_.emplace();
        parser_->header_limit(kMaxHeaderBytes);
        stream_.expires_after(hub_.options.limits.header);
        http::async_read(stream_, buffer_, *parser_,
                         [self = shared_from_this()](error_code error, std::size_t) { self->on_read(error); });
    }

    void on_read(error_code error) {
        if (error == http::error::end_of_stream || error == beast::error::timeout || hub_.stopping) return;
        if (error == http::error::header_limit)
            return refuse(http::status::request_header_fields_too_large, "The request header is longer than 8 KiB.");
        if (error == http::error::unexpected_body || error == http::error::body_limit)
            return refuse(http::status::payload_too_large, "Requests have no body here.");
        if (error.category() == http::make_error_code(http::error::end_of_stream).category())
            return refuse(http::status::bad_request, "This is not an HTTP request: " + error.message() + ".");
        if (error) return;
        request_ = parser_->release();
        keep_alive_ = request_.keep_alive();
        dispatch();
    }

    void dispatch() {
        if (request_.method() != http::verb::get && request_.method() != http::verb::head)
            return refuse(http::status::method_not_allowed, "Only GET and HEAD are answered here.");
        const std::string_view host = view_of(request_[http::field::host]);
        if (host.empty()) return refuse(http::status::bad_request, "The request names no Host.");
        if (const auto fault = request_fault(request_)) return refuse(http::status::bad_request, std::string(*fault));
        error_code error;
        const auto local = stream_.socket().local_endpoint(error).address();
        if (!allowed_host(host, hub_.options, local))
            return refuse(http::status::forbidden, "This server does not go by the name in the Host header.");
        if (request_.count(http::field::origin) && !allowed_origin(view_of(request_[http::field::origin]), host))
            return refuse(http::status::forbidden, "Pages of another origin may not use this server.");

        const std::string_view target = view_of(request_.target());
        const std::string_view path = target.substr(0, target.find('?'));
        if (path == "/healthz") return respond(http::status::ok, "text/plain; charset=utf-8", "ok\n");
        if (path == "/v1/ws") return upgrade();
        if (path == "/v1/mjpeg" || path == "/v1/frame.png" || path == "/v1/frame.jpg") {
            if (!authorised()) return refuse(http::status::unauthorized, "This needs Authorization: Bearer TOKEN.");
            if (request_.method() == http::verb::head)
                return refuse(http::status::method_not_allowed, "Only GET is answered here.");
            if (path != "/v1/mjpeg") return ask_still(path.ends_with("png") ? "png" : "jpg");
            if (hub_.full()) return refuse(http::status::service_unavailable, "There are too many clients already.");
            stream_.expires_never();
            return start_mjpeg_session(hub_, stream_.release_socket());
        }
        const std::string_view name = path == "/" ? "index.html" : path.substr(1);
        for (const EmbeddedFile& file : hub_.options.page)
            if (file.name == name) return respond(http::status::ok, content_type(name), std::string(file.content));
        refuse(http::status::not_found, "There is no such page.");
    }

    bool authorised() const {
        if (hub_.options.token.empty()) return true;
        std::string_view given = view_of(request_[http::field::authorization]);
        constexpr std::string_view scheme = "bearer ";
        if (given.size() < scheme.size() || lower(given.substr(0, scheme.size())) != scheme) return false;
        return equal_in_constant_time(trimmed(given.substr(scheme.size())), hub_.options.token);
    }

    void upgrade() {
        if (!beast::websocket::is_upgrade(request_)) {
            keep_alive_ = false;
            return refuse(http::status::upgrade_required, "This address speaks WebSocket only.");
        }
        if (const auto fault = handshake_fault(request_)) return refuse(http::status::bad_request, std::string(*fault));
        const std::optional<Encoding> encoding = chosen_encoding(request_);
        if (!encoding)
            return refuse(http::status::bad_request, "The subprotocol must be gonio.v1.proto or gonio.v1.json.");
        if (buffer_.size() != 0)
            return refuse(http::status::bad_request, "The client must wait for the answer to its upgrade.");
        if (hub_.full()) return refuse(http::status::service_unavailable, "There are too many clients already.");
        stream_.expires_never();
        start_websocket_session(hub_, std::move(stream_), std::move(request_), *encoding);
    }

    void ask_still(std::string format) {
        still_id_ = hub_.add(shared_from_this());
        if (still_id_ == 0) return refuse(http::status::service_unavailable, "There are too many clients already.");
        v1::ClientMessage message;
        message.set_request_id(1);
        message.mutable_capture()->set_format(std::move(format));
        if (!hub_.request(still_id_, std::move(message))) {
            hub_.remove(std::exchange(still_id_, 0));
            return refuse(http::status::service_unavailable, "The renderer is busy.");
        }
        stream_.expires_never();
        still_timer_.expires_after(hub_.options.limits.still);
        still_timer_.async_wait([self = shared_from_this()](error_code error) {
            if (error || self->still_id_ == 0) return;
            self->hub_.remove(std::exchange(self->still_id_, 0));
            self->refuse(http::status::gateway_timeout, "The picture was not rendered in time.");
        });
    }

    void answer_still(v1::ServerMessage message) {
        if (still_id_ == 0) return;
        hub_.remove(std::exchange(still_id_, 0));
        const auto self = shared_from_this();  // the timer's handler holds the only other reference
        still_timer_.cancel();
        if (message.has_capture()) {
            const std::string type = message.capture().format() == "png" ? "image/png" : "image/jpeg";
            Response response =
                make_response(http::status::ok, type, std::move(*message.mutable_capture()->mutable_image()));
            response.set("X-Scene-Rev", std::to_string(message.capture().scene_rev()));
            return send(std::move(response));
        }
        const v1::Result& result = message.result();
        refuse(result.code() == "busy" ? http::status::service_unavailable : http::status::internal_server_error,
               result.code() + ": " + result.message());
    }

    Response make_response(http::status status, std::string_view type, std::string body) const {
        Response response(status, request_.version() == 0 ? 11 : request_.version());
        response.set(http::field::content_type, beast::string_view(type.data(), type.size()));
        response.set(http::field::cache_control, "no-store");
        response.set("X-Content-Type-Options", "nosniff");
        response.keep_alive(keep_alive_);
        response.body() = std::move(body);
        response.prepare_payload();
        return response;
    }
    void respond(http::status status, std::string_view type, std::string body) {
        Response response = make_response(status, type, std::move(body));
        if (type.starts_with("text/html")) {
            // The socket's origin is spelled out because not every browser counts ws: as 'self'.
            const std::string host(view_of(request_[http::field::host]));
            response.set("Content-Security-Policy",
                         "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; "
                         "connect-src 'self' ws://" +
                             host + " wss://" + host +
                             "; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; object-src 'none'");
        }
        send(std::move(response));
    }
    void refuse(http::status status, const std::string& message) {
        if (status == http::status::bad_request || status == http::status::payload_too_large ||
            status == http::status::request_header_fields_too_large)
            keep_alive_ = false;  // where the next request begins is not known
        Response response = make_response(status, "text/plain; charset=utf-8", message + "\n");
        if (status == http::status::method_not_allowed) response.set(http::field::allow, "GET, HEAD");
        if (status == http::status::service_unavailable) response.set(http::field::retry_after, "1");
        if (status == http::status::unauthorized) response.set(http::field::www_authenticate, "Bearer");
        if (status == http::status::upgrade_required) response.set(http::field::upgrade, "websocket");
        send(std::move(response));
    }

    void send(Response response) {
        if (request_.method() == http::verb::head) {
            const std::size_t length = response.body().size();
            response.body().clear();
            response.content_length(length);
        }
        response_ = std::make_unique<Response>(std::move(response));
        stream_.expires_after(hub_.options.limits.write_stall);
        const auto done = [self = shared_from_this()](error_code error, std::size_t) { self->on_sent(error); };
        if (request_.method() == http::verb::head) {
            serializer_.emplace(*response_);
            return http::async_write_header(stream_, *serializer_, done);
        }
        http::async_write(stream_, *response_, done);
    }
    void on_sent(error_code error) {
        serializer_.reset();
        response_.reset();
        request_ = {};
        if (error || hub_.stopping) return;
        if (keep_alive_) return read();
        linger();
    }
    // Reads what the client still sends, so that closing does not reset the connection before it has read the answer.
    void linger() {
        error_code ignored;
        stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
        stream_.expires_after(std::chrono::seconds(1));
        drain();
    }
    void drain() {
        stream_.async_read_some(asio::buffer(drained_), [self = shared_from_this()](error_code error, std::size_t) {
            if (!error) self->drain();
        });
    }

    Hub& hub_;
    beast::tcp_stream stream_;
    asio::steady_timer still_timer_;
    beast::flat_buffer buffer_;
    std::optional<http::request_parser<http::empty_body>> parser_;
    HttpRequest request_{};
    std::unique_ptr<Response> response_;
    std::optional<http::response_serializer<http::string_body>> serializer_;
    SessionId still_id_ = 0;
    bool keep_alive_ = false;
    std::array<char, 1024> drained_{};
};

}  // namespace

void start_http_session(Hub& hub, tcp::socket socket) {
    std::make_shared<HttpSession>(hub, std::move(socket))->start();
}

}  // namespace gonio
