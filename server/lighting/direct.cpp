#include "server/lighting/direct.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/lighting/direct_tile.h"

namespace gonio::lighting {

unsigned unhidden(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                  const Points& points, const float* depth, unsigned active, float* passed, const glm::vec3* targets) {
    // They start this share of a pixel's width off its surface: depth and normals are those of pixels, not exact.
    constexpr float kOffPerPixel = 0.02f;
    const float off_m = 4.0f * geometry.step_off(light.position), per_depth = kOffPerPixel * gbuffer.depth_per_pixel;
    trace::RayPacket rays;
    for (int i = 0; i < trace::kPacket; ++i) {
        const float off = off_m + per_depth * depth[i];
        const glm::vec3 from(points.x[i] + off * points.nx[i], points.y[i] + off * points.ny[i],
                             points.z[i] + off * points.nz[i]);
        const glm::vec3& to = targets != nullptr ? targets[i] : light.position;
        rays.set(i, from, to - from, 1.0f - 1e-5f);  // one mounted on a surface is not hidden by it
    }
    const unsigned seen = active & ~geometry.occluded(rays, active, true);
    if (geometry.transmissive()) {
        glm::vec3 rgb[trace::kPacket];
        std::fill_n(rgb, trace::kPacket, glm::vec3(1.0f));
        geometry.transmittance(rays, seen, rgb);
        for (int i = 0; i < trace::kPacket; ++i) passed[i] = trace::luminous(rgb[i]);
    }
    return seen;
}

namespace {

constexpr std::size_t kMostAtOnce = 64;  // luminaires: bits of a mask, and planes of the lattice
// With more luminaires than so many a shadow of one of them is faint.
constexpr std::size_t kDense = 4;

// Result: bits of the luminaires whose beam meets the sphere around a box.
std::uint64_t beams_at(std::span<const DirectLight> lights, const glm::vec3& least, const glm::vec3& greatest) {
    if (!(least.x <= greatest.x)) return 0;
    const glm::vec3 centre = 0.5f * (least + greatest);
    std::uint64_t result = 0;
    for (std::size_t k = 0; k < lights.size(); ++k) {
        const DirectLight& light = lights[k];
        const float radius = 0.5f * glm::length(greatest - least) + (light.parts ? light.parts->radius_m : 0.0f);
        const glm::vec3 d = light.light_from_world * (centre - light.position);
        const float distance = glm::length(d);
        bool meets = light.beam_cos <= -1.0f || distance <= 1.001f * radius;
        if (!meets) {
            const float angle = std::acos(std::clamp(-d.z / distance, -1.0f, 1.0f));
            meets = angle <= std::acos(light.beam_cos) + std::asin(std::min(1.0f, radius / distance)) + 1e-3f;
        }
        result |= static_cast<std::uint64_t>(meets ? 1 : 0) << k;
    }
    return result;
}

// 8 × 8 points of a grid, beyond its edges the last ones again: four packets of every other one each.
struct GridPart {
    static constexpr int kSide = 8;
    alignas(64) float points[6][64], depth[64];
    std::size_t at[64];
    unsigned first_to[64];    // first_point()
    unsigned active[4] = {};  // of a packet: with a surface
    glm::vec3 least{1e30f}, greatest{-1e30f};

