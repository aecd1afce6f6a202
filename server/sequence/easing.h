// How a value goes from one key to the next. Pure.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace gonio::sequence {

// Functions of u = 0 … 1, the share of the time between two keys. They are u; 0 until the next key; u²; 1 − (1 − u)²;
// and 3u² − 2u³, which starts and ends at rest.
enum class Ease : std::uint8_t { linear, hold, in, out, in_out };

inline constexpr std::array<std::string_view, 5> kEaseNames = {"linear", "hold", "in", "out", "in-out"};

inline std::optional<Ease> parse_ease(std::string_view name) {
    const auto found = std::ranges::find(kEaseNames, name);
    if (found == kEaseNames.end()) return std::nullopt;
    return static_cast<Ease>(found - kEaseNames.begin());
}

// Result: the share of the way, 0 … 1. u: 0 … 1.
inline double eased(Ease ease, double u) {
    switch (ease) {
        case Ease::hold:
            return u < 1.0 ? 0.0 : 1.0;
        case Ease::in:
            return u * u;
        case Ease::out:
            return 1.0 - (1.0 - u) * (1.0 - u);
        case Ease::in_out:
            return u * u * (3.0 - 2.0 * u);
        default:
            return u;
    }
}

}  // namespace gonio::sequence
