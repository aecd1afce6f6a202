// What all connections of the front share. Lives on the net thread alone; knows no sockets.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/net/front.h"

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
    virtual void on_reply(v1::ServerMessage) {}
    virtual void on_state_published() {}
    virtual void on_state_changed(const SharedMessage&) {}
    virtual void on_video_config() {}  // Hub::video_config() of its lane may be another now
    virtual void on_moved() {}         // to another lane
    virtual void on_h264(const std::shared_ptr<const EncodedFrame>&, bool /*final*/, VideoGate::Verdict) {}
    virtual void on_jpeg(const std::shared_ptr<const EncodedFrame>&) {}
    virtual void on_shutdown() = 0;  // says goodbye where it can and ends
};

struct Hub {
    explicit Hub(const FrontOptions& front)
        : options(front), lanes({.private_lanes = front.private_lanes, .key_interval = front.limits.key_interval}) {}

    FrontOptions options;
    Front::Callbacks callbacks;
    std::map<SessionId, std::weak_ptr<Peer>> peers;
    unsigned connections = 0;
    unsigned clients = 0;                          // that are Ready, or take MJPEG
    unsigned mjpeg_clients = 0, mjpeg_takers = 0;  // takers: took the last part
    std::optional<v1::State> state;
    Lanes lanes;
    std::map<LaneId, v1::VideoConfig> streams;  // what the encoder of each lane makes
    v1::VideoConfig newest_stream;
    std::function<void(Lanes::Time)> wake_at;       // calls update_demand() then
    std::shared_ptr<const EncodedFrame> last_jpeg;  // kept while an MJPEG client is there
    std::atomic<std::uint32_t> packets_sent = 0;
    bool stopping = false;
    std::uint32_t reconnect_after_ms = 0;  // of the Goodbye

    // Result: the id of a new client; 0 at the limit of clients.
    SessionId add(const std::shared_ptr<Peer>& peer);
    void remove(SessionId id);
    bool full() const { return peers.size() >= options.limits.clients; }
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
    SessionId next_id_ = 1;
    std::optional<Demand> told_;
};

// Result: whether both are equal, in a time that depends on the length of `given` only.
bool equal_in_constant_time(std::string_view given, std::string_view secret);

}  // namespace gonio
