#include "server/http/session_registry.h"

#include <algorithm>

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

namespace {

// One less of a key; those at zero are not kept.
void take_one(std::map<std::string, unsigned>& counts, const std::string& key) {
    const auto found = counts.find(key);
    if (found != counts.end() && --found->second == 0) counts.erase(found);
}

unsigned count_of(const std::map<std::string, unsigned>& counts, const std::string& key) {
    const auto found = counts.find(key);
    return found == counts.end() ? 0 : found->second;
}

}  // namespace

Place::Place(SessionRegistry& registry, std::string address, bool local)
    : registry_(registry), address_(std::move(address)), local_(local) {
    ++registry_.connections;
    ++registry_.connections_of[address_];
}

Place::~Place() {
    --registry_.connections;
    take_one(registry_.connections_of, address_);
}

SessionRegistry::SessionRegistry(const HttpOptions& given, HttpServer::Callbacks given_callbacks)
    : options(given),
      callbacks(std::move(given_callbacks)),
      auth(given.limits.auth_failures),
      lanes({.private_lanes = given.private_lanes, .key_interval = given.limits.key_interval}) {}

unsigned SessionRegistry::most_clients_of(const Place& place) const {
    return place.local() ? options.limits.local_clients : options.limits.clients_per_address;
}

bool SessionRegistry::full_for(const Place& place) const {
    const unsigned most = most_clients_of(place);
    return most > 0 && count_of(clients_of, place.address()) >= most;
}

bool SessionRegistry::room_for_connection(const std::string& address, bool local) const {
    const HttpLimits& limits = options.limits;
    const unsigned most = local ? limits.local_connections : limits.connections_per_address;
    return connections < limits.connections && (most == 0 || count_of(connections_of, address) < most);
}

void SessionRegistry::count_clients(const char* transport, int change) {
    const int now = clients_by_transport_[transport] += change;
    options.metrics->gauge("clients", "Clients that are connected.", label("transport", transport)).set(now);
}

void SessionRegistry::count_rejected(const char* reason) {
    options.metrics->counter("ws_rejected_total", "WebSocket clients that were turned away.", label("reason", reason))
        .add();
}

SessionId SessionRegistry::add(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Place>& place) {
    if (full() || full_for(*place) || stopping) return 0;
    ++clients_of[place->address()];
    return keep(peer, place);
}

SessionId SessionRegistry::add_stranger(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Place>& place) {
    if (stopping) return 0;
    make_room_for_stranger(*place);
    return strangers_.emplace_back(keep(peer, place));
}

bool SessionRegistry::make_client(SessionId id) {
    const Place& place = *place_of.at(id);
    if (full() || full_for(place)) return false;
    std::erase(strangers_, id);
    ++clients_of[place.address()];
    return true;
}

void SessionRegistry::make_room_for_stranger(const Place& place) {
    const auto is_neighbour = [&](SessionId id) { return place_of.at(id)->address() == place.address(); };
    const unsigned most = most_clients_of(place);
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

SessionId SessionRegistry::keep(const std::shared_ptr<Peer>& peer, const std::shared_ptr<const Place>& place) {
    while (next_id_ == 0 || peers.contains(next_id_)) ++next_id_;
    peers[next_id_] = peer;
    place_of[next_id_] = place;
    return next_id_++;
}

bool SessionRegistry::too_much_waits_for(const Place& place) const {
    std::size_t sum = 0;
    for (const auto& [id, session] : peers)
        if (const auto peer = session.lock(); peer && place_of.at(id)->address() == place.address())
            sum += peer->waiting_bytes();
    return sum >= (most_clients_of(place) > 0 ? 4 : 16) * options.limits.queued_bytes;
}

void SessionRegistry::remove(SessionId id) {
    if (peers.erase(id) == 0) return;
    if (lanes.watches(id)) lanes.leave(id, Clock::now());
    const auto place = place_of.find(id);
    if (std::erase(strangers_, id) == 0) take_one(clients_of, place->second->address());
    place_of.erase(place);
    if (!stopping && callbacks.closed) callbacks.closed(id);
    tell_moved();
    update_demand();
}

v1::VideoConfig SessionRegistry::video_config(LaneId lane) const {
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

void SessionRegistry::publish_h264(const std::shared_ptr<const EncodedFrame>& frame, bool final) {
    for (const auto& [id, verdict] : lanes.published(frame->lane, frame->key, Clock::now()))
        if (const auto peer = find(id)) peer->on_h264(frame, final, verdict);
    tell_moved();
    update_demand();
}

void SessionRegistry::tell_moved() {
    for (const SessionId id : lanes.take_moved())
        if (const auto peer = find(id)) peer->on_moved();
}

bool Demand::h264() const {
    return std::any_of(lanes.begin(), lanes.end(), [](const LaneRequest& wish) { return wish.credit > 0; });
}

bool Demand::key() const {
    return std::any_of(lanes.begin(), lanes.end(), [](const LaneRequest& wish) { return wish.key; });
}

void SessionRegistry::update_demand() {
    if (stopping) return;
    const auto now = Clock::now();
    Demand demand;
    demand.lanes = lanes.wishes(now);
    demand.jpeg = mjpeg_takers > 0;
    demand.jpeg_clients = mjpeg_clients;
    demand.clients = clients;
    const auto due = lanes.due(now);
    if (due && wake_at) wake_at(*due);
    if (told_ == demand) return;
    told_ = demand;
    if (callbacks.demand) callbacks.demand(demand);
}

bool SessionRegistry::request(SessionId id, v1::ClientMessage message) {
    return !stopping && callbacks.request && callbacks.request(id, std::move(message));
}

bool SessionRegistry::identified(SessionId id, v1::Identify identify) {
    identify.clear_token();
    return !stopping && (!callbacks.identified || callbacks.identified(id, std::move(identify)));
}

}  // namespace gonio
