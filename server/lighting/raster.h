// The G-buffer on the CPU. Clusters are culled. Their triangles are set up in homogeneous screen coordinates (Olano and
// Greer 1997: nothing is clipped) and rasterised in strips of rows. What is nearest is shaded where it lies in the
// cache.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "server/base/pool.h"
#include "server/lighting/clusters.h"
#include "server/lighting/kernels.h"

namespace gonio::lighting {

struct GBuffer;
class PosedBodies;

// 64 bytes: a triangle that meets the picture. Edge k is a·x + b·y + c, x and y in pixels from (x0, y0): depth times
// the weight of corner k, negative outside. `depth` is their sum, near / distance.
struct alignas(64) Setup {
    float edge[3][3];
    float depth[3];
    float turn;  // −1: its back is seen
    std::int16_t x0, y0, x1, y1;
    std::uint32_t triangle;  // of the scene, and kAlphaMask: some of it is not seen
    static constexpr std::uint32_t kAlphaMask = 1u << 31;
};

// Triangles on the screen.
struct SetUp {
    // A chunk of clusters has room for a setup of each triangle, filled from the first on: memory that no triangle
    // needs is never touched.
    std::unique_ptr<Setup[]> setups;
    std::size_t capacity = 0;
    std::vector<std::vector<std::uint32_t>> bins;  // of setups, by chunk of clusters and strip
};

// What a picture keeps from frame to frame.
struct Raster : SetUp {
    SetUp bodies;
    // Per pixel: triangle + 1, 0 none. Those of bodies follow those of the scene.
    std::vector<std::uint32_t> nearest;
    std::vector<std::uint16_t> albedo;  // per pixel 4 half floats: linear reflectance, 1
    std::vector<float> emission;        // per pixel 4: cd/m²; empty unless the scene has emitters
};

// One of a picture's samples.
struct RasterSample {
    int index = -1, count = 16;  // sample `index` of `count`; -1: the only one
    float share = 1.0f;          // of its pixel: textures are filtered over that
};

// Fills depth and normals of `surfaces` (whose size and rays are set) and the raster's albedo and, if `emissive`,
// emission. Backs of one-sided surfaces are left out, holes of alpha masks too. What is seen through transmissive
// surfaces is tinted by them. Bodies, which may be null, are drawn over it, and no surface tints them. Result: clusters
// that were drawn. Eight parameters: a scene's and a picture's. Render thread.
unsigned draw_gbuffer(const Clusters& clusters, const MaterialTable& material_table, bool emissive, GBuffer& gbuffer,
                      Raster& raster, Pool& pool, const RasterSample& sample = {}, const PosedBodies* bodies = nullptr);

}  // namespace gonio::lighting
