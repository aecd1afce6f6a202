#include "server/net/hub.h"

namespace gonio {

using Clock = std::chrono::steady_clock;

std::shared_ptr<const std::string> SharedMessage::bytes(Encoding encoding) const {
    auto& slot = encoding == Encoding::proto ? proto_ : json_;
    if (!slot) {
        std::string bytes = encode_message(encoding, message_);
        if (encoding == Encoding::proto) bytes.insert(bytes.begin(), static_cast<char>(1));
        slot = std::make_shared<const std::string>(std::move(bytes));
    }
    return slot;
}

SessionId Hub::add(const std::shared_ptr<Peer>& peer) {
    if (full() || stopping) return 0;
    while (next_id_ == 0 || peers.contains(next_id_)) ++next_id_;
    peers[next_id_] = peer;
    return next_id_++;
}

void Hub::remove(SessionId id) {
    if (peers.erase(id) == 0) return;
    if (lanes.watches(id)) lanes.leave(id, Clock::now());
    if (!stopping && callbacks.closed) callbacks.closed(id);
    tell_moved();
    update_demand();
}

v1::VideoConfig Hub::video_config(LaneId lane) const {
    v1::VideoConfig config;
    if (!has_h264()) {
        config.set_encoder(options.encoder);
        return config;
    }
    const auto own = streams.find(lane);
    config = own == streams.end() ? newest_stream : own->second;
    config.set_lane(lane_kind(lane));
    return config;
}

void Hub::publish_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final) {
    for (const auto& [id, verdict] : lanes.published(frame->lane, frame->key, Clock::now()))
        if (const auto peer = find(id)) peer->on_h264(frame, final, verdict);
    tell_moved();
    update_demand();
}

void Hub::tell_moved() {
    for (const SessionId id : lanes.take_moved())
        if (const auto peer = find(id)) peer->on_moved();
}

void Hub::update_demand() {
    if (stopping) return;
    const auto now = Clock::now();
    Demand demand;
    demand.lanes = lanes.wishes(now);
    for (const LaneWish& wish : demand.lanes) {
        demand.h264 |= wish.credit > 0;
        demand.key |= wish.key;
    }
    demand.jpeg = mjpeg_takers > 0;
    demand.jpeg_clients = mjpeg_clients;
    demand.clients = clients;
    const auto due = lanes.due(now);
    if (due && wake_at) wake_at(*due);
    if (told_ == demand) return;
    told_ = demand;
    if (callbacks.demand) callbacks.demand(demand);
}

bool Hub::request(SessionId id, v1::ClientMessage message) {
    return !stopping && callbacks.request && callbacks.request(id, std::move(message));
}

bool Hub::identified(SessionId id, v1::Identify identify) {
    identify.clear_token();
    return !stopping && (!callbacks.identified || callbacks.identified(id, std::move(identify)));
}

bool equal_in_constant_time(std::string_view given, std::string_view secret) {
    volatile unsigned difference = given.size() == secret.size() ? 0 : 1;
    for (std::size_t i = 0; i < given.size(); ++i) {
        const auto a = static_cast<unsigned char>(given[i]);
        const auto b = static_cast<unsigned char>(secret.empty() ? 0 : secret[i % secret.size()]);
        difference = difference | (a ^ b);
    }
    return difference == 0;
}

}  // namespace gonio
