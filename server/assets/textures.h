// Pictures that the built-in scenes paint on their surfaces, computed from closed formulas: the same bytes every time.
#pragma once

#include "server/scene/scene.h"

namespace gonio {

// All are square with side size_px, tile without a seam, and store albedo (0..1, linear) sRGB-encoded, alpha 255.
Image brick_texture(int size_px);    // 4 courses of running bond with mortar joints
Image marble_texture(int size_px);   // 2 x 2 floor slabs, light and dark, with veins
Image plaster_texture(int size_px);  // pale stone with soft mottling
Image cloth_texture(int size_px);    // a pale weave with stripes, to be tinted by the base colour

}  // namespace gonio