    GridPart(const Grid& grid, int x, int y) {
        for (std::size_t i = 0; i < 64; ++i) {
            const int p = static_cast<int>(i / 16), k = static_cast<int>(i % 16);
            const int px = x + k % 4 * 2 + p % 2, py = y + k / 4 * 2 + p / 2;
            at[i] = static_cast<std::size_t>(grid.at(std::min(px, grid.width - 1), std::min(py, grid.height - 1)));
            first_to[i] = first_point(px, py);
            for (std::size_t v = 0; v < 6; ++v) points[v][i] = grid.values[v][at[i]];
            depth[i] = grid.values[6][at[i]];
            if (!(depth[i] > 0.0f)) continue;
            active[p] |= 1u << k;
            least = glm::min(least, grid.position(at[i]));
            greatest = glm::max(greatest, grid.position(at[i]));
        }
    }
    glm::vec3 position(std::size_t i) const { return {points[0][i], points[1][i], points[2][i]}; }
    glm::vec3 normal(std::size_t i) const { return {points[3][i], points[4][i], points[5][i]}; }
    // Result: whether all lie on one smooth surface.
    bool even() const {
        for (std::size_t i = 0; i < 64; ++i) {
            const std::size_t first = i % 16, next = i % 4 < 3 ? i + 1 : i;
            const glm::vec3 n = normal(first), off = position(i) - position(first),
                            across = position(next) - position(i);
            if (!(depth[i] > 0.0f) || glm::dot(n, normal(i)) < 0.98f ||
                std::abs(glm::dot(n, off)) > 0.1f * glm::length(off) ||
                std::abs(glm::dot(n, across)) > 0.1f * glm::length(across))
                return false;
        }
        return true;
    }
};

// The lattice's values of a part's points.
void ask_grid(const GridPart& part, const GBuffer& gbuffer, const trace::Geometry& geometry,
              std::span<const DirectLight> lights, bool sparse, Lattice& lattice) {
    const std::uint64_t beams = beams_at(lights, part.least, part.greatest);
    sparse = sparse && part.even();
    for (std::size_t k = 0; k < lights.size(); ++k) {
        const bool soft = lights[k].parts != nullptr;
        bool all_seen = false, all_hidden = false;  // so say the points asked first
        for (std::size_t p = 0; p < 4; ++p) {
            const std::size_t first = p * trace::kPacket;
            const unsigned active = part.active[p];
            alignas(64) float relative[trace::kPacket] = {}, ratio[trace::kPacket] = {};
            unsigned lit = 0;
            if ((beams >> k & 1u) != 0 && active != 0) {
                direct_points(lights[k], points_at(part.points, first), trace::kPacket, relative, ratio);
                for (int i = 0; i < trace::kPacket; ++i) lit |= (relative[i] > 0.0f ? 1u : 0u) << i;
                lit &= active;
            }
            unsigned seen = all_seen ? lit : 0u;
            float passed[trace::kPacket];
            std::fill_n(passed, trace::kPacket, 1.0f);
            if (lit != 0 && !all_seen && !all_hidden) {
                glm::vec3 targets[trace::kPacket];
                if (soft)
                    for (std::size_t i = 0; i < trace::kPacket; ++i)
                        targets[i] = first_target(lights[k], part.first_to[first + i], part.position(first + i),
                                                  part.normal(first + i));
                seen = unhidden(geometry, lights[k], gbuffer, points_at(part.points, first), part.depth + first, lit,
                                passed, soft ? targets : nullptr);
            }
            const bool dimmed = std::any_of(passed, passed + trace::kPacket, [](float share) { return share < 1.0f; });
            if (p == 0 && sparse && lit == active && !dimmed) all_seen = seen == lit, all_hidden = seen == 0;
            for (std::size_t i = 0; i < trace::kPacket; ++i) {
                const float value = std::max(ratio[i], kNoLight);
                const bool dark = ratio[i] <= 0.0f && (active >> i & 1u) != 0;
                if (soft)
                    lattice.through[k][part.at[first + i]] = (lit >> i & 1u) == 0    ? -1.0f
                                                             : (seen >> i & 1u) != 0 ? passed[i]
                                                                                     : 0.0f;
                else if (!lattice.through.empty())
                    lattice.through[k][part.at[first + i]] = passed[i];
                lattice.ratio[k][part.at[first + i]] = (seen >> i & 1u) != 0 || dark ? value : -value;
            }
        }
    }
}

// Whether something in a tile's part of a grid sees less than all of an opening, or light passes panes. values: of its
// first point, at (0, 0).
bool dims(const Tile& tile, const float* values, std::ptrdiff_t stride) {
    const float* from = values + (tile.first_y / kStep - 1) * stride + tile.first_x / kStep - 1;
    float least = 1.0f;
    for (int row = 0; row < kTileRows / kStep + 2; ++row, from += stride)
        for (int i = 0; i < static_cast<int>(kSimdWidth) + 2; ++i) least = std::min(least, from[i]);
    return least < 1.0f;
}

// First rays to one opening: of each pixel, or null and what the grid's points see of it.
struct FirstRays {
    const std::vector<std::uint8_t>* pixels;
    const Grid* grid;
    const std::vector<float>* through;
};

// Sixteen pixels of a tile that ask, or fewer: those from `first` of Tile::asking on.
struct Askers {
    std::size_t first, count;
    std::uint16_t pixels[trace::kPacket];
    alignas(64) float values[7][trace::kPacket] = {};  // as of Points, and the depth
    Askers(const Tile& tile, std::size_t from, std::size_t asking)
        : first(from), count(std::min<std::size_t>(trace::kPacket, asking - from)) {
        for (std::size_t i = 0; i < count; ++i) {
            pixels[i] = tile.asking[first + i];
            for (std::size_t v = 0; v < 6; ++v) values[v][i] = tile.points[v][pixels[i]];
            values[6][i] = tile.depth[pixels[i]];
        }
    }
    unsigned all() const { return (1u << count) - 1u; }
};

// The first rays to an opening of pixels that ask. Result: by pixel.
std::array<FirstRay, trace::kPacket> first_rays(const Tile& tile, const Askers& askers, const GBuffer& gbuffer,
                                                const trace::Geometry& geometry, const DirectLight& light) {
    glm::vec3 targets[trace::kPacket];
    std::fill_n(targets, trace::kPacket, light.position);
    for (std::size_t i = 0; i < askers.count; ++i) {
        const std::size_t pixel = askers.pixels[i];
        const auto& v = askers.values;
        targets[i] = first_target(light, first_point(tile.x_of(pixel), tile.y_of(pixel)), {v[0][i], v[1][i], v[2][i]},
                                  {v[3][i], v[4][i], v[5][i]});
    }
    float passed[trace::kPacket];
    std::fill_n(passed, trace::kPacket, 1.0f);
    const unsigned seen = unhidden(geometry, light, gbuffer, points_at(askers.values, 0), askers.values[6],
                                   askers.all(), passed, targets);
    std::array<FirstRay, trace::kPacket> answers{};
    for (std::size_t i = 0; i < askers.count; ++i)
        answers[i] = (seen >> i & 1u) == 0 ? FirstRay::hidden : passed[i] < 1.0f ? FirstRay::dimmed : FirstRay::seen;
    return answers;
}

// The same of every pixel of a picture that asks. answers: by pixel.
void ask_first(const Tile& tile, std::size_t asking, const GBuffer& gbuffer, const trace::Geometry& geometry,
               const DirectLight& light, std::vector<std::uint8_t>& answers) {
    for (std::size_t first = 0; first < asking; first += trace::kPacket) {
        const Askers askers(tile, first, asking);
        const auto own = first_rays(tile, askers, gbuffer, geometry, light);
        for (std::size_t i = 0; i < askers.count; ++i) {
            const std::size_t pixel = askers.pixels[i];
            answers[static_cast<std::size_t>(tile.y_of(pixel)) * gbuffer.row_length +
                    static_cast<std::size_t>(tile.x_of(pixel))] = static_cast<std::uint8_t>(own[i]);
        }
    }
}

// What pixels see of an opening where the first rays of all around them say the same, or where the four grid points
// around them and their own first rays do. Result: bits of the others.
unsigned by_first_rays(const Tile& tile, const Askers& askers, const GBuffer& gbuffer, const trace::Geometry& geometry,
                       const DirectLight& light, const FirstRays& known, float* share) {
    std::array<FirstRay, trace::kPacket> own{};
    if (known.pixels == nullptr) own = first_rays(tile, askers, gbuffer, geometry, light);
    unsigned left = askers.all();
    for (std::size_t i = 0; i < askers.count; ++i) {
        const std::size_t pixel = askers.pixels[i];
        const int x = tile.x_of(pixel), y = tile.y_of(pixel);
        FirstRay all = FirstRay::dimmed;
        if (known.pixels != nullptr)
            all = around_first(*known.pixels, gbuffer.row_length, gbuffer.height, x, y);
        else if (around_grid(*known.grid, *known.through, x, y) == own[i])
            all = own[i];
        if (all == FirstRay::dimmed) continue;
        left &= ~(1u << i);
        share[i] = all == FirstRay::seen ? 1.0f : 0.0f;
    }
    return left;
}

// Lights the pixels that a tile's grid points leave. known: of an opening.
void ask_pixels(Tile& tile, std::size_t asking, const GBuffer& gbuffer, const trace::Geometry& geometry,
                const DirectLight& light, std::size_t planes, const FirstRays& known) {
    const auto add = [&](const Askers& askers, std::size_t i, float share) {
        for (std::size_t k = 0; k < planes; ++k)
            tile.light[k][askers.pixels[i]] +=
                light.weight[static_cast<int>(k)] * tile.relative[askers.first + i] * share;
    };
    float share[trace::kPacket];
    if (light.parts) {  // those that first rays do not settle are left
        std::size_t left = 0;
        for (std::size_t first = 0; first < asking; first += trace::kPacket) {
            const Askers askers(tile, first, asking);
            const unsigned unknown = by_first_rays(tile, askers, gbuffer, geometry, light, known, share);
            for (std::size_t i = 0; i < askers.count; ++i) {
                if ((unknown >> i & 1u) == 0) {
                    add(askers, i, share[i]);
                    continue;
                }
                tile.asking[left] = askers.pixels[i];
                tile.relative[left++] = tile.relative[first + i];
            }
        }
        asking = left;
    }
    for (std::size_t first = 0; first < asking; first += trace::kPacket) {
        const Askers askers(tile, first, asking);
        const Points points = points_at(askers.values, 0);
        if (light.parts && known.pixels == nullptr) {
            unsigned quarter[trace::kPacket] = {};
            for (std::size_t i = 0; i < askers.count; ++i)
                quarter[i] =
                    static_cast<unsigned>((tile.y_of(askers.pixels[i]) & 1) * 2 + (tile.x_of(askers.pixels[i]) & 1));
            visible_among(geometry, light, gbuffer, points, askers.values[6], static_cast<int>(askers.count), quarter,
                          share);
        } else {
            visible_share(geometry, light, gbuffer, points, askers.values[6], askers.all(), kManyPoints, share);
        }
        for (std::size_t i = 0; i < askers.count; ++i) add(askers, i, share[i]);
    }
}

}  // namespace

void direct_light(const GBuffer& gbuffer, const ScreenGrid& screen, const trace::Geometry& geometry,
                  std::span<const DirectLight> lights, bool every_pixel, Planes& out, Lattice& lattice, Pool& pool) {
    const Grid& grid = screen.grid;
    for (std::vector<float>& plane : out) plane.resize(gbuffer.row_length * static_cast<std::size_t>(gbuffer.height));
    const int across = (grid.width + GridPart::kSide - 1) / GridPart::kSide,
              down = (grid.height + GridPart::kSide - 1) / GridPart::kSide;
    const int tiles_x = static_cast<int>(gbuffer.row_length) / kTileColumns,
              tiles_y = (gbuffer.height + kTileRows - 1) / kTileRows;
    const bool many = lights.size() > kDense;
    const bool soft = std::any_of(lights.begin(), lights.end(), [](const DirectLight& light) { return light.parts; });
    // The first rays of all pixels to one opening come before what follows from them: one luminaire after the other.
    const std::size_t at_once = soft && every_pixel ? 1 : kMostAtOnce;
    // Every tile with a surface that luminaires' beams meet.
    const auto each_tile = [&](std::span<const DirectLight> some, const auto& lit, const auto& stored) {
        pool.run(tiles_x * tiles_y, [&](int job) {
            static thread_local Tile tile;
            tile.first_x = job % tiles_x * kTileColumns, tile.first_y = job / tiles_x * kTileRows;
            for (auto& plane : tile.light) std::fill_n(plane, kTilePixels, 0.0f);
            if (fill_tile(tile, gbuffer, screen.to_pixels.weights.data())) {
                const std::uint64_t beams = beams_at(some, tile.least, tile.greatest);
                for (std::size_t k = 0; k < some.size(); ++k) {
                    if ((beams >> k & 1u) == 0) continue;
                    const auto points_of = [&](const Planes& planes) {
                        return every_pixel || planes.empty() ? nullptr : planes[k].data() + grid.at(0, 0);
                    };
                    const float* const through =
                        some[k].parts || geometry.transmissive() ? points_of(lattice.through) : nullptr;
                    const std::size_t asking = light_tile(
                        tile, some[k],
                        {points_of(lattice.ratio),
                         through != nullptr && dims(tile, through, grid.stride) ? through : nullptr, grid.stride},
                        !many, out.size());
                    lit(tile, asking, some[k], k);
                }
            }
            stored(tile);
        });
    };
    for (std::size_t first = 0; first == 0 || first < lights.size(); first += at_once) {
        const auto some = lights.subspan(first, std::min(at_once, lights.size() - first));
        if (!every_pixel) {
            lattice.ratio.resize(std::max(lattice.ratio.size(), some.size()));
            lattice.through.resize(geometry.transmissive() || soft ? lattice.ratio.size() : 0);
            for (std::vector<float>& plane : lattice.ratio) plane.resize(grid.first_spare() + kSimdWidth);
            for (std::vector<float>& plane : lattice.through) plane.resize(grid.first_spare() + kSimdWidth);
            pool.run(across * down, [&](int job) {
                const GridPart part(grid, job % across * GridPart::kSide, job / across * GridPart::kSide);
                ask_grid(part, gbuffer, geometry, some, many, lattice);
            });
            const auto soften = [&](std::size_t k, Pool* inside) {
                if (some[k].parts)
                    soften_grid(gbuffer, grid, geometry, some[k], lattice.ratio[k], lattice.through[k], inside);
            };
            const bool one = some.size() == 1;
            if (one) soften(0, &pool);
            pool.run(static_cast<int>(some.size()), [&](int light) {
                const auto k = static_cast<std::size_t>(light);
                if (!one) soften(k, nullptr);
                grid.extend(lattice.ratio[k]);
                if (!lattice.through.empty()) grid.extend(lattice.through[k]);
            });
        }
        const bool asks_first = every_pixel && !some.empty() && some[0].parts;
        if (asks_first) {
            lattice.first.assign(gbuffer.row_length * static_cast<std::size_t>(gbuffer.height),
                                 static_cast<std::uint8_t>(FirstRay::none));
            each_tile(
                some,
                [&](const Tile& tile, std::size_t asking, const DirectLight& light, std::size_t) {
                    ask_first(tile, asking, gbuffer, geometry, light, lattice.first);
                },
                [](const Tile&) {});
        }
        each_tile(
            some,
            [&](Tile& tile, std::size_t asking, const DirectLight& light, std::size_t k) {
                ask_pixels(tile, asking, gbuffer, geometry, light, out.size(),
                           {asks_first ? &lattice.first : nullptr, &grid,
                            lattice.through.size() > k ? &lattice.through[k] : nullptr});
            },
            [&](const Tile& tile) { store_tile(tile, gbuffer, out, first > 0); });
    }
}

}  // namespace gonio::lighting
