#include "server/http/sessions.h"

#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/http/http_rules.h"
#include "server/http/http_target.h"
#include "server/http/message_limits.h"
#include "server/http/upload_store.h"

namespace gonio {
namespace {

using Clock = std::chrono::steady_clock;
using Response = http::response<http::string_body>;

constexpr std::size_t kShownBytes = 128;                 // of a value that is refused
constexpr auto kWatch = std::chrono::milliseconds(500);  // between two looks whether a still's client is there

class HttpSession final : public Peer, public std::enable_shared_from_this<HttpSession> {
public:
    HttpSession(SessionRegistry& registry, Accepted accepted)
        : registry_(registry), admission_(std::move(accepted.admission)), stream_(std::move(accepted.stream)) {}
    ~HttpSession() override {
        registry_.remove(still_id_);
        registry_.remove(told_id_);
    }

    void start() { read(); }

    void on_reply(v1::ServerMessage message) override {
        if (still_id_ == 0) return;
        if (message.has_progress()) return wait_for_still();
        const auto self = shared_from_this();  // the timers' handlers hold the only other references
        end_wait();
        if (registry_.access.tokens.right_of(shown_token().value_or("")) == Right::none)
            return refuse(http::status::unauthorized, "The token does not hold any more.");
        if (message.has_capture()) {
            Response response = make_response(http::status::ok, content_type("." + message.capture().format()),
                                              std::move(*message.mutable_capture()->mutable_image()));
            response.set("X-Scene-Rev", std::to_string(message.capture().scene_rev()));
            return send(std::move(response));
        }
        const v1::Result& result = message.result();
        refuse(status_of(result.code()), said({result.code(), result.field(), result.value(), result.message()}));
    }
    void on_shutdown() override {
        if (still_id_ == 0) return;
        end_wait();
        keep_alive_ = false;
        refuse(http::status::service_unavailable, "The server ends.");
    }
    std::size_t waiting_bytes() const override { return response_ ? response_->body().size() : 0; }

private:
    void read() {
        parser_.emplace();
        parser_->header_limit(static_cast<std::uint32_t>(registry_.options.limits.header_bytes));
        parser_->body_limit(boost::none);  // an upload's is its own
        stream_.expires_after(registry_.options.limits.header);
        http::async_read_header(stream_, buffer_, *parser_,
                                [self = shared_from_this()](error_code error, std::size_t) { self->on_read(error); });
    }

    void on_read(error_code error) {
        if (error == http::error::end_of_stream || error == beast::error::timeout || registry_.stopping) return;
        if (error == http::error::header_limit)
            return refuse(http::status::request_header_fields_too_large, "The request header is too long.");
        if (error.category() == http::make_error_code(http::error::end_of_stream).category())
            return refuse(http::status::bad_request, "This is not an HTTP request: " + error.message() + ".");
        if (error) return;
        request_ = parser_->get();
        keep_alive_ = request_.keep_alive();
        dispatch();
    }

    void dispatch() {
        const http::verb method = request_.method();
        const Result<HttpTarget> target = parse_target(view_of(request_.target()));
        if (!target) return refuse(http::status::bad_request, target.error().text());
        const std::optional<std::string> upload = upload_name(*target);
        allowed_methods_ = upload                                             ? "PUT, DELETE"
                           : is_still(*target) || target->path == "/v1/mjpeg" ? "GET"
                                                                              : "GET, HEAD";
        if (!parser_->is_done()) keep_alive_ = false;  // an answer that comes before the body ends the connection
        if (!parser_->is_done() && !(upload && method == http::verb::put))
            return refuse(http::status::payload_too_large, "Requests have no body here.");
        if (method != http::verb::get && method != http::verb::head && !upload)
            return refuse(http::status::method_not_allowed, "Only GET and HEAD are answered here.");
        const std::string host(target->authority ? *target->authority : view_of(request_[http::field::host]));
        if (host.empty()) return refuse(http::status::bad_request, "The request names no Host.");
        if (const auto fault = request_fault(request_)) return refuse(http::status::bad_request, std::string(*fault));
        error_code error;
        const auto local = stream_.socket().local_endpoint(error).address();
        const bool socket = target->path == "/v1/ws";
        if (!allowed_host(host, registry_.options, local)) {
            if (socket) registry_.count_rejected("host");
            return refuse(http::status::forbidden,
                          {"permission", "Host", host, "This server does not go by that name."});
        }
        const std::string origin(view_of(request_[http::field::origin]));
        if (request_.count(http::field::origin) && !allowed_origin(origin, host, registry_.options)) {
            if (socket) registry_.count_rejected("origin");
            return refuse(http::status::forbidden,
                          {"permission", "Origin", origin, "Pages of another origin may not use this server."});
        }
        if (upload) return admitted(Right::change) ? answer_upload(*upload) : void();
        answer(*target, host);
    }

