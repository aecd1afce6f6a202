#include "server/shade/grid_light.h"

#include <algorithm>
#include <cmath>

#include "server/transport/links.h"

namespace gonio::shade {
namespace {

using transport::kNeighbours;
using transport::Surfels;

// The surfel of the surface at p, found by the triangle that a pixel shows.
std::uint16_t surfel_of(const transport::Transport::Surface& surface, const Looks& looks, std::uint32_t triangle,
                        const glm::vec3& p, const glm::vec3& eye) {
    const auto above = std::upper_bound(looks.first_triangle.begin(), looks.first_triangle.end(), triangle);
    const auto instance = static_cast<std::uint32_t>(above - looks.first_triangle.begin()) - 1;
    const std::uint32_t own = triangle - looks.first_triangle[instance];
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

void find_surfels(const Surfaces& surfaces, const Raster* raster, const Looks& looks, const ScreenGrid& screen,
                  const transport::Transport& transport, GridLinks& links, Pool& pool) {
    const Grid& grid = screen.grid;
    const transport::Transport::Surface& surface = *transport.surface;
    const Surfels& surfels = surface.surfels;
    const int step = screen.quality.step;
    links.around.assign(grid.size(), nullptr);
    links.weights.resize(grid.size() * kNeighbours);
    links.generations.clear();
    links.most = screen.quality.generations;
    links.nearness.assign(grid.size(), 0.0f);
    links.next = 0;
    if (surfels.count == 0) return;
    for_points(grid, pool, [&](std::size_t at, int x, int y) {
        if (!(grid.values[6][at] > 0.0f)) return;
        const glm::vec3 p = grid.position(at), n = grid.normal(at);
        std::uint32_t triangle = 0;
        if (raster != nullptr && x < 0) {
            triangle = raster->nearest[screen.second_pixels[at - grid.first_spare()]];
        } else if (raster != nullptr) {
            const int px = std::min(x * step + step / 2, surfaces.width - 1),
                      py = std::min(y * step + step / 2, surfaces.height - 1);
            triangle =
                raster->nearest[static_cast<std::size_t>(py) * surfaces.row_length + static_cast<std::size_t>(px)];
        }
        const std::uint16_t own = triangle > 0 ? surfel_of(surface, looks, triangle - 1, p, surfaces.rays.eye)
                                               : surfels.visible_from(*surface.geometry, {p, n, n});
        if (own == surfels.count) return;
        links.around[at] = surfels.neighbours[own].data();
        transport::weigh(surfels, surfels.neighbours[own].data(), p, n, links.weights.data() + at * kNeighbours);
    });
}

bool trace_grid_links(const ScreenGrid& screen, const transport::Transport& transport, GridLinks& links, Pool& pool) {
    const Grid& grid = screen.grid;
    const transport::Transport::Surface& surface = *transport.surface;
    const Surfels& surfels = surface.surfels;
    if (links.next == 0) {
        if (links.generations.size() == links.most) return false;
        links.generations.emplace_back(grid.size() * trace::kPacket, static_cast<std::uint16_t>(surfels.count));
    }
    const std::size_t generation = links.generations.size() - 1;
    std::vector<std::uint16_t>& ids = links.generations.back();
    constexpr std::size_t kPart = 8192, kChunk = 256;  // points
    const std::size_t first = links.next, end = std::min(first + kPart, grid.size());
    const float spacing = surfels.radius_m;
    pool.run_chunks(end - first, kChunk, [&](std::size_t begin, std::size_t count) {
        trace::HitPacket hits;
        for (std::size_t at = first + begin; at < first + begin + count; ++at) {
            if (!(grid.values[6][at] > 0.0f)) continue;
            const glm::vec3 p = grid.position(at), n = grid.normal(at);
            // Depth and normals are those of pixels, not exact.
            const float off =
                4.0f * surface.geometry->step_off(p) + 0.005f * screen.depth_per_point * grid.values[6][at];
            const transport::Fan fan = transport::make_fan(p + n * off, n, n, static_cast<std::uint32_t>(at),
                                                           static_cast<unsigned>(generation) * trace::kPacket);
            const unsigned met = transport::follow(fan, *surface.geometry, surfels, *surface.cells, hits,
                                                   ids.data() + at * trace::kPacket);
            for (int i = 0; i < trace::kPacket; ++i) {
                if (generation == 0 && (met >> i & 1u) != 0)
                    links.nearness[at] += std::min(1.0f, spacing / std::max(hits.distance[i], 1e-30f)) / trace::kPacket;
            }
        }
    });
    links.next = end == grid.size() ? 0 : end;
    return links.next == 0;
}

Planes irradiance_at_grid(const ScreenGrid& screen, const transport::Transport& transport, const GridLinks& links,
                          const SurfelLight& light, Pool& pool) {
    const Grid& grid = screen.grid;
    Planes planes(3, std::vector<float>(grid.size() + kLanes, 0.0f));
    if (transport.surface->surfels.count == 0 || light.indirect.empty()) return planes;
    transport::Table irradiance, first_bounce, sent;
    transport::make_table(light.indirect, irradiance, pool);
    const std::size_t complete = light.sent.empty() ? 0 : links.shown();
    if (complete > 0) transport::make_table(light.sent, sent, pool);
    const bool shared = complete > 0 && light.share > 0.0f;
    if (shared) transport::make_table(light.first, first_bounce, pool);
    constexpr std::size_t kChunk = 512;
    const float per_link = complete > 0 ? 1.0f / static_cast<float>(complete * trace::kPacket) : 0.0f;
    pool.run_chunks(grid.size(), kChunk, [&](std::size_t first, std::size_t count) {
        glm::vec4 around[kChunk], own[kChunk] = {}, given[kChunk] = {};
        transport::blend(irradiance, links.around.data() + first, links.weights.data() + first * kNeighbours, count,
                         around);
        if (shared)
            transport::blend(first_bounce, links.around.data() + first, links.weights.data() + first * kNeighbours,
                             count, given);
        for (std::size_t g = 0; g < complete; ++g)
            transport::gather(sent, links.generations[g].data() + first * trace::kPacket, trace::kPacket, count,
                              sent.unit * per_link, own);
        for (std::size_t i = 0; i < count; ++i) {
            glm::vec4 value = around[i];
            if (complete > 0) {
                // Where most of what a point sees is far away, the surfels around it see the same.
                const float near = links.nearness[first + i];
                const float share = links.around[first + i] == nullptr ? 1.0f : glm::smoothstep(0.04f, 0.16f, near);
                value = glm::mix(value, own[i] + light.share * given[i], share);
            }
            for (int k = 0; k < 3; ++k) planes[static_cast<std::size_t>(k)][first + i] = value[k];
        }
    });
    for (std::vector<float>& plane : planes) grid.extend(plane);
    return planes;
}

}  // namespace gonio::shade
