#include "server/lighting/grid_light.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace gonio::lighting {
namespace {

using transport::kNeighbours;
using transport::Surfels;

// The surfel of the surface at p, found by the triangle that a pixel shows.
std::uint16_t surfel_of(const transport::Transport::Surface& surface, const MaterialTable& material_table,
                        std::uint32_t triangle, const glm::vec3& p, const glm::vec3& eye) {
    const auto above =
        std::upper_bound(material_table.first_triangle.begin(), material_table.first_triangle.end(), triangle);
    const auto instance = static_cast<std::uint32_t>(above - material_table.first_triangle.begin()) - 1;
    const std::uint32_t own = triangle - material_table.first_triangle[instance];
    const auto c = surface.geometry->corners(static_cast<int>(instance), static_cast<int>(own));
    const glm::vec3 a = c[1] - c[0], b = c[2] - c[0], n = glm::cross(a, b), d = p - c[0];
    const float per_n2 = 1.0f / std::max(glm::dot(n, n), 1e-30f);
    const float u = glm::clamp(glm::dot(glm::cross(d, b), n) * per_n2, 0.0f, 1.0f),
                v = glm::clamp(glm::dot(glm::cross(a, d), n) * per_n2, 0.0f, 1.0f - u);
    return surface.cells->surfel_at(instance, own, u, v, glm::dot(eye - p, n) > 0.0f);
}

template <typename Job>
void for_points(const Grid& grid, Pool& pool, const Job& job) {
    constexpr std::size_t kSpare = 256;
    const int extra = static_cast<int>((grid.spare + kSpare - 1) / kSpare);
    pool.run(grid.height + extra, [&](int y) {
        if (y < grid.height) {
            for (int x = 0; x < grid.width; ++x) job(static_cast<std::size_t>(grid.at(x, y)), x, y);
        } else {
            const std::size_t first = grid.first_spare() + static_cast<std::size_t>(y - grid.height) * kSpare;
            for (std::size_t i = first; i < std::min(first + kSpare, grid.size()); ++i) job(i, -1, -1);
        }
    });
}

}  // namespace

void find_surfels(const GBuffer& gbuffer, const Raster* raster, const MaterialTable& material_table,
                  const BodiesAround* bodies, const ScreenGrid& screen, const transport::Transport& transport,
                  GridWeights& weights, Pool& pool) {
    const Grid& grid = screen.grid;
    const transport::Transport::Surface& surface = *transport.surface;
    const Surfels& surfels = surface.surfels;
    weights.around.assign(grid.size(), nullptr);
    weights.weights.resize(grid.size() * kNeighbours);
    weights.seen.assign(surfels.count + 1, 0);  // one for ids of none
    if (surfels.count == 0) return;
    std::vector<std::uint8_t> own_of_any(surfels.count, 0);
    for_points(grid, pool, [&](std::size_t at, int x, int y) {
        if (!(grid.values[6][at] > 0.0f)) return;
        const glm::vec3 p = grid.position(at), n = grid.normal(at);
        std::uint32_t triangle = 0;
        if (raster != nullptr && x < 0) {
            triangle = raster->nearest[screen.own_pixels[at - grid.first_spare()]];
        } else if (raster != nullptr) {
            const int px = std::min(x * kStep + kStep / 2, gbuffer.width - 1),
                      py = std::min(y * kStep + kStep / 2, gbuffer.height - 1);
            triangle =
                raster->nearest[static_cast<std::size_t>(py) * gbuffer.row_length + static_cast<std::size_t>(px)];
        }
        const auto scenes = static_cast<std::uint32_t>(material_table.triangles.size());
        const auto of_body = [&](std::size_t part) {
            if (part >= bodies->sides.parts()) return;
            weights.around[at] = bodies->sides.around(part).data();
            BodySides::weigh(n, weights.weights.data() + at * kNeighbours);
        };
        if (triangle > scenes) {
            if (bodies != nullptr) of_body(bodies->posed.part_of(triangle - scenes - 1));
            return;
        }
        const std::uint16_t own = triangle > 0 ? surfel_of(surface, material_table, triangle - 1, p, gbuffer.rays.eye)
                                               : surfels.visible_from(*surface.geometry, {p, n, n});
        if (own == surfels.count) {
            if (bodies != nullptr) of_body(bodies->sides.part_at(p));
            return;
        }
        weights.around[at] = surfels.neighbours[own].data();
        transport::weigh(surfels, weights.around[at], p, n, weights.weights.data() + at * kNeighbours);
        std::atomic_ref(own_of_any[own]).store(1, std::memory_order_relaxed);
    });
    for (std::size_t i = 0; i < surfels.count; ++i) {
        if (own_of_any[i] == 0) continue;
        for (const std::uint16_t id : surfels.neighbours[i]) weights.seen[id] = 1;
    }
}

Planes irradiance_at_grid(const ScreenGrid& screen, const GridWeights& weights, std::span<const glm::vec4> surfels,
                          Pool& pool) {
    constexpr std::size_t kChunk = 512;
    const Grid& grid = screen.grid;
    Planes planes(3, std::vector<float>(grid.size() + kSimdWidth, 0.0f));
    if (surfels.empty()) return planes;
    transport::Table irradiance;
    transport::make_table(surfels, irradiance, pool);
    pool.run_chunks(grid.size(), kChunk, [&](std::size_t first, std::size_t count) {
        glm::vec4 values[kChunk];
        transport::blend(irradiance, weights.around.data() + first, weights.weights.data() + first * kNeighbours, count,
                         values);
        for (std::size_t i = 0; i < count; ++i) {
            for (int k = 0; k < 3; ++k) planes[static_cast<std::size_t>(k)][first + i] = values[i][k];
        }
    });
    for (std::vector<float>& plane : planes) grid.extend(plane);
    return planes;
}

}  // namespace gonio::lighting
