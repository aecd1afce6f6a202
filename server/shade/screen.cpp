#include "server/shade/screen.h"

#include <algorithm>
#include <cmath>

#include "server/shade/close_blocks.h"
#include "server/shade/near_light.h"
#include "server/shade/second_points.h"
#include "server/shade/upsample.h"
#include "server/trace/sampler.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::shade {
namespace {

// The four nodes, one in `stride` points, around grid point (x, y) and their weights for bringing node values to it.
struct Corners {
    std::size_t at[4];
    float weight[4];
    float total = 0.0f;
};
Corners corners_around(const Grid& grid, const Grid& nodes, int stride, int x, int y, float near_per_depth) {
    const auto own = static_cast<std::size_t>(grid.at(x, y));
    const glm::vec3 position = grid.position(own), normal = grid.normal(own);
    const float per_near = 1.0f / std::max(grid.values[6][own] * near_per_depth, 1e-30f);
    const int low_x = x / stride, low_y = y / stride;
    const float along_x = static_cast<float>(x - low_x * stride) / static_cast<float>(stride),
                along_y = static_cast<float>(y - low_y * stride) / static_cast<float>(stride);
    Corners result;
    for (int k = 0; k < 4; ++k) {
        const auto at = static_cast<std::size_t>(nodes.at(low_x + k % 2, low_y + k / 2));
        const float bilinear =
            (k % 2 == 0 ? 1.0f - along_x : along_x) * (k / 2 == 0 ? 1.0f - along_y : along_y) + 1e-3f;
        const glm::vec3 n = nodes.normal(at), q = nodes.position(at);
        result.at[k] = at;
        result.weight[k] =
            bilinear * (glsl::surface_likeness(glm::dot(normal, n), glm::dot(normal, q - position) * per_near) +
                        1e-6f * glm::dot(n, n));
        result.total += result.weight[k];
    }
    return result;
}

}  // namespace

void look_through(const Eye& eye, const trace::Geometry& geometry, float near_m, int width, int height, Surfaces& s) {
    s.width = width;
    s.height = height;
    constexpr std::size_t kRow = 4 * kLanes;
    s.row_length = (static_cast<std::size_t>(width) + kRow - 1) / kRow * kRow;
    s.depth.resize(s.row_length * static_cast<std::size_t>(height));
    s.normal.resize(s.depth.size());
    const glm::dvec3 x = eye.right * eye.tan_half_x, y = eye.up * eye.tan_half_y;
    const glm::dvec3 right = x * (2.0 * eye.window_half.x / width), up = y * (2.0 * eye.window_half.y / height);
    s.rays.eye = geometry.local(eye.position);
    s.rays.right = glm::vec3(right);
    s.rays.up = glm::vec3(up);
    s.rays.corner = glm::vec3(eye.forward + x * (eye.window_centre.x - eye.window_half.x) +
                              y * (eye.window_centre.y - eye.window_half.y) + 0.5 * (right + up));
    s.rays.near_m = near_m;
    s.depth_per_pixel = static_cast<float>(glm::length(up));
}

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

void make_grid(const Surfaces& surfaces, const Quality& quality, ScreenGrid& screen, Pool& pool) {
    screen.quality = quality;
    screen.depth_per_point = surfaces.depth_per_pixel * static_cast<float>(quality.step);
    const int step = quality.step;
    Grid& grid = screen.grid;
    const int width = (surfaces.width + step - 1) / step, height = (surfaces.height + step - 1) / step;
    grid.resize(width, height, step > 1 ? most_second_points(width, height) : 0);
    pool.run(grid.height, [&](int y) {
        for (int x = 0; x < grid.width; ++x) {
            const Spot spot = spot_at(surfaces, std::min(x * step + step / 2, surfaces.width - 1),
                                      std::min(y * step + step / 2, surfaces.height - 1));
            grid.set(static_cast<std::size_t>(grid.at(x, y)), spot.position, spot.normal, spot.depth);
        }
    });
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

    screen.second_packets.clear();
    screen.second.clear();
    if (step > 1) {
        make_weights(surfaces, screen, pool);
        if (quality.second_share > 0.0f) find_second_points(surfaces, screen, pool);
        take_after(surfaces, screen, pool);
    }
    screen.near_directions = stratified_directions(quality.near_rays, quality.round);
    screen.tile_width = (grid.width + kTileSide - 1) / kTileSide;
    screen.tile_height = (grid.height + kTileSide - 1) / kTileSide;
    constexpr std::size_t kPad = 2 * kLanes;
    screen.tile_size =
        (static_cast<std::size_t>(screen.tile_width) * static_cast<std::size_t>(screen.tile_height) + kPad - 1) / kPad *
        kPad;
    pool.run(kArrays, [&](int k) {
        screen.tiled[k].assign(screen.tile_size * kTiles, 0.0f);
        for (int y = 0; y < grid.height; ++y) {
            for (int x = 0; x < grid.width; ++x)
                screen.tiled[k][screen.tiled_index(x, y)] = grid.values[k][static_cast<std::size_t>(grid.at(x, y))];
        }
    });
}

