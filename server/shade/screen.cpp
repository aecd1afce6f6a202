#include "server/shade/screen.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/packing.hpp>

#include "server/shade/near_light.h"
#include "server/trace/sampler.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::shade {
namespace {

constexpr int kArrays = 6;  // x y z nx ny nz
// Distances off a plane that are still near, in grid steps: for windows, and for bringing values to finer points.
constexpr float kWindowNear = 4.0f, kUpsampleNear = 2.0f;

Points points_at(const std::vector<float>* arrays, std::ptrdiff_t at) {
    return {arrays[0].data() + at, arrays[1].data() + at, arrays[2].data() + at,
            arrays[3].data() + at, arrays[4].data() + at, arrays[5].data() + at};
}

// Sixteen points as rays leave them: a step off their surfaces, along their normals.
struct PointPacket {
    alignas(64) float array[kArrays][trace::kPacket];

    void set(int i, const std::vector<float>* arrays, std::size_t at, const trace::Geometry& geometry) {
        for (int k = 0; k < kArrays; ++k) array[k][i] = arrays[k][at];
        const float off = 4.0f * geometry.step_off({array[0][i], array[1][i], array[2][i]});
        for (int k = 0; k < 3; ++k) array[k][i] += off * array[k + 3][i];
    }
    Points points() const { return {array[0], array[1], array[2], array[3], array[4], array[5]}; }
};

// The four nodes around grid point (x, y) and their weights for bringing node values to it.
struct Corners {
    std::ptrdiff_t at[4];
    float weight[4];
    float total = 0.0f;
};
Corners corners_around(const ScreenGrid& screen, int x, int y, float near_per_depth) {
    const Grid &grid = screen.grid, &nodes = screen.nodes;
    const int stride = screen.quality.node_stride;
    const std::ptrdiff_t own = grid.at(x, y);
    const auto vec = [](const Grid& g, int first, std::ptrdiff_t at) {
        return glm::vec3(g.values[first][static_cast<std::size_t>(at)],
                         g.values[first + 1][static_cast<std::size_t>(at)],
                         g.values[first + 2][static_cast<std::size_t>(at)]);
    };
    const glm::vec3 position = vec(grid, 0, own), normal = vec(grid, 3, own);
    const float per_near = 1.0f / std::max(grid.values[6][static_cast<std::size_t>(own)] * near_per_depth, 1e-30f);
    const int low_x = x / stride, low_y = y / stride;
    const float along_x = static_cast<float>(x - low_x * stride) / static_cast<float>(stride),
                along_y = static_cast<float>(y - low_y * stride) / static_cast<float>(stride);
    Corners result;
    for (int k = 0; k < 4; ++k) {
        const std::ptrdiff_t at = nodes.at(low_x + k % 2, low_y + k / 2);
        const float bilinear =
            (k % 2 == 0 ? 1.0f - along_x : along_x) * (k / 2 == 0 ? 1.0f - along_y : along_y) + 1e-3f;
        const glm::vec3 n = vec(nodes, 3, at), q = vec(nodes, 0, at);
        result.at[k] = at;
        result.weight[k] =
            bilinear * (glsl::surface_likeness(glm::dot(normal, n), glm::dot(normal, q - position) * per_near) +
                        1e-6f * glm::dot(n, n));
        result.total += result.weight[k];
    }
    return result;
}

}  // namespace

Spot spot_at(const Surfaces& s, int x, int y) {
    const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
    Spot spot;
    if (!(s.depth[at] > 0.0f)) return spot;
    spot.depth = s.rays.near_m / s.depth[at];
    spot.position =
        s.rays.eye +
        (s.rays.corner + static_cast<float>(x) * s.rays.right + static_cast<float>(y) * s.rays.up) * spot.depth;
    const auto part = [](std::uint32_t bits) {
        return std::max(static_cast<float>(static_cast<std::int16_t>(bits)) / 32767.0f, -1.0f);
    };
    spot.normal = glsl::octahedral_decode({part(s.normal[at] & 0xffffu), part(s.normal[at] >> 16)});
    return spot;
}

