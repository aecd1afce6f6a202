// Reflective shadow map texels -> virtual point lights, and the sum over all texels. No GL.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "shaders/shared/layouts.h"

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

// Result: flux-importance-sampled VPLs in 16 interleaved subsets, each a stratified sample of its own: subset s holds
// entries [s·stride, s·stride + per_subset) of `vpls`, the rest of the stride is dark. A VPL drawn with probability q
// (proportional to the luminance of its flux) among N carries flux / (N q) and the area area / (N q)
// (docs/rendering.md); dark maps give an empty list. Texels are walked along a Morton curve per face and the strata are
// fixed, so that equal inputs give equal lists and nothing flickers while nothing moves.
struct VplList {
    std::vector<layouts::Vpl> vpls;
    unsigned per_subset = 0;
    unsigned stride = 0;
};
inline constexpr unsigned kVplSubsets = 16;
VplList sample_vpls(const RsmTexels& rsm, unsigned count);

// Result: unoccluded irradiance at a point (relative to the luminaire, m) with a unit normal, summed over all texels in
// double precision, in lux per cd of peak, per channel.
glm::dvec3 dense_irradiance(const RsmTexels& rsm, const glm::dvec3& point, const glm::dvec3& normal);
// The same sum over a VPL list.
glm::dvec3 list_irradiance(const VplList& list, const glm::dvec3& point, const glm::dvec3& normal);

}  // namespace gonio
