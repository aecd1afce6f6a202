#include "server/http/sessions.h"

#include <spdlog/spdlog.h>

#include <boost/beast/websocket/stream.hpp>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/base/token_bucket.h"
#include "server/http/lane_metrics.h"
#include "server/http/message_limits.h"
#include "server/http/outgoing.h"
#include "server/http/socket_messages.h"

namespace gonio {
namespace {

namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;

constexpr auto kClosing = std::chrono::seconds(2);  // for the closing handshake

// Close codes of PROTOCOL.md.
constexpr std::uint16_t kNotIdentified = 4002, kWrongToken = 4003, kTooManyFailures = 4008, kTooSlow = 4009;
constexpr std::size_t kUpdateBytes = 16 << 10;               // of a message: every whole one counts as a command more
constexpr std::size_t kMaxUndoKeyBytes = 64;                 // of Identify.undo_key; more closes the connection
constexpr auto kBusyRetry = std::chrono::milliseconds(100);  // of "busy"

class WebSocketSession final : public Peer, public std::enable_shared_from_this<WebSocketSession> {
public:
    WebSocketSession(SessionRegistry& registry, Accepted accepted, Encoding encoding)
        : registry_(registry),
          admission_(std::move(accepted.admission)),
          socket_(std::move(accepted.stream)),
          encoding_(encoding) {
        registry_.count_clients("websocket", 1);
    }
    ~WebSocketSession() override {
        registry_.count_clients("websocket", -1);
        count(false);
        registry_.remove(id_);
    }

    void start(HttpRequest request) {
        id_ = registry_.add_stranger(shared_from_this(), admission_);
        if (id_ == 0) return;
        accepted_ = Clock::now();
        schedule_tick();  // bounds the upgrade too
        request_ = std::move(request);
        socket_.set_option(
            websocket::stream_base::decorator([encoding = encoding_](websocket::response_type& response) {
                const auto name = encoding == Encoding::proto ? kSubprotocolProto : kSubprotocolJson;
                response.set(http::field::sec_websocket_protocol, beast::string_view(name.data(), name.size()));
            }));
        socket_.read_message_max(registry_.options.limits.identify_bytes);
        socket_.auto_fragment(false);
        socket_.control_callback([this](websocket::frame_type kind, beast::string_view) {
            const auto now = Clock::now();
            if (kind == websocket::frame_type::pong && std::exchange(probing_, false) && registry_.lanes.watches(id_))
                registry_.lanes.round_trip(id_, now - last_ping_, now);
        });
        socket_.async_accept(request_, [self = shared_from_this()](error_code error) {
            if (error) return self->end();
            self->push(self->encoded(hello_message(self->registry_.options, self->registry_.video.has_h264())));
            self->read();
        });
    }

    void on_reply(v1::ServerMessage message) override {
        const std::uint32_t request_id = message.request_id();
        auto bytes = encoded(std::move(message));
        if (request_id == 0) return push(std::move(bytes));
        if (const std::size_t waiting = waiting_bytes(); waiting > 0 && queue_.over_bound(waiting + bytes->size()))
            bytes = encoded(refusal_message(request_id, full_of(waiting), kBusyRetry));
        push(std::move(bytes), Outgoing::Kind::reply);
    }
    std::size_t waiting_bytes() const override { return queue_.waiting_bytes(); }
    void on_state_published() override {
        if (identified_ && !ready_) send_ready();
    }
    void on_state_changed(const SharedMessage& message) override {
        const std::uint32_t rev = message.message().state_changed().scene_rev();
        // Who holds the camera is told without a new revision.
        if (!message.message().state_changed().state().has_control() && rev <= whole_state_rev_) return;
        if (!ready_ || !wants_state_) return;
        push(message.bytes(encoding_), Outgoing::Kind::state_changed, rev);
    }
    void on_video_config() override {
        if (!ready_ || !wants_video_) return;
        held_ = nullptr;  // of the stream before
        if (!registry_.video.has_h264()) watch(false);
        tell_stream();
    }
    void on_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final, VideoGate::Verdict verdict) override {
        if (!watching_) return;
        if (verdict == VideoGate::Verdict::send) return send_video(frame, final);
        held_ = verdict == VideoGate::Verdict::hold ? frame : nullptr;
        held_final_ = final;
    }
    void on_tokens() override {
        if (!identified_ || registry_.access.tokens.right_of(token_) >= right_) return;
        registry_.count_rejected("auth");
        close(kWrongToken, "the token does not hold any more");
    }
    void on_crowded_out() override {
        turn_away(websocket::close_code::try_again_later, "too many others have not identified either");
    }
    void on_shutdown() override {
        push(encoded(goodbye_message(registry_.reconnect_after_ms)));
        close_when_sent_ = true;
        write_next();
    }

private:
    std::shared_ptr<const std::string> encoded(v1::ServerMessage message) const {
        return SharedMessage(std::move(message)).bytes(encoding_);
    }

