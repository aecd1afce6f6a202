// A tile of the picture while luminaires light it: its surfaces and the sum of their light, in the order that vectors
// take pixels in. direct_light alone uses it.
#pragma once

#include "server/lighting/direct.h"

namespace gonio::lighting {

// As many pixels as stay in the cache while one luminaire after the other lights them. Pixels 4 apart follow each
// other: pixel (x, y) is number (4 y + x % 4) kSimdWidth + x / 4.
inline constexpr int kTileRows = 8, kTileColumns = 4 * static_cast<int>(kSimdWidth);
inline constexpr std::size_t kTilePixels = kTileRows * kTileColumns, kSquare = 16;

struct Tile {
    int first_x = 0, first_y = 0;
    int x_of(std::size_t pixel) const {
        return first_x + static_cast<int>(4 * (pixel % kSimdWidth) + pixel / kSimdWidth % 4);
    }
    int y_of(std::size_t pixel) const { return first_y + static_cast<int>(pixel / (4 * kSimdWidth)); }
    alignas(64) float points[6][kTilePixels], depth[kTilePixels];  // as of Points; 0: no surface
    alignas(64) std::uint32_t weights[kTilePixels];                // ToPixels::weights
    bool detailed = false;
    alignas(64) float detail[3][kTilePixels];  // normals of GBuffer::detail
    alignas(64) float light[3][kTilePixels];   // the sum
    glm::vec3 least, greatest;                 // corners of a box around the surfaces
    // Pixels that need a ray of their own, and what it would bring.
    std::uint16_t asking[kTilePixels];
    float relative[kTilePixels];
};

// Values of a luminaire at the grid's points, from the first on, as of Lattice; ratio null: every pixel asks.
struct LatticePoints {
    const float *ratio, *through;
    std::ptrdiff_t stride;
};

// Marks a grid point that receives no light: hidden or turned away (negative), or beyond the beam.
inline constexpr float kNoLight = 1e-20f;

// Fills in a tile's surfaces. weights: of the picture. Result: whether there are any. Any thread; so all below.
bool fill_tile(Tile& tile, const GBuffer& gbuffer, const std::uint32_t* weights);
// Adds one luminaire's light to a tile's pixels where the grid's points agree. The web is read at pixels that ask, and
// where it changes by a tenth between the points; else a pixel takes theirs, within 0.2 %. With edges all pixels of
// a square of 4 × 4 ask if a surface in it is turned away, whose shadow may be narrow. planes: 1 or 3. Result: how many
// pixels are left, in tile.asking, square by square.
std::size_t light_tile(Tile& tile, const DirectLight& light, const LatticePoints& lattice, bool edges,
                       std::size_t planes);
// Tile -> picture. adds: to what is there.
void store_tile(const Tile& tile, const GBuffer& gbuffer, Planes& planes, bool adds);

}  // namespace gonio::lighting
