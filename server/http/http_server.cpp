#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/http/http_rules.h"
#include "server/http/lane_metrics.h"
#include "server/http/sessions.h"
#include "server/http/tls.h"

#include <netinet/tcp.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/thread_pool.hpp>
#include <thread>

namespace gonio {
namespace {

constexpr auto kAcceptRetry = std::chrono::milliseconds(100);  // after accept failed, e.g. no file descriptor left
constexpr auto kFarewell = std::chrono::milliseconds(500);     // for Goodbye and the closing handshakes

// address: a plain one. Result: it as the limits tell clients apart: an IPv6 client owns a /64.
std::string client_address(const asio::ip::address& address) {
    if (address.is_v4()) return address.to_string();
    auto bytes = address.to_v6().to_bytes();
    std::fill(bytes.begin() + 8, bytes.end(), 0);
    return asio::ip::address_v6(bytes).to_string() + "/64";
}

class BeastServer final : public HttpServer {
public:
    BeastServer(const HttpOptions& options, Callbacks callbacks)
        : registry_(options, std::move(callbacks),
                    {[this](Lanes::Time time) { wake_at(time); },
                     [this](std::function<void()> call) { asio::post(disk_, std::move(call)); }}),
          encode_seconds_(registry_.options.metrics->histogram("encode_seconds", "What an encoder took for a frame.")),
          update_seconds_(registry_.options.metrics->histogram(
              "update_to_frame_seconds", "From the arrival of a command to the first encoded frame that shows it.")) {
        registry_.options.metrics->before_text([this] { show_lanes(registry_); });
    }
    ~BeastServer() override {
        if (!thread_.joinable()) return;
        asio::post(context_, [this] { shut_down(); });
        thread_.join();
        disk_.join();
    }

    Result<bool> listen() {
        const HttpOptions& options = registry_.options;
        const std::string address_text = options.host + ":" + std::to_string(options.port);
        const auto refusal = [&](const error_code& error) {
            return Error{"listen_failed", "", address_text, "Cannot listen: " + error.message() + "."};
        };
        if (secure()) {
            auto tls = load_tls(registry_.options.tls_certificate, registry_.options.tls_key);
            if (!tls) return tls.error();
            registry_.access.tls = *tls;
        }
        error_code error;
        const std::string host = options.host == "localhost" ? "127.0.0.1" : options.host;
        const auto address = asio::ip::make_address(host, error);
        if (error) return refusal(error);
        const tcp::endpoint endpoint(address, options.port);
        acceptor_.open(endpoint.protocol(), error);
        if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
        if (!error) acceptor_.bind(endpoint, error);
        if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
        if (error) return refusal(error);
        port_ = acceptor_.local_endpoint(error).port();
        accept();
        thread_ = std::thread([this] { run(); });
        return true;
    }

    std::uint16_t port() const override { return port_; }
    bool secure() const override { return !registry_.options.tls_certificate.empty(); }
    std::uint32_t packets_sent() const override { return registry_.packets_sent.load(); }