void Grid::resize(int new_width, int new_height) {
    width = new_width;
    height = new_height;
    // Rows end in a border and the widest vector that starts at the last value.
    stride = (width + 2 * kBorder + static_cast<std::ptrdiff_t>(kLanes) + 15) / 16 * 16;
    for (std::vector<float>& array : values) array.assign(size() + kLanes, 0.0f);
}

GridRows Grid::rows() const {
    return {points_at(values, at(0, 0)), values[6].data() + at(0, 0), stride};
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

ScreenGrid make_grid(const Surfaces& surfaces, const Quality& quality) {
    ScreenGrid screen;
    screen.quality = quality;
    screen.depth_per_point = surfaces.depth_per_pixel * static_cast<float>(quality.step);
    const int step = quality.step;
    Grid& grid = screen.grid;
    grid.resize((surfaces.width + step - 1) / step, (surfaces.height + step - 1) / step);
    for (int y = 0; y < grid.height; ++y) {
        for (int x = 0; x < grid.width; ++x) {
            const Spot spot = spot_at(surfaces, std::min(x * step + step / 2, surfaces.width - 1),
                                      std::min(y * step + step / 2, surfaces.height - 1));
            const auto at = static_cast<std::size_t>(grid.at(x, y));
            for (int k = 0; k < 3; ++k) {
                grid.values[k][at] = spot.position[k];
                grid.values[k + 3][at] = spot.normal[k];
            }
            grid.values[6][at] = spot.depth;
        }
    }
    for (std::vector<float>& array : grid.values) grid.extend(array);

    Grid& nodes = screen.nodes;
    const int stride = quality.node_stride;
    nodes.resize((grid.width + stride - 1) / stride, (grid.height + stride - 1) / stride);
    for (int y = 0; y < nodes.height; ++y) {
        for (int x = 0; x < nodes.width; ++x) {
            for (int k = 0; k < 7; ++k)
                nodes.values[k][static_cast<std::size_t>(nodes.at(x, y))] =
                    grid.values[k][static_cast<std::size_t>(grid.at(x * stride, y * stride))];
        }
    }
    for (std::vector<float>& array : nodes.values) nodes.extend(array);

    screen.tile_width = (grid.width + kTileSide - 1) / kTileSide;
    screen.tile_height = (grid.height + kTileSide - 1) / kTileSide;
    constexpr std::size_t kPad = 2 * kLanes;
    screen.tile_size =
        (static_cast<std::size_t>(screen.tile_width) * static_cast<std::size_t>(screen.tile_height) + kPad - 1) / kPad *
        kPad;
    for (int k = 0; k < kArrays; ++k) {
        screen.tiled[k].assign(screen.tile_size * kTiles, 0.0f);
        for (int y = 0; y < grid.height; ++y) {
            for (int x = 0; x < grid.width; ++x)
                screen.tiled[k][screen.tiled_index(x, y)] = grid.values[k][static_cast<std::size_t>(grid.at(x, y))];
        }
    }
    return screen;
}

Occlusion trace_occlusion(const ScreenGrid& screen, const LightView& light, Pool& pool) {
    const Grid& nodes = screen.nodes;
    const Quality& quality = screen.quality;
    Occlusion result;
    result.planes.assign(2, std::vector<float>(nodes.size() + kLanes, 0.0f));
    if (light.vpls.dark() || quality.node_vpls == 0) return result;  // nothing is blocked
    Planes raw = result.planes;
    const unsigned looked_at = std::min(quality.node_vpls, static_cast<unsigned>(light.vpls.vpls.size()));
    const unsigned per_node = std::max(1u, looked_at / 4);
    const glm::vec3 origin(light.position);
    // Sixteen nodes of the same parity at a time: a block of 4 × 4 of them, 8 × 8 nodes wide, looks at the same VPLs.
    const int blocks_x = (nodes.width + 7) / 8, blocks_y = (nodes.height + 7) / 8;
    pool.run(blocks_x * blocks_y * 4, [&](int job) {
        const int parity = job % 4, block_x = job / 4 % blocks_x * 8, block_y = job / 4 / blocks_x * 8;
        PointPacket packet;
        std::size_t at[trace::kPacket];
        unsigned active = 0;
        for (int i = 0; i < trace::kPacket; ++i) {
            const int x = block_x + i % 4 * 2 + parity % 2, y = block_y + i / 4 * 2 + parity / 2;
            at[i] = static_cast<std::size_t>(nodes.at(std::min(x, nodes.width - 1), std::min(y, nodes.height - 1)));
            packet.set(i, nodes.values, at[i], light.geometry);
            if (x < nodes.width && y < nodes.height && nodes.values[6][at[i]] > 0.0f) active |= 1u << i;
        }
        if (active == 0) return;
        const Points points = packet.points();
        // The first VPLs of the list are a stratified sample of the whole, their quarters again.
        const std::span<const Vpl> vpls(light.vpls.vpls.data() + static_cast<std::size_t>(parity) * per_node, per_node);
        static thread_local std::vector<float> light_of;
        light_of.resize(vpls.size() * kLanes);
        terms(points, origin, vpls, quality.kappa, light_of.data());
        alignas(64) float open[trace::kPacket] = {}, blocked[trace::kPacket] = {};
        trace::RayPacket query;
        for (int i = 0; i < trace::kPacket; ++i)
            query.from_x[i] = points.x[i], query.from_y[i] = points.y[i], query.from_z[i] = points.z[i];
        for (std::size_t v = 0; v < vpls.size(); ++v) {
            unsigned lit = 0;
            for (int i = 0; i < trace::kPacket; ++i)
                lit |= (light_of[v * kLanes + static_cast<std::size_t>(i)] > 0.0f ? 1u : 0u) << i;
            lit &= active;
            if (lit == 0) continue;
            const glm::vec3 p = origin + glm::vec3(vpls[v].position_area);
            const glm::vec3 to = p + glm::vec3(vpls[v].normal) * (4.0f * light.geometry.step_off(p));
            for (int i = 0; i < trace::kPacket; ++i) {
                query.along_x[i] = to.x - query.from_x[i], query.along_y[i] = to.y - query.from_y[i],
                query.along_z[i] = to.z - query.from_z[i];
                query.far[i] = 1.0f;
            }
            const unsigned stopped = light.geometry.occluded(query, lit);
            for (int i = 0; i < trace::kPacket; ++i) {
                const float e = light_of[v * kLanes + static_cast<std::size_t>(i)];
                open[i] += e;
                if ((stopped >> i & 1u) != 0) blocked[i] += e;
            }
        }
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((active >> i & 1u) == 0) continue;
            raw[0][at[i]] = open[i];
            raw[1][at[i]] = blocked[i];
        }
    });
    for (std::vector<float>& plane : raw) nodes.extend(plane);
    // 2 × 2 nodes look at different VPLs: a tent over 3 × 3 holds each of the four sets equally.
    const Window tent{3, {-1, 0, 1, 0}, {1.0f, 2.0f, 1.0f, 0.0f}};
    const float* in[2];
    float* out[2];
    for (int k = 0; k < 2; ++k)
        in[k] = raw[static_cast<std::size_t>(k)].data() + nodes.at(0, 0),
        out[k] = result.planes[static_cast<std::size_t>(k)].data() + nodes.at(0, 0);
    const float near_per_depth = kWindowNear * screen.depth_per_point * static_cast<float>(quality.node_stride);
    const GridRows rows = nodes.rows();
    pool.run(nodes.height, [&](int y) { filter_row(rows, y, nodes.width, tent, near_per_depth, 2, in, out); });
    for (std::vector<float>& plane : result.planes) nodes.extend(plane);
    return result;
}

