#include "client/relay/media_time.h"

#include <algorithm>

namespace gonio {
namespace {

constexpr std::uint64_t kLeastStepNs = 1'000'000;

}  // namespace

std::uint64_t MediaTime::say(std::uint64_t media_ns, std::uint64_t now_ns) {
    media_ns_ = begun_ ? std::max(media_ns, media_ns_ + kLeastStepNs) : media_ns;
    said_at_ns_ = now_ns;
    begun_ = true;
    return media_ns_;
}

std::uint64_t MediaTime::at(std::uint64_t now_ns) const {
    return media_ns_ + (now_ns - said_at_ns_);
}

std::uint64_t MediaTime::again(std::uint64_t now_ns) {
    return say(at(now_ns), now_ns);
}

std::uint64_t MediaTime::picture(std::uint64_t rendered_ns, std::uint64_t now_ns) {
    if (begun_ && rendered_ns == rendered_ns_) return again(now_ns);  // the same picture, encoded anew
    if (begun_) {
        const std::uint64_t here = at(now_ns), there = rendered_ns + ahead_ns_;
        const std::uint64_t apart = std::min(here - there, there - here);
        if (apart > kJumpNs) ahead_ns_ = here - rendered_ns;
    }
    rendered_ns_ = rendered_ns;
    return say(rendered_ns + ahead_ns_, now_ns);
}

std::uint32_t rtp_time(std::uint64_t media_ns, std::uint32_t first) {
    return first + static_cast<std::uint32_t>(media_ns / 100'000 * 9 + media_ns % 100'000 * 9 / 100'000);
}

}  // namespace gonio
