// Keeps live frames within the time that a frame rate leaves them: picks a quality level by the times measured. Render
// thread; time is a parameter.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/render/quality_level.h"

namespace gonio {

class Budget {
public:
    // frame_ms: what a frame may take, 0: as long as it does.
    explicit Budget(double frame_ms = 0.0) : frame_ms_(frame_ms) {}

    // Says what a frame took. heavy: it computed light anew; others say nothing about quality levels.
    void took(double ms, bool heavy, std::int64_t now_ns);
    // Result: index into kQualityLevels for the next frame: the greatest quality level that fits, by the newest two or
    // three heavy frames. It is the first once no heavy frame came for kRestNs.
    std::size_t choose(std::int64_t now_ns);
    std::size_t chosen() const { return chosen_; }
    // Result: whether the last picture was made with less than the full quality level and nothing moves any more.
    bool owes(std::int64_t now_ns) const { return chosen_ != 0 && rests(now_ns); }
    // Result: when that will be, ns from now; INT64_MAX: not at all.
    std::int64_t owes_in_ns(std::int64_t now_ns) const;

    static constexpr std::int64_t kRestNs = 200'000'000;

private:
    bool rests(std::int64_t now_ns) const { return now_ns - last_heavy_ns_ >= kRestNs; }

    double frame_ms_;
    double full_ms_ = 0.0;  // what a heavy frame would take at the full quality level, by a running mean; 0: unknown
    std::size_t chosen_ = 0;
    std::int64_t last_heavy_ns_ = INT64_MIN / 2;
};

}  // namespace gonio
