// A picture's surfaces, and a grid of points on them, one per 4 × 4 pixels. While anything moves indirect light is
// found at these points, and joint bilateral upsampling brings it to the pixels (docs/rendering.md).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "server/base/pool.h"
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
    std::vector<std::uint32_t> detail;  // likewise, normal maps included; empty where the scene has none
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
// Result: the normal that direct light has there, of normal maps where the scene has some.
glm::vec3 lit_normal_at(const GBuffer& gbuffer, int x, int y);

// Points on a picture's surfaces in rows, with a border all around, so that windows need no edges; and some beside
// them.
struct Grid {
    static constexpr int kBorder = 4;
    int width = 0, height = 0;
    std::ptrdiff_t stride = 0;
    std::size_t spare = 0;         // room for points outside the rows, from first_spare() on
    std::vector<float> values[7];  // x y z nx ny nz depth

    void resize(int new_width, int new_height, std::size_t new_spare = 0);  // all values become 0
    std::ptrdiff_t at(int x, int y) const { return (y + kBorder) * stride + x + kBorder; }
    std::size_t first_spare() const {
        return static_cast<std::size_t>(stride) * static_cast<std::size_t>(height + 2 * kBorder);
    }
    std::size_t size() const { return first_spare() + spare; }
    glm::vec3 position(std::size_t at) const { return {values[0][at], values[1][at], values[2][at]}; }
    glm::vec3 normal(std::size_t at) const { return {values[3][at], values[4][at], values[5][at]}; }
    void set(std::size_t at, const glm::vec3& position, const glm::vec3& normal, float depth);
    // Repeats the outermost values of an array of this shape into its border.
    void extend(std::vector<float>& plane) const;
};
using Planes = std::vector<std::vector<float>>;

// How a grid's values come to the pixels. Point (i, j) stands at pixel (4i + 2, 4j + 2). A pixel takes the weighted
// mean of the four points around it (joint bilateral upsampling). A weight is a byte: the lower left's the lowest, then
// lower right, upper left, upper right. Points on one plane are alike by 1. Where the four are alike by less than 0.2
// all in all, the bytes sum to some 127, else to 255. By less than 0.02, or without a surface, they are 0.
struct ToPixels {
    std::vector<std::uint32_t> weights;  // GBuffer::row_length a row
    std::vector<std::uint8_t> poor;  // of every four pixels: how many show a surface that the points are poorly like
    struct Odd {
        std::uint32_t x, from;
    };
    // By row: pixels that do not follow their weights, in order, and the point in the grid's arrays that each is of.
    std::vector<std::vector<Odd>> odd;
};
inline constexpr unsigned kPoorSum = 192;  // of weights; a smaller one is poor

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

// light: 3 planes in the shape of the grid. out: 4 half floats per pixel, surfaces.row_length pixels a row.
void upsample(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, std::vector<std::uint16_t>& out,
              Pool& pool);
// The same of row y alone. Any thread.
void upsample_line(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, int y, std::uint16_t* out);

}  // namespace gonio::lighting
