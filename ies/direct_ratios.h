// EULUMDAT's direct ratios: how much of a luminaire's light reaches the working plane of a room without a reflection.
#pragma once

#include <array>

#include "ies/web.h"

namespace gonio::ies {

inline constexpr std::array<double, 10> kRoomIndices = {0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0};

// web: of a Type C luminaire that hangs as it was measured. Result: for each room index k the flux that reaches the
// working plane directly, as a part of all flux, 0..1; 0 for a dark web. The room is square, k = side / (2 x height),
// where the height is that of the luminaires above the working plane. They hang as points in a square pattern, half a
// spacing from the walls, with the fewest of them whose spacing is no more than their height.
// Any thread; some ten milliseconds.
std::array<double, 10> direct_ratios(const PhotometricWeb& web);

}  // namespace gonio::ies
