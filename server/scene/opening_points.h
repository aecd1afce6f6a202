// Points of luminous openings, in the luminaire's frame: photometric zero on -Z, the length along X (C0), the width
// along Y. All carry the same share of the light.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "ies/photometry.h"

namespace gonio {

// Result: the point of an opening that uniform numbers stand for, from its middle, m. A point has one.
glm::dvec3 opening_point(const ies::Opening& opening, const glm::dvec2& first, const glm::dvec2& second);
// Result: half of the measures along X, Y and Z, m: of what is flat, 0 across.
glm::dvec3 half_sides(const ies::Opening& opening);
// Result: 0.001 m along the photometric zero, of what is flat; else nothing. Rays end so far before the opening: what
// it is mounted on, or let into by less, does not hide it.
glm::dvec3 lifted_off(const ies::Opening& opening);

// Level n of its parts: the longest side is cut into 2^n, other sides likewise where a part would else be longer than
// those; round ones into rings. Parts of 2 × 2 have their points where Gauss's rule has them, so the error falls with
// the fourth power of size_m over the distance. Of round and flat ones it is the rule of three degrees. Boxes have a
// fixed spread over their luminous faces.
struct OpeningParts {
    double size_m = 0.0;             // the longest side of a part
    std::vector<glm::dvec3> points;  // 1 on level 0: the middle
};
OpeningParts opening_parts(const ies::Opening& opening, unsigned level);
// Result: n points, a power of two, evenly over the opening whichever way it is cut across: for what is seen of it.
std::vector<glm::dvec3> opening_spread(const ies::Opening& opening, unsigned n);

}  // namespace gonio
