// What all connections of the HTTP server share. Lives on the net thread alone; knows no sockets.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/http/auth_guard.h"
#include "server/http/http_server.h"
#include "server/http/update_clock.h"

namespace gonio {

// A control message on its way to several clients: encoded once per encoding, when first asked for.
class SharedMessage {
public:
    explicit SharedMessage(v1::ServerMessage message) : message_(std::move(message)) {}
    // Result: the WebSocket message: for proto with the leading kind byte.
    std::shared_ptr<const std::string> bytes(Encoding encoding) const;
    const v1::ServerMessage& message() const { return message_; }

private:
    v1::ServerMessage message_;
    mutable std::shared_ptr<const std::string> proto_, json_;
};

struct SessionRegistry;

// A connection that lives longer than one request.
class Peer {
public:
    virtual ~Peer() = default;
    virtual void on_reply(v1::ServerMessage) {}
    virtual void on_state_published() {}
    virtual void on_state_changed(const SharedMessage&) {}
    virtual void on_video_config() {}  // SessionRegistry::video_config() of its lane may be another now
    virtual void on_moved() {}         // to another lane
    virtual void on_h264(const std::shared_ptr<const EncodedFrame>&, bool /*final*/, VideoGate::Verdict) {}
    virtual void on_jpeg(const std::shared_ptr<const EncodedFrame>&) {}
    virtual void on_shutdown() = 0;   // says goodbye where it can and ends
    virtual void on_crowded_out() {}  // its place went to another before it identified
    // Other tokens are asked for now: who shows none of them ends.
    virtual void on_tokens() {}
    // Result: of messages or an answer that wait or are being written; video is counted by SessionRegistry::lanes.
    virtual std::size_t waiting_bytes() const { return 0; }
};

// A connection's place among those that the limits count; ends with its last owner.
class Place {
public:
    // address: as the limits tell clients apart; local: loopback.
    Place(SessionRegistry& registry, std::string address, bool local);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    const std::string& address() const { return address_; }
    bool local() const { return local_; }

private:
    SessionRegistry& registry_;
    std::string address_;
    bool local_;
};

struct TlsContext;

struct SessionRegistry {
    explicit SessionRegistry(const HttpOptions& given, HttpServer::Callbacks given_callbacks);

    HttpOptions options;
    HttpServer::Callbacks callbacks;
    std::map<SessionId, std::weak_ptr<Peer>> peers;
    unsigned connections = 0;
    unsigned clients = 0;                                        // that are Ready, or take MJPEG
    unsigned mjpeg_clients = 0, mjpeg_takers = 0;                // takers: took the last part
    std::map<std::string, unsigned> connections_of, clients_of;  // by address, only those that have some
    std::map<SessionId, std::shared_ptr<const Place>> place_of;  // of `peers`
    std::shared_ptr<TlsContext> tls;                             // null: plain HTTP
    AuthGuard auth;
    UpdateClock updates;
    bool ready = false;
    std::atomic<std::chrono::steady_clock::time_point> came_by{};  // the render thread, last; any thread
    std::function<void(std::function<void()>)> on_disk;            // runs the call on the disk thread
    std::optional<v1::State> state;
    Lanes lanes;
    std::map<LaneId, v1::VideoConfig> streams;  // what the encoder of each lane makes
    v1::VideoConfig newest_stream;
    std::function<void(Lanes::Time)> wake_at;       // calls update_demand() then
    std::shared_ptr<const EncodedFrame> last_jpeg;  // kept while an MJPEG client is there
    std::atomic<std::uint32_t> packets_sent = 0;
    bool stopping = false;
    std::uint32_t reconnect_after_ms = 0;  // of the Goodbye

    // Result: the id of a new client; 0 at a limit of clients.
    SessionId add(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Place>& place);
    // Result: the id of a socket that has not identified. It takes no client's place; there are as many places for
    // such, and where they are taken the oldest (of the same address, where that has its share) goes. 0: stopping.
    SessionId add_stranger(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Place>& place);
    // id: of add_stranger(). Result: whether it is a client now; false at a limit of clients.
    bool make_client(SessionId id);
    void remove(SessionId id);
    bool full() const { return peers.size() - strangers_.size() >= options.limits.clients; }
    // Whether the address has as many clients as it may.
    bool full_for(const Place& place) const;
    // Whether clients of this address wait for more than four times HttpLimits::queued_bytes; sixteen times, of an
    // address that has no limit of its own. No further stills are begun for them then.
    bool too_much_waits_for(const Place& place) const;
    bool room_for_connection(const std::string& address, bool local) const;
    void count_clients(const char* transport, int change);
    void count_rejected(const char* reason);
    // Tells the daemon what is wanted if that changed. Call after everything that may change it.
    void update_demand();
    bool has_h264() const { return options.encoder != "mjpeg"; }
    // Result: for a viewer of this lane; of a lane that has no encoder yet what others make.
    v1::VideoConfig video_config(LaneId lane) const;
    void publish_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final);
    // Tells those that were moved to another lane.
    void tell_moved();
    // Result: false where the render queue is full.
    bool request(SessionId id, v1::ClientMessage message);
    bool identified(SessionId id, v1::Identify identify);
    // Calls `call(peer)` for each peer; one may end or be added meanwhile.
    template <typename Call>
    void for_each(const Call& call) {
        for (SessionId after = 0;;) {
            const auto next = peers.upper_bound(after);
            if (next == peers.end()) return;
            after = next->first;
            if (const auto peer = next->second.lock()) call(*peer);
        }
    }

    std::shared_ptr<Peer> find(SessionId id) const {
        const auto found = peers.find(id);
        return found == peers.end() ? nullptr : found->second.lock();
    }

private:
    SessionId keep(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Place>& place);
    void make_room_for_stranger(const Place& place);
    unsigned most_clients_of(const Place& place) const;  // 0: no limit of its address

    SessionId next_id_ = 1;
    std::deque<SessionId> strangers_;  // of `peers`, the oldest first
    std::optional<Demand> told_;
    std::map<std::string, int> clients_by_transport_;
};

}  // namespace gonio
