#include "client/connection/connection.h"

#include "client/connection/link.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/beast/websocket/stream.hpp>
#include <cstring>

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"

namespace gonio {
namespace {

namespace websocket = beast::websocket;

constexpr std::uint16_t kFirstPrivateCloseCode = 4000;  // below: the connection broke; from here: the server says why

// Result: "cli:USER@HOST": what one call of gonio did another can undo. At most 64 bytes of ASCII.
std::string undo_key() {
    std::array<char, 256> host{};
    const passwd* user = getpwuid(geteuid());
    if (gethostname(host.data(), host.size() - 1) != 0) host = {"localhost"};
    std::string key = "cli:" + (user != nullptr ? std::string(user->pw_name) : std::to_string(geteuid())) + "@" +
                      std::string(host.data());
    key.resize(std::min<std::size_t>(key.size(), 64));
    for (char& c : key)
        if (c < ' ' || c > '~') c = '_';
    return key;
}

class WebSocketConnection final : public Connection {
public:
    Result<bool> start(const ServerAddress& address, const Wanted& wanted) {
        where_ = address.host_header();
        Result<NetStream> stream = link_.connect(address);
        if (!stream) return stream.error();
        socket_.emplace(std::move(*stream));
        socket_->set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
            request.set(beast::http::field::sec_websocket_protocol,
                        beast::string_view(kSubprotocolProto.data(), kSubprotocolProto.size()));
        }));
        websocket::response_type response;
        error_code error = run(kConnectTime, [&](const NetStream::Done& done) {
            socket_->async_handshake(response, where_, "/v1/ws", [done](error_code e) { done(e); });
        });
        if (error == websocket::error::upgrade_declined) {
            const int status = response.result_int();
            const bool refused = status == 400 || status == 401 || status == 403 || status == 429 || status == 503;
            return Error{refused ? "refused" : "unreachable", "HTTP " + std::to_string(status), where_,
                         status == 429   ? "Too many wrong tokens or connections came from this address; wait a minute."
                         : status == 403 ? "The server has another name; its --host-name may name this one too."
                         : refused       ? "The server refused the connection."
                                         : "This address does not speak this protocol."};
        }
        if (error) return unreachable(error);
        socket_->read_message_max(kMaxServerMessageBytes);
        socket_->binary(true);

        v1::ClientMessage identify;
        identify.mutable_identify()->set_client(wanted.client);
        identify.mutable_identify()->set_video(wanted.video);
        identify.mutable_identify()->set_state(wanted.state);
        identify.mutable_identify()->set_token(wanted.token);
        identify.mutable_identify()->set_role(wanted.role);
        identify.mutable_identify()->set_undo_key(undo_key());
        if (auto said = say(identify); !said) return said;
        for (;;) {
            auto event = read(kReplyTime);
            if (!event) return event.error();
            if (event->message.has_ready()) {
                ready_ = std::move(*event->message.mutable_ready());
                return true;
            }
        }
    }

    const v1::Ready& ready() const override { return ready_; }

    Result<v1::ServerMessage> ask(v1::ClientMessage message, const OnProgress& on_progress) override {
        message.set_request_id(++last_request_id_);
        if (auto said = say(message); !said) return said.error();
        auto deadline = std::chrono::steady_clock::now() + kReplyTime;
        for (;;) {
            auto event = read(deadline - std::chrono::steady_clock::now());
            if (!event) return event.error();
            if (event->access_unit.empty() && event->message.request_id() == last_request_id_) {
                const v1::Result& result = event->message.result();
                if (event->message.has_result() && result.code() != "ok")
                    return Error{result.code(), result.field(), result.value(), result.message()};
                return std::move(event->message);
            }
            if (!event->message.has_progress() || event->message.progress().request() != last_request_id_) continue;
            deadline = std::chrono::steady_clock::now() + kReplyTime;
            on_progress(event->message.progress());
        }
    }
    Result<bool> say(const v1::ClientMessage& message) override {
        std::string bytes = encode_message(Encoding::proto, message);
        bytes.insert(bytes.begin(), static_cast<char>(kBinaryControl));
        const error_code error = run(kReplyTime, [&](const NetStream::Done& done) {
            socket_->async_write(asio::buffer(bytes), [done](error_code e, std::size_t) { done(e); });
        });
        if (error) return unreachable(error);
        return true;
    }
    Result<ServerEvent> next() override { return read(kForever); }
    Result<std::optional<ServerEvent>> next_arrived() override {
        if (!reading_) {
            buffer_.consume(buffer_.size());
            arrived_.reset();
            reading_ = true;
            socket_->async_read(buffer_, [this](error_code error, std::size_t) { arrived_ = error; });
        }
        link_.poll();
        if (!arrived_) return std::optional<ServerEvent>();
        reading_ = false;
        auto event = read_buffer(*arrived_);
        if (!event) return event.error();
        return std::optional(std::move(*event));
    }
    int descriptor() override { return socket_->next_layer().socket().native_handle(); }

