// What all connections of the HTTP server share. Lives on the net thread alone; knows no sockets.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"
#include "server/http/auth_guard.h"
#include "server/http/blobs.h"
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

// A connection that lives longer than one request.
class Peer {
public:
    virtual ~Peer() = default;
    virtual void on_reply(v1::ServerMessage) {}  // NOLINT(performance-unnecessary-value-param): others keep it
    virtual void on_state_published() {}
    virtual void on_state_changed(const SharedMessage&) {}
    virtual void on_video_config() {}  // VideoConfigs::of() its lane may be another now, or it is in another lane
    virtual void on_h264(const std::shared_ptr<const EncodedFrame>&, bool /*final*/, VideoGate::Verdict) {}
    virtual void on_jpeg(const std::shared_ptr<const EncodedFrame>&) {}
    virtual void on_shutdown() = 0;   // says goodbye where it can and ends
    virtual void on_crowded_out() {}  // another came in instead before it identified
    // Other tokens are asked for now: who shows none of them ends.
    virtual void on_tokens() {}
    // Result: of messages or an answer that wait or are being written; video is counted by SessionRegistry::lanes.
    virtual std::size_t waiting_bytes() const { return 0; }
};

// How many there are of each address.
class AddressCounts {
public:
    void add(const std::string& address) {
        ++all_;
        ++of_[address];
    }
    // One less, of those that were added.
    void take(const std::string& address) {
        --all_;
        if (--of_.at(address) == 0) of_.erase(address);
    }
    unsigned of(const std::string& address) const;
    unsigned all() const { return all_; }

private:
    unsigned all_ = 0;
    std::map<std::string, unsigned> of_;  // only those that have some
};

// That the limits let a connection in, which counts until the last owner is gone.
class Admission {
public:
    // address: as the limits tell clients apart; local: loopback.
    Admission(AddressCounts& connections, std::string address, bool local);
    ~Admission() { connections_.take(address_); }
    Admission(const Admission&) = delete;
    Admission& operator=(const Admission&) = delete;
    const std::string& address() const { return address_; }
    bool local() const { return local_; }

private:
    AddressCounts& connections_;
    std::string address_;
    bool local_;
};

// What clients must show, and who showed wrong tokens too often.
struct Access {
    Tokens tokens;
    AuthGuard guard;
    std::shared_ptr<TlsContext> tls;  // null: plain HTTP

    // Result: how long the address is not answered; zero: it is.
    std::chrono::seconds blocked(const Admission& admission) const;
    void failed(const Admission& admission) { guard.failed(admission.address(), std::chrono::steady_clock::now()); }
};

// Whether pictures come.
struct Readiness {
    bool ready = false;
    std::atomic<std::chrono::steady_clock::time_point> came_by{};  // the render thread, last; any thread

    // Result: a sentence; null where they come. stuck: how long the render thread may stay away.
    const char* why_not(std::chrono::milliseconds stuck) const;
};

// What the encoders make.
class VideoConfigs {
public:
    explicit VideoConfigs(std::string encoder) : encoder_(std::move(encoder)) {}
    bool has_h264() const { return encoder_ != "mjpeg"; }
    void stop_h264() { encoder_ = "mjpeg"; }
    void put(LaneId lane, v1::VideoConfig config);
    // Result: for a viewer of this lane; of a lane that has no encoder yet what others make.
    v1::VideoConfig of(LaneId lane) const;
    const std::string& newest_encoder() const;  // of the last stream; before it the one that the server began with

private:
    std::string encoder_;
    std::map<LaneId, v1::VideoConfig> of_;
    v1::VideoConfig newest_;
};

struct MjpegClients {
    unsigned all = 0, takers = 0;                // takers: took the last part
    std::shared_ptr<const EncodedFrame> newest;  // kept while a client is there

    void leave() {
        if (--all == 0) newest = nullptr;
    }
};

// What the HTTP server does for its sessions.
struct ServerCalls {
    std::function<void(Lanes::Time)> wake_at;            // calls update_demand() then
    std::function<void(std::function<void()>)> on_disk;  // runs the call on the disk thread
};

class SessionRegistry {
public:
    SessionRegistry(const HttpOptions& given, HttpServer::Callbacks callbacks, ServerCalls its_calls);

    const HttpOptions options;  // as given: tokens and encoder may be others by now
    const ServerCalls calls;
    Access access;
    Readiness readiness;
    VideoConfigs video;
    Lanes lanes;
    MjpegClients mjpeg;
    UpdateClock updates;
    std::optional<v1::State> state;
    std::shared_ptr<const Blobs> blobs = std::make_shared<const Blobs>();
    std::atomic<std::uint32_t> packets_sent = 0;
    bool stopping = false;
    std::uint32_t reconnect_after_ms = 0;  // of the Goodbye

    // Result: null where the limits have no room for a connection of this address.
    std::shared_ptr<const Admission> admit(const std::string& address, bool local);
    // Result: the id of a new client; 0 at a limit of clients.
    SessionId add(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Admission>& admission);
    // Result: the id of a socket that has not identified. It takes no client's room; there is as much for
    // such, and where it is taken the oldest (of the same address, where that has its share) goes. 0: stopping.
    SessionId add_stranger(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Admission>& admission);
    // id: of add_stranger(). Result: whether it is a client now; false at a limit of clients.
    bool make_client(SessionId id);
    void remove(SessionId id);
    bool full() const { return peers_.size() - strangers_.size() >= options.limits.clients; }
    // Whether the address has as many clients as it may.
    bool full_for(const Admission& admission) const;
    // Whether clients of this address wait for more than four times HttpLimits::queued_bytes; sixteen times, of an
    // address that has no limit of its own. No further stills are begun for them then.
    bool too_much_waits_for(const Admission& admission) const;
    // One more or less that is connected; that is Ready, or takes MJPEG.
    void count_clients(const char* transport, int change);
    void count_served(bool more) { more ? ++served_ : --served_; }
    void count_rejected(const char* reason);
    void count_answer(unsigned status);
    // Tells the daemon what is wanted if that changed. Call after everything that may change it.
    void update_demand();
    void publish_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final);
    // Tells those that were moved to another lane.
    void tell_moved();
    // Result: false where the render queue is full.
    bool request(SessionId id, v1::ClientMessage message);
    bool identified(SessionId id, v1::Identify identify);
    // Calls `call(peer)` for each peer; one may end or be added meanwhile.
    template <typename Call>
    void for_each(const Call& call) const {
        for (SessionId after = 0;;) {
            const auto next = peers_.upper_bound(after);
            if (next == peers_.end()) return;
            after = next->first;
            if (const auto peer = next->second.peer.lock()) call(*peer);
        }
    }

    // Result: null where it has gone.
    std::shared_ptr<Peer> find(SessionId id) const {
        const auto found = peers_.find(id);
        return found == peers_.end() ? nullptr : found->second.peer.lock();
    }
    bool empty() const { return peers_.empty(); }

private:
    SessionId keep(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Admission>& admission);
    void make_room_for_stranger(const Admission& admission);
    unsigned most_clients_of(const Admission& admission) const;  // 0: no limit of its address

    HttpServer::Callbacks callbacks_;
    struct Member {
        std::weak_ptr<Peer> peer;
        std::shared_ptr<const Admission> admission;
    };
    std::map<SessionId, Member> peers_;
    AddressCounts connections_, clients_;
    unsigned served_ = 0;
    SessionId next_id_ = 1;
    std::deque<SessionId> strangers_;  // of `peers_`, the oldest first
    std::optional<Demand> told_;
    std::map<std::string, int> clients_by_transport_;
};

}  // namespace gonio
