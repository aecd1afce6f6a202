// Which light of an MVR show is which of its edition before. Pure.
#pragma once

#include <vector>

#include "server/scene/imported.h"

namespace gonio {

inline constexpr double kMostDrift_m = 0.1;  // that two places of one name may be apart

enum class MatchedBy : std::uint8_t { none, uuid, number, place };
struct Match {
    int was = -1;  // index into the lights of the edition before; -1: it is new
    MatchedBy by = MatchedBy::none;
};

// Result: of each light of `now`. First by UUID, which the standard calls persistent; then by number and type, where
// one fixture alone has them; then by name and place. None of `was` is taken twice.
std::vector<Match> match_lights(const Imported& was, const Imported& now);

}  // namespace gonio
