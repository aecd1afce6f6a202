// OSC over UDP and TCP: messages in, answers and feedback to subscribers out. Lives on the inputs' thread; knows values
// by their address, never the scene.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/osc/osc_space.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/state.pb.h"
#include "server/base/token_bucket.h"
#include "server/inputs/watch.h"

namespace gonio {

inline constexpr std::uint16_t kOscPort = 9000;
inline constexpr std::size_t kMaxOscSubscribers = 32;       // one more is refused
inline constexpr std::size_t kMaxOscConnections = 32;       // TCP; one more is closed at once
inline constexpr std::size_t kMaxOscClients = 64;           // rows of the source table; then the oldest goes
inline constexpr std::size_t kMaxOscScheduled = 1024;       // messages that wait for their time tag; more: refused
inline constexpr std::size_t kMaxOscScheduledBytes = 2048;  // of one such message; a longer one is refused
inline constexpr std::size_t kMaxOscUnsent = 256u << 10;    // bytes waiting for a TCP client; more closes it
inline constexpr double kOscAnswerBytes = 2 << 20;  // over UDP, to whoever asked, a second; more answers are left out
inline constexpr double kOscAddressBytes = 512 << 10;            // of it, to one IP address
inline constexpr std::size_t kOscAmplification = 4;              // to who has not subscribed, over the bytes that asked
inline constexpr std::int64_t kOscFarthest_ns = 60'000'000'000;  // a time tag farther ahead is refused: wrong clock
inline constexpr std::int64_t kOscLease_ns = 60'000'000'000;     // a UDP subscriber that says nothing is dropped
inline constexpr std::int64_t kOscIdle_ns = 300'000'000'000;     // a TCP client likewise, unless it subscribes
inline constexpr std::int64_t kOscPause_ns = 1'000'000'000;      // no accept() for so long where descriptors ran out
inline constexpr std::int64_t kOscRetell_ns = 1'000'000'000;     // who subscribes again within is not told all again
inline constexpr std::int64_t kOscFeedback_ns = 20'000'000;      // feedback comes at most so often
inline constexpr std::int64_t kEosEvery_ns = 1'000'000'000;      // the progress of a cue, as Eos tells it
inline constexpr std::int64_t kOscEchoGuard_ns = 300'000'000;    // what a hand moves is not told to that hand meanwhile

struct OscClient {
    bool tcp = false;
    UdpPeer peer;
    auto operator<=>(const OscClient&) const = default;
};

class OscServer {
public:
    // set: hands values, at least one, to the scene; false: refused, there is too much waiting.
    using Set = std::function<bool(const OscClient& from, const std::string& address, OscSet values)>;
    // Errors: "listen_failed". UDP and TCP take the same port.
    // eos: addresses of Eos too, and to subscribers what it tells of its cues.
    static Result<std::unique_ptr<OscServer>> open(const UdpPeer& at, Watch& watch, Set set, bool eos = false);
    ~OscServer();

    void publish_state(v1::State state);
    UdpPeer address() const { return endpoint_.at; }
    void count_refusals(std::uint32_t count) { endpoint_.refused += count; }
    // Tells a subscriber that its message was refused.
    void refuse(const OscClient& to, const std::string& address, const Error& error);
    // Carries out what is due, sends feedback, ends leases. Result: when it wants to be called again at the latest.
    std::int64_t tick(std::int64_t now_ns);
    void describe(v1::Sources& table, std::int64_t now_ns) const;

private:
    struct Connection {
        Descriptor socket;
        OscClient client;
        OscStream stream;
        std::int64_t heard_ns = 0;  // its last whole packet
        std::vector<std::uint8_t> unsent;
    };
    struct Subscriber {
        UdpPeer to;                              // UDP
        std::int64_t until_ns = 0, told_ns = 0;  // the end of its lease; when it was to be told everything
        OscValues sent;
        std::map<std::string, std::int64_t> guarded_until_ns;
    };
    struct Row {
        std::uint32_t packets = 0;
        std::int64_t heard_ns = 0;
        std::string last;
        PacketRate rate;
    };
    OscServer(Watch& watch, Set set, bool eos)
        : watch_(watch), set_(std::move(set)), eos_(eos), receiver_(kOscMaxPacket) {}
    void receive();
    void accept_connections();
    bool is_connected(const OscClient& client) const;
    bool may_answer(const OscClient& to, std::size_t bytes);
    void serve_connection(int fd, std::uint32_t events);
    bool flush(Connection& connection);
    void close_connection(int fd);
    void take(Bytes packet, const OscClient& from);
    void act(const OscMessage& message, const OscClient& from, std::int64_t now_ns);
    void subscribe(const OscSubscribe& request, const OscMessage& message, const OscClient& from, std::int64_t now_ns);
    void send(const OscClient& to, const UdpPeer& udp, const std::vector<std::uint8_t>& packet);
    void send_values(const OscClient& to, const UdpPeer& udp, const OscValues& values);
    void send_feedback(std::int64_t now_ns);
    void send_eos(std::int64_t now_ns);
    const OscValues& values();

    Watch& watch_;
    Set set_;
    bool eos_;
    OscValues eos_said_;
    std::int64_t eos_said_ns_ = 0;
    Receiver receiver_;
    Descriptor udp_, listener_;
    std::map<int, Connection> connections_;
    std::map<OscClient, Subscriber> subscribers_;
    std::map<OscClient, Row> rows_;
    std::multimap<std::int64_t, std::pair<OscClient, OscMessage>> scheduled_;  // by monotonic time
    v1::State state_;
    OscValues values_;
    std::size_t pattern_budget_ = kOscPatternBudget;         // of the packet being carried out
    TokenBucket answers_{kOscAnswerBytes, kOscAnswerBytes};  // bytes
    std::map<std::uint32_t, TokenBucket> answers_of_;        // by IP address, kMaxOscClients at most
    std::int64_t accept_again_ns_ = 0;                       // 0: connections are being accepted
    bool values_stale_ = true, feedback_due_ = false;
    std::int64_t fed_back_ns_ = 0;
    Endpoint endpoint_;
};

}  // namespace gonio
