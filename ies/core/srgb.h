// How pictures and files encode colour.
#pragma once

#include <cmath>

namespace gonio {

// encoded: 0..1, of sRGB (IEC 61966-2-1). Result: linear, 0..1.
inline double linear_of_srgb(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace gonio
