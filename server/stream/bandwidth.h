// What a viewer's acknowledgements say about its link: the least round trip, the bytes a second, and from these how
// large a frame may be. Works above TCP, so that it measures the whole way, proxies included. Pure: time is a
// parameter.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace gonio {

class Bandwidth {
public:
    using Clock = std::chrono::steady_clock;
    using Time = Clock::time_point;
    using Duration = Clock::duration;

    // The first byte of a frame is given to the socket.
    void wrote(std::uint32_t seq, std::size_t bytes, Time now);
    // The viewer has drawn the frame (and all before it); decode: how long that took after its arrival, 0: not told.
    void acknowledged(std::uint32_t seq, Duration decode, Time now);
    // A ping that was sent while no frame was on its way came back.
    void round_trip(Duration rtt, Time now);
    // Whether the least round trip should be measured anew: the next frame should wait until none is on its way, and a
    // ping go before it.
    bool wants_probe(Time now) const;
    void probed(Time now) { last_probe_ = now; }

    // Result: the least round trip of the last 10 to 20 s; nothing before the first measurement.
    std::optional<Duration> min_rtt() const;
    // Result: bits a second that the link carries; 0: not known, or so many that it does not matter.
    double bits_per_s() const;
    // Result: how large a frame may be so that the link is done with it in kFrameTime, in steps of a fifth; 0: as large
    // as it likes.
    std::uint32_t frame_budget_bytes() const { return budget_bytes_; }
    // Result: of frames that were given to the socket and not acknowledged.
    std::size_t bytes_in_flight() const;
    // Result: how many frames may be on their way: 3 where two would leave a long link idle.
    std::uint32_t window(Time now) const;

    static constexpr Duration kFrameTime = std::chrono::milliseconds(33);
    static constexpr std::uint32_t kLeastBudgetBytes = 4 << 10;   // below it frames come more seldom instead
    static constexpr std::uint32_t kMostBudgetBytes = 256 << 10;  // 60 Mb/s: more is no limit

private:
    struct Flight {
        std::uint32_t seq;
        std::size_t bytes;
        Time wrote;
    };
    struct Sample {
        double bytes, seconds;
    };
    std::uint32_t budget_of_samples() const;

    std::deque<Flight> flights_;                    // at most kMostFlights
    std::deque<Sample> samples_;                    // at most kMostSamples
    std::array<std::optional<Duration>, 2> least_;  // of the present span of kSpan, and of the one before
    std::uint32_t budget_bytes_ = 0;
    Time span_began_{}, last_arrival_{}, last_probe_{};
};

}  // namespace gonio
