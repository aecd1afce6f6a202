// Smoother edges for pictures that have one sample a pixel, as while the camera moves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/base/pool.h"

namespace gonio::lighting {

// Filters Y' of NV12, width × height bytes from the top left, as shaders/lib/edge_filter.glsl says. Chroma, of half the
// resolution, stays. before: scratch, that others may use between two calls.
void filter_edges(int width, int height, std::uint8_t* luma, std::vector<std::uint8_t>& before, Pool& pool);

}  // namespace gonio::lighting