namespace {

// Applies job to every grid point with a surface, row by row: job(x, y, index into a plane).
template <typename Job>
void for_points(const Grid& grid, Pool& pool, const Job& job) {
    pool.run(grid.height, [&](int y) {
        for (int x = 0; x < grid.width; ++x) {
            const auto at = static_cast<std::size_t>(grid.at(x, y));
            if (grid.values[6][at] > 0.0f) job(x, y, at);
        }
    });
}

// 4 × 4 points around each: all 16 subsets, all 16 strata of the short rays.
Planes filtered(const ScreenGrid& screen, Planes& planes, Pool& pool) {
    const Grid& grid = screen.grid;
    Planes result(planes.size(), std::vector<float>(grid.size() + kLanes, 0.0f));
    const float* in[3];
    float* out[3];
    for (std::size_t k = 0; k < 3; ++k) {
        grid.extend(planes[k]);
        in[k] = planes[k].data() + grid.at(0, 0);
        out[k] = result[k].data() + grid.at(0, 0);
    }
    const Window window{4, {-2, -1, 0, 1}, {1.0f, 1.0f, 1.0f, 1.0f}};
    const GridRows rows = grid.rows();
    pool.run(grid.height,
             [&](int y) { filter_row(rows, y, grid.width, window, kWindowNear * screen.depth_per_point, 3, in, out); });
    return result;
}

// The light near contacts at sixteen points of a tile: near_rays short rays each, of the tile's own stratum.
void near_light_at(const ScreenGrid& screen, const LightView& light, std::size_t tile, std::size_t first,
                   float* const* out) {
    const std::size_t start = tile * screen.tile_size + first;
    const Points points = points_at(screen.tiled, static_cast<std::ptrdiff_t>(start));
    unsigned active = 0;
    for (int i = 0; i < trace::kPacket; ++i)
        active |= (points.nx[i] != 0.0f || points.ny[i] != 0.0f || points.nz[i] != 0.0f ? 1u : 0u) << i;
    if (active == 0 || screen.quality.near_rays == 0) return;
    NearSums sums;
    Directions about_z;
    const unsigned rays = screen.quality.near_rays;
    for (unsigned r = 0; r < rays; ++r) {
        const unsigned index = static_cast<unsigned>(tile) * rays + r;
        about_z.set_all(trace::cosine_hemisphere(trace::scrambled_pair(index, 0x68bc21ebu, 0x02e5be93u)));
        add_near_light(light, points, active, about_z, screen.quality.kappa, sums);
    }
    const float share = light.unit_m2 / static_cast<float>(rays);
    for (std::size_t i = 0; i < trace::kPacket; ++i) {
        out[0][start + i] = sums.red[i] * share;
        out[1][start + i] = sums.green[i] * share;
        out[2][start + i] = sums.blue[i] * share;
    }
}

}  // namespace

