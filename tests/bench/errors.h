// What a picture of illuminance is off by: which pixels are compared, and the figures made of them. No GL.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace gonio::bench {

// Result: one pixel in each of cells × cells equal cells of the picture, at a hashed position, the same in every run;
// x to the right, y up from the lowest row. Fewer cells where the picture has fewer pixels.
std::vector<glm::ivec2> stratified_pixels(int width_px, int height_px, int cells);

// Shown values a against a reference b, relative to b's mean m; NaN-free for m > 0, all 0 for m = 0.
struct Errors {
    double rmse = 0.0;            // sqrt(mean((a-b)²) - mean variance of b) / m
    double rmse99 = 0.0;          // the same without the 1 % of pixels with the largest squared error
    double p95 = 0.0, p99 = 0.0;  // percentiles of |a-b| / max(b, 0.05 m)
    double bias = 0.0;            // mean(a-b) / m
    double noise = 0.0;           // sqrt(mean variance of b) / m: what b itself is uncertain by
};
// variance: of each b, in its unit squared; empty: b is exact. Sizes are equal.
Errors errors_of(std::span<const double> shown, std::span<const double> reference, std::span<const double> variance);

// Result: which points no other beats in both, as indices in ascending x: y falls strictly. Points that are not finite
// are left out.
std::vector<std::size_t> pareto_front(std::span<const glm::dvec2> points);

}  // namespace gonio::bench
