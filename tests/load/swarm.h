// Many WebSocket clients in one thread: viewers that acknowledge every frame, sockets that do nothing, readers that
// read at a given rate or never. They count what they see. For load tests and the soak.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace gonio::load {

inline constexpr int kViewers = 100, kIdle = 2000;  // clients of the tests

enum class Kind : std::uint8_t {
    viewer,  // reads at once, acknowledges each frame
    idle,    // identified, wants neither video nor state, answers pings
    slow,    // a viewer that reads so many bytes a second
    deaf,    // a viewer that never reads: its pings go unanswered
};

// What one client saw since the last reset_tallies(); the revision since it joined.
struct Tally {
    Kind kind = Kind::viewer;
    std::uint64_t frames = 0, keys = 0, bytes = 0;
    std::uint64_t older = 0;  // frames of a revision before one that came already: must stay 0
    std::uint32_t newest_rev = 0;
    bool final = false;                     // the newest frame said that nothing newer is due
    bool gone = false;                      // the server closed it
    int close_code = 0;                     // with this code; 0: none
    std::vector<std::uint32_t> latency_us;  // from NV12 in the server's memory to here, of each frame
};

class Swarm {
public:
    explicit Swarm(std::uint16_t port);
    ~Swarm();  // closes all
    Swarm(const Swarm&) = delete;

    // Connects and goes as far as Ready. bytes_per_s: of slow readers. Result: its id; -1 where it was refused.
    int join(Kind kind, double bytes_per_s = 0);
    // Goes away: by a closing handshake's first half and FIN, or at once (RST).
    void leave(int id, bool reset);
    Tally tally(int id) const;
    std::vector<Tally> tallies(Kind kind) const;
    void reset_tallies();
    double cpu_s() const { return static_cast<double>(cpu_ns_.load()) * 1e-9; }  // of the swarm's own thread

private:
    struct Member {
        int socket = -1;
        double bytes_per_s = 0, allowance = 0;
        std::string buffer;
        Tally tally;
    };
    void run();
    void read(Member& member, std::size_t most);
    void take_frames(Member& member);
    void take_video(Member& member, const std::string& payload);
    void close(Member& member);

    std::uint16_t port_;
    int epoll_ = -1;
    mutable std::mutex mutex_;
    std::map<int, std::unique_ptr<Member>> members_;
    int next_id_ = 1;
    std::atomic<bool> done_{false};
    std::atomic<std::int64_t> cpu_ns_{0};
    std::thread thread_;
};

// Result: the value that a share of the values does not exceed (0.99: p99); 0 for none. Sorts a copy.
double percentile_ms(std::vector<std::uint32_t> values_us, double share);

}  // namespace gonio::load
