// Luminaires' luminous openings as the pixels of a picture show them.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/lighting/screen.h"
#include "server/trace/sources.h"

namespace gonio::lighting {

// One pixel and one luminaire.
struct OpeningPixel {
    std::uint32_t x, y;   // from the bottom left
    std::uint32_t light;  // Light::id
    float covered;        // of the pixel by what is seen of the opening, of 4 × 4 samples
    float nit;            // its luminance × covered, before the luminaire's weight, cd/m²
};
// Result: all there are. What hides an opening is told by the depth of the pixels around. Where they do not agree rays
// tell it, and where surfaces are transmissive. bodies: the pixels show some. These hide no opening, as light begins
// within them, so that rays tell it too. Render thread.
std::vector<OpeningPixel> see_openings(std::span<const trace::Luminaire> luminaires, const GBuffer& gbuffer,
                                       const trace::Geometry& geometry, bool bodies, Pool& pool);

// A pixel with all openings that it shows, at their weights.
struct ShiningPixel {
    std::uint32_t x, y;
    float covered;
    glm::vec3 nit;  // × covered, cd/m²
};
// Result: by row from the bottom, then by column. weight_of: of a light by its id, rgb.
std::vector<ShiningPixel> weigh_openings(std::span<const OpeningPixel> pixels,
                                         const std::function<glm::vec3(std::uint32_t)>& weight_of);

}  // namespace gonio::lighting
