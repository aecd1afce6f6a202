// What SIMD kernels read, and those of half floats. Highway picks the instruction set at run time. Pure functions; any
// thread; pointers may be unaligned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace gonio::lighting {

inline constexpr std::size_t kSimdWidth = 16;  // arrays are padded to this many floats, the widest set's SIMD lanes

// Points that receive light, as arrays; positions in m, local (server/trace/geometry.h), normals unit or all zero where
// there is no surface.
struct Points {
    const float *x, *y, *z, *nx, *ny, *nz;
};
// The points from `at` on of the six arrays x y z nx ny nz.
template <typename Array>
Points points_at(const Array* arrays, std::size_t at) {
    const auto from = [&](int k) { return std::data(arrays[k]) + at; };
    return {from(0), from(1), from(2), from(3), from(4), from(5)};
}

// How pixels look at the scene: the ray through pixel (x, y), counted from the bottom left, is
// corner + x × right + y × up, one metre deep.
struct Rays {
    glm::vec3 eye;  // local, m
    glm::vec3 corner, right, up;
    float near_m;
};

// Half floats of `count` floats, a multiple of kSimdWidth; what is greater becomes 65,504.
void to_halves(const float* from, std::size_t count, std::uint16_t* to);
// The same of three arrays: 4 half floats each, rgb and 1.
void rgb_to_halves(const float* r, const float* g, const float* b, std::size_t count, std::uint16_t* to);
void from_halves(const std::uint16_t* from, std::size_t count, float* to);
// Adds `count` half floats, any number, to as many floats.
void add_halves(const std::uint16_t* from, std::size_t count, float* to);
// Adds `count` floats, any number, × weight to as many.
void add_scaled(const float* from, float weight, std::size_t count, float* to);

}  // namespace gonio::lighting
