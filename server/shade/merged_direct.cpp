// Direct light of many luminaires in one pass. Visibility is constant over most of a picture: it is asked at every grid
// point, and at the pixels only between grid points that do not agree.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "server/shade/looks.h"
#include "server/shade/merged.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/shade/merged_direct.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef GONIO_SHADE_MERGED_BLOCK
#define GONIO_SHADE_MERGED_BLOCK
namespace gonio::shade {

// The pixels between four grid points are a cell: 4 × 4 of them, from the one at the lower left point on; a packet of
// rays. A block is as many cells as stay in the cache while one luminaire after the other lights them.
inline constexpr int kCellSide = 4, kBlockSide = 8;
inline constexpr std::size_t kCellPixels = kCellSide * kCellSide, kBlockPixels = kCellPixels * kBlockSide * kBlockSide;
// Shadow rays start this share of a pixel's width off its surface (direct.cpp).
inline constexpr float kOffPerPixel = 0.02f;
// Marks a grid point that receives no light: hidden or turned away (negative), or beyond the beam.
inline constexpr float kNoLight = 1e-20f;

struct Block {
    alignas(64) float x[kBlockPixels], y[kBlockPixels], z[kBlockPixels], nx[kBlockPixels], ny[kBlockPixels],
        nz[kBlockPixels], depth[kBlockPixels];
    // Share of the lower left, lower right, upper left and upper right grid point; all 0: no surface, or none is alike.
    alignas(64) float share[4][kBlockPixels];
    alignas(64) float light[3][kBlockPixels];  // the sum, rgb
    alignas(64) float column[kCellPixels], row[kCellPixels], along_x[kCellPixels], along_y[kCellPixels];
    struct Cell {
        std::ptrdiff_t at;     // grid index of its lower left point
        unsigned used = 0;     // bits of grid points that any pixel is alike
        bool surface = false;  // any
        bool lost = false;     // a surface without a grid point that is alike
    };
    Cell cells[kBlockSide * kBlockSide];
    std::uint16_t asking[kBlockPixels];  // pixels that need a ray of their own

    Points points(std::size_t first) const {
        return {x + first, y + first, z + first, nx + first, ny + first, nz + first};
    }
};

}  // namespace gonio::shade
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::shade {
namespace HWY_NAMESPACE {

#include "server/shade/lanes.h"
#include "server/shade/layer_lanes.h"
#include "server/shade/look_lanes.h"
#include "server/shade/web_lanes.h"

// At `count` points, a multiple of kLanes: illuminance per cd of the luminaire's peak if nothing stands between, 0
// where it is behind; ratio: I / I_peak, or null.
void LightPoints(const MergedLight& light, const Points& points, std::size_t count, float* lux_per_cd, float* ratio) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const Vec3 to = Vec3(load(points.x + i), load(points.y + i), load(points.z + i)) - spread(light.position);
        const Vec3 n(load(points.nx + i), load(points.ny + i), load(points.nz + i));
        const Float d2 = max(dot(to, to), Float(1e-12f));
        const Float cosine = max(-dot(n, to) * inversesqrt(d2), Float(0.0f));
        const Float value = web_ratio(light.web, turned(light.light_from_world, to));
        store(value * cosine / d2, lux_per_cd + i);
        if (ratio != nullptr) store(value, ratio + i);
    }
}

