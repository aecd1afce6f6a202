// Pictures of gobo wheels as their files have them: a show's fixtures bring hundreds, of which few are ever shown.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "server/scene/light.h"

namespace gonio {

// Decoded once, when it is first shown, and kept then.
struct PackedGobo {
    using Decode = Result<std::vector<std::uint16_t>> (*)(std::string_view bytes, const std::string& place);
    std::string bytes;        // of the picture's file
    std::string sha256;       // of the picture's file, where `bytes` are a show's (saved_profile.h); empty: of `bytes`
    std::string place;        // of it, for messages
    Decode decode = nullptr;  // Result: as Gobo::transmission
    mutable std::once_flag once;
    mutable std::vector<std::uint16_t> made;  // empty: it cannot be decoded
    mutable std::string failed;               // why
    mutable std::atomic<bool> told = false;   // of the failure
};

// Result: what the gobo lets through, size_px squared values; none where it has no picture, or one that cannot be
// decoded: then it is open. Any thread; some ten milliseconds where the picture is shown for the first time.
std::span<const std::uint16_t> transmission_of(const Gobo& gobo);

// Result: a sentence where the light's gobo cannot be decoded and nobody was told yet; else empty. Any thread.
std::string untold_failure(const Light& light);

}  // namespace gonio
