#include "server/session/budget.h"

#include <algorithm>

namespace gonio {
namespace {

// A quality level fits if it is expected to take this share of the budget; a greater one than before only with more to
// spare, so that the choice does not swing.
constexpr double kFits = 0.95, kFitsBetter = 0.8;

}  // namespace

void Budget::took(double ms, bool heavy, std::int64_t now_ns) {
    if (!heavy) return;
    last_heavy_ns_ = now_ns;
    const double full_ms = ms / kQualityLevels[chosen_].cost;
    full_ms_ = full_ms_ > 0.0 ? 0.5 * (full_ms_ + full_ms) : full_ms;
}

std::size_t Budget::choose(std::int64_t now_ns) {
    if (!(frame_ms_ > 0.0) || owes(now_ns)) return chosen_ = 0;
    const auto fits = [&](std::size_t quality_level) {
        const double share = quality_level < chosen_ ? kFitsBetter : kFits;
        return full_ms_ * kQualityLevels[quality_level].cost <= share * frame_ms_;
    };
    std::size_t quality_level = 0;
    while (quality_level + 1 < kQualityLevels.size() && !fits(quality_level)) ++quality_level;
    return chosen_ = quality_level;
}

std::int64_t Budget::owes_in_ns(std::int64_t now_ns) const {
    return chosen_ == 0 ? INT64_MAX : std::max<std::int64_t>(0, last_heavy_ns_ + kRestNs - now_ns);
}

}  // namespace gonio
