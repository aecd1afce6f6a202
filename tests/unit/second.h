// A second of the clocks that tests move by hand, ns.
#pragma once

#include <cstdint>

namespace gonio {

inline constexpr std::int64_t kSecond = 1'000'000'000;

}  // namespace gonio
