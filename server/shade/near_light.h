// The part of the indirect light that the VPLs' kernel leaves out, found by short cosine-distributed rays.
#pragma once

#include "server/shade/screen.h"

namespace gonio::shade {

// Adds to sums[lane] (rgb per candela of peak) what one ray of each active point brings. points: kPacket of them, a
// step off their surfaces. random: the point of the unit square that every lane turns into its direction.
void add_near_light(const LightView& light, const Points& points, unsigned active, glm::vec2 random, float kappa,
                    glm::vec3* sums);

}  // namespace gonio::shade
