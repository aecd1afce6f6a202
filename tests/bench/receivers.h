// The surface points that chosen pixels show, and the unoccluded one-bounce light there from a fine reflective shadow
// map: the first of the two references. Render thread.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::bench {

// What one pixel's centre shows.
struct Receiver {
    glm::ivec2 pixel{0};         // x to the right, y up from the lowest row
    glm::dvec3 position{0.0};    // world, m
    glm::dvec3 normal{0, 1, 0};  // unit, world; the shading normal, as the picture is lit with
};

// Result: those of the pixels that show a surface, in order, from the same G-buffer pass as the live picture.
std::vector<Receiver> receivers_of(const Scene& scene, std::span<const glm::ivec2> pixels);

// Result: luminance of a picture's rgb (rows from the bottom) at each receiver's pixel.
std::vector<double> shown_lx(const std::vector<glm::vec3>& picture, int width_px, std::span<const Receiver> receivers);

// Result: indirect illuminance of one unoccluded bounce at each receiver, lux (Rec. 709 luminance): the sum of all
// lights over all texels of an RSM of rsm_size² texels a face, with the area-bounded kernel, in double precision.
std::vector<double> dense_rsm_lx(const Scene& scene, std::span<const Receiver> receivers, int rsm_size);

}  // namespace gonio::bench