    // A GET or HEAD from an allowed origin.
    void answer(const HttpTarget& target, const std::string& host) {
        const std::string& path = target.path;
        if (path == "/readyz")
            if (const char* const why = registry_.readiness.why_not(registry_.options.limits.stuck))
                return refuse(http::status::service_unavailable, why);
        if (path == "/healthz" || path == "/readyz")
            return respond(http::status::ok, "text/plain; charset=utf-8", "ok\n");
        if (path == "/v1/ws") return upgrade();
        if (path == "/metrics") {
            if (!admitted(Right::look)) return;
            return respond(http::status::ok, "text/plain; version=0.0.4; charset=utf-8",
                           registry_.options.metrics->text() + process_metrics_text());
        }
        if (path == "/v1/mjpeg" || is_still(target)) {
            if (foreign_page(request_, registry_.options))
                return refuse(http::status::forbidden,
                              {"permission", "Sec-Fetch-Site", std::string(view_of(request_["Sec-Fetch-Site"])),
                               "Pages of another origin may not use this server."});
            if (!admitted(Right::look)) return;
            if (request_.method() == http::verb::head)
                return refuse(http::status::method_not_allowed, "Only GET is answered here.");
            if (is_still(target)) return ask_still(target);
            if (registry_.full_for(*admission_)) return refuse_full_address();
            if (registry_.full())
                return refuse(http::status::service_unavailable, "There are too many clients already.");
            stream_.expires_never();
            return start_mjpeg_session(registry_, {std::move(stream_), admission_},
                                       std::string(shown_token().value_or("")));
        }
        if (const auto blob = blob_name(target)) {
            if (!admitted(Right::look)) return;
            return answer_blob(*blob);
        }
        const std::string_view name = path == "/" ? "index.html" : std::string_view(path).substr(1);
        for (const EmbeddedFile& file : registry_.options.page)
            if (file.name == name)
                return respond(http::status::ok, content_type(name), std::string(file.content), host);
        refuse(http::status::not_found, {"not_found", "", path, "There is no such page."});
    }

    // Result: nothing where none was shown.
    std::optional<std::string_view> shown_token() const {
        return bearer_token(view_of(request_[http::field::authorization]));
    }
    // Result: whether the client showed a token that lets it do so, where one is asked for; else it has been answered.
    bool admitted(Right needed) {
        if (!registry_.access.tokens.asked()) return true;
        if (const auto wait = registry_.access.blocked(*admission_); wait.count() > 0) {
            refuse(http::status::too_many_requests, "Too many wrong tokens came from this address.", wait);
            return false;
        }
        const auto given = shown_token();
        const Right right = registry_.access.tokens.right_of(given.value_or(""));
        if (right >= needed) return true;
        if (right == Right::look) {
            refuse(http::status::forbidden, "permission: this token lets its owner look, not change anything.");
            return false;
        }
        if (given) registry_.access.failed(*admission_);  // who shows none does not guess
        refuse(http::status::unauthorized, "This needs Authorization: Bearer TOKEN.");
        return false;
    }

    void answer_blob(const std::string& name) {
        const auto found = registry_.blobs->find(name);
        if (found == registry_.blobs->end())
            return refuse(http::status::not_found, {"not_found", "", name, "Nothing of this show has this hash."});
        if (found->second.content) return respond(http::status::ok, "application/octet-stream", *found->second.content);
        if (request_.method() == http::verb::head)
            return refuse(http::status::method_not_allowed, "Only GET is answered here.");
        stream_.expires_never();
        start_blob_session(registry_, {std::move(stream_), admission_}, found->second);
    }