// Places and normals of one cell's pixels and their shares of the four grid points around. depth, normal: of the cell's
// pixels, near / distance (0: none) and octahedral.
void PlaceCell(Block& block, std::size_t which, const Rays& rays, int x, int y, const GridRows& grid,
               float near_per_depth, const float* depth, const std::uint32_t* normal) {
    const Tag tag;
    const IntTag ints;
    Block::Cell& cell = block.cells[which];
    cell.used = 0;
    cell.surface = cell.lost = false;
    for (std::size_t i = 0; i < kCellPixels; i += hn::Lanes(tag)) {
        const std::size_t at = which * kCellPixels + i;
        const Raw d = hn::LoadU(tag, depth + i);
        const Mask surface = hn::Gt(d, hn::Zero(tag));
        const Float z = Float(rays.near_m) / max(Float(d), Float(1e-30f));
        const Float column = load(block.column + i) + Float(static_cast<float>(x)),
                    row = load(block.row + i) + Float(static_cast<float>(y));
        const Vec3 along(Float(rays.corner.x) + column * Float(rays.right.x) + row * Float(rays.up.x),
                         Float(rays.corner.y) + column * Float(rays.right.y) + row * Float(rays.up.y),
                         Float(rays.corner.z) + column * Float(rays.right.z) + row * Float(rays.up.z));
        const Vec3 p = spread(rays.eye) + along * z;
        const Vec3 n = unpack_normal(hn::LoadU(ints, reinterpret_cast<const std::int32_t*>(normal) + i));
        store(p.x, block.x + at), store(p.y, block.y + at), store(p.z, block.z + at);
        store(n.x, block.nx + at), store(n.y, block.ny + at), store(n.z, block.nz + at);
        store(z, block.depth + at);
        const Float per_near = Float(1.0f) / max(z * Float(near_per_depth), Float(1e-30f));
        const Float along_x = load(block.along_x + i), along_y = load(block.along_y + i);
        Float share[4], total;
        for (int corner = 0; corner < 4; ++corner) {
            const std::ptrdiff_t from = cell.at + corner / 2 * grid.stride + corner % 2;
            const Vec3 q(Float(grid.points.x[from]), Float(grid.points.y[from]), Float(grid.points.z[from]));
            const Vec3 m(Float(grid.points.nx[from]), Float(grid.points.ny[from]), Float(grid.points.nz[from]));
            const Float near = (corner % 2 == 0 ? Float(1.0f) - along_x : along_x) *
                               (corner / 2 == 0 ? Float(1.0f) - along_y : along_y);
            share[corner] = surface_likeness(dot(n, m), dot(n, q - p) * per_near) * near;
            total = total + share[corner];
        }
        // Little likeness with any of the four is none.
        const Mask alike = hn::And(surface, Float(kPoorlyAlike) < total);
        const Float per_total = hn::IfThenElseZero(alike, (Float(1.0f) / max(total, Float(0.1f))).raw);
        for (int corner = 0; corner < 4; ++corner) {
            const Float own = share[corner] * per_total;
            store(own, block.share[corner] + at);
            if (!hn::AllFalse(tag, Float(0.0f) < own)) cell.used |= 1u << corner;
        }
        for (auto& channel : block.light) store(Float(0.0f), channel + at);
        cell.surface |= !hn::AllFalse(tag, surface);
        cell.lost |= !hn::AllFalse(tag, hn::AndNot(alike, surface));
    }
}

// Adds one luminaire's light to a block where the grid points agree. lattice: its values at the grid points. Result:
// how many pixels are left, in block.asking.
std::size_t LightBlock(Block& block, const MergedLight& light, const float* lattice, std::ptrdiff_t stride) {
    const Tag tag;
    // A pixel that a grid point of another mind has no more of than this follows the others.
    constexpr float kOpinion = 0.05f;
    std::size_t asking = 0;
    for (std::size_t which = 0; which < std::size(block.cells); ++which) {
        const Block::Cell& cell = block.cells[which];
        if (!cell.surface) continue;
        const float values[4] = {lattice[cell.at], lattice[cell.at + 1], lattice[cell.at + stride],
                                 lattice[cell.at + stride + 1]};
        float least = 1e30f, greatest = 0.0f;
        bool seen = false;
        for (unsigned corner = 0; corner < 4; ++corner) {
            if ((cell.used >> corner & 1u) == 0) continue;
            const float size = values[corner] < 0.0f ? -values[corner] : values[corner];
            least = size < least ? size : least;
            greatest = size > greatest ? size : greatest;
            seen |= values[corner] > 0.0f;
        }
        if (!cell.lost && (!seen || greatest <= kNoLight)) continue;
        // Within a cell the web is taken as linear; not where it changes by a tenth.
        const bool steep = greatest > 0.002f && least < 0.9f * greatest;
        for (std::size_t i = 0; i < kCellPixels; i += hn::Lanes(tag)) {
            const std::size_t at = which * kCellPixels + i;
            Float ratio, open, shares;
            for (int corner = 0; corner < 4; ++corner) {
                const Float share = load(block.share[corner] + at);
                shares = shares + share;
                ratio = ratio + share * abs(Float(values[corner]));
                if (values[corner] > 0.0f) open = open + share;
            }
            const Vec3 to = Vec3(load(block.x + at), load(block.y + at), load(block.z + at)) - spread(light.position);
            const Vec3 n(load(block.nx + at), load(block.ny + at), load(block.nz + at));
            const Float d2 = max(dot(to, to), Float(1e-12f));
            const Float per_d = inversesqrt(d2), cosine = -dot(n, to) * per_d;
            const Mask faces = Float(0.0f) < cosine, alike = Float(0.5f) < shares;
            const Mask agree = hn::And(alike, hn::Or(open < Float(kOpinion), Float(1.0f - kOpinion) < open));
            const Mask lit = hn::And(hn::And(faces, agree), Float(0.5f) < open);
            if (!hn::AllFalse(tag, lit)) {
                if (steep) ratio = web_ratio(light.web, turned(light.light_from_world, to));
                const Float value = hn::IfThenElseZero(lit, (ratio * cosine * per_d * per_d).raw);
                for (int k = 0; k < 3; ++k)
                    store(load(block.light[k] + at) + value * Float(light.weight[k]), block.light[k] + at);
            }
            const Mask asks = hn::And(hn::AndNot(agree, faces), Float(0.0f) < load(block.depth + at));
            if (hn::AllFalse(tag, asks)) continue;
            HWY_ALIGN float flags[kLanes];
            hn::Store(hn::IfThenElseZero(asks, hn::Set(tag, 1.0f)), tag, flags);
            for (std::size_t lane = 0; lane < hn::Lanes(tag); ++lane) {
                if (flags[lane] != 0.0f) block.asking[asking++] = static_cast<std::uint16_t>(at + lane);
            }
        }
    }
    return asking;
}

