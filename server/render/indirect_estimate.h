// Indirect irradiance at a point as two estimates of one light, so that their difference tells the error of their mean.
// No GL.
#pragma once

#include <array>

#include "server/render/rsm_texels.h"

namespace gonio {

// Result: as dense_irradiance, summed over the white and over the black texels of a checkerboard on each face: their
// sum is the whole, their difference what the texels' size leaves open.
std::array<glm::dvec3, 2> checkerboard_irradiance(const RsmTexels& rsm, const glm::dvec3& point,
                                                  const glm::dvec3& normal);
// Result: texels that carry light.
unsigned lit_texels(const RsmTexels& rsm);

}  // namespace gonio
