// A picture's surfaces, and a grid of points on them, one per 4 × 4 pixels. While anything moves indirect light is
// found at these points, and joint bilateral upsampling brings it to the pixels (docs/rendering.md).
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "server/base/pool.h"
#include "server/lighting/grid.h"
#include "server/lighting/kernels.h"
#include "server/scene/eye.h"
#include "server/trace/geometry.h"

namespace gonio::lighting {

inline constexpr int kStep = 4;  // pixels between points of a grid

// The depth and normals of a target and the rays through its pixels; rows from the bottom.
struct GBuffer {
    int width = 0, height = 0;
    Rays rays;
    float depth_per_pixel = 0.0f;       // width of a pixel per metre of depth
    std::vector<float> depth;           // near / distance; 0 no surface; row_length floats a row
    std::vector<std::uint32_t> normal;  // octahedral, 2 snorm16
    std::size_t row_length = 0;         // a multiple of 4·kSimdWidth
};

// Sets a picture's size and rays and makes room for its surfaces. near_m: whose share of the distance depth is.
void look_through(const Eye& eye, const trace::Geometry& geometry, float near_m, int width, int height,
                  GBuffer& gbuffer);

// What one pixel shows; depth 0: no surface.
struct Spot {
    glm::vec3 position{0.0f}, normal{0.0f};  // local, m; unit
    float depth = 0.0f;                      // along the view axis, m
};
Spot spot_at(const GBuffer& gbuffer, int x, int y);

// Distance off a plane that is still near when values are brought to finer points, in steps of their grid.
inline constexpr float kUpsampleNear = 2.0f;

// How a grid's values come to the pixels (upsample.h).
struct ToPixels {
    std::vector<std::uint32_t> weights;  // of weights_row, GBuffer::row_length a row
    std::vector<std::uint8_t> poor;      // likewise, a quarter of it a row
    struct Odd {
        std::uint32_t x, from;
    };
    // By row: pixels that do not follow their weights, in order, and the point in the grid's arrays that each is of.
    std::vector<std::vector<Odd>> odd;
    // Whether the four points around a pixel of a surface are poorly like it.
    static bool is_poor(std::uint32_t weights) {
        return (weights & 255u) + (weights >> 8 & 255u) + (weights >> 16 & 255u) + (weights >> 24) < kPoorSum;
    }
};

// What does not depend on the luminaires: made once per camera.
struct ScreenGrid {
    float depth_per_point = 0.0f;  // distance of neighbouring grid points per metre of depth
    Grid grid;
    ToPixels to_pixels;
    // Where surfaces are finer than the grid pixels have points of their own, outside its rows. By such a point: where
    // its pixel lies in the picture's arrays.
    std::vector<std::uint32_t> own_pixels;
};
// screen: of any former grid, whose memory is used again. own_points: whether pixels get points of their own, at most
// one of kOwnPoints.
inline constexpr std::size_t kOwnPoints = 16;
void make_grid(const GBuffer& gbuffer, bool own_points, ScreenGrid& screen, Pool& pool);

}  // namespace gonio::lighting
