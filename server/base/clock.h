// The clock of everything that is measured and paced.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace gonio {

// Monotonic, ns since some moment that is the same for the whole process.
inline std::int64_t monotonic_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

// Result: s from one time of monotonic_ns() to another.
inline double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
    return static_cast<double>(to_ns - from_ns) * 1e-9;
}

// Result: s since a time of monotonic_ns().
inline double seconds_since(std::int64_t t_ns) {
    return seconds_between(t_ns, monotonic_ns());
}

// Result: the nearest whole number of ns. seconds: less than 290 years.
inline std::int64_t nanoseconds_of(double seconds) {
    return static_cast<std::int64_t>(std::llround(seconds * 1e9));
}

}  // namespace gonio
