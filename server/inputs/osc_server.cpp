#include "server/inputs/osc_server.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "protocol/schema/console.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/base/clock.h"

namespace gonio {
namespace {

constexpr std::size_t kBundleBytes = 1400;  // feedback stays within one Ethernet frame

std::int64_t wall_clock_ns() {
    return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

// Result: about how many bytes the values are as messages.
std::size_t bytes_of(const OscValues& values) {
    std::size_t bytes = 0;
    for (const auto& [address, arguments] : values) bytes += address.size() + 16 * arguments.size() + 8;
    return bytes;
}

// Takes the entry with the earliest time out of a map that is full.
template <typename Map, typename Time>
void make_room(Map& map, std::size_t most, const Time& time_of) {
    if (map.size() < most) return;
    map.erase(std::min_element(map.begin(), map.end(),
                               [&](const auto& a, const auto& b) { return time_of(a.second) < time_of(b.second); }));
}

}  // namespace

Result<std::unique_ptr<OscServer>> OscServer::open(const UdpPeer& at, Watch& watch, Set set, bool eos) {
    std::unique_ptr<OscServer> server(new OscServer(watch, std::move(set), eos));
    // Any free port must be free in both: a few are tried.
    for (int attempt = 0; !server->listener_; ++attempt) {
        auto udp = open_udp(at);
        if (!udp) return udp.error();
        auto tcp = open_tcp({at.ip, bound_to(*udp).port});
        if (!tcp && (at.port != 0 || attempt == 8)) return tcp.error();
        if (!tcp) continue;
        server->udp_ = std::move(*udp);
        server->listener_ = std::move(*tcp);
    }
    server->endpoint_.at = bound_to(server->udp_);
    watch.add(server->udp_.fd(), [server = server.get()](std::uint32_t) { server->receive(); });
    watch.add(server->listener_.fd(), [server = server.get()](std::uint32_t) { server->accept_connections(); });
    return server;
}

OscServer::~OscServer() {
    if (udp_) watch_.remove(udp_.fd());
    if (listener_) watch_.remove(listener_.fd());
    while (!connections_.empty()) close_connection(connections_.begin()->first);
}

void OscServer::receive() {
    for (const Datagram& datagram : receiver_.receive(udp_, endpoint_.drops[udp_.fd()]))
        take(datagram.bytes, {false, datagram.from});
}

void OscServer::accept_connections() {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    Descriptor socket(
        accept4(listener_.fd(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)) {
        // The caller stays in the kernel's queue and the listener ready: without a pause this thread would do nothing
        // else.
        endpoint_.last_error = std::string("cannot accept a connection: ") + std::strerror(errno);
        watch_.change(listener_.fd(), 0);
        accept_again_ns_ = monotonic_ns() + kOscPause_ns;
        return;
    }
    if (!socket || connections_.size() >= kMaxOscConnections) return;  // closed with `socket`
    const int fd = socket.fd();
    set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
    // A client that was switched off says nothing: without these its room would be taken for ever.
    set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
    set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, 30);   // s
    set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, 10);  // s
    set_option(socket, IPPROTO_TCP, TCP_KEEPCNT, 3);
    set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, 60'000);  // ms, of what it does not acknowledge
    Connection& connection = connections_[fd];
    connection.heard_ns = monotonic_ns();
    connection.client = {true, {ntohl(address.sin_addr.s_addr), ntohs(address.sin_port)}};
    connection.socket = std::move(socket);
    watch_.add(fd, [this, fd](std::uint32_t events) { serve_connection(fd, events); });
}

void OscServer::close_connection(int fd) {
    const auto found = connections_.find(fd);
    if (found == connections_.end()) return;
    watch_.remove(fd);
    const OscClient client = found->second.client;
    subscribers_.erase(client);
    connections_.erase(found);
    // What it wanted to be told at a later time is told to nobody; what it set for then counts.
    std::erase_if(scheduled_, [&](const auto& one) {
        const auto& [from, message] = one.second;
        const bool cue = message.address.starts_with("/gonio/cue/");
        return from == client && !cue && (message.arguments.empty() || message.address.starts_with("/gonio/"));
    });
}

bool OscServer::is_connected(const OscClient& client) const {
    return std::any_of(connections_.begin(), connections_.end(),
                       [&](const auto& one) { return one.second.client == client; });
}

// Whether an answer may be sent: whoever forges an address on UDP shall not make this machine a hose.
bool OscServer::may_answer(const OscClient& to, std::size_t bytes) {
    if (to.tcp) return true;
    const auto now = std::chrono::steady_clock::now();
    if (!answers_of_.contains(to.peer.ip))
        make_room(answers_of_, kMaxOscClients, [](const TokenBucket& bucket) { return bucket.asked(); });
    TokenBucket& own = answers_of_.try_emplace(to.peer.ip, kOscAddressBytes, kOscAddressBytes).first->second;
    const auto count = static_cast<double>(bytes);
    return own.take_whole(now, count) && answers_.take_whole(now, count);
}

void OscServer::serve_connection(int fd, std::uint32_t events) {
    const auto found = connections_.find(fd);
    if (found == connections_.end()) return;
    Connection& connection = found->second;
    if ((events & EPOLLOUT) != 0 && !flush(connection)) return close_connection(fd);
    if ((events & (EPOLLIN | EPOLLHUP | EPOLLERR)) == 0) return;
    std::array<std::uint8_t, 16384> buffer;
    const ssize_t size = recv(fd, buffer.data(), buffer.size(), 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size <= 0) return close_connection(fd);
    const auto packets = connection.stream.feed(Bytes(buffer).first(static_cast<std::size_t>(size)));
    if (!packets) {
        endpoint_.bad_packet(packets.error());
        return close_connection(fd);
    }
    const OscClient client = connection.client;
    if (!packets->empty()) connection.heard_ns = monotonic_ns();
    for (const auto& packet : *packets) take(packet, client);  // may close the connection
}

// Result: false where the connection is to be closed.
bool OscServer::flush(Connection& connection) {
    while (!connection.unsent.empty()) {
        const ssize_t size =
            ::send(connection.socket.fd(), connection.unsent.data(), connection.unsent.size(), MSG_NOSIGNAL);
        if (size < 0) {
            if (errno != EAGAIN && errno != EINTR) return false;
            break;
        }
        connection.unsent.erase(connection.unsent.begin(), connection.unsent.begin() + size);
    }
    watch_.change(connection.socket.fd(), connection.unsent.empty() ? EPOLLIN : EPOLLIN | EPOLLOUT);
    return connection.unsent.size() <= kMaxOscUnsent;
}

void OscServer::send(const OscClient& to, const UdpPeer& udp, const std::vector<std::uint8_t>& packet) {
    if (!to.tcp) return send_datagram(udp_, udp, packet);
    for (auto& [fd, connection] : connections_) {
        if (connection.client != to) continue;
        const std::vector<std::uint8_t> framed = connection.stream.frame(packet);
        connection.unsent.insert(connection.unsent.end(), framed.begin(), framed.end());
        // A client that has gone or does not read is closed when its socket is next served: not here, where callers
        // walk the lists of connections and subscribers.
        if (!flush(connection)) shutdown(fd, SHUT_RDWR);
        return;
    }
}

void OscServer::send_values(const OscClient& to, const UdpPeer& udp, const OscValues& values) {
    std::vector<OscMessage> messages;
    std::size_t bytes = 0;
    const auto send_off = [&] {
        if (messages.size() == 1) send(to, udp, encode_osc(messages[0]));
        if (messages.size() > 1) send(to, udp, encode_osc_bundle(messages));
        messages.clear();
        bytes = 0;
    };
    for (const auto& [address, arguments] : values) {
        OscMessage message{kOscImmediately, address, arguments};
        const std::size_t size = encode_osc(message).size() + 4;
        if (bytes + size > kBundleBytes) send_off();
        messages.push_back(std::move(message));
        bytes += size;
    }
    send_off();
}

void OscServer::take(Bytes packet, const OscClient& from) {
    const std::int64_t now_ns = monotonic_ns();
    ++endpoint_.packets;
    pattern_budget_ = kOscPatternBudget;
    auto messages = decode_osc(packet);
    if (!rows_.contains(from)) make_room(rows_, kMaxOscClients, [](const Row& row) { return row.heard_ns; });
    Row& row = rows_[from];
    ++row.packets;
    row.heard_ns = now_ns;
    row.rate.count(now_ns);
    if (!messages) return endpoint_.bad_packet(messages.error());
    if (const auto subscriber = subscribers_.find(from); subscriber != subscribers_.end())
        subscriber->second.until_ns = now_ns + kOscLease_ns;
    for (OscMessage& message : *messages) {
        row.last = message.address;
        const auto wall_ns = osc_wall_ns(message.time_tag);
        const std::int64_t ahead_ns = wall_ns ? *wall_ns - wall_clock_ns() : 0;
        if (ahead_ns <= 0) {
            act(message, from, now_ns);
        } else if (ahead_ns > kOscFarthest_ns) {
            refuse(from, message.address,
                   {"invalid_argument", message.address, "",
                    "its time tag lies " + print_number(std::ceil(static_cast<double>(ahead_ns) * 1e-9)) +
                        " s ahead, and a message waits for 60 s at most: do both clocks show the same time?"});
        } else if (scheduled_.size() >= kMaxOscScheduled) {
            refuse(from, message.address,
                   {"busy", message.address, "", "1,024 messages wait for the time of their tags already"});
        } else if (const std::size_t size = encode_osc(message).size(); size > kMaxOscScheduledBytes) {
            refuse(from, message.address,
                   {"too_large", message.address, std::to_string(size) + " bytes",
                    "a message that waits for its time has at most 2,048 bytes"});
        } else {
            scheduled_.emplace(now_ns + ahead_ns, std::pair(from, std::move(message)));
        }
    }
}

void OscServer::act(const OscMessage& message, const OscClient& from, std::int64_t now_ns) {
    const auto action = osc_action(message, eos_);
    if (!action) return refuse(from, message.address, action.error());
    if (std::holds_alternative<OscNothing>(*action)) return;
    if (const auto* ping = std::get_if<OscPing>(&*action)) {
        const std::vector<std::uint8_t> pong = encode_osc({kOscImmediately, ping->pong, message.arguments});
        if (may_answer(from, pong.size())) send(from, from.peer, pong);
    } else if (std::holds_alternative<OscUnsubscribe>(*action)) {
        subscribers_.erase(from);
    } else if (const auto* request = std::get_if<OscSubscribe>(&*action)) {
        subscribe(*request, message, from, now_ns);
    } else if (std::holds_alternative<OscQuery>(*action)) {
        const auto selected = osc_select(values(), message.address, pattern_budget_);
        if (!selected) return refuse(from, message.address, selected.error());
        if (selected->empty())
            return refuse(from, message.address, {"not_found", message.address, "", "there is no such value"});
        // To who has not subscribed, and may be somebody else: not much more than was asked.
        const bool amplifies = !from.tcp && !subscribers_.contains(from) &&
                               bytes_of(*selected) > kOscAmplification * encode_osc(message).size();
        if (amplifies || !may_answer(from, bytes_of(*selected)))
            return refuse(from, message.address, {"busy", message.address, "", "too much is asked for, or too often"});
        send_values(from, from.peer, *selected);
    } else {
        const auto subscriber = subscribers_.find(from);
        if (subscriber != subscribers_.end() && !is_osc_pattern(message.address)) {
            subscriber->second.sent[message.address] = message.arguments;
            subscriber->second.guarded_until_ns[message.address] = now_ns + kOscEchoGuard_ns;
            feedback_due_ = true;
            if (subscriber->second.sent.size() > 2 * values().size() + 64) {  // addresses of nothing are not kept
                subscriber->second.sent.clear();
                subscriber->second.guarded_until_ns.clear();
            }
        }
        if (!set_(from, message.address, std::get<OscSet>(*action)))
            refuse(from, message.address, {"busy", message.address, "", "too many messages wait for the renderer"});
    }
}

void OscServer::subscribe(const OscSubscribe& request, const OscMessage& message, const OscClient& from,
                          std::int64_t now_ns) {
    if (from.tcp && !is_connected(from)) return;  // it closed before its time tag
    if (!subscribers_.contains(from) && subscribers_.size() >= kMaxOscSubscribers)
        return refuse(from, message.address, {"busy", message.address, "", "there are 32 subscribers already"});
    const UdpPeer to = {from.peer.ip, request.port.value_or(from.peer.port)};
    const auto known = subscribers_.find(from);
    const bool told =
        known != subscribers_.end() && known->second.to == to && now_ns - known->second.told_ns < kOscRetell_ns;
    if (!told && !may_answer(from, bytes_of(values())))
        return refuse(from, message.address, {"busy", message.address, "", "too many answers are asked for"});
    Subscriber& subscriber = subscribers_[from];
    subscriber.to = to;
    subscriber.until_ns = now_ns + kOscLease_ns;
    if (told) return;
    subscriber.told_ns = now_ns;
    eos_said_.clear();        // likewise
    subscriber.sent.clear();  // everything is told anew
    subscriber.guarded_until_ns.clear();
    feedback_due_ = true;
}

void OscServer::refuse(const OscClient& to, const std::string& address, const Error& error) {
    ++endpoint_.refused;
    endpoint_.last_error = error.text();
    // Only who subscribed is told, and never about our own kind of message: two servers must not complain to each
    // other.
    const auto subscriber = subscribers_.find(to);
    if (subscriber == subscribers_.end() || address.starts_with("/gonio/")) return;
    const auto packet = encode_osc({kOscImmediately, "/gonio/error", {error.code, address, error.message}});
    if (may_answer(to, packet.size())) send(to, subscriber->second.to, packet);
}

void OscServer::publish_state(v1::State state) {
    state_ = std::move(state);
    values_stale_ = true;
    feedback_due_ = feedback_due_ || !subscribers_.empty();
}

const OscValues& OscServer::values() {
    if (values_stale_) values_ = osc_values(state_);
    values_stale_ = false;
    return values_;
}

void OscServer::send_feedback(std::int64_t now_ns) {
    feedback_due_ = false;
    fed_back_ns_ = now_ns;
    for (auto& [client, subscriber] : subscribers_) {
        OscValues news;
        for (const auto& [address, arguments] : values()) {
            const auto guard = subscriber.guarded_until_ns.find(address);
            if (guard != subscriber.guarded_until_ns.end()) {
                if (guard->second > now_ns) {
                    feedback_due_ = true;  // looked at again later
                    continue;
                }
                subscriber.guarded_until_ns.erase(guard);
            }
            const auto sent = subscriber.sent.find(address);
            if (sent != subscriber.sent.end() && sent->second == arguments) continue;
            subscriber.sent[address] = arguments;
            news.emplace(address, arguments);
        }
        send_values(client, subscriber.to, news);
    }
}

// Of a cue that begins or is next at once, of its progress once a second, to all subscribers.
void OscServer::send_eos(std::int64_t now_ns) {
    OscValues now = eos_values(state_);
    const auto names = [](const OscValues& values) {
        std::vector<std::pair<std::string, std::vector<OscArgument>>> told;
        for (const auto& [address, arguments] : values)
            told.emplace_back(address, address.ends_with("/text") ? arguments : std::vector<OscArgument>());
        return told;
    };
    if (now == eos_said_ || (now_ns - eos_said_ns_ < kEosEvery_ns && names(now) == names(eos_said_))) return;
    eos_said_ns_ = now_ns;
    eos_said_ = std::move(now);
    for (const auto& [client, subscriber] : subscribers_) send_values(client, subscriber.to, eos_said_);
}

std::int64_t OscServer::tick(std::int64_t now_ns) {
    pattern_budget_ = kOscPatternBudget;
    while (!scheduled_.empty() && scheduled_.begin()->first <= now_ns) {
        const auto [from, message] = std::move(scheduled_.begin()->second);
        scheduled_.erase(scheduled_.begin());
        act(message, from, now_ns);
    }
    std::erase_if(subscribers_, [&](const auto& one) { return !one.first.tcp && one.second.until_ns <= now_ns; });
    std::erase_if(rows_, [&](const auto& one) { return now_ns - one.second.heard_ns > kSourceRow_ns; });
    for (auto& [fd, connection] : connections_)  // closed when next served: not here, inside their list
        if (now_ns - connection.heard_ns > kOscIdle_ns && !subscribers_.contains(connection.client))
            shutdown(fd, SHUT_RDWR);
    if (accept_again_ns_ != 0 && now_ns >= accept_again_ns_) {
        accept_again_ns_ = 0;
        watch_.change(listener_.fd(), EPOLLIN);
    }
    if (feedback_due_ && now_ns - fed_back_ns_ >= kOscFeedback_ns) send_feedback(now_ns);
    if (eos_ && !subscribers_.empty()) send_eos(now_ns);
    std::int64_t next_ns = now_ns + 1'000'000'000;
    if (!scheduled_.empty()) next_ns = std::min(next_ns, scheduled_.begin()->first);
    if (feedback_due_) next_ns = std::min(next_ns, fed_back_ns_ + kOscFeedback_ns);
    return next_ns;
}

void OscServer::describe(v1::Sources& table, std::int64_t now_ns) const {
    endpoint_.describe(table, "osc");
    for (const auto& [client, seen] : rows_) {
        v1::SourceRow& row = *table.add_sources();
        row.set_protocol("osc");
        row.set_name(seen.last);
        row.set_address(print_peer(client.peer) + (client.tcp ? " tcp" : ""));
        row.set_rate_hz(seen.rate.per_second(now_ns));
        row.set_packets(seen.packets);
        row.set_state(subscribers_.contains(client) ? "subscribed" : "live");
        row.set_age_s(seconds_between(seen.heard_ns, now_ns));
    }
}

}  // namespace gonio
