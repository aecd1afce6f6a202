#include "server/scene/tint.h"

namespace gonio {
namespace {

constexpr glm::dvec2 kD65{0.3127, 0.3290};  // x, y of ITU-R BT.709
// Of the locus after Krystek (1985), whose u(T), v(T) come nearest to D65 at 6,507 K.
constexpr glm::dvec2 kNormal{-0.80477, 0.59358};

glm::dvec2 uv_of(const glm::dvec2& xy) {
    const double d = -2 * xy.x + 12 * xy.y + 3;
    return {4 * xy.x / d, 6 * xy.y / d};
}

// Linear Rec.709 of luminance 1. The matrix is that of IEC 61966-2-1 in double.
glm::dvec3 rgb_of(const glm::dvec2& uv) {
    const double d = 2 * uv.x - 8 * uv.y + 4, x = 3 * uv.x / d, y = 2 * uv.y / d, big_x = x / y,
                 big_z = (1 - x - y) / y;
    return {3.2404542 * big_x - 1.5371385 - 0.4985314 * big_z, -0.9692660 * big_x + 1.8760108 + 0.0415560 * big_z,
            0.0556434 * big_x - 0.2040259 + 1.0572252 * big_z};
}

}  // namespace

glm::dvec3 tint_factors(double duv) {
    if (duv == 0) return glm::dvec3(1.0);
    const glm::dvec2 white = uv_of(kD65);
    const glm::dvec3 factors = rgb_of(white + kNormal * duv) / rgb_of(white);
    return factors / glm::dot(factors, {0.2126, 0.7152, 0.0722});
}

}  // namespace gonio
