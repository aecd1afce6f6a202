// The few SIMD kernels that pay: gathering VPLs, filtering the grid, bringing the grid to the pixels. Highway picks the
// instruction set at run time. Pure functions; any thread; pointers may be unaligned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace gonio::shade {

inline constexpr std::size_t kLanes = 16;  // arrays are padded to this many floats, the widest set's lanes

// One virtual point light. Positions are relative to the luminaire, world axes.
struct Vpl {
    glm::vec4 position_area;  // xyz: m; w: represented area / pi, m²
    glm::vec4 normal;         // xyz: unit length, world; all zero where there is none
    glm::vec4 intensity;      // rgb: flux / pi per candela of the profile's peak, sr^-1 · lm/cd
};

// Points that receive light, as arrays; positions in m, local (server/trace/geometry.h), normals unit or all zero where
// there is no surface.
struct Points {
    const float *x, *y, *z, *nx, *ny, *nz;
};

// out = weight × the sum over the VPLs at `count` points (a multiple of kLanes): irradiance per candela of peak, 1/m².
// origin: what VPL positions are relative to, local, m. kappa: how much near light is left to rays (vpl.glsl).
void gather(const Points& points, std::size_t count, const glm::vec3& origin, std::span<const Vpl> vpls, float kappa,
            float weight, float* red, float* green, float* blue);

// The single terms of that sum as luminance at kLanes points: out[v × kLanes + lane].
void terms(const Points& points, const glm::vec3& origin, std::span<const Vpl> vpls, float kappa, float* out);
// out[v]: of `count` such VPLs, each one's share in what all bring to all lanes. Result: false where they bring
// nothing.
bool shares(const float* terms, std::size_t count, float* out);

// A grid's rows as the filters read them: row r starts at r × stride; Grid::kBorder values and kLanes more may be
// read on both sides of what is written.
struct GridRows {
    Points points;
    const float* depth;  // distance along the view axis, m
    std::ptrdiff_t stride;
};
// out[k][i] = mean of in[k], k < 3, over the window of 4 × 4 of the row's points from two before each on, weighted by
// surface_likeness. near_per_depth: the distance off a point's plane that is still near, per metre of depth.
void filter_row(const GridRows& grid, std::ptrdiff_t row, int width, float near_per_depth, const float* const* in,
                float* const* out);
// What nodes learned by asking, each for itself: all that the VPLs asked bring, what of it is blocked, as a share, and
// the variance of that share.
struct NodeShares {
    const float *open, *blocked, *share, *variance;
};
// open and blocked: means over the window of 3 × 3 nodes around each of the row, weighted by a tent, by
// surface_likeness, and by how well shares agree: from 1 where they are equal down to 0 where they differ by four
// standard errors of their difference, that is, where the two see other things.
void filter_nodes_row(const GridRows& grid, std::ptrdiff_t row, int width, float near_per_depth, const NodeShares& in,
                      float* open, float* blocked);

// How pixels look at the scene: the ray through pixel (x, y), counted from the bottom left, is
// corner + x × right + y × up, one metre deep.
struct Rays {
    glm::vec3 eye;  // local, m
    glm::vec3 corner, right, up;
    float near_m;
};
// One row of `width` pixels, a multiple of 4·kLanes: the weights of the four points around each in a joint bilateral
// upsampling of a grid of one point per 4 × 4 pixels, point (i, j) standing at pixel (4i + 2, 4j + 2): a byte each, the
// lower left in the lowest, lower right, upper left, upper right. Where they are alike, 1 on one plane, by less than
// kPoorlyAlike all in all, the bytes sum to some 127, else to 255; by less than kLeastAlike, or without a surface: 0.
// depth: near / distance, 0 no surface; normal: octahedral, 2 snorm16 in 4 bytes. poor: of every four pixels, how many
// show a surface that the points are poorly alike.
inline constexpr float kPoorlyAlike = 0.2f, kLeastAlike = 0.02f;
inline constexpr unsigned kPoorSum = 192;  // a smaller one is poor
void weights_row(const GridRows& grid, int y, int width, const Rays& rays, float near_per_depth, const float* depth,
                 const std::uint32_t* normal, std::uint32_t* weights, std::uint8_t* poor);
// The same row from the values of such a grid, by these weights. stride: of the grid's rows. out: 4 half floats per
// pixel, rgb and 1.
void upsample_row(const float* const* values, std::ptrdiff_t stride, int y, int width, const std::uint32_t* weights,
                  std::uint16_t* out);

// A photometric web as the kernels read it.
struct Web {
    const std::uint32_t* words;  // of pack_web (server/render/web_buffer.h)
    bool symmetric;              // the same in all directions around its axis
    bool even_v, even_h;         // its angles are equally spaced, within 1e-6 rad
};
Web web_of(const std::uint32_t* words);

// A luminaire as the direct light's kernel sees it.
struct DirectLight {
    glm::vec3 position;  // local, m
    glm::mat3 light_from_world;
    Web web;
    float unit_m2;  // the result is measured in
};
// One row of `width` pixels, a multiple of kLanes: unoccluded illuminance per candela of peak × unit_m2, 0 where there
// is no surface; and where a ray from there to the luminaire starts: off_m plus off_per_depth times the depth off the
// surface, local, m. depth, normal: as of upsample_row.
void direct_row(const DirectLight& light, int y, int width, const Rays& rays, float off_m, float off_per_depth,
                const float* depth, const std::uint32_t* normal, float* lux_per_cd, float* from_x, float* from_y,
                float* from_z);

// The same at `count` points, a multiple of kLanes, whatever stands between.
void direct_points(const DirectLight& light, const Points& points, std::size_t count, float* lux_per_cd);

// Half floats of `count` floats, a multiple of kLanes; what is greater becomes 65,504.
void to_halves(const float* from, std::size_t count, std::uint16_t* to);

// to = share × (factor × from) + (1 − share) × to, half floats; count: a multiple of kLanes; likewise bounded.
void mix_halves(const float* from, float factor, float share, std::size_t count, std::uint16_t* to);
// to: plus factor × from. Any count that is a multiple of 4; both arrays end on whole lanes.
void add_halves(const std::uint16_t* from, float factor, std::size_t count, float* to);

}  // namespace gonio::shade
