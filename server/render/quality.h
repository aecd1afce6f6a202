// How fine each kind of target of the default technique is computed. Figures per setting: docs/performance.md.
#pragma once

#include "server/render/effort.h"
#include "server/shade/screen.h"

namespace gonio {

inline constexpr shade::Quality kLive{
    4, true, 4, kEfforts[0].node_vpls, 1, 16.0f, 0, kEfforts[0].second_share, {kEfforts[0].close_share}};
inline constexpr shade::Quality kStill{1, true, 4, 512, 3, 16.0f};
inline constexpr shade::Quality kPrecise{1, false, 2, 1024, 4, 16.0f};

}  // namespace gonio
