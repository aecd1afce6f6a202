// multipart/x-mixed-replace: the picture for browsers without WebCodecs. Browsers show a part only when the header of
// the next one has arrived, so that header is sent right behind each picture ("advance headers"), without a length.
#include "server/http/lane_metrics.h"
#include "server/http/sessions.h"

#include <array>

namespace gonio {
namespace {

constexpr std::string_view kHeader =  // up to the empty line that kBetween begins with
    "HTTP/1.1 200 OK\r\n"
    "Content-Type: multipart/x-mixed-replace;boundary=gonio-frame\r\n"
    "Cache-Control: no-store\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Connection: close\r\n";
constexpr std::string_view kBetween =
    "\r\n--gonio-frame\r\n"
    "Content-Type: image/jpeg\r\n"
    "\r\n";

constexpr std::size_t kPartBytes = 64 << 10;  // written at once

class MjpegSession final : public Peer, public std::enable_shared_from_this<MjpegSession> {
public:
    MjpegSession(SessionRegistry& registry, Accepted accepted, std::string token)
        : registry_(registry),
          admission_(std::move(accepted.admission)),
          token_(std::move(token)),
          socket_(std::move(accepted.stream)) {}
    ~MjpegSession() override { forget(); }

    void start() {
        id_ = registry_.add(shared_from_this(), admission_);
        if (id_ == 0) return end();
        registry_.count_served(true);
        ++registry_.mjpeg.all;
        registry_.count_clients("mjpeg", 1);
        read();
        pending_ = registry_.mjpeg.newest;
        write({asio::buffer(kHeader), asio::buffer(kBetween)});
        update_demand();
    }

    void on_jpeg(const std::shared_ptr<const EncodedFrame>& frame) override {
        if (sent_ && frame->rendered_ns == sent_->rendered_ns) {
            pending_ = nullptr;  // encoded again for another client
            return update_demand();
        }
        pending_ = frame;
        if (!writing_) write_pending();
    }
    void on_shutdown() override { end(); }
    void on_tokens() override {
        if (registry_.access.tokens.right_of(token_) == Right::none) end();
    }

private:
    // Nothing is expected from the client; a completed read means that it is gone.
    void read() {
        socket_.async_read_some(asio::buffer(ignored_), [self = shared_from_this()](error_code error, std::size_t) {
            if (error) return self->end();
            self->read();
        });
    }
    void write_pending() {
        sent_ = std::exchange(pending_, nullptr);
        ++registry_.packets_sent;
        write({asio::buffer(sent_->data), asio::buffer(kBetween)});
        update_demand();
    }
    void write(const std::array<asio::const_buffer, 2>& buffers) {
        writing_ = true;
        const auto began = std::chrono::steady_clock::now();
        // Asked before each part: a client that takes something has its time anew.
        const auto next = [self = shared_from_this()](error_code error, std::size_t) -> std::size_t {
            if (error) return 0;
            self->expect_progress();
            return kPartBytes;
        };
        asio::async_write(socket_, buffers, next, [self = shared_from_this(), began](error_code error, std::size_t) {
            self->writing_ = false;
            self->stall_.cancel();
            if (error) return self->end();
            if (self->sent_)  // else it was the header
                self->send_seconds_.observe(
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
            if (self->pending_) return self->write_pending();
            self->update_demand();
        });
    }
    void expect_progress() {
        stall_.expires_after(registry_.options.limits.write_stall);
        stall_.async_wait([self = shared_from_this()](error_code error) {
            if (!error) self->end();
        });
    }
    void update_demand() {
        set_takes(!ended_ && !writing_ && !pending_);
        registry_.update_demand();
    }
    void set_takes(bool takes) {
        if (takes == takes_) return;
        takes_ = takes;
        takes ? ++registry_.mjpeg.takers : --registry_.mjpeg.takers;
    }
    void end() {
        stall_.cancel();
        socket_.close();
        forget();
    }
    void forget() {
        if (std::exchange(ended_, true) || id_ == 0) return;
        set_takes(false);
        registry_.count_served(false);
        registry_.count_clients("mjpeg", -1);
        registry_.mjpeg.leave();
        registry_.remove(id_);
    }

    SessionRegistry& registry_;
    std::shared_ptr<const Admission> admission_;
    std::string token_;  // that was shown
    NetStream socket_;
    Histogram& send_seconds_ = send_seconds(*registry_.options.metrics);
    asio::steady_timer stall_{socket_.get_executor()};
    SessionId id_ = 0;
    std::array<char, 256> ignored_{};
    std::shared_ptr<const EncodedFrame> pending_, sent_;  // the newest that waits; the last that was written
    bool writing_ = false, takes_ = false, ended_ = false;
};

}  // namespace

void start_mjpeg_session(SessionRegistry& registry, Accepted accepted, std::string token) {
    std::make_shared<MjpegSession>(registry, std::move(accepted), std::move(token))->start();
}

}  // namespace gonio
