// Angles in radians, for tests.
#pragma once

#include <numbers>

namespace gonio {

inline constexpr double kPi = std::numbers::pi, kDegree = kPi / 180.0;

}  // namespace gonio
