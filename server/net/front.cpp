#include "server/net/front.h"

#include <spdlog/spdlog.h>

#include <thread>

#include "server/net/sessions.h"

namespace gonio {
namespace {

constexpr auto kAcceptRetry = std::chrono::milliseconds(100);  // after accept failed, e.g. no file descriptor left
constexpr auto kFarewell = std::chrono::milliseconds(500);     // for Goodbye and the closing handshakes

class BeastFront final : public Front {
public:
    BeastFront(const FrontOptions& options, Callbacks callbacks) : hub_(options) {
        hub_.callbacks = std::move(callbacks);
        hub_.wake_at = [this](Lanes::Time time) { wake_at(time); };
    }
    ~BeastFront() override {
        if (!thread_.joinable()) return;
        asio::post(context_, [this] { shut_down(); });
        thread_.join();
    }
    BeastFront(const BeastFront&) = delete;
    BeastFront& operator=(const BeastFront&) = delete;

    Result<bool> listen() {
        const FrontOptions& options = hub_.options;
        const std::string address_text = options.host + ":" + std::to_string(options.port);
        const auto refusal = [&](const error_code& error) {
            return Error{"listen_failed", "", address_text, "Cannot listen: " + error.message() + "."};
        };
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
    std::uint32_t packets_sent() const override { return hub_.packets_sent.load(); }

    void publish_state(v1::State state) override {
        asio::post(context_, [this, state = std::move(state)]() mutable {
            const bool first = !hub_.state;
            hub_.state = std::move(state);
            if (first) hub_.for_each([](Peer& peer) { peer.on_state_published(); });
        });
    }
    void broadcast(v1::StateChanged change) override {
        asio::post(context_, [this, change = std::move(change)]() mutable {
            v1::ServerMessage message;
            *message.mutable_state_changed() = std::move(change);
            const SharedMessage shared(std::move(message));
            hub_.for_each([&](Peer& peer) { peer.on_state_changed(shared); });
        });
    }
    void reply(SessionId session, v1::ServerMessage message) override {
        asio::post(context_, [this, session, message = std::move(message)]() mutable {
            const auto found = hub_.peers.find(session);
            if (found == hub_.peers.end()) return;  // it left before its answer came
            if (const auto peer = found->second.lock()) peer->on_reply(std::move(message));
        });
    }
    void publish_video_config(v1::VideoConfig config, LaneId lane) override {
        asio::post(context_, [this, lane, config = std::move(config)]() mutable {
            hub_.newest_stream = config;
            hub_.streams[lane] = std::move(config);
            hub_.lanes.restarted(lane);
            for (const SessionId id : hub_.lanes.viewers_of(lane))
                if (const auto peer = hub_.find(id)) peer->on_video_config();
            hub_.update_demand();
        });
    }
    void publish_h264(EncodedFrame frame, bool final) override {
        asio::post(context_, [this, frame = std::make_shared<const EncodedFrame>(std::move(frame)), final] {
            hub_.publish_h264(frame, final);
        });
    }
    void stop_h264() override {
        asio::post(context_, [this] {
            hub_.options.encoder = "mjpeg";
            hub_.for_each([](Peer& peer) { peer.on_video_config(); });
            hub_.update_demand();
        });
    }
    void publish_jpeg(EncodedFrame frame) override {
        asio::post(context_, [this, frame = std::make_shared<const EncodedFrame>(std::move(frame))] {
            hub_.last_jpeg = frame;
            hub_.for_each([&](Peer& peer) { peer.on_jpeg(frame); });
            hub_.update_demand();
        });
    }
    void stop_accepting() override {
        asio::post(context_, [this] { close_acceptor(); });
    }
    void stop(std::uint32_t reconnect_after_ms) override {
        asio::post(context_, [this, reconnect_after_ms] {
            if (hub_.stopping) return;
            hub_.reconnect_after_ms = reconnect_after_ms;
            shut_down();
        });
    }

private:
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
            if (hub_.stopping || error == asio::error::operation_aborted) return;
            if (error) {
                spdlog::warn("net: accept failed: {}", error.message());
                retry_.expires_after(kAcceptRetry);
                retry_.async_wait([this](error_code cancelled) {
                    if (!cancelled) accept();
                });
                return;
            }
            accept();
            if (hub_.connections >= hub_.options.limits.connections) return;  // closed with `socket`
            start_http_session(hub_, std::move(socket));
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
            hub_.update_demand();
        });
    }
    void shut_down() {
        if (std::exchange(hub_.stopping, true)) return;
        close_acceptor();
        wake_.cancel();
        hub_.for_each([](Peer& peer) { peer.on_shutdown(); });
        retry_.expires_after(kFarewell);
        retry_.async_wait([this](error_code) { context_.stop(); });
        stop_when_alone();
    }
    // Ends early once the last client is gone.
    void stop_when_alone() {
        if (hub_.peers.empty()) return context_.stop();
        poll_.expires_after(std::chrono::milliseconds(5));
        poll_.async_wait([this](error_code error) {
            if (!error) stop_when_alone();
        });
    }

    Hub hub_;  // before the context: sessions end with the context and take leave of the hub
    asio::io_context context_{1};
    tcp::acceptor acceptor_{context_};
    asio::steady_timer retry_{context_}, poll_{context_}, wake_{context_};
    Lanes::Time wake_time_{};  // that wake_ is set to
    std::uint16_t port_ = 0;
    std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<Front>> Front::start(const FrontOptions& options, Callbacks callbacks) {
    auto front = std::make_unique<BeastFront>(options, std::move(callbacks));
    if (auto listening = front->listen(); !listening) return listening.error();
    return std::unique_ptr<Front>(std::move(front));
}

}  // namespace gonio