    // ---- reading
    void read() {
        socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
            if (error) return self->end();
            const std::string message(static_cast<const char*>(self->buffer_.data().data()), self->buffer_.size());
            self->buffer_.consume(self->buffer_.size());
            if (self->closing_) return self->read();
            self->on_message(message, self->socket_.got_text());
            self->read();
        });
    }

    void on_message(std::string_view bytes, bool is_text) {
        if (!identified_) {
            const Result<v1::ClientMessage> message = decode_frame(encoding_, bytes, is_text);
            if (!message || !message->has_identify())
                return close(kNotIdentified, "Identify must be the first message");
            return on_identify(message->identify());
        }
        // Reading a long message takes time even where it is refused.
        if (const std::size_t more = bytes.size() / kUpdateBytes; more > 0) {
            const auto retry = updates_.take(Clock::now(), static_cast<double>(more));
            if (retry.count() > 0) {
                const std::string_view first = encoding_ == Encoding::proto ? bytes.substr(0, kUpdateBytes) : bytes;
                return refuse(peek_request_id(encoding_, body_of(encoding_, first)), too_fast(), retry);
            }
        }
        Result<v1::ClientMessage> message = decode_frame(encoding_, bytes, is_text);
        if (!message) {
            const bool right_frame = is_text == (encoding_ == Encoding::json);
            return refuse(right_frame ? peek_request_id(encoding_, body_of(encoding_, bytes)) : 0, message.error());
        }
        const std::uint32_t request_id = message->request_id();
        switch (message->message_case()) {
            case v1::ClientMessage::kFrameAck:
                return on_frame_ack(message->frame_ack());
            case v1::ClientMessage::kRequestKeyframe:
                held_ = nullptr;
                if (watching_) registry_.lanes.need_key(id_);
                return registry_.update_demand();
            case v1::ClientMessage::kIdentify:
                return refuse(request_id, {"unexpected", "identify", "", "This connection is identified already."});
            default:
                if (!admit(*message)) return;
                if (!registry_.request(id_, std::move(*message)))
                    return refuse(request_id, {"busy", "", "", "The renderer has too much to do; try again."},
                                  kBusyRetry);
                if (request_id != 0) ++outstanding_;
        }
    }
    // Result: whether the request is within the limits; else it has been refused.
    bool admit(const v1::ClientMessage& message) {
        const HttpLimits& limits = registry_.options.limits;
        const auto now = Clock::now();
        const auto refused = [&](const Error& error, std::chrono::milliseconds retry) {
            refuse(message.request_id(), error, retry);
            return false;
        };
        if (const auto error = over_limit(limits, message)) return refused(*error, std::chrono::milliseconds(0));
        if (message.request_id() != 0 && outstanding_ >= limits.outstanding)
            return refused({"busy", "", std::to_string(outstanding_),
                            "So many requests of this client are unanswered; wait for some."},
                           kBusyRetry);
        if (const std::size_t waiting = waiting_bytes(); is_query(message) && queue_.over_bound(waiting))
            return refused(full_of(waiting), kBusyRetry);
        // The camera's lease is told to everybody, like a change.
        if (message.has_command() || message.has_acquire_control() || message.has_release_control())
            if (const auto retry = updates_.take(now); retry.count() > 0) return refused(too_fast(), retry);
        if (message.has_command()) registry_.updates.arrived(id_, message.request_id(), now);
        return true;
    }

    Error too_fast() const {
        return {"slow_down", "", print_number(registry_.options.limits.updates_per_s) + "/s",
                "This client sends more commands than that; none of this one was applied."};
    }

    void on_identify(const v1::Identify& identify) {
        const Right right = registry_.access.tokens.right_of(identify.token());
        if (registry_.access.blocked(*admission_).count() > 0) {
            registry_.count_rejected("auth_rate");
            return close(kTooManyFailures, "too many wrong tokens from this address; wait a minute");
        }
        if (registry_.access.tokens.asked() && right == Right::none) {
            // Who shows none does not guess: the page asks for it then.
            if (!identify.token().empty()) registry_.access.failed(*admission_);
            registry_.count_rejected("auth");
            return close(kWrongToken, "the token is wrong");
        }
        const std::string& role = identify.role();
        if (!role.empty() && role != "controller" && role != "viewer")
            return close(kNotIdentified, "the role must be controller or viewer");
        if (identify.undo_key().size() > kMaxUndoKeyBytes)
            return close(kNotIdentified, "the undo_key must have at most 64 bytes");
        v1::Identify told = identify;
        if (right == Right::look) told.set_role("viewer");
        if (!registry_.make_client(id_)) {
            registry_.count_rejected("clients");
            return close(websocket::close_code::try_again_later, "there are too many clients already");
        }
        if (!registry_.identified(id_, std::move(told)))
            return close(websocket::close_code::try_again_later, "the server is busy");
        identified_ = true;
        token_ = identify.token();
        right_ = right;
        role_ = right == Right::look || role == "viewer" ? "viewer" : "controller";
        wants_video_ = identify.video();
        wants_state_ = identify.state();
        socket_.read_message_max(registry_.options.limits.message_bytes + 1);  // and the kind byte
        spdlog::info("net: client {} is {}", id_, shortened_text(identify.client(), 128));
        if (registry_.state) send_ready();
    }

    // ---- writing
    void send_ready() {
        ready_ = true;
        count(true);
        if (wants_video_ && registry_.video.has_h264()) watch(true);
        push(nullptr, Outgoing::Kind::whole_state);
        registry_.update_demand();
    }
    std::shared_ptr<const std::string> take_whole_state() {
        v1::ServerMessage message;
        message.mutable_ready()->set_client_id(id_);
        message.mutable_ready()->set_role(role_);
        if (registry_.state) *message.mutable_ready()->mutable_state() = *registry_.state;
        told_stream_ = stream_config();
        *message.mutable_ready()->mutable_video_config() = told_stream_;
        whole_state_rev_ = message.ready().state().scene_rev();
        queue_.drop_changes_until(whole_state_rev_);
        return encoded(std::move(message));
    }
    void refuse(std::uint32_t request_id, const Error& error,
                std::chrono::milliseconds retry = std::chrono::milliseconds(0)) {
        push(encoded(refusal_message(request_id, error, retry)));
    }
    static Error full_of(std::size_t waiting) {
        return {"busy", "", std::to_string(waiting), "So many bytes wait for this client; read them first."};
    }

    void push(std::shared_ptr<const std::string> bytes, Outgoing::Kind kind = Outgoing::Kind::note,
              std::uint32_t scene_rev = 0) {
        if (closing_ || ended_) return;
        const OutgoingQueue::Pushed pushed = queue_.push(std::move(bytes), kind, scene_rev);
        if (pushed == OutgoingQueue::Pushed::too_slow) return close(kTooSlow, "too many messages wait for this client");
        write_next();
    }
    void write_next() {
        if (queue_.writing() || closing_ || ended_ || !socket_.is_open()) return;
        if (queue_.empty()) {
            if (close_when_sent_) close(websocket::close_code::going_away, "the server stops");
            return;
        }
        Outgoing& outgoing = queue_.begin_write();
        write_began_ = Clock::now();
        const auto done = [self = shared_from_this()](error_code error, std::size_t) { self->end_write(error); };
        if (outgoing.kind == Outgoing::Kind::video) {
            ++registry_.packets_sent;
            const std::size_t bytes = outgoing.header.size() + outgoing.frame->data.size();
            if (watching_ && registry_.lanes.wrote(id_, outgoing.seq, bytes, write_began_) && !pinging_) {
                probing_ = true;
                ping();
            }
            socket_.binary(true);
            return socket_.async_write(
                std::array<asio::const_buffer, 2>{asio::buffer(outgoing.header), asio::buffer(outgoing.frame->data)},
                done);
        }
        if (outgoing.kind == Outgoing::Kind::whole_state) outgoing.bytes = take_whole_state();
        socket_.text(encoding_ == Encoding::json);
        socket_.async_write(asio::buffer(*outgoing.bytes), done);
    }
    void end_write(error_code error) {
        const Outgoing written = queue_.end_write();
        if (error) return end();
        if (written.kind == Outgoing::Kind::video)
            send_seconds_.observe(std::chrono::duration<double>(Clock::now() - write_began_).count());
        if (written.kind == Outgoing::Kind::reply && outstanding_ > 0) --outstanding_;
        write_next();
    }

    // ---- video
    void send_video(const std::shared_ptr<const EncodedFrame>& frame, bool final) {
        const std::uint32_t seq = registry_.lanes.take_credit(id_);
        sent_at_[seq % sent_at_.size()] = {seq, Clock::now()};
        queue_.push_video(frame, final, seq);
        write_next();
    }
    void on_frame_ack(const v1::FrameAck& ack) {
        auto& sent = sent_at_[ack.seq() % sent_at_.size()];
        if (sent.seq == ack.seq() && sent.seq != 0) {
            ack_seconds_.observe(std::chrono::duration<double>(Clock::now() - sent.at).count());
            sent.seq = 0;
        }
        if (!watching_) return;
        const bool goes =
            registry_.lanes.acknowledged(id_, ack.seq(), std::chrono::microseconds(ack.decode_us()), Clock::now());
        if (goes && held_) send_video(std::exchange(held_, nullptr), held_final_);
        registry_.update_demand();
    }
    void watch(bool watches) {
        if (watches == watching_) return;
        watching_ = watches;
        if (watches)
            registry_.lanes.join(id_, Clock::now());
        else
            registry_.lanes.leave(id_, Clock::now());
    }
    v1::VideoConfig stream_config() const {
        return registry_.video.of(watching_ ? registry_.lanes.lane_of(id_) : kSharedLane);
    }
    // Where the lane's frames are others than the client knows of.
    void tell_stream() {
        v1::ServerMessage message;
        v1::VideoConfig& now = *message.mutable_video_config();
        now = stream_config();
        if (now.SerializeAsString() == told_stream_.SerializeAsString()) return;
        told_stream_ = now;
        push(encoded(std::move(message)));
    }
    void count(bool counts) {
        if (counts == counted_) return;
        counted_ = counts;
        registry_.count_served(counts);
    }

    // ---- time and end
    void schedule_tick() {
        const HttpLimits& limits = registry_.options.limits;
        const auto shortest = std::min({limits.identify, limits.ping, limits.write_stall});
        tick_.expires_after(std::clamp<std::chrono::milliseconds>(shortest / 5, std::chrono::milliseconds(20),
                                                                  std::chrono::milliseconds(1000)));
        tick_.async_wait([self = shared_from_this()](error_code error) {
            if (error || self->ended_) return;
            self->check_times();
            if (!self->ended_) self->schedule_tick();
        });
    }
    void check_times() {
        const HttpLimits& limits = registry_.options.limits;
        const auto now = Clock::now();
        const NetStream& stream = socket_.next_layer();
        // Who takes a long message piece by piece is there too: no ping gets past it.
        const auto taken = queue_.writing() ? stream.last_written() : accepted_;
        const auto silence = now - std::max({accepted_, stream.last_read(), taken});
        if (closing_) {
            if (now - closing_since_ > kClosing) end();
        } else if (queue_.writing() && now - std::max(write_began_, stream.last_written()) > limits.write_stall) {
            spdlog::info("net: client {} does not read; dropped", id_);
            end();
        } else if (silence > limits.dead) {
            spdlog::info("net: client {} is silent; dropped", id_);
            end();
        } else if (!identified_ && now - accepted_ > limits.identify) {
            turn_away(kNotIdentified, "Identify did not come in time");
        } else if (silence > limits.ping && now - last_ping_ > limits.ping && !pinging_ && socket_.is_open()) {
            ping();
        }
    }
    void ping() {
        last_ping_ = Clock::now();
        pinging_ = true;
        socket_.async_ping({}, [self = shared_from_this()](error_code error) {
            self->pinging_ = false;
            if (error) self->end();
        });
    }
    // Also while the upgrade is under way.
    void turn_away(std::uint16_t code, const char* reason) { socket_.is_open() ? close(code, reason) : end(); }
    void close(std::uint16_t code, const char* reason) {
        if (closing_ || ended_) return;
        closing_ = true;
        closing_since_ = Clock::now();
        queue_.clear();
        held_ = nullptr;
        count(false);
        watch(false);
        socket_.async_close(websocket::close_reason(static_cast<websocket::close_code>(code), reason),
                            [self = shared_from_this()](error_code) { self->end(); });
        registry_.tell_moved();
        registry_.update_demand();
    }
    void end() {
        if (std::exchange(ended_, true)) return;
        count(false);
        watching_ = false;  // remove() takes leave of the lanes
        tick_.cancel();
        beast::get_lowest_layer(socket_).close();
        registry_.remove(id_);
    }

    SessionRegistry& registry_;
    std::shared_ptr<const Admission> admission_;
    websocket::stream<NetStream> socket_;
    Encoding encoding_;
    TokenBucket updates_{registry_.options.limits.updates_per_s, registry_.options.limits.update_burst};
    unsigned outstanding_ = 0;  // requests whose answer was not sent yet
    struct Sent {
        std::uint32_t seq = 0;  // 0: none
        Clock::time_point at;
    };
    std::array<Sent, 8> sent_at_{};  // the last frames, for the round trip of their acknowledgements
    Histogram& ack_seconds_ =
        registry_.options.metrics->histogram("ack_rtt_seconds", "From sending a frame to its acknowledgement.");
    Histogram& send_seconds_ = send_seconds(*registry_.options.metrics);
    SessionId id_ = 0;
    HttpRequest request_;
    beast::flat_buffer buffer_;

    bool identified_ = false, ready_ = false, wants_video_ = false, wants_state_ = false;
    const char* role_ = "";
    std::string token_;  // that was shown, and what it lets do
    Right right_ = Right::none;
    bool pinging_ = false, closing_ = false, close_when_sent_ = false, ended_ = false;
    OutgoingQueue queue_{registry_.options.limits};
    std::uint32_t whole_state_rev_ = 0;  // of the last whole state that was sent

    bool watching_ = false;  // is a viewer of SessionRegistry::lanes
    bool counted_ = false;   // by SessionRegistry::count_served()
    bool probing_ = false;   // the ping that is out measures the link
    v1::VideoConfig told_stream_;
    std::shared_ptr<const EncodedFrame> held_;
    bool held_final_ = false;

    asio::steady_timer tick_{socket_.get_executor()};
    Clock::time_point accepted_, last_ping_, write_began_, closing_since_;
};

}  // namespace

void start_websocket_session(SessionRegistry& registry, Accepted accepted, HttpRequest request, Encoding encoding) {
    std::make_shared<WebSocketSession>(registry, std::move(accepted), encoding)->start(std::move(request));
}

}  // namespace gonio
