#include "server/stream/bandwidth.h"

#include <algorithm>
#include <cmath>

namespace gonio {
namespace {

constexpr std::size_t kMostFlights = 8, kMostSamples = 12;
// Smaller frames say more about the machines at both ends than about the link.
constexpr double kLeastEvidenceBytes = 4096;
// What threads and timers at both ends add to each frame: not the link's.
constexpr auto kSlack = std::chrono::milliseconds(2);
constexpr auto kSpan = std::chrono::seconds(10), kProbeEvery = std::chrono::seconds(5);
constexpr auto kLongRtt = std::chrono::milliseconds(50);
constexpr double kShare = 0.9;  // of the link that frames may fill

double seconds_of(Bandwidth::Duration time) {
    return std::chrono::duration<double>(time).count();
}

}  // namespace

void Bandwidth::wrote(std::uint32_t seq, std::size_t bytes, Time now) {
    flights_.push_back({seq, bytes, now});
    if (flights_.size() > kMostFlights) flights_.pop_front();
}

void Bandwidth::acknowledged(std::uint32_t seq, Duration decode, Time now) {
    double bytes = 0;
    std::optional<Time> first, last;
    while (!flights_.empty() && flights_.front().seq <= seq) {
        bytes += static_cast<double>(flights_.front().bytes);
        if (!first) first = flights_.front().wrote;
        last = flights_.front().wrote;
        flights_.pop_front();
    }
    if (!first) return;
    const Time arrival = now - std::clamp<Duration>(decode, Duration::zero(), now - *last);
    round_trip(arrival - *last, now);
    // The link was busy with these bytes from when they could arrive at the earliest, or from when it was done with the
    // frame before.
    const Time free_at = std::max(*first + *min_rtt(), last_arrival_);
    last_arrival_ = arrival;
    if (bytes < kLeastEvidenceBytes) return;
    samples_.push_back({bytes, std::max(seconds_of(arrival - free_at - kSlack), 0.0)});
    if (samples_.size() > kMostSamples) samples_.pop_front();
    budget_bytes_ = budget_of_samples();
}

std::size_t Bandwidth::bytes_in_flight() const {
    std::size_t sum = 0;
    for (const Flight& flight : flights_) sum += flight.bytes;
    return sum;
}

void Bandwidth::round_trip(Duration rtt, Time now) {
    if (now - span_began_ >= kSpan) {
        least_[1] = now - span_began_ < 2 * kSpan ? least_[0] : std::nullopt;
        least_[0] = std::nullopt;
        span_began_ = now;
    }
    least_[0] = least_[0] ? std::min(*least_[0], rtt) : rtt;
}

std::optional<Bandwidth::Duration> Bandwidth::min_rtt() const {
    if (least_[0] && least_[1]) return std::min(*least_[0], *least_[1]);
    return least_[0] ? least_[0] : least_[1];
}

// Only a link that frames keep busy: elsewhere the least round trip is measured often enough by itself.
bool Bandwidth::wants_probe(Time now) const {
    return now - last_probe_ >= kProbeEvery && (last_probe_ == Time{} || frame_budget_bytes() > 0);
}

double Bandwidth::bits_per_s() const {
    double bytes = 0, seconds = 0;
    for (const Sample& sample : samples_) {
        bytes += sample.bytes;
        seconds += sample.seconds;
    }
    const double most = kMostBudgetBytes * 8.0 / (kShare * seconds_of(kFrameTime));
    if (bytes <= 0 || bytes * 8 >= most * seconds) return 0;
    return bytes * 8 / seconds;
}

std::uint32_t Bandwidth::budget_of_samples() const {
    const double rate = bits_per_s();
    if (rate <= 0) return 0;
    const double bytes = kShare * rate / 8 * seconds_of(kFrameTime);
    constexpr double kSteps = 4;  // to the doubling
    const double stepped = std::exp2(std::floor(std::log2(bytes) * kSteps) / kSteps);
    return std::max(kLeastBudgetBytes, static_cast<std::uint32_t>(stepped));
}

std::uint32_t Bandwidth::window(Time now) const {
    if (wants_probe(now) && !flights_.empty()) return 1;
    const auto rtt = min_rtt();
    return rtt && *rtt > kLongRtt ? 3 : 2;
}

}  // namespace gonio
