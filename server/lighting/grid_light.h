// From surfels (server/transport) to the points of a picture's grid: the irradiance of those around each point.
#pragma once

#include <cstdint>
#include <vector>

#include "server/lighting/body_sides.h"
#include "server/lighting/material_table.h"
#include "server/lighting/posed_bodies.h"
#include "server/lighting/raster.h"
#include "server/lighting/screen.h"
#include "server/transport/transport.h"

namespace gonio::lighting {

// The surfels around a grid's points, in the shape of ScreenGrid::grid, points outside its rows with it. The same for
// all light.
struct GridWeights {
    std::vector<const std::uint16_t*> around;  // kNeighbours of them, or null: none
    std::vector<float> weights;                // kNeighbours a point, of sum 1
    std::vector<std::uint8_t> seen;            // by surfel: whether it is around any point
};
struct BodiesAround {
    const PosedBodies& posed;
    const BodySides& sides;
};
// raster: of these surfaces; null: drawn by GL. bodies: that they show; null: none. Five ways to find a point's surfel,
// and where it goes: eight parameters.
void find_surfels(const GBuffer& gbuffer, const Raster* raster, const MaterialTable& material_table,
                  const BodiesAround* bodies, const ScreenGrid& screen, const transport::Transport& transport,
                  GridWeights& weights, Pool& pool);

// surfels: irradiance at each, and where the grid shows bodies at their sides. Result: at every point, 3 planes in the
// shape of the grid.
Planes irradiance_at_grid(const ScreenGrid& screen, const GridWeights& weights, std::span<const glm::vec4> surfels,
                          Pool& pool);

}  // namespace gonio::lighting
