// From a grid of one point per 4 × 4 pixels to the pixels: joint bilateral upsampling, whose weights are made once per
// camera.
#pragma once

#include <cstdint>
#include <vector>

#include "server/lighting/screen.h"

namespace gonio::lighting {

// Fills in the weights and where they are poor. screen: its grid is made.
void make_weights(const GBuffer& gbuffer, ScreenGrid& screen, Pool& pool);

// Fills in what pixels with poor weights take after rather than these: a point of their own. There are as many such
// points as places outside the grid's rows, at most most_own. Pixels without one and without any weights take the most
// alike of sixteen points around.
void take_after(const GBuffer& gbuffer, std::size_t most_own, ScreenGrid& screen, Pool& pool);

// light: 3 planes in the shape of the grid. out: 4 half floats per pixel, surfaces.row_length pixels a row.
void upsample(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, std::vector<std::uint16_t>& out,
              Pool& pool);
// The same of row y alone. Any thread.
void upsample_line(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, int y, std::uint16_t* out);

}  // namespace gonio::lighting
