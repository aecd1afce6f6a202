#include "server/lighting/upsample.h"

#include <algorithm>

#include "shaders/lib/as_cpp.h"

namespace gonio::lighting {
namespace {

std::size_t row_of(const GBuffer& gbuffer, int y) {
    return static_cast<std::size_t>(y) * gbuffer.row_length;
}

// How like a pixel's surface a point of the grid's arrays is, 0..1.
float edge_stopping_weight(const Grid& grid, std::size_t at, const Spot& spot, float near_per_depth) {
    return glsl::edge_stopping_weight(
        glm::dot(spot.normal, grid.normal(at)),
        glm::dot(spot.normal, grid.position(at) - spot.position) / (spot.depth * near_per_depth));
}

// Result: of the sixteen points around a pixel the one most like its surface, else the nearest that shows one; 0: none.
std::size_t best_point(const Grid& grid, int x, int y, const Spot& spot, float near_per_depth) {
    float best = 0.0f;
    std::size_t from = 0;
    for (int k = 0; k < 16; ++k) {
        const auto at = static_cast<std::size_t>(grid.at(std::clamp((x + 2) / 4 - 2 + k % 4, 0, grid.width - 1),
                                                         std::clamp((y + 2) / 4 - 2 + k / 4, 0, grid.height - 1)));
        if (!(grid.values[6][at] > 0.0f)) continue;
        const glm::vec3 to = grid.position(at) - spot.position;
        const float weight = edge_stopping_weight(grid, at, spot, near_per_depth) +
                             1e-4f / (1.0f + glm::dot(to, to) / (spot.depth * spot.depth));
        if (weight > best) best = weight, from = at;
    }
    return from;
}

}  // namespace

void make_weights(const GBuffer& gbuffer, ScreenGrid& screen, Pool& pool) {
    const Grid& grid = screen.grid;
    const Points points = points_at(grid.values, static_cast<std::size_t>(grid.at(0, 0)));
    ToPixels& to = screen.to_pixels;
    to.weights.resize(row_of(gbuffer, gbuffer.height));
    to.poor.resize(to.weights.size() / 4);
    pool.run(gbuffer.height, [&](int y) {
        const std::size_t row = row_of(gbuffer, y);
        weights_row(points, grid.stride, gbuffer.rays, kUpsampleNear * screen.depth_per_point,
                    {y, static_cast<int>(gbuffer.row_length), gbuffer.depth.data() + row, gbuffer.normal.data() + row,
                     to.weights.data() + row, to.poor.data() + row / 4});
    });
}

void take_after(const GBuffer& gbuffer, std::size_t most, ScreenGrid& screen, Pool& pool) {
    ToPixels& to = screen.to_pixels;
    const auto height = static_cast<std::size_t>(gbuffer.height);
    to.odd.resize(height);
    pool.run(gbuffer.height, [&](int y) {
        std::vector<ToPixels::Odd>& odd = to.odd[static_cast<std::size_t>(y)];
        odd.clear();
        const std::size_t row = row_of(gbuffer, y);
        for (std::size_t x = 0; x < static_cast<std::size_t>(gbuffer.width); ++x) {
            if (to.poor[(row + x) / 4] == 0)
                x |= 3;
            else if (ToPixels::is_poor(to.weights[row + x]) && gbuffer.depth[row + x] > 0.0f)
                odd.push_back({static_cast<std::uint32_t>(x), 0});
        }
    });
    std::vector<std::size_t> before{0};  // row y: of such pixels
    for (const auto& odd : to.odd) before.push_back(before.back() + odd.size());
    const std::size_t wanted = before.back(), own = std::min({wanted, most, screen.grid.spare});
    screen.own_pixels.resize(own);
    pool.run(gbuffer.height, [&](int y) {
        std::vector<ToPixels::Odd>& odd = to.odd[static_cast<std::size_t>(y)];
        std::size_t kept = 0;
        for (std::size_t i = 0; i < odd.size(); ++i) {
            ToPixels::Odd pixel = odd[i];
            const std::size_t at = row_of(gbuffer, y) + pixel.x, nth = before[static_cast<std::size_t>(y)] + i,
                              point = nth * own / wanted;
            const Spot spot = spot_at(gbuffer, static_cast<int>(pixel.x), y);
            if ((nth + 1) * own / wanted > point) {  // so many of those that want one, evenly
                pixel.from = static_cast<std::uint32_t>(screen.grid.first_spare() + point);
                screen.own_pixels[point] = static_cast<std::uint32_t>(at);
                screen.grid.set(pixel.from, spot.position, spot.normal, spot.depth);
            } else if (to.weights[at] == 0) {
                pixel.from = static_cast<std::uint32_t>(best_point(screen.grid, static_cast<int>(pixel.x), y, spot,
                                                                   kUpsampleNear * screen.depth_per_point));
            }
            if (pixel.from != 0) odd[kept++] = pixel;
        }
        odd.resize(kept);
    });
}

void upsample_line(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, int y, std::uint16_t* out) {
    const Grid& grid = screen.grid;
    const float* values[3];
    for (std::size_t k = 0; k < 3; ++k) values[k] = light[k].data() + grid.at(0, 0);
    upsample_row(values, grid.stride, y, static_cast<int>(gbuffer.row_length),
                 screen.to_pixels.weights.data() + row_of(gbuffer, y), out);
    const std::vector<ToPixels::Odd>& odd = screen.to_pixels.odd[static_cast<std::size_t>(y)];
    static thread_local std::vector<float> own;  // 4 for each pixel of `odd`
    static thread_local std::vector<std::uint16_t> halves;
    own.resize((4 * odd.size() + kSimdWidth - 1) / kSimdWidth * kSimdWidth);
    halves.resize(own.size());
    for (std::size_t i = 0; i < odd.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) own[4 * i + k] = light[k][odd[i].from];
    }
    to_halves(own.data(), own.size(), halves.data());
    for (std::size_t i = 0; i < odd.size(); ++i) std::copy_n(halves.data() + 4 * i, 3, out + 4 * odd[i].x);
}

void upsample(const GBuffer& gbuffer, const ScreenGrid& screen, const Planes& light, std::vector<std::uint16_t>& out,
              Pool& pool) {
    out.resize(row_of(gbuffer, gbuffer.height) * 4);
    pool.run(gbuffer.height,
             [&](int y) { upsample_line(gbuffer, screen, light, y, out.data() + 4 * row_of(gbuffer, y)); });
}

}  // namespace gonio::lighting