private:
    error_code run(std::chrono::steady_clock::duration time, const std::function<void(NetStream::Done)>& start) {
        return link_.run(time, socket_->next_layer(), start);
    }

    Result<ServerEvent> read(std::chrono::steady_clock::duration time) {
        buffer_.consume(buffer_.size());
        return read_buffer(run(time, [&](const NetStream::Done& done) {
            socket_->async_read(buffer_, [done](error_code e, std::size_t) { done(e); });
        }));
    }

    // Result: what was read into the buffer, if it was.
    Result<ServerEvent> read_buffer(const error_code& error) const {
        if (error == websocket::error::closed && socket_->reason().code >= kFirstPrivateCloseCode)
            return Error{"refused", "close " + std::to_string(socket_->reason().code), where_,
                         "The server closed the connection: " + std::string(socket_->reason().reason.c_str()) + "."};
        if (error) return unreachable(error);
        const std::string_view bytes(static_cast<const char*>(buffer_.data().data()), buffer_.size());
        ServerEvent event;
        if (!bytes.empty() && static_cast<std::uint8_t>(bytes[0]) == kBinaryVideo) {
            const auto header = decode_frame_header(std::as_bytes(std::span(bytes.data(), bytes.size())));
            if (!header) return header.error();
            event.header = *header;
            event.access_unit.resize(bytes.size() - kFrameHeaderBytes);
            std::memcpy(event.access_unit.data(), bytes.data() + kFrameHeaderBytes, event.access_unit.size());
            return event;
        }
        auto message = decode_server_message(Encoding::proto, bytes.empty() ? bytes : bytes.substr(1));
        // A message of a later protocol is none of ours.
        if (!message && message.error().code == "unsupported") return event;
        if (!message) return message.error();
        event.message = std::move(*message);
        return event;
    }

    Error unreachable(const error_code& error) const {
        return {"unreachable", "", where_, "The server cannot be reached: " + error.message() + "."};
    }

    Link link_;
    std::optional<websocket::stream<NetStream>> socket_;  // from start() on
    beast::flat_buffer buffer_;
    std::string where_;
    v1::Ready ready_;
    std::uint32_t last_request_id_ = 0;
    bool reading_ = false;               // of next_arrived()
    std::optional<error_code> arrived_;  // how that read ended
};

}  // namespace

Result<ServerAddress> parse_server_url(std::string_view url) {
    const auto refusal = [&](const char* why) { return Error{"usage", "--server", std::string(url), why}; };
    std::string_view rest = url;
    ServerAddress address;
    if (const std::size_t scheme = rest.find("://"); scheme != std::string_view::npos) {
        const std::string_view name = rest.substr(0, scheme);
        address.secure = name == "https" || name == "wss";
        if (name != "http" && name != "ws" && !address.secure)
            return refusal("Only http:// and https:// can be spoken.");
        if (address.secure) address.port = "443";
        rest.remove_prefix(scheme + 3);
    }
    if (rest.ends_with('/')) rest.remove_suffix(1);
    if (rest.find_first_of("/?#@") != std::string_view::npos)
        return refusal("A server's address has neither path, query nor user; a token is given by itself.");
    std::size_t port_at = rest.rfind(':');
    if (rest.starts_with('[')) {
        const std::size_t close = rest.find(']');
        if (close == std::string_view::npos) return refusal("The address lacks its closing bracket.");
        address.host = rest.substr(1, close - 1);
        port_at = close + 1 < rest.size() && rest[close + 1] == ':' ? close + 1 : std::string_view::npos;
    } else {
        address.host = rest.substr(0, port_at);
    }
    if (port_at != std::string_view::npos) address.port = rest.substr(port_at + 1);
    if (address.host.empty() || address.port.empty() || address.port.size() > 5 ||
        address.port.find_first_not_of("0123456789") != std::string::npos || std::stoi(address.port) < 1 ||
        std::stoi(address.port) > 65535)
        return refusal("A server is written like http://127.0.0.1:8080.");
    return address;
}

void end_when_silent(int descriptor) {
    constexpr int kOn = 1, kIdleS = 10, kIntervalS = 5, kProbes = 3;
    constexpr unsigned kUnacknowledgedMs = 25'000;
    setsockopt(descriptor, SOL_SOCKET, SO_KEEPALIVE, &kOn, sizeof kOn);
    setsockopt(descriptor, IPPROTO_TCP, TCP_KEEPIDLE, &kIdleS, sizeof kIdleS);
    setsockopt(descriptor, IPPROTO_TCP, TCP_KEEPINTVL, &kIntervalS, sizeof kIntervalS);
    setsockopt(descriptor, IPPROTO_TCP, TCP_KEEPCNT, &kProbes, sizeof kProbes);
    setsockopt(descriptor, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMs, sizeof kUnacknowledgedMs);
}

Result<std::unique_ptr<Connection>> Connection::open(const ServerAddress& address, const Wanted& wanted) {
    auto connection = std::make_unique<WebSocketConnection>();
    if (auto started = connection->start(address, wanted); !started) return started.error();
    return std::unique_ptr<Connection>(std::move(connection));
}

}  // namespace gonio