    void answer_upload(const std::string& name) {
        if (!registry_.options.leader.empty())
            return refuse(http::status::forbidden, {"permission", "uploads", registry_.options.leader,
                                                    "This server follows that one: upload it there."});
        if (registry_.options.uploads == nullptr)
            return refuse(http::status::not_found, {"not_found", "", name, "This server takes no uploads."});
        if (request_.method() == http::verb::put) {
            if (const auto fault = upload_fault(request_)) return refuse(fault->status, fault->sentence);
            return start_upload_session(registry_, {std::move(stream_), admission_}, std::move(buffer_),
                                        std::move(*parser_), name, std::string(shown_token().value_or("")));
        }
        if (request_.method() != http::verb::delete_)
            return refuse(http::status::method_not_allowed, "Uploads are written by PUT and removed by DELETE.");
        registry_.calls.on_disk([self = shared_from_this(), name]() mutable {
            const bool removed = self->registry_.options.uploads->remove(name);
            const auto executor = self->stream_.get_executor();
            asio::post(executor, [self = std::move(self), name, removed] {
                if (!removed)
                    return self->refuse(http::status::not_found, {"not_found", "", name, "There is no such upload."});
                self->respond(http::status::ok, "text/plain; charset=utf-8", "removed\n");
            });
        });
    }

    void upgrade() {
        if (!beast::websocket::is_upgrade(request_)) {
            keep_alive_ = false;
            return refuse(http::status::upgrade_required, "This address speaks WebSocket only.");
        }
        if (const auto fault = handshake_fault(request_)) return refuse(http::status::bad_request, std::string(*fault));
        const std::optional<Encoding> encoding = chosen_encoding(request_);
        if (!encoding) {
            registry_.count_rejected("subprotocol");
            return refuse(http::status::bad_request, "The subprotocol must be gonio.v1.proto or gonio.v1.json.");
        }
        if (buffer_.size() != 0)
            return refuse(http::status::bad_request, "The client must wait for the answer to its upgrade.");
        if (const auto wait = registry_.access.blocked(*admission_); wait.count() > 0) {
            registry_.count_rejected("auth_rate");
            return refuse(http::status::too_many_requests, "Too many wrong tokens came from this address.", wait);
        }
        if (registry_.full_for(*admission_)) {
            registry_.count_rejected("clients_of_address");
            return refuse_full_address();
        }
        if (registry_.full()) {
            registry_.count_rejected("clients");
            return refuse(http::status::service_unavailable, "There are too many clients already.");
        }
        stream_.expires_never();
        start_websocket_session(registry_, {std::move(stream_), admission_}, std::move(request_), *encoding);
    }
    void refuse_full_address() {
        refuse(http::status::too_many_requests, "This address has too many clients already.");
    }

    void ask_still(const HttpTarget& target) {
        Result<v1::CaptureQuery> query = still_query(target);
        if (!query) return refuse(http::status::bad_request, said(query.error()));
        v1::ClientMessage message;
        message.set_request_id(1);
        *message.mutable_capture() = std::move(*query);
        if (const auto error = over_limit(registry_.options.limits, message))
            return refuse(http::status::bad_request, said(*error));
        if (registry_.full_for(*admission_)) return refuse_full_address();
        if (registry_.too_much_waits_for(*admission_))
            return refuse(http::status::service_unavailable, "Too much waits for clients of this address.");
        still_id_ = registry_.add(shared_from_this(), admission_);
        if (still_id_ == 0) return refuse(http::status::service_unavailable, "There are too many clients already.");
        if (!registry_.request(still_id_, std::move(message))) {
            registry_.remove(std::exchange(still_id_, 0));
            return refuse(http::status::service_unavailable, "The renderer is busy.");
        }
        stream_.expires_never();
        wait_for_still();
        watch_for_end();
    }
    // Nobody renders for a client that has gone. What it sent before (its next request; under TLS its goodbye) lies
    // in front of the end of what can be read, so the connection's state is asked.
    void watch_for_end() {
        watch_timer_.expires_after(kWatch);
        watch_timer_.async_wait([self = shared_from_this()](error_code error) {
            if (error || self->still_id_ == 0) return;
            if (!self->stream_.peer_has_gone()) return self->watch_for_end();
            self->still_timer_.cancel();
            self->registry_.remove(std::exchange(self->still_id_, 0));
            self->stream_.close();
        });
    }
    // Again whenever the renderer tells of its progress.
    void wait_for_still() {
        still_timer_.expires_after(registry_.options.limits.still);
        still_timer_.async_wait([self = shared_from_this()](error_code error) {
            if (error || self->still_id_ == 0) return;
            self->end_wait();
            self->refuse(http::status::gateway_timeout, "The picture was not rendered in time.");
        });
    }
    // What comes now is the answer.
    void end_wait() {
        told_id_ = std::exchange(still_id_, 0);
        still_timer_.cancel();
        watch_timer_.cancel();
    }

