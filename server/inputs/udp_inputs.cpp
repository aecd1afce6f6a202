#include "server/inputs/udp_inputs.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <set>
#include <thread>

#include <spdlog/spdlog.h>

#include "protocol/dmx/artnet_sources.h"
#include "protocol/dmx/e131.h"
#include "protocol/dmx/sacn_sources.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/base/clock.h"
#include "server/inputs/watch.h"

namespace gonio {
namespace {

constexpr std::int64_t kTick_ns = 100'000'000;          // how often the passing of time is judged
constexpr std::int64_t kTable_ns = 250'000'000;         // how often a source table is made
constexpr std::int64_t kRejoin_ns = 5'000'000'000;      // a group that could not be joined is tried again
constexpr std::int64_t kInterfaces_ns = 5'000'000'000;  // how often new interfaces are looked for
constexpr unsigned kMaxPolls = 8;  // ArtPolls answered within kTick_ns, as many consoles in one network do not ask
constexpr std::size_t kDatagramBytes = 2048;  // the longest of sACN has 1,144
constexpr std::uint32_t kLimitedBroadcast = 0xFFFFFFFF;

class UdpInputs final : public Inputs {
public:
    UdpInputs(const InputOptions& options, std::function<void()> wake)
        : options_(options), wake_(std::move(wake)), sacn_(options.accept_preview), receiver_(kDatagramBytes) {}
    ~UdpInputs() override {
        stop_ = true;
        nudge();
        if (thread_.joinable()) thread_.join();
    }

