// The photometric solid of the seed paper (§4.1): a closed triangle mesh whose radius in each direction is I(ω).
#pragma once

#include <cstdint>
#include <vector>

#include "ies/web.h"

namespace gonio::ies {

struct SolidMesh {
    std::vector<float> positions;          // x,y,z per vertex, luminaire frame, unit: candela (length = I in cd)
    std::vector<float> normals;            // x,y,z per vertex, unit length, outward
    std::vector<std::uint32_t> triangles;  // 3 indices per triangle, counter-clockwise from outside
};

// Result: the solid on the web's own grid, symmetry unfolded, refined so that no edge spans more than max_step
// (chord error 1 - cos(step/2): 0.1 % at 5 degrees). Dark webs give an empty mesh.
SolidMesh photometric_solid(const PhotometricWeb& web, Angle max_step);

}  // namespace gonio::ies
