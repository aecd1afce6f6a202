#include "server/http/sessions.h"

#include <spdlog/spdlog.h>

#include <boost/beast/websocket/stream.hpp>
#include <deque>

#include "protocol/schema/frame_header.h"
#include "protocol/text/shortened_text.h"
#include "server/base/token_bucket.h"
#include "server/http/lane_metrics.h"
#include "server/http/message_limits.h"

namespace gonio {
namespace {

namespace websocket = beast::websocket;
using Clock = std::chrono::steady_clock;

constexpr auto kClosing = std::chrono::seconds(2);  // for the closing handshake

// Close codes of PROTOCOL.md.
constexpr std::uint16_t kNotIdentified = 4002, kWrongToken = 4003, kTooManyFailures = 4008, kTooSlow = 4009;
constexpr std::size_t kUpdateBytes = 16 << 10;               // of a message: every whole one counts as a command more
constexpr auto kBusyRetry = std::chrono::milliseconds(100);  // of "busy"

std::uint32_t microseconds(std::int64_t from_ns, std::int64_t to_ns) {
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>((to_ns - from_ns) / 1000, 0, UINT32_MAX));
}

class WebSocketSession final : public Peer, public std::enable_shared_from_this<WebSocketSession> {
public:
    WebSocketSession(SessionRegistry& registry, Accepted accepted, Encoding encoding)
        : registry_(registry),
          place_(std::move(accepted.place)),
          socket_(std::move(accepted.stream)),
          encoding_(encoding),
          updates_(registry.options.limits.updates_per_s, registry.options.limits.update_burst),
          ack_seconds_(
              registry.options.metrics->histogram("ack_rtt_seconds", "From sending a frame to its acknowledgement.")),
          send_seconds_(send_seconds(*registry.options.metrics)),
          tick_(socket_.get_executor()) {
        registry_.count_clients("websocket", 1);
    }
    ~WebSocketSession() override {
        registry_.count_clients("websocket", -1);
        count(false);
        registry_.remove(id_);
    }
    WebSocketSession(const WebSocketSession&) = delete;
    WebSocketSession& operator=(const WebSocketSession&) = delete;

    void start(HttpRequest request) {
        id_ = registry_.add_stranger(shared_from_this(), place_);
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
            v1::ServerMessage message;
            v1::Hello& hello = *message.mutable_hello();
            hello.set_server(self->registry_.options.server_name);
            hello.set_renderer(self->registry_.options.renderer);
            hello.set_encoder(self->registry_.options.encoder);
            if (self->registry_.has_h264()) hello.add_features("h264");
            for (const char* feature : {"mjpeg", "still"}) hello.add_features(feature);
            self->push(SharedMessage(std::move(message)).bytes(self->encoding_));
            self->read();
        });
    }

    void on_reply(v1::ServerMessage message) override {
        const std::uint32_t request_id = message.request_id();
        auto bytes = SharedMessage(std::move(message)).bytes(encoding_);
        if (request_id == 0) return push(std::move(bytes));
        if (const std::size_t waiting = waiting_bytes(); waiting > 0 && over_bound(waiting + bytes->size()))
            bytes = encoded_refusal(request_id, full_of(waiting), kBusyRetry);
        push(std::move(bytes), Kind::reply);
    }
    std::size_t waiting_bytes() const override {
        std::size_t sum = writing_ ? outgoing_.message_bytes() : 0;
        for (const Outgoing& waiting : queue_) sum += waiting.message_bytes();
        return sum;
    }
    void on_state_published() override {
        if (identified_ && !ready_) send_ready();
    }
    void on_state_changed(const SharedMessage& message) override {
        const std::uint32_t rev = message.message().state_changed().scene_rev();
        // Who holds the camera is told without a new revision.
        if (!message.message().state_changed().state().has_control() && rev <= whole_state_rev_) return;
        if (!ready_ || !wants_state_) return;
        push(message.bytes(encoding_), Kind::state_changed, rev);
    }
    void on_video_config() override {
        if (!ready_ || !wants_video_) return;
        held_ = nullptr;  // of the stream before
        if (!registry_.has_h264()) watch(false);
        tell_stream();
    }
    void on_moved() override { on_video_config(); }
    void on_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final, VideoGate::Verdict verdict) override {
        if (!watching_) return;
        switch (verdict) {
            case VideoGate::Verdict::send:
                send_video(frame, final);
                break;
            case VideoGate::Verdict::hold:
                held_ = frame;
                held_final_ = final;
                break;
            case VideoGate::Verdict::skip:
                held_ = nullptr;
                break;
        }
    }
    void on_tokens() override {
        if (!identified_ || registry_.options.tokens.right_of(token_) >= right_) return;
        registry_.count_rejected("auth");
        close(kWrongToken, "the token does not hold any more");
    }
    void on_crowded_out() override {
        turn_away(websocket::close_code::try_again_later, "too many others have not identified either");
    }
    void on_shutdown() override {
        v1::ServerMessage message;
        message.mutable_goodbye()->set_reason("The server stops.");
        message.mutable_goodbye()->set_reconnect_after_ms(registry_.reconnect_after_ms);
        push(SharedMessage(std::move(message)).bytes(encoding_));
        close_when_sent_ = true;
        write_next();
    }

