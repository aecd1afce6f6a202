// The white of a light: a correlated colour temperature, and green or magenta beside it (tint). Both as factors of
// linear Rec.709.
#pragma once

#include <glm/glm.hpp>

namespace gonio {

inline constexpr double kWhiteCct_k = 6504;  // nearest to the white of Rec.709 (CIE D65)

// x, y of CIE 1931.
// Result: the chromaticity of cct_k (1000..15000 K) on the Planckian locus after Krystek (1985, CIE 1960 u, v, whose
// normal the tint follows), or of D65 where cct_k is 0. `duv` (-0.05..0.05, Duv of ANSI C78.377) goes along the normal
// of the locus there, positive above it, towards green. Any thread.
glm::dvec2 white_xy(double cct_k, double duv);

// Result: linear Rec.709 of the chromaticity, relative to the white of Rec.709; its luminance 0.2126 R + 0.7152 G +
// 0.0722 B is 1: lux stay. A chromaticity that Rec.709 lacks (below some 1,900 K, or far off the locus) goes straight
// towards white in x, y, until the factor that is below 0 is 0. No factor is above 13.9.
glm::dvec3 rgb_of_xy(const glm::dvec2& xy);
// Likewise where it is, with factors below 0 for what Rec.709 lacks: of lights that are added before in_gamut().
glm::dvec3 wide_rgb_of_xy(const glm::dvec2& xy);
glm::dvec3 in_gamut(const glm::dvec3& rgb_of_luminance_1);

// Result: what a light's colour is multiplied by: rgb_of_xy of white_xy. Exactly 1, 1, 1 where both are 0.
glm::dvec3 white_factors(double cct_k, double duv);

// Result: the luminance of linear Rec.709.
double luminance_of(const glm::dvec3& rgb);

}  // namespace gonio
