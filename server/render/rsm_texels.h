// A reflective shadow map read back, and the exact sum over all its texels as two estimates of one light. No GL.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace gonio {

// What a light sees, read back from its cube maps; 6·size² texels, face-major in GL's face order, rows from t = -1.
// Positions are relative to the luminaire, world axes.
struct RsmTexels {
    int size = 0;
    std::vector<float> radial_depth;   // m; 0: the direction leaves the scene
    std::vector<std::int16_t> normal;  // octahedral snorm, 2 per texel, world
    std::vector<glm::vec4> flux;       // rgb: lm per cd of peak; a: represented area / pi, m²

    glm::dvec3 position(std::size_t texel) const;  // m
    glm::dvec3 normal_of(std::size_t texel) const;
};

// Result: unoccluded irradiance at a point (relative to the luminaire, m) with a unit normal, in lux per cd of peak,
// per channel, with the area-bounded kernel. It is summed in double precision over the white and over the black texels
// of a checkerboard on each face. Their sum is the whole, their difference what the texels' size leaves open.
std::array<glm::dvec3, 2> checkerboard_irradiance(const RsmTexels& rsm, const glm::dvec3& point,
                                                  const glm::dvec3& normal);
// Result: texels that carry light.
unsigned lit_texels(const RsmTexels& rsm);

}  // namespace gonio
