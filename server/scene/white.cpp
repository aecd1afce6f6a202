#include "server/scene/white.h"

#include <algorithm>
#include <cmath>

namespace gonio {
namespace {

constexpr glm::dvec2 kD65{0.3127, 0.3290};  // x, y of ITU-R BT.709

// A point of the Planckian locus in CIE 1960 (u, v), and how it goes on with T. Krystek (1985): each is a quotient of
// polynomials of T.
struct Locus {
    glm::dvec2 uv, slope;
};

Locus locus_at(double t) {
    const auto quotient = [t](double a, double b, double c, double d, double e) {
        const double above = a + (b + c * t) * t, below = 1 + (d + e * t) * t;
        return glm::dvec2(above / below, ((b + 2 * c * t) * below - above * (d + 2 * e * t)) / (below * below));
    };
    const glm::dvec2 u = quotient(0.860117757, 1.54118254e-4, 1.28641212e-7, 8.42420235e-4, 7.08145163e-7),
                     v = quotient(0.317398726, 4.22806245e-5, 4.20481691e-8, -2.89741816e-5, 1.61456053e-7);
    return {{u.x, v.x}, {u.y, v.y}};
}

glm::dvec2 uv_of(const glm::dvec2& xy) {
    const double d = -2 * xy.x + 12 * xy.y + 3;
    return {4 * xy.x / d, 6 * xy.y / d};
}

glm::dvec2 xy_of(const glm::dvec2& uv) {
    const double d = 2 * uv.x - 8 * uv.y + 4;
    return {3 * uv.x / d, 2 * uv.y / d};
}

// Linear Rec.709 of luminance 1. The matrix is that of IEC 61966-2-1 in double.
glm::dvec3 rgb_of(const glm::dvec2& xy) {
    const double big_x = xy.x / xy.y, big_z = (1 - xy.x - xy.y) / xy.y;
    return {3.2404542 * big_x - 1.5371385 - 0.4985314 * big_z, -0.9692660 * big_x + 1.8760108 + 0.0415560 * big_z,
            0.0556434 * big_x - 0.2040259 + 1.0572252 * big_z};
}

}  // namespace

glm::dvec2 white_xy(double cct_k, double duv) {
    const auto [uv, slope] = locus_at(cct_k == 0 ? kWhiteCct_k : cct_k);
    const glm::dvec2 normal = glm::normalize(glm::dvec2(slope.y, -slope.x));  // u and v fall with T: v grows along it
    return xy_of((cct_k == 0 ? uv_of(kD65) : uv) + normal * duv);
}

double luminance_of(const glm::dvec3& rgb) {
    return glm::dot(rgb, {0.2126, 0.7152, 0.0722});
}

glm::dvec3 in_gamut(const glm::dvec3& rgb) {
    const double least = std::min({rgb.r, rgb.g, rgb.b});
    return least >= 0 ? rgb : glm::max(glm::dvec3(1.0) + (rgb - 1.0) / (1.0 - least), 0.0);
}

glm::dvec3 wide_rgb_of_xy(const glm::dvec2& xy) {
    const glm::dvec3 rgb = rgb_of(xy) / rgb_of(kD65);
    return rgb / luminance_of(rgb);
}

glm::dvec3 rgb_of_xy(const glm::dvec2& xy) {
    return in_gamut(wide_rgb_of_xy(xy));
}

glm::dvec3 white_factors(double cct_k, double duv) {
    return cct_k == 0 && duv == 0 ? glm::dvec3(1.0) : rgb_of_xy(white_xy(cct_k, duv));
}

}  // namespace gonio
