#include "server/http/session_registry.h"

#include <algorithm>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/session.pb.h"

namespace gonio {

using Clock = std::chrono::steady_clock;

std::shared_ptr<const std::string> SharedMessage::bytes(Encoding encoding) const {
    auto& encoded = encoding == Encoding::proto ? proto_ : json_;
    if (!encoded) {
        std::string bytes = encode_message(encoding, message_);
        if (encoding == Encoding::proto) bytes.insert(bytes.begin(), static_cast<char>(1));
        encoded = std::make_shared<const std::string>(std::move(bytes));
    }
    return encoded;
}

unsigned AddressCounts::of(const std::string& address) const {
    const auto found = of_.find(address);
    return found == of_.end() ? 0 : found->second;
}

Admission::Admission(AddressCounts& connections, std::string address, bool local)
    : connections_(connections), address_(std::move(address)), local_(local) {
    connections_.add(address_);
}

std::chrono::seconds Access::blocked(const Admission& admission) const {
    return tokens.asked() ? guard.blocked(admission.address(), Clock::now()) : std::chrono::seconds(0);
}

const char* Readiness::why_not(std::chrono::milliseconds stuck) const {
    if (!ready) return "No pictures come now.";
    return Clock::now() - came_by.load() > stuck ? "The renderer does not answer." : nullptr;
}

void VideoConfigs::put(LaneId lane, v1::VideoConfig config) {
    newest_ = config;
    of_[lane] = std::move(config);
}

v1::VideoConfig VideoConfigs::of(LaneId lane) const {
    v1::VideoConfig config;
    if (!has_h264()) {
        config.set_encoder(encoder_);
        return config;
    }
    const auto own = of_.find(lane);
    config = own == of_.end() ? newest_ : own->second;
    config.set_lane(lane_kind(lane));
    return config;
}

const std::string& VideoConfigs::newest_encoder() const {
    return has_h264() && !newest_.encoder().empty() ? newest_.encoder() : encoder_;
}

SessionRegistry::SessionRegistry(const HttpOptions& given, HttpServer::Callbacks callbacks, ServerCalls its_calls)
    : options(given),
      calls(std::move(its_calls)),
      access{given.tokens, AuthGuard(given.limits.auth_failures), nullptr},
      video(given.encoder),
      lanes({.private_lanes = given.private_lanes, .key_interval = given.limits.key_interval}),
      callbacks_(std::move(callbacks)) {}

unsigned SessionRegistry::most_clients_of(const Admission& admission) const {
    return admission.local() ? options.limits.local_clients : options.limits.clients_per_address;
}

bool SessionRegistry::full_for(const Admission& admission) const {
    const unsigned most = most_clients_of(admission);
    return most > 0 && clients_.of(admission.address()) >= most;
}

std::shared_ptr<const Admission> SessionRegistry::admit(const std::string& address, bool local) {
    const HttpLimits& limits = options.limits;
    const unsigned most = local ? limits.local_connections : limits.connections_per_address;
    if (connections_.all() >= limits.connections || (most > 0 && connections_.of(address) >= most)) return nullptr;
    return std::make_shared<const Admission>(connections_, address, local);
}

void SessionRegistry::count_clients(const char* transport, int change) {
    const int now = clients_by_transport_[transport] += change;
    options.metrics->gauge("clients", "Clients that are connected.", label("transport", transport)).set(now);
}

void SessionRegistry::count_rejected(const char* reason) {
    options.metrics->counter("ws_rejected_total", "WebSocket clients that were turned away.", label("reason", reason))
        .add();
}

void SessionRegistry::count_answer(unsigned status) {
    options.metrics
        ->counter("http_requests_total", "Requests, by the status of their answer.",
                  label("code", std::to_string(status)))
        .add();
}

SessionId SessionRegistry::add(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Admission>& admission) {
    if (full() || full_for(*admission) || stopping) return 0;
    clients_.add(admission->address());
    return keep(peer, admission);
}

SessionId SessionRegistry::add_stranger(const std::shared_ptr<Peer>& peer,
                                        const std::shared_ptr<const Admission>& admission) {
    if (stopping) return 0;
    make_room_for_stranger(*admission);
    return strangers_.emplace_back(keep(peer, admission));
}

bool SessionRegistry::make_client(SessionId id) {
    const Admission& admission = *peers_.at(id).admission;
    if (full() || full_for(admission)) return false;
    std::erase(strangers_, id);
    clients_.add(admission.address());
    return true;
}

void SessionRegistry::make_room_for_stranger(const Admission& admission) {
    const auto is_neighbour = [&](SessionId id) { return peers_.at(id).admission->address() == admission.address(); };
    const unsigned most = most_clients_of(admission);
    auto leaves = strangers_.end();
    if (most > 0 && std::count_if(strangers_.begin(), strangers_.end(), is_neighbour) >= most)
        leaves = std::find_if(strangers_.begin(), strangers_.end(), is_neighbour);
    else if (strangers_.size() >= options.limits.clients)
        leaves = strangers_.begin();
    if (leaves == strangers_.end()) return;
    const auto peer = find(*leaves);
    remove(*leaves);
    count_rejected("unidentified");
    if (peer) peer->on_crowded_out();
}

SessionId SessionRegistry::keep(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Admission>& admission) {
    while (next_id_ == 0 || peers_.contains(next_id_)) ++next_id_;
    peers_[next_id_] = {peer, admission};
    return next_id_++;
}

bool SessionRegistry::too_much_waits_for(const Admission& admission) const {
    std::size_t sum = 0;
    for (const auto& [id, member] : peers_)
        if (const auto peer = member.peer.lock(); peer && member.admission->address() == admission.address())
            sum += peer->waiting_bytes();
    return sum >= (most_clients_of(admission) > 0 ? 4 : 16) * options.limits.queued_bytes;
}

void SessionRegistry::remove(SessionId id) {
    const auto member = peers_.find(id);
    if (member == peers_.end()) return;
    if (lanes.watches(id)) lanes.leave(id, Clock::now());
    if (std::erase(strangers_, id) == 0) clients_.take(member->second.admission->address());
    peers_.erase(member);
    if (!stopping && callbacks_.closed) callbacks_.closed(id);
    tell_moved();
    update_demand();
}

void SessionRegistry::publish_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final) {
    for (const auto& [id, verdict] : lanes.published(frame->lane, frame->key, Clock::now()))
        if (const auto peer = find(id)) peer->on_h264(frame, final, verdict);
    tell_moved();
    update_demand();
}

void SessionRegistry::tell_moved() {
    for (const SessionId id : lanes.take_moved())
        if (const auto peer = find(id)) peer->on_video_config();
}

void SessionRegistry::update_demand() {
    if (stopping) return;
    const auto now = Clock::now();
    Demand demand;
    demand.lanes = lanes.requests(now);
    demand.jpeg = mjpeg.takers > 0;
    demand.jpeg_clients = mjpeg.all;
    demand.clients = served_;
    const auto due = lanes.due(now);
    if (due && calls.wake_at) calls.wake_at(*due);
    if (told_ == demand) return;
    told_ = demand;
    if (callbacks_.demand) callbacks_.demand(demand);
}

bool SessionRegistry::request(SessionId id, v1::ClientMessage message) {
    return !stopping && callbacks_.request && callbacks_.request(id, std::move(message));
}

bool SessionRegistry::identified(SessionId id, v1::Identify identify) {
    identify.clear_token();
    return !stopping && (!callbacks_.identified || callbacks_.identified(id, std::move(identify)));
}

}  // namespace gonio
