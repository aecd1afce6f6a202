#include "server/shade/close_blocks.h"

#include <algorithm>
#include <numeric>

namespace gonio::shade {
namespace {

// Blocks whose curvature is below this are left to the common windows: 3 degrees within two grid points.
constexpr float kLeastCurvature = 0.04f;
// Two grid points apart on one surface, unless further apart than this many steps of the grid.
constexpr float kSameSurface = 12.0f;

// Sum over the block's points of 1 − cosine between their normals and those two points on, where it is one surface that
// bends rather than an edge or another surface behind.
float curvature(const Grid& grid, float depth_per_point, int first_x, int first_y) {
    const auto vec = [&](int first, std::size_t at) {
        return glm::vec3(grid.values[first][at], grid.values[first + 1][at], grid.values[first + 2][at]);
    };
    float sum = 0.0f;
    for (int y = first_y; y < std::min(first_y + kCloseSide, grid.height); ++y) {
        for (int x = first_x; x < std::min(first_x + kCloseSide, grid.width); ++x) {
            const auto at = static_cast<std::size_t>(grid.at(x, y));
            if (!(grid.values[6][at] > 0.0f)) continue;
            const glm::vec3 position = vec(0, at), normal = vec(3, at);
            const float far = kSameSurface * depth_per_point * grid.values[6][at];
            for (const std::ptrdiff_t step : {std::ptrdiff_t{2}, 2 * grid.stride}) {
                const std::size_t other = at + static_cast<std::size_t>(step);
                const float cosine = glm::dot(normal, vec(3, other));
                const glm::vec3 d = vec(0, other) - position;
                if (cosine > 0.0f && glm::dot(d, d) < far * far) sum += std::max(0.0f, 1.0f - cosine);
            }
        }
    }
    return sum;
}

}  // namespace

void choose_close_blocks(const Grid& grid, float depth_per_point, float share, CloseBlocks& close, Pool& pool) {
    close.blocks.clear();
    const int columns = (grid.width + kCloseSide - 1) / kCloseSide, rows = (grid.height + kCloseSide - 1) / kCloseSide;
    const auto most = static_cast<std::size_t>(share * static_cast<float>(columns * rows));
    if (most == 0) return;
    std::vector<float> curved(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    pool.run(rows, [&](int row) {
        for (int column = 0; column < columns; ++column)
            curved[static_cast<std::size_t>(row * columns + column)] =
                curvature(grid, depth_per_point, column * kCloseSide, row * kCloseSide);
    });
    std::vector<int> order(curved.size());
    std::iota(order.begin(), order.end(), 0);
    std::erase_if(order, [&](int block) { return curved[static_cast<std::size_t>(block)] < kLeastCurvature; });
    if (order.size() > most) {
        std::nth_element(
            order.begin(), order.begin() + static_cast<std::ptrdiff_t>(most), order.end(), [&](int a, int b) {
                const float of_a = curved[static_cast<std::size_t>(a)], of_b = curved[static_cast<std::size_t>(b)];
                return of_a != of_b ? of_a > of_b : a < b;
            });
        order.resize(most);
    }
    if (order.empty()) return;
    std::sort(order.begin(), order.end());
    close.columns = columns;
    close.is_close.assign(curved.size(), 0);
    for (int block : order) {
        close.is_close[static_cast<std::size_t>(block)] = 1;
        close.blocks.emplace_back(block % columns * kCloseSide, block / columns * kCloseSide);
    }

    for (std::vector<float>& plane : close.normals) plane.assign(grid.size() + kLanes, 0.0f);
    close.nodes.resize((grid.width + kCloseNodeStride - 1) / kCloseNodeStride,
                       (grid.height + kCloseNodeStride - 1) / kCloseNodeStride);
    for (std::vector<float>& array : close.points) array.assign(kCloseSide * kCloseSide * close.blocks.size(), 0.0f);
    for (std::size_t i = 0; i < close.blocks.size(); ++i) {
        for (int k = 0; k < kCloseSide * kCloseSide; ++k) {
            const int x = close.blocks[i].x + k % kCloseSide, y = close.blocks[i].y + k / kCloseSide;
            if (x >= grid.width || y >= grid.height) continue;
            const auto at = static_cast<std::size_t>(grid.at(x, y));
            const std::size_t to = kCloseSide * kCloseSide * i + static_cast<std::size_t>(k);
            for (int a = 0; a < 6; ++a) close.points[a][to] = grid.values[a][at];
            for (int a = 0; a < 3; ++a) close.normals[a][at] = grid.values[a + 3][at];
            if (x % kCloseNodeStride != 0 || y % kCloseNodeStride != 0) continue;
            const auto node = static_cast<std::size_t>(close.nodes.at(x / kCloseNodeStride, y / kCloseNodeStride));
            for (int a = 0; a < 7; ++a) close.nodes.values[a][node] = grid.values[a][at];
        }
    }
}

void gather_close(const CloseBlocks& close, const Grid& grid, const VplCast& cast, const glm::vec3& origin, float kappa,
                  float weight, const std::function<void(int, int, const glm::vec3&)>& put, Pool& pool) {
    constexpr std::size_t kPoints = kCloseSide * kCloseSide, kTogether = 2;  // blocks
    static_assert(kPoints % kLanes == 0);
    const std::size_t count = close.blocks.size();
    pool.run(static_cast<int>((count + kTogether - 1) / kTogether), [&](int job) {
        const std::size_t first = static_cast<std::size_t>(job) * kTogether,
                          n = std::min(kTogether, count - first) * kPoints;
        alignas(64) float rgb[3][kTogether * kPoints];
        gather(points_at(close.points, static_cast<std::ptrdiff_t>(first * kPoints)), n, origin, cast.vpls, kappa,
               weight, rgb[0], rgb[1], rgb[2]);
        for (std::size_t i = 0; i < n; ++i) {
            const glm::ivec2 block = close.blocks[first + i / kPoints];
            const int x = block.x + static_cast<int>(i % kCloseSide),
                      y = block.y + static_cast<int>(i % kPoints / kCloseSide);
            if (x < grid.width && y < grid.height) put(x, y, {rgb[0][i], rgb[1][i], rgb[2][i]});
        }
    });
}

void filter_close(const CloseBlocks& close, const Grid& grid, float near_per_depth, const Planes& in, const Planes& own,
                  Planes& out, Pool& pool) {
    const Window tent{3, {-1, 0, 1, 0}, {1.0f, 2.0f, 1.0f, 0.0f}};
    pool.run(static_cast<int>(close.blocks.size()), [&](int block) {
        const glm::ivec2 first = close.blocks[static_cast<std::size_t>(block)];
        const int width = std::min(kCloseSide, grid.width - first.x);
        for (int y = first.y; y < std::min(first.y + kCloseSide, grid.height); ++y) {
            const std::ptrdiff_t at = grid.at(first.x, y);
            GridRows rows{points_at(grid.values, at), grid.values[6].data() + at, grid.stride};
            rows.points.nx = close.normals[0].data() + at;
            rows.points.ny = close.normals[1].data() + at;
            rows.points.nz = close.normals[2].data() + at;
            alignas(64) float filtered[3][kLanes];
            const float* const from[3] = {in[0].data() + at, in[1].data() + at, in[2].data() + at};
            float* const to[3] = {filtered[0], filtered[1], filtered[2]};
            filter_row(rows, 0, width, tent, near_per_depth, 3, from, to);
            for (std::size_t k = 0; k < 3; ++k) {
                for (int x = 0; x < width; ++x) {
                    const auto i = static_cast<std::size_t>(at + x);
                    out[k][i] = own[k][i] + filtered[k][x];
                }
            }
        }
    });
}

}  // namespace gonio::shade