    static std::string said(const Error& error) { return error.code + ": " + error.text(); }

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
    // host: of the request, where a page is answered.
    void respond(http::status status, std::string_view type, std::string body, const std::string& host = "") {
        Response response = make_response(status, type, std::move(body));
        if (type.starts_with("text/html")) {
            // The socket's origin is spelled out because not every browser counts ws: as 'self'.
            response.set("Content-Security-Policy",
                         "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; "
                         "connect-src 'self' ws://" +
                             host + " wss://" + host +
                             "; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; object-src 'none'");
        }
        send(std::move(response));
    }
    void refuse(http::status status, const std::string& message, std::chrono::seconds retry = std::chrono::seconds(1)) {
        if (status == http::status::bad_request || status == http::status::payload_too_large ||
            status == http::status::length_required || status == http::status::unsupported_media_type ||
            status == http::status::request_header_fields_too_large)
            keep_alive_ = false;  // where the next request begins is not known
        Response response = make_response(status, "text/plain; charset=utf-8", message + "\n");
        if (status == http::status::method_not_allowed) response.set(http::field::allow, allowed_methods_);
        if (status == http::status::service_unavailable || status == http::status::too_many_requests)
            response.set(http::field::retry_after, std::to_string(retry.count()));
        if (status == http::status::unauthorized) response.set(http::field::www_authenticate, "Bearer");
        if (status == http::status::upgrade_required) response.set(http::field::upgrade, "websocket");
        send(std::move(response));
    }

    // Names the offending value, as much of it as is fit to print.
    void refuse(http::status status, Error error) {
        error.value = shortened_text(error.value, kShownBytes);
        refuse(status, said(error));
    }

    void send(Response response) {
        if (request_.method() == http::verb::head) {
            const std::size_t length = response.body().size();
            response.body().clear();
            response.content_length(length);
        }
        registry_.count_answer(response.result_int());
        response_ = std::make_unique<Response>(std::move(response));
        serializer_.emplace(*response_);
        if (request_.method() != http::verb::head) return write_some();
        stream_.expires_after(registry_.options.limits.write_stall);
        http::async_write_header(stream_, *serializer_,
                                 [self = shared_from_this()](error_code error, std::size_t) { self->on_sent(error); });
    }
    // A client that takes something has its time anew.
    void write_some() {
        stream_.expires_after(registry_.options.limits.write_stall);
        http::async_write_some(stream_, *serializer_, [self = shared_from_this()](error_code error, std::size_t) {
            if (!error && !self->serializer_->is_done()) return self->write_some();
            self->on_sent(error);
        });
    }
    void on_sent(error_code error) {
        serializer_.reset();
        response_.reset();
        request_ = {};
        registry_.remove(std::exchange(told_id_, 0));
        if (error) return;
        if (registry_.stopping) keep_alive_ = false;
        if (keep_alive_) return read();
        stream_.expires_after(std::chrono::seconds(1));
        stream_.async_shut_down([self = shared_from_this()](error_code) {});
    }

    SessionRegistry& registry_;
    std::shared_ptr<const Admission> admission_;
    NetStream stream_;
    asio::steady_timer still_timer_{stream_.get_executor()}, watch_timer_{stream_.get_executor()};
    beast::flat_buffer buffer_;
    std::optional<http::request_parser<http::empty_body>> parser_;
    HttpRequest request_{};
    std::unique_ptr<Response> response_;
    std::optional<http::response_serializer<http::string_body>> serializer_;
    SessionId still_id_ = 0;  // waits for a picture
    SessionId told_id_ = 0;   // is being answered: keeps its room until all of it was sent
    bool keep_alive_ = false;
    const char* allowed_methods_ = "GET, HEAD";  // of the target
};

}  // namespace

void start_http_session(SessionRegistry& registry, Accepted accepted) {
    std::make_shared<HttpSession>(registry, std::move(accepted))->start();
}

}  // namespace gonio