    Result<bool> open() {
        nudge_ = Descriptor(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
        watch_.add(nudge_.fd(), [this](std::uint32_t) {
            std::uint64_t count = 0;
            (void)!read(nudge_.fd(), &count, sizeof count);
        });
        if (options_.sacn)
            if (auto opened = open_sacn(); !opened) return opened;
        if (options_.artnet)
            if (auto opened = open_artnet(); !opened) return opened;
        if (options_.osc) {
            auto osc = OscServer::open(
                *options_.osc, watch_,
                [this](const OscClient& from, const std::string& address, OscSet values) {
                    return post_osc(from, address, std::move(values));
                },
                options_.osc_eos);
            if (!osc) return osc.error();
            osc_ = std::move(*osc);
        }
        make_table(monotonic_ns());
        thread_ = std::thread([this] { run(); });
        return true;
    }

    Latest<InputUpdates>& updates() override { return updates_; }
    Latest<v1::Sources>& table() override { return table_; }
    void listen_to(std::vector<DmxKey> universes) override {
        new_wanted_.put(std::move(universes));
        nudge();
    }
    void publish_state(v1::State state) override {
        if (!options_.osc) return;
        new_state_.put(std::move(state));
        nudge();
    }
    void tell_refusal(OscClient to, std::string address, Error error) override {
        if (!refusals_.push({to, {}, std::move(address), std::move(error)})) ++untold_;
        nudge();
    }
    void tell_refusal(DmxProtocol protocol, Error error) override {
        refusals_.push({{}, protocol, "", std::move(error)});  // one of many like it
        nudge();
    }

private:
    struct Refusal {
        OscClient to;
        std::optional<DmxProtocol> protocol;  // of DMX; else to the client
        std::string address;
        Error error;
    };

    void nudge() {
        const std::uint64_t one = 1;
        (void)!write(nudge_.fd(), &one, sizeof one);
    }

    void run() {
        std::int64_t ticked_ns = 0, table_ns = 0;
        while (!stop_) {
            const std::int64_t wait_ns = std::min(ticked_ns + kTick_ns, osc_next_ns_) - monotonic_ns();
            watch_.wait(static_cast<int>(std::clamp<std::int64_t>((wait_ns + 999'999) / 1'000'000, 0, 100)));
            const std::int64_t now_ns = monotonic_ns();
            take_requests(now_ns);
            if (now_ns - ticked_ns >= kTick_ns) {
                ticked_ns = now_ns;
                sacn_.tick(now_ns);
                artnet_.tick(now_ns);
                polls_ = 0;
                find_interfaces(now_ns);
                join_groups(now_ns);
            }
            if (osc_) osc_next_ns_ = osc_->tick(now_ns);
            post_universes();
            if (now_ns - table_ns >= kTable_ns) {
                table_ns = now_ns;
                make_table(now_ns);
            }
        }
    }

    // What the render thread asked for.
    void take_requests(std::int64_t now_ns) {
        if (auto wanted = new_wanted_.try_take()) {
            wanted_ = std::set<DmxKey>(wanted->begin(), wanted->end());
            sacn_.prefer(wanted_of(DmxProtocol::sacn));
            artnet_.prefer(wanted_of(DmxProtocol::artnet));
            resend_ = true;  // also what did not change since: the patch is new
            join_groups(now_ns);
        }
        if (auto state = new_state_.try_take(); state && osc_) osc_->publish_state(std::move(*state));
        while (auto refusal = refusals_.try_pop()) {
            if (refusal->protocol)
                (*refusal->protocol == DmxProtocol::sacn ? sacn_end_ : artnet_end_).last_error = refusal->error.text();
            else if (osc_)
                osc_->refuse(refusal->to, refusal->address, refusal->error);
        }
        if (const std::uint32_t untold = untold_.exchange(0); untold > 0 && osc_) osc_->count_refusals(untold);
    }
    std::set<std::uint16_t> wanted_of(DmxProtocol protocol) const {
        std::set<std::uint16_t> universes;
        for (const DmxKey& key : wanted_)
            if (key.protocol == protocol) universes.insert(key.universe);
        return universes;
    }

    // ---- sACN
    Result<bool> open_sacn() {
        auto socket = open_udp(*options_.sacn);
        if (!socket) return socket.error();
        sacn_socket_ = std::move(*socket);
        sacn_end_.at = bound_to(sacn_socket_);
        watch_sacn(sacn_socket_);
        find_interfaces(monotonic_ns());
        join_groups(monotonic_ns());
        return true;
    }
    void watch_sacn(const Descriptor& socket) {
        watch_.add(socket.fd(), [this, &socket](std::uint32_t) { receive_sacn(socket); });
    }
    void receive_sacn(const Descriptor& socket) {
        for (const Datagram& datagram : receiver_.receive(socket, sacn_end_.drops[socket.fd()])) {
            ++sacn_end_.packets;
            if (!sacn_end_.whole(datagram)) continue;
            const auto packet = decode_e131(datagram.bytes);
            if (!packet) {
                sacn_end_.bad_packet(packet.error());
            } else if (!sacn_.take(*packet, print_peer(datagram.from), monotonic_ns())) {
                ++sacn_end_.refused;
            }
        }
    }
    // Where groups are joined; on interfaces that have come up since those are joined that are joined elsewhere.
    void find_interfaces(std::int64_t now_ns) {
        if (!options_.sacn || now_ns - interfaces_ns_ < kInterfaces_ns) return;
        interfaces_ns_ = now_ns;
        std::vector<MulticastInterface> found = multicast_interfaces(options_.sacn->ip);
        for (const MulticastInterface& interface : found) {
            if (std::find(interfaces_.begin(), interfaces_.end(), interface) != interfaces_.end()) continue;
            for (const auto& [universe, socket] : groups_) join_group(socket, e131_group(universe), interface);
        }
        interfaces_ = std::move(found);
    }
    // Joins the groups of the patched universes, of synchronization and of discovery, and leaves the others.
    void join_groups(std::int64_t now_ns) {
        if (!options_.sacn) return;
        std::set<std::uint16_t> groups = sacn_.sync_addresses();
        groups.insert(kE131DiscoveryUniverse);
        std::size_t patched = 0;
        for (const std::uint16_t universe : wanted_of(DmxProtocol::sacn))
            if (patched++ < kMaxJoinedUniverses) groups.insert(universe);
        for (auto group = groups_.begin(); group != groups_.end();) {
            if (groups.contains(group->first)) {
                ++group;
                continue;
            }
            watch_.remove(group->second.fd());
            sacn_end_.forget_socket(group->second.fd());
            group = groups_.erase(group);
        }
        for (const std::uint16_t universe : groups) {
            if (groups_.contains(universe)) continue;
            const auto failed = failed_joins_.find(universe);
            if (failed != failed_joins_.end() && now_ns - failed->second < kRejoin_ns) continue;
            auto socket = open_multicast(e131_group(universe), sacn_end_.at.port, interfaces_);
            if (!socket) {
                if (failed == failed_joins_.end()) spdlog::warn("sACN: {}", socket.error().text());
                sacn_end_.last_error = socket.error().text();
                failed_joins_[universe] = now_ns;
                continue;
            }
            failed_joins_.erase(universe);
            watch_sacn(groups_.emplace(universe, std::move(*socket)).first->second);
        }
    }

    // ---- Art-Net
    Result<bool> open_artnet() {
        auto socket = open_udp(*options_.artnet);
        if (!socket) return socket.error();
        artnet_sockets_.push_back(std::move(*socket));
        artnet_end_.at = bound_to(artnet_sockets_[0]);
        if (options_.artnet->ip != 0) {  // a socket of one address does not hear the broadcasts of its network
            std::vector<std::uint32_t> broadcasts;
            if (const auto directed = broadcast_of(options_.artnet->ip)) broadcasts = {*directed, kLimitedBroadcast};
            for (const std::uint32_t address : broadcasts)
                if (auto more = open_udp({address, artnet_end_.at.port})) artnet_sockets_.push_back(std::move(*more));
        }
        for (const Descriptor& one : artnet_sockets_)
            watch_.add(one.fd(), [this, &one](std::uint32_t) { receive_artnet(one); });
        return true;
    }
    void receive_artnet(const Descriptor& socket) {
        for (const Datagram& datagram : receiver_.receive(socket, artnet_end_.drops[socket.fd()])) {
            ++artnet_end_.packets;
            if (!artnet_end_.whole(datagram)) continue;
            const auto packet = decode_artnet(datagram.bytes);
            if (!packet) {
                artnet_end_.bad_packet(packet.error());
            } else if (const auto* dmx = std::get_if<ArtDmx>(&*packet)) {
                if (!artnet_.take(*dmx, datagram.from, monotonic_ns())) ++artnet_end_.refused;
            } else if (const auto* time = std::get_if<ArtTimeCode>(&*packet)) {
                const std::pair heard(time->timecode, monotonic_ns());
                if (updates_.merge([&](InputUpdates& updates) { updates.timecode = heard; })) wake_();
            } else if (std::holds_alternative<ArtSync>(*packet)) {
                artnet_.take_sync(datagram.from, monotonic_ns());
            } else if (std::holds_alternative<ArtPoll>(*packet)) {
                if (++polls_ <= kMaxPolls) reply_to_poll(datagram);
            }
        }
    }
    void reply_to_poll(const Datagram& poll) {
        ArtNode node;
        const std::uint32_t ip = options_.artnet->ip != 0 ? options_.artnet->ip : poll.local_ip;
        for (std::size_t i = 0; i < 4; ++i) node.ip[i] = static_cast<std::uint8_t>(ip >> (24 - 8 * i));
        node.port = artnet_end_.at.port;
        node.short_name = "Gonio";
        node.long_name = "Gonio lighting previsualisation";
        node.report = "#0001 [" + std::to_string(artnet_end_.packets % 10000) + "] listening";
        for (const std::uint16_t universe : wanted_of(DmxProtocol::artnet)) node.universes.push_back(universe);
        for (const ArtPollReply& reply : art_poll_replies(node)) {
            // The standard's port, and where the question came from: some controllers listen only there.
            send_datagram(artnet_sockets_[0], {poll.from.ip, kArtnetPort}, reply);
            if (poll.from.port != kArtnetPort) send_datagram(artnet_sockets_[0], poll.from, reply);
        }
    }

    // ---- to the render thread
    void post_universes() {
        std::vector<DmxKey> changed;
        for (const std::uint16_t universe : sacn_.take_changed()) changed.push_back({DmxProtocol::sacn, universe});
        for (const std::uint16_t universe : artnet_.take_changed()) changed.push_back({DmxProtocol::artnet, universe});
        if (std::exchange(resend_, false)) changed.assign(wanted_.begin(), wanted_.end());
        std::erase_if(changed, [&](const DmxKey& key) { return !wanted_.contains(key); });
        if (changed.empty()) return;
        std::vector<std::shared_ptr<const DmxUniverse>> views;
        for (const DmxKey& key : changed) {
            views.push_back(std::make_shared<const DmxUniverse>(
                key.protocol == DmxProtocol::sacn ? sacn_.universe(key.universe) : artnet_.universe(key.universe)));
        }
        const bool fresh = updates_.merge([&](InputUpdates& updates) {
            for (std::size_t i = 0; i < changed.size(); ++i) updates.universes[changed[i]] = std::move(views[i]);
        });
        if (fresh) wake_();
    }
    bool post_osc(const OscClient& from, const std::string& address, OscSet values) {
        bool taken = false;
        const bool pattern = values[0].pattern;
        const bool fresh = updates_.merge([&](InputUpdates& updates) {
            const bool room =
                updates.osc.size() < kMaxOscUpdates && (!pattern || updates.osc_patterns < kMaxOscPatternUpdates);
            const bool known = updates.osc.contains(address);
            taken = known || room;
            if (!known && taken && pattern) ++updates.osc_patterns;
            if (taken) updates.osc[address] = {from, std::move(values), ++osc_order_};
        });
        if (fresh) wake_();
        return taken;
    }
    void make_table(std::int64_t now_ns) {
        v1::Sources table;
        const auto describe = [&](const Endpoint& endpoint, DmxProtocol protocol, const auto& sources) {
            v1::InputEndpoint& row = endpoint.describe(table, dmx_protocol_name(protocol));
            for (const std::uint16_t universe : wanted_of(protocol)) row.add_universes(universe);
            sources.describe(table, now_ns);
        };
        if (options_.sacn) describe(sacn_end_, DmxProtocol::sacn, sacn_);
        if (options_.artnet) describe(artnet_end_, DmxProtocol::artnet, artnet_);
        if (osc_) osc_->describe(table, now_ns);
        table_.put(std::move(table));
    }

    InputOptions options_;
    std::function<void()> wake_;
    Latest<InputUpdates> updates_;
    Latest<v1::Sources> table_;
    Latest<std::vector<DmxKey>> new_wanted_;
    Latest<v1::State> new_state_;
    Queue<Refusal> refusals_{256};
    std::atomic<bool> stop_{false};
    std::atomic<std::uint32_t> untold_{0};  // refusals that found no room in the queue

    // All below belongs to the thread.
    Watch watch_;
    Descriptor nudge_, sacn_socket_;
    std::vector<MulticastInterface> interfaces_;
    std::int64_t interfaces_ns_ = -kInterfaces_ns;
    std::map<std::uint16_t, Descriptor> groups_;
    std::map<std::uint16_t, std::int64_t> failed_joins_;
    std::vector<Descriptor> artnet_sockets_;
    Endpoint sacn_end_, artnet_end_;
    SacnSources sacn_;
    ArtnetSources artnet_;
    Receiver receiver_;
    std::unique_ptr<OscServer> osc_;
    std::set<DmxKey> wanted_;
    unsigned polls_ = 0;  // within this tick
    bool resend_ = false;
    std::uint64_t osc_order_ = 0;
    std::int64_t osc_next_ns_ = std::numeric_limits<std::int64_t>::max();  // where there is no OSC: never
    std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<Inputs>> Inputs::start(const InputOptions& options, std::function<void()> wake) {
    auto inputs = std::make_unique<UdpInputs>(options, std::move(wake));
    if (auto opened = inputs->open(); !opened) return opened.error();
    return std::unique_ptr<Inputs>(std::move(inputs));
}

}  // namespace gonio
