// How fine each kind of target of the default technique is computed. Figures per setting: docs/performance.md.
#pragma once

#include "server/render/effort.h"
#include "server/shade/screen.h"

namespace gonio {

inline constexpr shade::Quality kLive{4, 16, kEfforts[0].second_share};
inline constexpr shade::Quality kStill = kLive;  // as the live picture once it rests
inline constexpr shade::Quality kPrecise{1, 4};

}  // namespace gonio
