// Tint: green or magenta beside the white of a light, as cameras and LED luminaires have it.
#pragma once

#include <glm/glm.hpp>

namespace gonio {

// Result: factors of linear Rec.709 that move its white (D65) by `duv` in CIE 1960 (u, v). The way is the normal of
// the Planckian locus at 6,507 K, the point nearest to D65; above the locus, towards green, is positive (Duv of
// ANSI C78.377). Their luminance 0.2126 R + 0.7152 G + 0.0722 B is 1: lux stay. 0: exactly 1, 1, 1.
// duv: -0.05..0.05; farther out a factor would be near 0. Any thread.
glm::dvec3 tint_factors(double duv);

}  // namespace gonio