    void publish_state(v1::State state) override {
        asio::post(context_, [this, state = std::move(state)]() mutable {
            const bool first = !registry_.state;
            registry_.state = std::move(state);
            if (first) registry_.for_each([](Peer& peer) { peer.on_state_published(); });
        });
    }
    void broadcast(v1::StateChanged change) override {
        asio::post(context_, [this, change = std::move(change)]() mutable {
            v1::ServerMessage message;
            *message.mutable_state_changed() = std::move(change);
            const SharedMessage shared(std::move(message));
            registry_.for_each([&](Peer& peer) { peer.on_state_changed(shared); });
        });
    }
    void reply(SessionId session, v1::ServerMessage message) override {
        asio::post(context_, [this, session, message = std::move(message)]() mutable {
            const auto peer = registry_.find(session);
            if (!peer) return;  // it left before its answer came
            const v1::Result& result = message.result();
            if (message.has_result() &&
                registry_.updates.answered(session, message.request_id(), result.code() == "ok", result.scene_rev()))
                registry_.options.metrics
                    ->counter("updates_total", "Commands of clients, by their result.", label("result", result.code()))
                    .add();
            peer->on_reply(std::move(message));
        });
    }
    void publish_blobs(std::shared_ptr<const Blobs> blobs) override {
        asio::post(context_, [this, blobs = std::move(blobs)] { registry_.blobs = blobs; });
    }
    void send_away(std::uint32_t reconnect_after_ms) override {
        asio::post(context_, [this, reconnect_after_ms] {
            registry_.reconnect_after_ms = reconnect_after_ms;
            registry_.for_each([](Peer& peer) { peer.on_shutdown(); });
        });
    }
    void publish_video_config(v1::VideoConfig config, LaneId lane) override {
        asio::post(context_, [this, lane, config = std::move(config)]() mutable {
            registry_.video.put(lane, std::move(config));
            registry_.lanes.restarted(lane);
            for (const SessionId id : registry_.lanes.viewers_of(lane))
                if (const auto peer = registry_.find(id)) peer->on_video_config();
            registry_.update_demand();
        });
    }
    void publish_h264(EncodedFrame frame, bool final) override {
        asio::post(context_, [this, frame = std::make_shared<const EncodedFrame>(std::move(frame)), final] {
            observe(*frame, "h264");
            registry_.publish_h264(frame, final);
        });
    }
    void stop_h264() override {
        asio::post(context_, [this] {
            registry_.video.stop_h264();
            registry_.for_each([](Peer& peer) { peer.on_video_config(); });
            registry_.update_demand();
        });
    }
    void publish_jpeg(EncodedFrame frame) override {
        asio::post(context_, [this, frame = std::make_shared<const EncodedFrame>(std::move(frame))] {
            observe(*frame, "jpeg");
            registry_.mjpeg.newest = frame;
            registry_.for_each([&](Peer& peer) { peer.on_jpeg(frame); });
            registry_.update_demand();
        });
    }
    void stop_accepting() override {
        asio::post(context_, [this] { close_acceptor(); });
    }
    void stop(std::uint32_t reconnect_after_ms) override {
        asio::post(context_, [this, reconnect_after_ms] {
            registry_.reconnect_after_ms = reconnect_after_ms;
            shut_down();
        });
    }
    void post(std::function<void()> call) override { asio::post(context_, std::move(call)); }
    void set_ready(bool ready) override {
        came_by();
        asio::post(context_, [this, ready] { registry_.readiness.ready = ready; });
    }
    void came_by() override { registry_.readiness.came_by = std::chrono::steady_clock::now(); }
    void set_tokens(Tokens tokens) override {
        asio::post(context_, [this, tokens = std::move(tokens)] {
            registry_.access.tokens = tokens;
            registry_.for_each([](Peer& peer) { peer.on_tokens(); });
        });
    }
    void set_tls(std::shared_ptr<TlsContext> tls) override {
        if (!secure()) return;
        asio::post(context_, [this, tls = std::move(tls)] { registry_.access.tls = tls; });
    }

private:
    void observe(const EncodedFrame& frame, const char* codec) {
        count_frame(*registry_.options.metrics, frame, codec);
        encode_seconds_.observe(static_cast<double>(frame.encoded_ns - std::max(frame.rendered_ns, frame.began_ns)) *
                                1e-9);
        registry_.updates.shown(frame.scene_rev, std::chrono::steady_clock::now(), [this](auto time) {
            update_seconds_.observe(std::chrono::duration<double>(time).count());
        });
    }
    void run() {
        for (;;) {
            try {
                context_.run();
                return;
            } catch (const std::exception& exception) {
                // One handler failed (out of memory, say); its connection ends with it, the others go on.
                spdlog::error("net: a handler failed: {}", exception.what());
            }
        }
    }
    void accept() {
        acceptor_.async_accept([this](error_code error, tcp::socket socket) {
            if (registry_.stopping || error == asio::error::operation_aborted) return;
            if (error) {
                spdlog::warn("net: accept failed: {}", error.message());
                retry_.expires_after(kAcceptRetry);
                retry_.async_wait([this](error_code cancelled) {
                    if (!cancelled) accept();
                });
                return;
            }
            accept();
            const tcp::endpoint remote = socket.remote_endpoint(error);
            if (error) return;  // gone already
            const asio::ip::address address = plain_address(remote.address());
            auto admission = registry_.admit(client_address(address), address.is_loopback());
            if (!admission) {  // closed with `socket`
                registry_.count_rejected("connections");
                return;
            }
            Accepted accepted{NetStream(std::move(socket)), std::move(admission)};
            error_code ignored;
            tcp::socket& plain = accepted.stream.socket();
            plain.set_option(tcp::no_delay(true), ignored);
            // A small send buffer: what lies in the kernel is lag that no pacing can take back.
            plain.set_option(asio::socket_base::send_buffer_size(128 << 10), ignored);
            plain.set_option(asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>(64 << 10), ignored);
            registry_.access.tls ? start_secure_session(registry_, std::move(accepted))
                                 : start_http_session(registry_, std::move(accepted));
        });
    }
    void close_acceptor() {
        error_code ignored;
        acceptor_.close(ignored);
        retry_.cancel();
    }
    void wake_at(Lanes::Time time) {
        if (time == wake_time_) return;
        wake_time_ = time;
        wake_.expires_at(time);
        wake_.async_wait([this](error_code cancelled) {
            if (cancelled) return;
            wake_time_ = {};
            registry_.update_demand();
        });
    }
    void shut_down() {
        if (std::exchange(registry_.stopping, true)) return;
        close_acceptor();
        wake_.cancel();
        registry_.for_each([](Peer& peer) { peer.on_shutdown(); });
        retry_.expires_after(kFarewell);
        retry_.async_wait([this](error_code) { context_.stop(); });
        stop_when_alone();
    }
    // Ends early once the last client is gone.
    void stop_when_alone() {
        if (registry_.empty()) return context_.stop();
        poll_.expires_after(std::chrono::milliseconds(5));
        poll_.async_wait([this](error_code error) {
            if (!error) stop_when_alone();
        });
    }

    // Before the context: sessions end with the context and take leave of the session registry.
    SessionRegistry registry_;
    Histogram &encode_seconds_, &update_seconds_;
    asio::thread_pool disk_{1};
    asio::io_context context_{1};
    tcp::acceptor acceptor_{context_};
    asio::steady_timer retry_{context_}, poll_{context_}, wake_{context_};
    Lanes::Time wake_time_{};  // that wake_ is set to
    std::uint16_t port_ = 0;
    std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<HttpServer>> HttpServer::start(const HttpOptions& options, Callbacks callbacks) {
    auto http_server = std::make_unique<BeastServer>(options, std::move(callbacks));
    if (auto listening = http_server->listen(); !listening) return listening.error();
    return std::unique_ptr<HttpServer>(std::move(http_server));
}

}  // namespace gonio
