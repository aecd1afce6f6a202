// The few SIMD kernels that pay: bringing the grid to the pixels, half floats. Highway picks the
// instruction set at run time. Pure functions; any thread; pointers may be unaligned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace gonio::lighting {

inline constexpr std::size_t kSimdWidth = 16;  // arrays are padded to this many floats, the widest set's lanes

// Points that receive light, as arrays; positions in m, local (server/trace/geometry.h), normals unit or all zero where
// there is no surface.
struct Points {
    const float *x, *y, *z, *nx, *ny, *nz;
};

// How pixels look at the scene: the ray through pixel (x, y), counted from the bottom left, is
// corner + x × right + y × up, one metre deep.
struct Rays {
    glm::vec3 eye;  // local, m
    glm::vec3 corner, right, up;
    float near_m;
};
// One row of `width` pixels, a multiple of 4·kSimdWidth: the weights of the four points around each in a joint
// bilateral upsampling. The grid has one point per 4 × 4 pixels. Point (i, j) stands at pixel (4i + 2, 4j + 2). Each
// weight is a byte: the lower left in the lowest, then lower right, upper left, upper right. Points on one plane are
// alike by 1. Where the four are alike by less than kPoorWeight all in all, the bytes sum to some 127, else to 255. By
// less than kLeastWeight, or without a surface, they are 0. The argument grid is its first point, stride values a row.
// Grid::kBorder points beyond its edges and kSimdWidth more may be read. The depth is near / distance, 0 no surface.
// The normal is octahedral, 2 snorm16 in 4 bytes. Of every four pixels, poor is how many show a surface that the points
// are poorly alike.
inline constexpr float kPoorWeight = 0.2f, kLeastWeight = 0.02f;
inline constexpr unsigned kPoorSum = 192;  // a smaller one is poor
struct WeightedRow {
    int y, width;
    const float* depth;
    const std::uint32_t* normal;
    std::uint32_t* weights;  // out, as the next
    std::uint8_t* poor;
};
void weights_row(const Points& grid, std::ptrdiff_t stride, const Rays& rays, float near_per_depth,
                 const WeightedRow& row);
// The same row from the values of such a grid, by these weights. stride: of the grid's rows. out: 4 half floats per
// pixel, rgb and 1.
void upsample_row(const float* const* values, std::ptrdiff_t stride, int y, int width, const std::uint32_t* weights,
                  std::uint16_t* out);

// Half floats of `count` floats, a multiple of kSimdWidth; what is greater becomes 65,504.
void to_halves(const float* from, std::size_t count, std::uint16_t* to);
// The same of three arrays: 4 half floats each, rgb and 1.
void rgb_to_halves(const float* r, const float* g, const float* b, std::size_t count, std::uint16_t* to);
void from_halves(const std::uint16_t* from, std::size_t count, float* to);

}  // namespace gonio::lighting
