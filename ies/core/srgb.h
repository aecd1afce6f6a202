// The transfer curve of sRGB (IEC 61966-2-1). Any thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace gonio {

// encoded: 0..1. Result: linear, 0..1.
inline double linear_of_srgb(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}
// linear: 0..1. Result: encoded, 0..1.
inline double srgb_of_linear(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}
// Result: encoded and rounded to a byte. Values outside of 0..1 become 0 or 255.
inline std::uint8_t srgb_byte(double linear) {
    return static_cast<std::uint8_t>(std::lround(255.0 * srgb_of_linear(std::clamp(linear, 0.0, 1.0))));
}

}  // namespace gonio