Planes gather_grid(const ScreenGrid& screen, const LightView& light, const Occlusion& occlusion, Pool& pool) {
    const Grid& grid = screen.grid;
    const Planes nothing(3, std::vector<float>(grid.size() + kLanes, 0.0f));
    if (light.vpls.dark()) return nothing;
    const bool interleaved = screen.quality.interleaved;

    // Chunks of 512 points stay in the first cache beside the VPLs of their subset.
    constexpr std::size_t kChunk = 512;
    std::vector<float> tiled[6];  // gathered rgb, near rgb
    for (std::vector<float>& plane : tiled) plane.resize(screen.tiled[0].size());
    float* const near_out[3] = {tiled[3].data(), tiled[4].data(), tiled[5].data()};
    const std::size_t chunks = (screen.tile_size + kChunk - 1) / kChunk, per_subset = light.vpls.per_subset;
    pool.run(static_cast<int>(chunks * kTiles), [&](int job) {
        const std::size_t tile = static_cast<std::size_t>(job) / chunks,
                          first = static_cast<std::size_t>(job) % chunks * kChunk;
        const std::size_t at = tile * screen.tile_size + first, count = std::min(kChunk, screen.tile_size - first);
        const std::span<const Vpl> vpls = interleaved
                                              ? std::span(light.vpls.vpls).subspan(tile * per_subset, per_subset)
                                              : std::span(light.vpls.vpls);
        gather(points_at(screen.tiled, static_cast<std::ptrdiff_t>(at)), count, glm::vec3(light.position), vpls,
               screen.quality.kappa, light.unit_m2 * (interleaved ? static_cast<float>(kSubsets) : 1.0f),
               tiled[0].data() + at, tiled[1].data() + at, tiled[2].data() + at);
        for (std::size_t i = 0; i < count; i += trace::kPacket) near_light_at(screen, light, tile, first + i, near_out);
    });

    const float near_per_depth =
        kUpsampleNear * screen.depth_per_point * static_cast<float>(screen.quality.node_stride);
    Planes gathered = nothing, near_light = nothing;
    for_points(grid, pool, [&](int x, int y, std::size_t at) {
        const Corners corners = corners_around(screen, x, y, near_per_depth);
        float open = 0.0f, blocked = 0.0f;
        for (int c = 0; c < 4; ++c) {
            open += corners.weight[c] * occlusion.planes[0][static_cast<std::size_t>(corners.at[c])];
            blocked += corners.weight[c] * occlusion.planes[1][static_cast<std::size_t>(corners.at[c])];
        }
        const float seen = open > 0.0f ? std::clamp(1.0f - blocked / open, 0.0f, 1.0f) : 1.0f;
        const std::size_t from = screen.tiled_index(x, y);
        for (std::size_t k = 0; k < 3; ++k) {
            gathered[k][at] = tiled[k][from] * seen + (interleaved ? tiled[k + 3][from] : 0.0f);
            if (!interleaved) near_light[k][at] = tiled[k + 3][from];
        }
    });
    // Near light is interleaved always; the list where the quality says so.
    Planes result = filtered(screen, interleaved ? gathered : near_light, pool);
    if (!interleaved) {
        for_points(grid, pool, [&](int, int, std::size_t at) {
            for (std::size_t k = 0; k < 3; ++k) result[k][at] += gathered[k][at];
        });
    }
    for (std::vector<float>& plane : result) grid.extend(plane);
    return result;
}

