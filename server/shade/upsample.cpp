#include "server/shade/upsample.h"

#include <algorithm>

#include "shaders/lib/as_cpp.h"

namespace gonio::shade {
namespace {

// Second points must be as much like a pixel, all in all, to be taken rather than what its weights, if poor ones, give.
constexpr float kSecondAlike = 0.5f;

std::size_t row_of(const Surfaces& surfaces, int y) {
    return static_cast<std::size_t>(y) * surfaces.row_length;
}

// How like a pixel's surface a point of the grid's arrays is, 0..1.
float likeness(const Grid& grid, std::size_t at, const Spot& spot, float near_per_depth) {
    return glsl::surface_likeness(
        glm::dot(spot.normal, grid.normal(at)),
        glm::dot(spot.normal, grid.position(at) - spot.position) / (spot.depth * near_per_depth));
}

// Adds the second points around pixel x, those of its cell and of the eight around it, by their likeness. Result:
// false, and none, where they are less like it than `least` all in all.
bool add_second_points(const ScreenGrid& screen, int x, int y, const Spot& spot, float near_per_depth, float least,
                       std::vector<ToPixels::Odd>& odd) {
    const std::size_t first = odd.size();
    float total = 0.0f;
    for (int k = 0; k < 9; ++k) {
        const std::uint32_t at =
            screen.second[static_cast<std::size_t>(screen.grid.at(x / 4 - 1 + k % 3, y / 4 - 1 + k / 3))];
        const float share = at != 0 ? likeness(screen.grid, at, spot, near_per_depth) : 0.0f;
        if (!(share >= kLeastAlike)) continue;
        odd.push_back({static_cast<std::uint32_t>(x), at, share});
        total += share;
    }
    if (total < least) odd.resize(first);
    for (std::size_t i = first; i < odd.size(); ++i) odd[i].share /= total;
    return odd.size() > first;
}

// Result: of the sixteen points around a pixel the one most like its surface, else the nearest that shows one; 0: none.
std::size_t most_alike(const Grid& grid, int x, int y, const Spot& spot, float near_per_depth) {
    float best = 0.0f;
    std::size_t from = 0;
    for (int k = 0; k < 16; ++k) {
        const auto at = static_cast<std::size_t>(grid.at(std::clamp((x + 2) / 4 - 2 + k % 4, 0, grid.width - 1),
                                                         std::clamp((y + 2) / 4 - 2 + k / 4, 0, grid.height - 1)));
        if (!(grid.values[6][at] > 0.0f)) continue;
        const glm::vec3 to = grid.position(at) - spot.position;
        const float alike =
            likeness(grid, at, spot, near_per_depth) + 1e-4f / (1.0f + glm::dot(to, to) / (spot.depth * spot.depth));
        if (alike > best) best = alike, from = at;
    }
    return from;
}

}  // namespace

void make_weights(const Surfaces& surfaces, ScreenGrid& screen, Pool& pool) {
    const GridRows rows = screen.grid.rows();
    ToPixels& to = screen.to_pixels;
    to.weights.resize(row_of(surfaces, surfaces.height));
    to.poor.resize(to.weights.size() / 4);
    pool.run(surfaces.height, [&](int y) {
        const std::size_t row = row_of(surfaces, y);
        weights_row(rows, y, static_cast<int>(surfaces.row_length), surfaces.rays,
                    kUpsampleNear * screen.depth_per_point, surfaces.depth.data() + row, surfaces.normal.data() + row,
                    to.weights.data() + row, to.poor.data() + row / 4);
    });
}

void take_after(const Surfaces& surfaces, ScreenGrid& screen, Pool& pool) {
    const float near_per_depth = kUpsampleNear * screen.depth_per_point;
    ToPixels& to = screen.to_pixels;
    to.odd.resize(static_cast<std::size_t>(surfaces.height));
    pool.run(surfaces.height, [&](int y) {
        std::vector<ToPixels::Odd>& odd = to.odd[static_cast<std::size_t>(y)];
        odd.clear();
        const std::size_t row = row_of(surfaces, y);
        for (int x = 0; x < surfaces.width; ++x) {
            const std::size_t at = row + static_cast<std::size_t>(x);
            if (to.poor[at / 4] == 0) {
                x |= 3;
                continue;
            }
            const bool weighed = to.weights[at] != 0;
            if (!ToPixels::is_poor(to.weights[at]) || !(surfaces.depth[at] > 0.0f)) continue;
            if (weighed && screen.second.empty()) continue;
            const Spot spot = spot_at(surfaces, x, y);
            const float least = weighed ? kSecondAlike : kLeastAlike;
            if (!screen.second.empty() && add_second_points(screen, x, y, spot, near_per_depth, least, odd)) continue;
            if (weighed) continue;
            const std::size_t from = most_alike(screen.grid, x, y, spot, near_per_depth);
            if (from != 0) odd.push_back({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(from), 1.0f});
        }
    });
}

void upsample_line(const Surfaces& surfaces, const ScreenGrid& screen, const Planes& light, int y, std::uint16_t* out) {
    const Grid& grid = screen.grid;
    const float* values[3];
    for (std::size_t k = 0; k < 3; ++k) values[k] = light[k].data() + grid.at(0, 0);
    upsample_row(values, grid.stride, y, static_cast<int>(surfaces.row_length),
                 screen.to_pixels.weights.data() + row_of(surfaces, y), out);
    const std::vector<ToPixels::Odd>& odd = screen.to_pixels.odd[static_cast<std::size_t>(y)];
    static thread_local std::vector<float> sums;  // 4 for each pixel of `odd`
    static thread_local std::vector<std::uint16_t> halves;
    sums.assign(4 * odd.size() + kLanes, 1.0f);
    std::size_t pixels = 0;
    for (std::size_t i = 0; i < odd.size(); ++pixels) {
        const std::uint32_t x = odd[i].x;
        glm::vec3 sum(0.0f);
        for (; i < odd.size() && odd[i].x == x; ++i)
            sum += odd[i].share * glm::vec3(light[0][odd[i].from], light[1][odd[i].from], light[2][odd[i].from]);
        for (int k = 0; k < 3; ++k) sums[4 * pixels + static_cast<std::size_t>(k)] = sum[k];
    }
    halves.resize(sums.size());
    to_halves(sums.data(), (4 * pixels + kLanes - 1) / kLanes * kLanes, halves.data());
    pixels = 0;
    for (std::size_t i = 0; i < odd.size(); ++i) {
        if (i > 0 && odd[i].x == odd[i - 1].x) continue;
        std::copy_n(halves.data() + 4 * pixels++, 3, out + 4 * odd[i].x);
    }
}

void upsample(const Surfaces& surfaces, const ScreenGrid& screen, const Planes& light, std::vector<std::uint16_t>& out,
              Pool& pool) {
    out.resize(row_of(surfaces, surfaces.height) * 4);
    pool.run(surfaces.height,
             [&](int y) { upsample_line(surfaces, screen, light, y, out.data() + 4 * row_of(surfaces, y)); });
}

}  // namespace gonio::shade
