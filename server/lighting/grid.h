// Points on a picture's surfaces in rows, with a border all around, so that windows need no edges; and some beside
// them.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#include "server/lighting/kernels.h"

namespace gonio::lighting {

struct Grid {
    static constexpr int kBorder = 4;
    int width = 0, height = 0;
    std::ptrdiff_t stride = 0;
    std::size_t spare = 0;         // places for points outside the rows, from first_spare() on
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

// The points from `at` on of the six arrays x y z nx ny nz.
template <typename Array>
Points points_at(const Array* arrays, std::size_t at) {
    const auto from = [&](int k) { return std::data(arrays[k]) + at; };
    return {from(0), from(1), from(2), from(3), from(4), from(5)};
}

}  // namespace gonio::lighting