namespace {

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
    const GridRows rows = grid.rows();
    pool.run(grid.height,
             [&](int y) { filter_row(rows, y, grid.width, kWindowNear * screen.depth_per_point, in, out); });
    return result;
}

// The light near contacts at 4 × 4 neighbouring points from (x, y) on: near_rays short rays each, a stratum of its own
// for each of the sixteen, so that any window of 4 × 4 holds all of them. Adds to `out`.
void near_light_at(const ScreenGrid& screen, const LightView& light, int x, int y, Planes& out) {
    const Patch patch = patch_at(screen.grid, x, y);
    if (patch.active == 0) return;
    const NearSums sums =
        near_light(light, patch.points.points(), patch.active, screen.near_directions, screen.quality.kappa);
    const float share = light.unit_m2 / static_cast<float>(screen.quality.near_rays);
    for (int i = 0; i < trace::kPacket; ++i) {
        if ((patch.active >> i & 1u) == 0) continue;
        out[0][patch.at[i]] += sums.red[i] * share;
        out[1][patch.at[i]] += sums.green[i] * share;
        out[2][patch.at[i]] += sums.blue[i] * share;
    }
}

}  // namespace

Planes gather_grid(const ScreenGrid& screen, const LightView& light, const Planes& occlusion, Pool& pool) {
    const Grid& grid = screen.grid;
    const Planes nothing(3, std::vector<float>(grid.size() + kLanes, 0.0f));
    if (light.vpls.dark()) return nothing;
    const bool interleaved = screen.quality.interleaved;

    // Chunks of 512 points stay in the first cache beside the VPLs of their subset.
    constexpr std::size_t kChunk = 512;
    std::vector<float> tiled[3];
    for (std::vector<float>& plane : tiled) plane.resize(screen.tiled[0].size());
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
    });

    // The part of the light that nothing blocks at grid point (x, y), 0..1.
    const auto seen_at = [&](int x, int y) {
        const int stride = screen.quality.node_stride;
        const Corners corners = corners_around(grid, screen.nodes, stride, x, y,
                                               kUpsampleNear * screen.depth_per_point * static_cast<float>(stride));
        float open = 0.0f, blocked = 0.0f;
        for (int c = 0; c < 4; ++c) {
            open += corners.weight[c] * occlusion[0][corners.at[c]];
            blocked += corners.weight[c] * occlusion[1][corners.at[c]];
        }
        return open > 0.0f ? std::clamp(1.0f - blocked / open, 0.0f, 1.0f) : 1.0f;
    };
    Planes gathered = nothing, near_light = nothing;
    pool.run((grid.height + kTileSide - 1) / kTileSide, [&](int strip) {
        const int first_y = strip * kTileSide, last_y = std::min(first_y + kTileSide, grid.height);
        for (int y = first_y; y < last_y; ++y) {
            for (int x = 0; x < grid.width; ++x) {
                const auto at = static_cast<std::size_t>(grid.at(x, y));
                if (!(grid.values[6][at] > 0.0f)) continue;
                const float seen = seen_at(x, y);
                const std::size_t from = screen.tiled_index(x, y);
                for (std::size_t k = 0; k < 3; ++k) gathered[k][at] = tiled[k][from] * seen;
            }
        }
        if (screen.quality.near_rays == 0) return;
        for (int x = 0; x < grid.width; x += kTileSide) near_light_at(screen, light, x, first_y, near_light);
    });
    const auto add = [](Planes& to, const Planes& from) {
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < to[k].size(); ++i) to[k][i] += from[k][i];
        }
    };
    // Near light is interleaved always; the list where the quality says so.
    Planes result;
    if (interleaved) {
        Planes both = gathered;
        add(both, near_light);
        result = filtered(screen, both, pool);
        light_second_points(screen, light, result, pool);
        light_close_blocks(choose_close_blocks(grid, result, screen.quality.close), screen, light, result, pool);
    } else {
        result = filtered(screen, near_light, pool);
        add(result, gathered);
    }
    for (std::vector<float>& plane : result) grid.extend(plane);
    return result;
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