void upsample(const Surfaces& surfaces, const ScreenGrid& screen, const Planes& light, std::vector<std::uint16_t>& out,
              Pool& pool) {
    const Grid& grid = screen.grid;
    const float* values[3];
    for (std::size_t k = 0; k < 3; ++k) values[k] = light[k].data() + grid.at(0, 0);
    const float near_per_depth = kUpsampleNear * screen.depth_per_point;
    const GridRows rows = grid.rows();
    out.resize(surfaces.row_length * static_cast<std::size_t>(surfaces.height) * 4);
    pool.run(surfaces.height, [&](int y) {
        static thread_local std::vector<std::uint8_t> lost;
        lost.resize(surfaces.row_length);
        const std::size_t row = static_cast<std::size_t>(y) * surfaces.row_length;
        upsample_row(rows, values, y, static_cast<int>(surfaces.row_length), surfaces.rays, near_per_depth,
                     surfaces.depth.data() + row, surfaces.normal.data() + row, out.data() + 4 * row, lost.data());
        // A pixel that none of its four grid points resembles takes the most alike of the sixteen around it.
        for (int x = 0; x < surfaces.width; ++x) {
            if (lost[static_cast<std::size_t>(x)] == 0) continue;
            const Spot spot = spot_at(surfaces, x, y);
            float best = 0.0f;
            std::ptrdiff_t from = -1;
            for (int k = 0; k < 16; ++k) {
                const int gx = std::clamp((x + 2) / 4 - 2 + k % 4, 0, grid.width - 1),
                          gy = std::clamp((y + 2) / 4 - 2 + k / 4, 0, grid.height - 1);
                const auto at = static_cast<std::size_t>(grid.at(gx, gy));
                const glm::vec3 n(grid.values[3][at], grid.values[4][at], grid.values[5][at]),
                    q(grid.values[0][at], grid.values[1][at], grid.values[2][at]);
                const float alike =
                    glsl::surface_likeness(glm::dot(spot.normal, n),
                                           glm::dot(spot.normal, q - spot.position) / (spot.depth * near_per_depth)) +
                    1e-4f * glm::dot(n, n) /
                        (1.0f + glm::dot(q - spot.position, q - spot.position) / (spot.depth * spot.depth));
                if (alike > best) best = alike, from = static_cast<std::ptrdiff_t>(at);
            }
            if (from < 0) continue;
            for (std::size_t k = 0; k < 3; ++k)
                out[4 * (row + static_cast<std::size_t>(x)) + k] =
                    glm::packHalf1x16(std::min(light[k][static_cast<std::size_t>(from)], 65504.0f));
        }
    });
}

