// A filter for pictures to look at: it takes the noise out of few samples, and a bias takes its place. Not for values
// that are measured. docs/rendering.md has its formulas. Pure functions, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace gonio::trace {

// Samples a pixel: with fewer, a filtered picture looks worse than the live one (FLIP, docs/rendering.md).
inline constexpr std::uint32_t kLeastDenoised = 64;

// What a picture's pixels show, rows from the top, each a mean over the pixel's samples.
struct DenoisePlanes {
    int width_px = 0, height_px = 0;
    std::array<std::vector<glm::vec3>, 2> half;  // radiance that holds noise, of each half of the samples, cd/m²;
                                                 // albedo times something smooth
    std::vector<glm::vec3> exact;                // radiance that holds none: left as it is
    std::vector<glm::vec3> albedo;               // 0..1; 0 where there is no surface
    std::vector<glm::vec3> normal;               // of unit normals: shorter than 1 where they differ
    std::vector<float> inverse_depth;            // 1 over the distance along the view axis, 1/m: linear on a plane
    std::vector<float> inverse_depth_variance;   // of the samples within the pixel
};

struct Denoised {
    std::vector<glm::vec3> radiance;  // exact and filtered, cd/m²
    double noise = 0.0;  // root mean square of half the difference of the two filtered halves, over the mean luminance
};

// Result: the planes' radiance without most of its noise. All planes have width · height values. threads: 0:
// thread_count(). idle: they yield to everything else.
Denoised denoise(const DenoisePlanes& planes, int threads = 0, bool idle = false);

}  // namespace gonio::trace
