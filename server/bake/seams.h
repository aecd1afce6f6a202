// Maps levelled along seams, so that the two sides of an edge read the same. Done by least squares over the texels that
// bilinear filtering reads there (Iwanicki 2013, "Lighting Technology of The Last of Us"). Any thread. No files.
#pragma once

#include <vector>

#include "server/bake/atlas.h"
#include "server/bake/fill.h"

namespace gonio::bake {

inline constexpr double kSameNormal = 0.99;  // least cosine of normals on both sides of a seam; else it is a hard edge
inline constexpr double kKeep = 0.1;         // weight of a texel's own value beside a seam's

// picture: of the atlas's pixels, `channels` each; edge and gutter texels change, within what
// the seam's texels around them have.
void level_seams(const Atlas& atlas, const FillPlan& plan, std::vector<float>& picture, int channels);

// Result: root mean square over all seams of the difference of the two sides' bilinear reads.
double seam_difference(const Atlas& atlas, const std::vector<float>& picture, int channels);

}  // namespace gonio::bake