// Half floats, rgb and 1, of a cell's pixels.
void CellHalves(const Block& block, std::size_t which, float unit, std::uint16_t* out) {
    const Tag tag;
    const hn::Rebind<hwy::float16_t, Tag> halves;
    const HalfBits bits;
    for (std::size_t i = 0; i < kCellPixels; i += hn::Lanes(tag)) {
        const auto half = [&](int k) {
            const Raw value = hn::Mul(hn::LoadU(tag, block.light[k] + which * kCellPixels + i), hn::Set(tag, unit));
            return hn::BitCast(bits, hn::DemoteTo(halves, hn::Min(value, hn::Set(tag, 65504.0f))));
        };
        hn::StoreInterleaved4(half(0), half(1), half(2), hn::Set(bits, std::uint16_t{0x3c00}), bits, out + 4 * i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::shade
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::shade {

HWY_EXPORT(LightPoints);
HWY_EXPORT(PlaceCell);
HWY_EXPORT(LightBlock);
HWY_EXPORT(CellHalves);

namespace {

struct Sphere {
    glm::vec3 centre{0.0f};
    float radius = -1.0f;  // negative: nothing in it
};
// Result: a sphere around those of the points that have a depth.
Sphere around(const Points& points, const float* depth, std::size_t count) {
    glm::vec3 least(1e30f), greatest(-1e30f);
    for (std::size_t i = 0; i < count; ++i) {
        if (!(depth[i] > 0.0f)) continue;
        const glm::vec3 p(points.x[i], points.y[i], points.z[i]);
        least = glm::min(least, p);
        greatest = glm::max(greatest, p);
    }
    if (!(least.x <= greatest.x)) return {};
    return {0.5f * (least + greatest), 0.5f * glm::length(greatest - least)};
}

// Result: bits of the luminaires whose beam meets the sphere; none for an empty one.
std::uint64_t beams_at(const MergedList& list, const Sphere& sphere) {
    std::uint64_t result = 0;
    if (sphere.radius < 0.0f) return result;
    for (std::size_t k = 0; k < list.lights.size(); ++k) {
        const MergedLight& light = list.lights[k];
        const glm::vec3 d = light.light_from_world * (sphere.centre - light.position);
        const float distance = glm::length(d);
        bool meets = light.beam_cos <= -1.0f || distance <= 1.001f * sphere.radius;
        if (!meets) {
            const float angle = std::acos(std::clamp(-d.z / distance, -1.0f, 1.0f));
            const float wide = std::acos(light.beam_cos) + std::asin(std::min(1.0f, sphere.radius / distance));
            meets = angle <= wide + 1e-3f;
        }
        result |= static_cast<std::uint64_t>(meets ? 1 : 0) << k;
    }
    return result;
}

// Where shadow rays of a point at that depth start: this far off its surface, m.
struct Start {
    float off_m, per_depth;
};

// Sixteen shadow rays to a luminaire. Result: bits of those that nothing stops.
unsigned unhidden(const trace::Geometry& geometry, const MergedLight& light, const Points& points, const float* depth,
                  const Start& start, unsigned active) {
    trace::RayPacket query;
    for (int i = 0; i < trace::kPacket; ++i) {
        const float off = start.off_m + start.per_depth * depth[i];
        query.from_x[i] = points.x[i] + off * points.nx[i], query.from_y[i] = points.y[i] + off * points.ny[i],
        query.from_z[i] = points.z[i] + off * points.nz[i];
        query.along_x[i] = light.position.x - query.from_x[i];
        query.along_y[i] = light.position.y - query.from_y[i];
        query.along_z[i] = light.position.z - query.from_z[i];
        query.far[i] = 1.0f - 1e-5f;  // a luminaire mounted on a surface is not hidden by it
    }
    return active & ~geometry.occluded(query, active, true);
}

// Sixteen points in arrays of their own.
struct Packet {
    alignas(64) float array[6][kLanes] = {}, depth[kLanes] = {};
    void set(std::size_t i, const float* const* from, const float* from_depth, std::size_t at) {
        for (std::size_t k = 0; k < 6; ++k) array[k][i] = from[k][at];
        depth[i] = from_depth[at];
    }
    Points points() const { return {array[0], array[1], array[2], array[3], array[4], array[5]}; }
};

// With more luminaires than so many a shadow of one of them is faint: blocks ask every other grid point first.
constexpr std::size_t kDense = 4;

// Result: whether 8 × 8 grid points, four packets of every other one each, lie on one smooth surface.
bool even(const Packet* packets, const unsigned* active) {
    const auto vec = [](const Packet& packet, int first, int i) {
        return glm::vec3(packet.array[first][i], packet.array[first + 1][i], packet.array[first + 2][i]);
    };
    for (int p = 0; p < 4; ++p) {
        if (active[p] != 0xffffu) return false;
        for (int i = 0; i < trace::kPacket; ++i) {
            const glm::vec3 n = vec(packets[0], 3, i), off = vec(packets[p], 0, i) - vec(packets[0], 0, i);
            if (glm::dot(n, vec(packets[p], 3, i)) < 0.98f) return false;
            if (std::abs(glm::dot(n, off)) > 0.1f * glm::length(off)) return false;
            const int next = i % 4 < 3 ? i + 1 : i;  // and between the packets' own points
            const glm::vec3 across = vec(packets[p], 0, next) - vec(packets[p], 0, i);
            if (std::abs(glm::dot(n, across)) > 0.1f * glm::length(across)) return false;
        }
    }
    return true;
}

// The lattice's values of 8 × 8 grid points from (x, y) on.
void ask_grid(const Grid& grid, const trace::Geometry& geometry, const MergedList& list, std::span<const Start> starts,
              int x, int y, Lattice& lattice) {
    const float* arrays[6];
    for (std::size_t k = 0; k < 6; ++k) arrays[k] = grid.values[k].data();
    Packet packets[4];
    std::size_t at[4][kLanes];
    unsigned inside[4] = {}, active[4] = {};  // of the grid; and with a surface
    alignas(64) float lx[4 * kLanes], ly[4 * kLanes], lz[4 * kLanes], depth[4 * kLanes];
    for (int p = 0; p < 4; ++p) {
        for (int i = 0; i < trace::kPacket; ++i) {
            const int px = x + i % 4 * 2 + p % 2, py = y + i / 4 * 2 + p / 2;
            if (px < grid.width && py < grid.height) inside[p] |= 1u << i;
            at[p][i] = static_cast<std::size_t>(grid.at(std::min(px, grid.width - 1), std::min(py, grid.height - 1)));
            packets[p].set(static_cast<std::size_t>(i), arrays, grid.values[6].data(), at[p][i]);
            if ((inside[p] >> i & 1u) != 0 && packets[p].depth[i] > 0.0f) active[p] |= 1u << i;
            const std::size_t flat = static_cast<std::size_t>(p) * kLanes + static_cast<std::size_t>(i);
            lx[flat] = packets[p].array[0][i], ly[flat] = packets[p].array[1][i], lz[flat] = packets[p].array[2][i];
            depth[flat] = (active[p] >> i & 1u) != 0 ? packets[p].depth[i] : 0.0f;
        }
    }
    const std::uint64_t beams = beams_at(list, around({lx, ly, lz, lx, ly, lz}, depth, 4 * kLanes));
    const bool sparse = list.lights.size() > kDense && even(packets, active);
    for (std::size_t k = 0; k < list.lights.size(); ++k) {
        bool all_seen = false, all_hidden = false;  // so say the points asked first
        for (int p = 0; p < 4; ++p) {
            float* to = lattice[k].data();
            if ((beams >> k & 1u) == 0 || active[p] == 0) {
                for (int i = 0; i < trace::kPacket; ++i) {
                    if ((inside[p] >> i & 1u) != 0) to[at[p][i]] = 0.0f;
                }
                continue;
            }
            alignas(64) float lux[kLanes], ratio[kLanes];
            HWY_DYNAMIC_DISPATCH(LightPoints)(list.lights[k], packets[p].points(), kLanes, lux, ratio);
            unsigned lit = 0;
            for (int i = 0; i < trace::kPacket; ++i) lit |= (lux[i] > 0.0f ? 1u : 0u) << i;
            lit &= active[p];
            unsigned seen = all_seen ? lit : 0u;
            if (lit != 0 && !all_seen && !all_hidden)
                seen = unhidden(geometry, list.lights[k], packets[p].points(), packets[p].depth, starts[k], lit);
            if (p == 0 && sparse && lit == active[p]) all_seen = seen == lit, all_hidden = seen == 0;
            for (int i = 0; i < trace::kPacket; ++i) {
                if ((inside[p] >> i & 1u) == 0) continue;
                const float value = std::max(ratio[i], kNoLight);
                const bool dark = ratio[i] <= 0.0f && (active[p] >> i & 1u) != 0;
                to[at[p][i]] = (seen >> i & 1u) != 0 || dark ? value : -value;
            }
        }
    }
}

}  // namespace

void merged_direct(const Surfaces& surfaces, const ScreenGrid& screen, const trace::Geometry& geometry,
                   const MergedList& list, float unit_m2, Lattice& lattice, std::vector<std::uint16_t>& out,
                   Pool& pool) {
    const Grid& grid = screen.grid;
    out.resize(surfaces.row_length * static_cast<std::size_t>(surfaces.height) * 4);
    lattice.resize(list.lights.size());
    for (std::vector<float>& plane : lattice) plane.resize(grid.first_spare() + kLanes);
    std::vector<Start> starts;
    for (const MergedLight& light : list.lights)
        starts.push_back({4.0f * geometry.step_off(light.position), kOffPerPixel * surfaces.depth_per_pixel});

    const int across = (grid.width + kBlockSide - 1) / kBlockSide, down = (grid.height + kBlockSide - 1) / kBlockSide;
    pool.run(across * down, [&](int job) {
        ask_grid(grid, geometry, list, starts, job % across * kBlockSide, job / across * kBlockSide, lattice);
    });
    pool.run(static_cast<int>(lattice.size()), [&](int k) { grid.extend(lattice[static_cast<std::size_t>(k)]); });

    // Cell (i, j) lies between the grid points i - 1 and i; the grid's border stands for those beyond the picture.
    const int columns = grid.width + 1, rows = grid.height + 1;
    const int blocks_x = (columns + kBlockSide - 1) / kBlockSide, blocks_y = (rows + kBlockSide - 1) / kBlockSide;
    const float near_per_depth = kUpsampleNear * screen.depth_per_point;
    GridRows all = grid.rows();
    const std::ptrdiff_t origin = grid.at(0, 0);
    for (const float** array :
         {&all.points.x, &all.points.y, &all.points.z, &all.points.nx, &all.points.ny, &all.points.nz, &all.depth})
        *array -= origin;
    pool.run(blocks_x * blocks_y, [&](int job) {
        static thread_local Block block;
        for (std::size_t i = 0; i < kCellPixels; ++i) {
            block.column[i] = static_cast<float>(i % kCellSide), block.row[i] = static_cast<float>(i / kCellSide);
            block.along_x[i] = block.column[i] / kCellSide, block.along_y[i] = block.row[i] / kCellSide;
        }
        const int first_x = job % blocks_x * kBlockSide, first_y = job / blocks_x * kBlockSide;
        bool surface = false;
        for (std::size_t which = 0; which < std::size(block.cells); ++which) {
            const int i = first_x + static_cast<int>(which) % kBlockSide,
                      j = first_y + static_cast<int>(which) / kBlockSide;
            const int x = kCellSide * i - kCellSide / 2, y = kCellSide * j - kCellSide / 2;
            alignas(64) float depth[kCellPixels] = {};
            alignas(64) std::uint32_t normal[kCellPixels] = {};
            for (int dy = 0; dy < kCellSide; ++dy) {
                for (int dx = 0; dx < kCellSide; ++dx) {
                    if (x + dx < 0 || x + dx >= surfaces.width || y + dy < 0 || y + dy >= surfaces.height) continue;
                    const std::size_t from =
                        static_cast<std::size_t>(y + dy) * surfaces.row_length + static_cast<std::size_t>(x + dx);
                    depth[dy * kCellSide + dx] = surfaces.depth[from];
                    normal[dy * kCellSide + dx] = surfaces.normal[from];
                }
            }
            block.cells[which].at = grid.at(std::min(i, grid.width) - 1, std::min(j, grid.height) - 1);
            HWY_DYNAMIC_DISPATCH(PlaceCell)
            (block, which, surfaces.rays, x, y, all, near_per_depth, depth, normal);
            for (std::size_t k = 0; k < kCellPixels; ++k) {
                if (!(depth[k] > 0.0f)) block.depth[which * kCellPixels + k] = 0.0f;
            }
            surface |= block.cells[which].surface;
        }
        const std::uint64_t beams =
            surface ? beams_at(list, around(block.points(0), block.depth, kBlockPixels)) : std::uint64_t{0};
        const float* const arrays[6] = {block.x, block.y, block.z, block.nx, block.ny, block.nz};
        for (std::size_t k = 0; k < list.lights.size(); ++k) {
            if ((beams >> k & 1u) == 0) continue;
            const MergedLight& light = list.lights[k];
            const std::size_t asking = HWY_DYNAMIC_DISPATCH(LightBlock)(block, light, lattice[k].data(), grid.stride);
            for (std::size_t first = 0; first < asking; first += kLanes) {
                const std::size_t count = std::min(kLanes, asking - first);
                Packet packet;
                for (std::size_t i = 0; i < count; ++i) packet.set(i, arrays, block.depth, block.asking[first + i]);
                alignas(64) float lux[kLanes];
                HWY_DYNAMIC_DISPATCH(LightPoints)(light, packet.points(), kLanes, lux, nullptr);
                unsigned lit = 0;
                for (std::size_t i = 0; i < count; ++i) lit |= (lux[i] > 0.0f ? 1u : 0u) << i;
                if (lit == 0) continue;
                const unsigned seen = unhidden(geometry, light, packet.points(), packet.depth, starts[k], lit);
                for (std::size_t i = 0; i < count; ++i) {
                    if ((seen >> i & 1u) == 0) continue;
                    for (int c = 0; c < 3; ++c) block.light[c][block.asking[first + i]] += light.weight[c] * lux[i];
                }
            }
        }
        alignas(64) std::uint16_t halves[4 * kCellPixels];
        for (std::size_t which = 0; which < std::size(block.cells); ++which) {
            const int x = kCellSide * (first_x + static_cast<int>(which) % kBlockSide) - kCellSide / 2,
                      y = kCellSide * (first_y + static_cast<int>(which) / kBlockSide) - kCellSide / 2;
            HWY_DYNAMIC_DISPATCH(CellHalves)(block, which, unit_m2, halves);
            const int left = std::max(0, -x), right = std::min(kCellSide, surfaces.width - x);
            for (int dy = std::max(0, -y); dy < std::min(kCellSide, surfaces.height - y) && left < right; ++dy) {
                std::memcpy(out.data() + 4 * (static_cast<std::size_t>(y + dy) * surfaces.row_length +
                                              static_cast<std::size_t>(x + left)),
                            halves + 4 * (dy * kCellSide + left), static_cast<std::size_t>(right - left) * 8);
            }
        }
    });
}

}  // namespace gonio::shade
#endif
