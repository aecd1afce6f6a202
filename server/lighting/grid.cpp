#include "server/lighting/grid.h"

#include <algorithm>

namespace gonio::lighting {

void Grid::resize(int new_width, int new_height, std::size_t new_spare) {
    width = new_width;
    height = new_height;
    spare = (new_spare + kSimdWidth - 1) / kSimdWidth * kSimdWidth;
    // Rows end in a border and the widest vector that starts at the last value.
    stride = (width + 2 * kBorder + static_cast<std::ptrdiff_t>(kSimdWidth) + 15) / 16 * 16;
    for (std::vector<float>& array : values) array.assign(size() + kSimdWidth, 0.0f);
}

void Grid::set(std::size_t at, const glm::vec3& position, const glm::vec3& normal, float depth) {
    for (int k = 0; k < 3; ++k) {
        values[k][at] = position[k];
        values[k + 3][at] = normal[k];
    }
    values[6][at] = depth;
}

void Grid::extend(std::vector<float>& plane) const {
    for (int y = 0; y < height; ++y) {
        for (int b = 1; b <= kBorder; ++b) {
            plane[static_cast<std::size_t>(at(-b, y))] = plane[static_cast<std::size_t>(at(0, y))];
            plane[static_cast<std::size_t>(at(width - 1 + b, y))] = plane[static_cast<std::size_t>(at(width - 1, y))];
        }
    }
    for (int b = 1; b <= kBorder; ++b) {
        std::copy_n(plane.begin() + at(-kBorder, 0), stride, plane.begin() + at(-kBorder, -b));
        std::copy_n(plane.begin() + at(-kBorder, height - 1), stride, plane.begin() + at(-kBorder, height - 1 + b));
    }
}

}  // namespace gonio::lighting