private:
    // reply: ends a request that counts as outstanding; note: any other message that is no state.
    enum class Kind : std::uint8_t { note, reply, state_changed, whole_state, video };
    static bool is_state(Kind kind) { return kind == Kind::state_changed || kind == Kind::whole_state; }
    // Messages leave in the order in which they were pushed, so that no frame overtakes its VideoConfig.
    struct Outgoing {
        std::shared_ptr<const std::string> bytes;  // of messages; of whole_state from its sending on
        Kind kind = Kind::note;
        std::uint32_t scene_rev = 0;                // of state_changed
        std::shared_ptr<const EncodedFrame> frame;  // of video, with its header
        std::array<std::byte, kFrameHeaderBytes> header{};
        std::uint32_t seq = 0;
        std::size_t message_bytes() const { return bytes ? bytes->size() : 0; }
    };

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
            const Result<v1::ClientMessage> message = decode(bytes, is_text);
            if (!message || !message->has_identify())
                return close(kNotIdentified, "Identify must be the first message");
            return on_identify(message->identify());
        }
        // Reading a long message takes time even where it is refused.
        if (const auto more = static_cast<double>(bytes.size() / kUpdateBytes); more > 0) {
            const auto retry = updates_.take(Clock::now(), more);
            if (retry.count() > 0) {
                const std::string_view first = encoding_ == Encoding::proto ? bytes.substr(0, kUpdateBytes) : bytes;
                return refuse(peek_request_id(encoding_, body(first)), too_fast(), retry);
            }
        }
        Result<v1::ClientMessage> message = decode(bytes, is_text);
        if (!message) {
            const bool right_frame = is_text == (encoding_ == Encoding::json);
            return refuse(right_frame ? peek_request_id(encoding_, body(bytes)) : 0, message.error());
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
        std::optional<Error> error = over_limit(limits, message);
        std::chrono::milliseconds retry(0);
        if (!error && message.request_id() != 0 && outstanding_ >= limits.outstanding) {
            retry = kBusyRetry;
            error = Error{"busy", "", std::to_string(outstanding_),
                          "So many requests of this client are unanswered; wait for some."};
        }
        if (const std::size_t waiting = waiting_bytes(); !error && is_query(message) && over_bound(waiting)) {
            retry = kBusyRetry;
            error = full_of(waiting);
        }
        // The camera's lease is told to everybody, like a change.
        if (!error && (message.has_command() || message.has_acquire_control() || message.has_release_control())) {
            retry = updates_.take(now);
            if (retry.count() > 0) error = too_fast();
        }
        if (error) {
            refuse(message.request_id(), *error, retry);
            return false;
        }
        if (message.has_command()) registry_.updates.arrived(id_, message.request_id(), now);
        return true;
    }

    Error too_fast() const {
        return {"slow_down", "", print_number(registry_.options.limits.updates_per_s) + "/s",
                "This client sends more commands than that; none of this one was applied."};
    }

    std::string_view body(std::string_view bytes) const {
        return encoding_ == Encoding::proto && !bytes.empty() ? bytes.substr(1) : bytes;
    }
    Result<v1::ClientMessage> decode(std::string_view bytes, bool is_text) const {
        if (encoding_ == Encoding::json) {
            if (!is_text) return Error{"bad_message", "", "", "Messages of gonio.v1.json are text frames."};
        } else if (is_text || bytes.empty() || static_cast<unsigned char>(bytes[0]) != kBinaryControl) {
            return Error{"bad_message", "byte 0", "",
                         "Messages of gonio.v1.proto are binary frames that begin with 1."};
        }
        return decode_client_message(encoding_, body(bytes));
    }

    void on_identify(const v1::Identify& identify) {
        const Right right = registry_.options.tokens.right_of(identify.token());
        if (registry_.options.tokens.asked()) {
            if (registry_.auth.blocked(place_->address(), Clock::now()).count() > 0) {
                registry_.count_rejected("auth_rate");
                return close(kTooManyFailures, "too many wrong tokens from this address; wait a minute");
            }
            if (right == Right::none) {
                // Who shows none does not guess: the page asks for it then.
                if (!identify.token().empty()) registry_.auth.failed(place_->address(), Clock::now());
                registry_.count_rejected("auth");
                return close(kWrongToken, "the token is wrong");
            }
        }
        const std::string& role = identify.role();
        if (!role.empty() && role != "controller" && role != "viewer")
            return close(kNotIdentified, "the role must be controller or viewer");
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
        if (wants_video_ && registry_.has_h264()) watch(true);
        push(nullptr, Kind::whole_state);
        registry_.update_demand();
    }
    // Changes that wait behind the whole state and are contained in it are dropped: revisions never go back.
    std::shared_ptr<const std::string> take_whole_state() {
        v1::ServerMessage message;
        message.mutable_ready()->set_client_id(id_);
        message.mutable_ready()->set_role(role_);
        if (registry_.state) *message.mutable_ready()->mutable_state() = *registry_.state;
        told_stream_ = registry_.video_config(watching_ ? registry_.lanes.lane_of(id_) : kSharedLane);
        *message.mutable_ready()->mutable_video_config() = told_stream_;
        whole_state_rev_ = message.ready().state().scene_rev();
        std::erase_if(queue_, [rev = whole_state_rev_](const Outgoing& waiting) {
            return waiting.kind == Kind::state_changed && waiting.scene_rev <= rev;
        });
        return SharedMessage(std::move(message)).bytes(encoding_);
    }
    void refuse(std::uint32_t request_id, const Error& error,
                std::chrono::milliseconds retry = std::chrono::milliseconds(0)) {
        push(encoded_refusal(request_id, error, retry));
    }
    std::shared_ptr<const std::string> encoded_refusal(std::uint32_t request_id, const Error& error,
                                                       std::chrono::milliseconds retry) const {
        v1::ServerMessage message;
        message.set_request_id(request_id);
        *message.mutable_result() = refusal(error);
        message.mutable_result()->set_retry_after_ms(static_cast<std::uint32_t>(retry.count()));
        return SharedMessage(std::move(message)).bytes(encoding_);
    }
    bool over_bound(std::size_t bytes) const { return bytes > registry_.options.limits.queued_bytes; }
    static Error full_of(std::size_t waiting) {
        return {"busy", "", std::to_string(waiting), "So many bytes wait for this client; read them first."};
    }

    void push(std::shared_ptr<const std::string> bytes, Kind kind = Kind::note, std::uint32_t scene_rev = 0) {
        if (closing_ || ended_) return;
        const bool full = queue_.size() >= registry_.options.limits.queued_messages ||
                          (kind == Kind::state_changed && over_bound(waiting_bytes() + bytes->size()));
        if (full && !make_room(kind)) return;
        queue_.push_back({std::move(bytes), kind, scene_rev, nullptr});
        write_next();
    }
    // At the bound all waiting changes of the state become one message with the whole state, encoded when it is sent. A
    // client that lets answers pile up is closed. Result: whether the new message is still to be queued.
    bool make_room(Kind kind) {
        const std::size_t removed = std::erase_if(queue_, [](const Outgoing& o) { return is_state(o.kind); });
        if (removed == 0 && !is_state(kind)) {
            close(kTooSlow, "too many messages wait for this client");
            return false;
        }
        queue_.push_back({nullptr, Kind::whole_state, 0, nullptr});
        return !is_state(kind);
    }

    void write_next() {
        if (writing_ || closing_ || ended_ || !socket_.is_open()) return;
        if (queue_.empty()) {
            if (close_when_sent_) close(websocket::close_code::going_away, "the server stops");
            return;
        }
        outgoing_ = std::move(queue_.front());
        queue_.pop_front();
        writing_ = true;
        write_began_ = Clock::now();
        const auto done = [self = shared_from_this()](error_code error, std::size_t) { self->end_write(error); };
        if (outgoing_.kind == Kind::video) {
            ++registry_.packets_sent;
            const std::size_t bytes = outgoing_.header.size() + outgoing_.frame->data.size();
            if (watching_ && registry_.lanes.wrote(id_, outgoing_.seq, bytes, write_began_) && !pinging_) {
                probing_ = true;
                ping();
            }
            socket_.binary(true);
            return socket_.async_write(
                std::array<asio::const_buffer, 2>{asio::buffer(outgoing_.header), asio::buffer(outgoing_.frame->data)},
                done);
        }
        if (outgoing_.kind == Kind::whole_state) outgoing_.bytes = take_whole_state();
        socket_.text(encoding_ == Encoding::json);
        socket_.async_write(asio::buffer(*outgoing_.bytes), done);
    }
    void end_write(error_code error) {
        writing_ = false;
        if (error) return end();
        if (outgoing_.kind == Kind::video)
            send_seconds_.observe(std::chrono::duration<double>(Clock::now() - write_began_).count());
        if (outgoing_.kind == Kind::reply && outstanding_ > 0) --outstanding_;
        outgoing_ = {};  // a picture's bytes go now, not with the next message
        write_next();
    }

    // ---- video
    void send_video(const std::shared_ptr<const EncodedFrame>& frame, bool final) {
        FrameHeader header;
        header.seq = registry_.lanes.take_credit(id_);
        sent_at_[header.seq % sent_at_.size()] = {header.seq, Clock::now()};
        header.key = frame->key;
        header.final = final;
        header.lane = frame->lane;
        header.scene_rev = frame->scene_rev;
        header.rendered_ns = static_cast<std::uint64_t>(frame->rendered_ns);
        header.render_us = microseconds(frame->drained_ns, frame->rendered_ns);
        header.encode_us = microseconds(std::max(frame->rendered_ns, frame->began_ns), frame->encoded_ns);
        queue_.push_back({nullptr, Kind::video, 0, frame, encode_frame_header(header), header.seq});
        write_next();
    }
    void on_frame_ack(const v1::FrameAck& ack) {
        observe_ack(ack.seq());
        if (!watching_) return;
        const bool goes =
            registry_.lanes.acknowledged(id_, ack.seq(), std::chrono::microseconds(ack.decode_us()), Clock::now());
        if (goes && held_) send_video(std::exchange(held_, nullptr), held_final_);
        registry_.update_demand();
    }
    void observe_ack(std::uint32_t seq) {
        auto& sent = sent_at_[seq % sent_at_.size()];
        if (sent.seq != seq || seq == 0) return;
        ack_seconds_.observe(std::chrono::duration<double>(Clock::now() - sent.at).count());
        sent.seq = 0;
    }
    void watch(bool watches) {
        if (watches == watching_) return;
        watching_ = watches;
        if (watches)
            registry_.lanes.join(id_, Clock::now());
        else
            registry_.lanes.leave(id_, Clock::now());
    }
    // Where the lane's frames are others than the client knows of.
    void tell_stream() {
        v1::ServerMessage message;
        v1::VideoConfig& now = *message.mutable_video_config();
        now = registry_.video_config(watching_ ? registry_.lanes.lane_of(id_) : kSharedLane);
        if (now.SerializeAsString() == told_stream_.SerializeAsString()) return;
        told_stream_ = now;
        push(SharedMessage(std::move(message)).bytes(encoding_));
    }
    void count(bool counts) {
        if (counts == counted_) return;
        counted_ = counts;
        counts ? ++registry_.clients : --registry_.clients;
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
        const auto taken = writing_ ? stream.last_written() : accepted_;
        const auto silence = now - std::max({accepted_, stream.last_read(), taken});
        if (closing_) {
            if (now - closing_since_ > kClosing) end();
        } else if (writing_ && now - std::max(write_began_, stream.last_written()) > limits.write_stall) {
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
    std::shared_ptr<const Place> place_;
    websocket::stream<NetStream> socket_;
    Encoding encoding_;
    TokenBucket updates_;
    unsigned outstanding_ = 0;  // requests whose answer was not sent yet
    struct Sent {
        std::uint32_t seq = 0;  // 0: none
        Clock::time_point at;
    };
    std::array<Sent, 8> sent_at_{};  // the last frames, for the round trip of their acknowledgements
    Histogram &ack_seconds_, &send_seconds_;
    SessionId id_ = 0;
    HttpRequest request_;
    beast::flat_buffer buffer_;

    bool identified_ = false, ready_ = false, wants_video_ = false, wants_state_ = false;
    const char* role_ = "";
    std::string token_;  // that was shown, and what it lets do
    Right right_ = Right::none;
    bool writing_ = false, pinging_ = false, closing_ = false, close_when_sent_ = false, ended_ = false;
    std::deque<Outgoing> queue_;         // at most HttpLimits::queued_messages and queued_bytes, and a whole state
    Outgoing outgoing_{};                // being written
    std::uint32_t whole_state_rev_ = 0;  // of the last whole state that was sent

    bool watching_ = false;  // is a viewer of SessionRegistry::lanes
    bool counted_ = false;   // in SessionRegistry::clients
    bool probing_ = false;   // the ping that is out measures the link
    v1::VideoConfig told_stream_;
    std::shared_ptr<const EncodedFrame> held_;
    bool held_final_ = false;

    asio::steady_timer tick_;
    Clock::time_point accepted_, last_ping_, write_began_, closing_since_;
};

}  // namespace

void start_websocket_session(SessionRegistry& registry, Accepted accepted, HttpRequest request, Encoding encoding) {
    std::make_shared<WebSocketSession>(registry, std::move(accepted), encoding)->start(std::move(request));
}

}  // namespace gonio
