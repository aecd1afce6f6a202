// How far from the origin anything may be.
#pragma once

namespace gonio {

// No coordinate that a command sets lies beyond it, m. Scenes that reach beyond it are brought near.
inline constexpr double kFarthest_m = 1e6;

}  // namespace gonio
