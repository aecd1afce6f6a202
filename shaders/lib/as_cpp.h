// The pure GLSL of this folder (pure.inc lists it) compiled as C++: namespace glsl in single precision, as a GPU runs
// it, and glsl64 in double, for sums and tests. One maths source for both; nothing is written twice.
#pragma once

#include <cmath>
#include <concepts>
#include <glm/glm.hpp>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wdouble-promotion"

namespace gonio::glsl {
namespace {
using namespace glm;
#include "shaders/lib/pure.inc"
}  // namespace
}  // namespace gonio::glsl

namespace gonio::glsl64 {
namespace {
using glm::abs, glm::cross, glm::dot, glm::exp2, glm::length, glm::mix, glm::normalize, std::exp, std::floor, std::log2,
    std::sqrt;
using vec2 = glm::dvec2;
using vec3 = glm::dvec3;
using vec4 = glm::dvec4;
// GLSL's literals are float: these take them beside doubles.
template <typename T>
concept Scalar = std::is_arithmetic_v<T>;
double max(Scalar auto a, Scalar auto b) {
    return a > b ? a : b;
}
double min(Scalar auto a, Scalar auto b) {
    return a < b ? a : b;
}
double clamp(Scalar auto x, Scalar auto low, Scalar auto high) {
    return x < low ? low : x > high ? high : x;
}
double atan(Scalar auto y, Scalar auto x) {
    return std::atan2(y, x);
}
double pow(Scalar auto x, Scalar auto y) {
    return std::pow(x, y);
}
#define float double
#include "shaders/lib/pure.inc"
#undef float
}  // namespace
}  // namespace gonio::glsl64

#pragma GCC diagnostic pop
