// The clock of everything that is measured and paced.
#pragma once

#include <chrono>
#include <cstdint>

namespace gonio {

// Monotonic, ns since some moment that is the same for the whole process.
inline std::int64_t monotonic_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

// Result: s since a time of monotonic_ns().
inline double seconds_since(std::int64_t t_ns) {
    return static_cast<double>(monotonic_ns() - t_ns) * 1e-9;
}

}  // namespace gonio
