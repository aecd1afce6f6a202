// Indirect light on the pixels of one target, on the CPU: VPLs gathered without occlusion on a coarse interleaved grid,
// times the share of their light that is not blocked, traced on a coarser grid still, plus what the gather leaves out
// near contact, given back by short rays; brought to the pixels by joint bilateral upsampling (docs/rendering.md).
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "server/scene/eye.h"
#include "server/shade/grid.h"
#include "server/shade/kernels.h"
#include "server/shade/looks.h"
#include "server/shade/point_packet.h"
#include "server/shade/pool.h"
#include "server/shade/vpl_rays.h"

namespace gonio::shade {

// What is done where light differs most within a few points (close_blocks.h).
struct Close {
    float share = 0.0f;      // of the blocks of 4 × 4 grid points that are chosen, at most; 0 unless interleaved
    float fade = 0.5f;       // blocks of that much more contrast than the next in line show their own estimate alone
    unsigned summed = 2048;  // VPLs that each point sums, in whole subsets
    unsigned asked = 64;     // of `listed`, that all points of a block ask, about
    unsigned listed = 1024;  // likewise in whole subsets
    unsigned near_rays = 8;  // short rays of each point
    int from_row = 0, to_row = 1 << 24;  // of the grid, multiples of 4: blocks are chosen between these
};

// How fine a target is computed.
struct Quality {
    int step = 4;              // pixels between grid points: 4, or 1: every pixel
    bool interleaved = true;   // a grid point sums one of 16 subsets and its window the rest; else the whole list
    int node_stride = 2;       // grid points between the nodes that trace occlusion
    unsigned node_vpls = 512;  // VPLs that 2 × 2 nodes together ask; 0: nothing is blocked
    unsigned near_rays = 1;    // short rays of each grid point, of one of 16 strata
    float kappa = 4.0f;        // how much near light the rays give back rather than VPLs (vpl.glsl)
    unsigned round = 0;        // which part of the short rays' sequence
    float second_share =
        0.0f;  // of the cells of 4 × 4 pixels that get a second point, at most 1/16; 0 unless interleaved, of step 4
    Close close;
};

// The depth and normals of a target and the rays through its pixels; rows from the bottom.
struct Surfaces {
    int width = 0, height = 0;
    Rays rays;
    float depth_per_pixel = 0.0f;       // width of a pixel per metre of depth
    std::vector<float> depth;           // near / distance; 0 no surface; row_length floats a row
    std::vector<std::uint32_t> normal;  // octahedral, 2 snorm16
    std::size_t row_length = 0;         // a multiple of 4·kLanes
};

// Sets a picture's size and rays and makes room for its surfaces. near_m: whose share of the distance depth is.
void look_through(const Eye& eye, const trace::Geometry& geometry, float near_m, int width, int height,
                  Surfaces& surfaces);

// What one pixel shows; depth 0: no surface.
struct Spot {
    glm::vec3 position{0.0f}, normal{0.0f};  // local, m; unit
    float depth = 0.0f;                      // along the view axis, m
};
Spot spot_at(const Surfaces& surfaces, int x, int y);

// Distance off a plane that is still near for windows of points, in steps of their grid.
inline constexpr float kWindowNear = 4.0f;
// The same for bringing values to finer points.
inline constexpr float kUpsampleNear = 2.0f;

inline constexpr int kTileSide = 4;
inline constexpr std::size_t kTiles = kTileSide * kTileSide;

// How a grid's values come to the pixels (upsample.h).
struct ToPixels {
    std::vector<std::uint32_t> weights;  // of weights_row, Surfaces::row_length a row
    std::vector<std::uint8_t> poor;      // likewise, a quarter of it a row
    struct Odd {
        std::uint32_t x, from;
        float share;
    };
    // By row: pixels that do not follow their weights, in order, and the points in the grid's arrays that each is the
    // sum of.
    std::vector<std::vector<Odd>> odd;
    // Whether the four points around a pixel of a surface are poorly like it.
    static bool is_poor(std::uint32_t weights) {
        return (weights & 255u) + (weights >> 8 & 255u) + (weights >> 16 & 255u) + (weights >> 24) < kPoorSum;
    }
};

// What does not depend on the luminaires: made once per camera.
struct ScreenGrid {
    Quality quality;
    float depth_per_point = 0.0f;  // distance of neighbouring grid points per metre of depth
    Grid grid, nodes;
    ToPixels to_pixels;                 // step 4 only
    std::vector<std::uint32_t> second;  // by Grid::at of the cell: its second point, 0 none; empty: none at all
    std::vector<Patch> second_packets;  // all of them, neighbours together
    // The grid's points rearranged into 4 × 4 tiles, each padded to whole kLanes: points of a tile share VPLs and rays.
    std::vector<float> tiled[6];
    std::vector<glm::vec3> near_directions;  // of the short rays about +Z, near_rays for each place of a tile
    std::size_t tile_size = 0;
    int tile_width = 0, tile_height = 0;
    std::size_t tiled_index(int x, int y) const {
        const auto tile = static_cast<std::size_t>(y % kTileSide * kTileSide + x % kTileSide);
        return tile * tile_size + static_cast<std::size_t>(y / kTileSide * tile_width + x / kTileSide);
    }
};
// screen: of any former grid, whose memory is used again.
void make_grid(const Surfaces& surfaces, const Quality& quality, ScreenGrid& screen, Pool& pool);

struct MergedList;  // merged.h
struct LightView {
    const trace::Geometry& geometry;
    const VplRays& rays;
    const VplCast& vpls;
    glm::dvec3 position;  // local
    glm::dmat3 world_from_light;
    Web web;
    const Looks& looks;
    float unit_m2 = 1.0f;  // grids of light are measured in
    const MergedList* merged =
        nullptr;  // all luminaires of a list instead: vpls are its own, position the local origin
};
// Result: of one luminaire on the nodes of a grid, filtered: all light of the VPLs looked at, and the blocked part of
// it; 2 planes in the shape of ScreenGrid::nodes.
Planes trace_occlusion(const ScreenGrid& screen, const LightView& light, Pool& pool);

// Result: irradiance per candela of peak × unit_m2 at every grid point: 3 planes in the shape of ScreenGrid::grid.
Planes gather_grid(const ScreenGrid& screen, const LightView& light, const Planes& occlusion, Pool& pool);

// out: direct illuminance per candela of peak, surfaces.row_length pixels a row. every_pixel: a shadow ray for each
// that light could reach; else one for 2 × 2 pixels on a plane, and for each of them only where their neighbours' rays
// end otherwise: a shadow narrower than two pixels that ends within three may be lost.
void direct_light(const Surfaces& surfaces, const trace::Geometry& geometry, const DirectLight& light, bool every_pixel,
                  std::vector<float>& out, Pool& pool);

// Irradiance at one point with the whole list, a ray to each VPL, and many short rays: rgb per candela of
// peak. parts: what each of the list's subsets with its share of the short rays finds alone; `light` is their mean.
struct PointLight {
    glm::dvec3 light{0.0};
    std::array<glm::dvec3, kSubsets> parts{};
};
// point: local, m, on its surface.
PointLight at_point(const LightView& light, const glm::dvec3& point, const glm::dvec3& normal);

}  // namespace gonio::shade