PointLight at_point(const LightView& light, const glm::dvec3& point, const glm::dvec3& normal) {
    PointLight result;
    if (light.vpls.dark()) return result;
    constexpr float kKappa = 16.0f;
    constexpr unsigned kNearRays = 1024;
    const glm::vec3 n(normal),
        p(point + normal * static_cast<double>(4.0f * light.geometry.step_off(glm::vec3(point))));
    trace::RayPacket query;
    for (int i = 0; i < trace::kPacket; ++i) query.from_x[i] = p.x, query.from_y[i] = p.y, query.from_z[i] = p.z;
    for (std::size_t first = 0; first < light.vpls.vpls.size(); first += trace::kPacket) {
        glm::dvec3 bring[trace::kPacket];
        unsigned active = 0;
        for (int i = 0; i < trace::kPacket; ++i) {
            const Vpl& vpl = light.vpls.vpls[first + static_cast<std::size_t>(i)];
            const glm::dvec3 at = light.position + glm::dvec3(vpl.position_area);
            const double geometry = glsl64::vpl_geometry_shared(point - at, glm::dvec3(vpl.normal), normal,
                                                                static_cast<double>(kKappa * vpl.position_area.w));
            bring[i] = glm::dvec3(vpl.intensity) * geometry;
            if (geometry > 0.0) active |= 1u << i;
            const glm::vec3 to =
                glm::vec3(at) + glm::vec3(vpl.normal) * (4.0f * light.geometry.step_off(glm::vec3(at))) - p;
            query.along_x[i] = to.x, query.along_y[i] = to.y, query.along_z[i] = to.z;
            query.far[i] = 1.0f;
        }
        const unsigned seen = active & ~(active != 0 ? light.geometry.occluded(query, active) : 0u);
        for (int i = 0; i < trace::kPacket; ++i) {
            const std::size_t subset = (first + static_cast<std::size_t>(i)) / light.vpls.per_subset;
            if ((seen >> i & 1u) != 0) result.parts[subset] += bring[i] * static_cast<double>(kSubsets);
        }
    }
    PointPacket packet;
    const glm::vec3 on(point);
    for (int i = 0; i < trace::kPacket; ++i) {
        for (int k = 0; k < 3; ++k) packet.array[k][i] = on[k], packet.array[k + 3][i] = n[k];
    }
    const Points points = packet.points();
    // Consecutive points of the sequence are as even as the whole: each part gets a run of them.
    constexpr unsigned kPerPart = kNearRays / kSubsets;
    for (unsigned r = 0; r < kNearRays; r += trace::kPacket) {
        Directions about_z;
        for (unsigned i = 0; i < trace::kPacket; ++i)
            about_z.set(static_cast<int>(i),
                        trace::cosine_hemisphere({trace::unit_interval(trace::reverse_bits(r + i)),
                                                  trace::unit_interval(trace::sobol_second(r + i))}));
        NearSums sums;
        add_near_light(light, points, 0xffffu, about_z, kKappa, sums);
        glm::dvec3& part = result.parts[r / kPerPart];
        for (int i = 0; i < trace::kPacket; ++i)
            part += glm::dvec3(sums.red[i], sums.green[i], sums.blue[i]) / static_cast<double>(kPerPart);
    }
    for (const glm::dvec3& part : result.parts) result.light += part / static_cast<double>(kSubsets);
    return result;
}

}  // namespace gonio::shade
