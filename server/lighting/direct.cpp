#include "server/lighting/direct.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/lighting/material_table.h"
#include "shaders/shared/layouts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/direct.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

#ifndef GONIO_LIGHTING_DIRECT_TILE
#define GONIO_LIGHTING_DIRECT_TILE
namespace gonio::lighting {

// As many pixels as stay in the cache while one luminaire after the other lights them. Pixels 4 apart follow each
// other: pixel (x, y) is number (4 y + x % 4) kSimdWidth + x / 4.
inline constexpr int kTileRows = 8, kTileColumns = 4 * static_cast<int>(kSimdWidth);
inline constexpr std::size_t kTilePixels = kTileRows * kTileColumns, kSquare = 16;

struct Tile {
    int first_x = 0, first_y = 0;
    int x_of(std::size_t pixel) const {
        return first_x + static_cast<int>(4 * (pixel % kSimdWidth) + pixel / kSimdWidth % 4);
    }
    int y_of(std::size_t pixel) const { return first_y + static_cast<int>(pixel / (4 * kSimdWidth)); }
    alignas(64) float points[6][kTilePixels], depth[kTilePixels];  // as of Points; 0: no surface
    alignas(64) std::uint32_t weights[kTilePixels];                // ToPixels::weights
    bool detailed = false;
    alignas(64) float detail[3][kTilePixels];  // normals of GBuffer::detail
    alignas(64) float light[3][kTilePixels];   // the sum
    glm::vec3 least, greatest;                 // corners of a box around the surfaces
    // Pixels that need a ray of their own, and what it would bring.
    std::uint16_t asking[kTilePixels];
    float relative[kTilePixels];
};

// Values of a luminaire at the grid's points, from the first on, as of Lattice; ratio null: every pixel asks.
struct LatticePoints {
    const float *ratio, *through;
    std::ptrdiff_t stride;
};

// Marks a grid point that receives no light: hidden or turned away (negative), or beyond the beam.
inline constexpr float kNoLight = 1e-20f;

}  // namespace gonio::lighting
#endif

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_air.h"
#include "server/lighting/simd_materials.h"
#include "server/lighting/simd_pixels.h"
#include "server/lighting/simd_web.h"
#include "server/lighting/simd_web_parts.h"

void SoftPoints(const DirectLight& light, const Points& points, std::size_t count, float* relative, float* ratio) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        const Vec3 to = position_of(points, at) - spread(light.position), n = normal_of(points, at);
        const Float light_there = from_parts(light, to, n);
        store(light_there * Float(light.unit_m2), relative + i);
        if (ratio != nullptr) store(light_there / even_falloff(*light.parts, to, n), ratio + i);
    }
}

// What of the light passes the haze on its way; to: from the luminaire.
HWY_INLINE Float passes_air(const DirectLight& light, const Vec3& to) {
    const Float y(light.position.y);
    return air_passes(light.air, sqrt(dot(to, to)), y, y + to.y);
}

void DirectPoints(const DirectLight& light, const Points& points, std::size_t count, float* relative, float* ratio) {
    if (light.parts) {
        SoftPoints(light, points, count, relative, ratio);
        return;
    }
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        const Vec3 to = position_of(points, at) - spread(light.position);
        const Float share = falloff(to, normal_of(points, at));
        const bool dark = ratio == nullptr && hn::AllFalse(Tag(), Float(0.0f) < share);
        const Float value = dark ? Float(0.0f) : web_ratio(light.web, turned(light.light_from_world, to));
        const Float passed = light.air && !dark ? passes_air(light, to) : Float(1.0f);
        store(value * share * passed * Float(light.unit_m2), relative + i);
        if (ratio != nullptr) store(value, ratio + i);
    }
}

// Fills in a tile's surfaces. weights: of the picture. Result: whether there are any.
bool FillTile(Tile& tile, const GBuffer& s, const std::uint32_t* weights) {
    tile.detailed = !s.detail.empty();
    const Tag tag;
    const IntTag ints;
    const std::size_t simd_lanes = hn::Lanes(tag);
    Vec3 least(Float(1e30f), Float(1e30f), Float(1e30f)), greatest(Float(-1e30f), Float(-1e30f), Float(-1e30f));
    for (int row = 0; row < kTileRows; ++row) {
        const int y = tile.first_y + row;
        const bool inside = y < s.height;
        const std::size_t from = static_cast<std::size_t>(inside ? y : 0) * s.row_length;
        const glm::vec3 start = s.rays.corner + static_cast<float>(y) * s.rays.up;
        for (std::size_t i = 0; i < kSimdWidth; i += simd_lanes) {
            const std::size_t x = static_cast<std::size_t>(tile.first_x) + 4 * i;
            Raw depth[4];
            hn::Vec<IntTag> normal[4], weight[4], detail[4];
            hn::LoadInterleaved4(tag, s.depth.data() + from + x, depth[0], depth[1], depth[2], depth[3]);
            hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(s.normal.data() + from + x), normal[0],
                                 normal[1], normal[2], normal[3]);
            hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(weights + from + x), weight[0], weight[1],
                                 weight[2], weight[3]);
            if (tile.detailed)
                hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(s.detail.data() + from + x), detail[0],
                                     detail[1], detail[2], detail[3]);
            for (std::size_t phase = 0; phase < 4; ++phase) {
                const std::size_t at = (4 * static_cast<std::size_t>(row) + phase) * kSimdWidth + i;
                const Mask surface = inside ? Float(0.0f) < Float(depth[phase]) : Float(0.0f) < Float(0.0f);
                const Float z = Float(s.rays.near_m) / max(Float(depth[phase]), Float(1e-30f));
                const Vec3 p = surface_point(s.rays, start, column_of(x + phase), z), n = unpack_normal(normal[phase]);
                store(p.x, tile.points[0] + at), store(p.y, tile.points[1] + at), store(p.z, tile.points[2] + at);
                store(n.x, tile.points[3] + at), store(n.y, tile.points[4] + at), store(n.z, tile.points[5] + at);
                store(hn::IfThenElseZero(surface, z.raw), tile.depth + at);
                if (tile.detailed) {
                    const Vec3 own = unpack_normal(detail[phase]);
                    store(own.x, tile.detail[0] + at), store(own.y, tile.detail[1] + at),
                        store(own.z, tile.detail[2] + at);
                }
                hn::StoreU(weight[phase], ints, reinterpret_cast<std::int32_t*>(tile.weights) + at);
                const auto widen = [&](Float value, Float& low, Float& high) {
                    low = mix(low, min(low, value), surface), high = mix(high, max(high, value), surface);
                };
                widen(p.x, least.x, greatest.x), widen(p.y, least.y, greatest.y), widen(p.z, least.z, greatest.z);
            }
        }
    }
    const auto lowest = [](Float x) { return hn::GetLane(hn::MinOfLanes(Tag(), x.raw)); };
    tile.least = {lowest(least.x), lowest(least.y), lowest(least.z)};
    tile.greatest = {-lowest(-greatest.x), -lowest(-greatest.y), -lowest(-greatest.z)};
    return tile.least.x <= tile.greatest.x;
}

// What the four grid points around pixels say: sums of the weights, of those that see the luminaire, and of I / I_peak;
// the least and the greatest of it among those that count.
struct Around {
    Float sum, open, ratio, least, greatest;
    HWY_INLINE Around() : least(1e30f) {}
};
HWY_INLINE Around around_pixels(const Tile& tile, std::size_t at, const float* lattice, std::ptrdiff_t stride) {
    const Tag tag;
    const IntTag ints;
    const int y = tile.first_y + static_cast<int>(at / (4 * kSimdWidth)), phase = static_cast<int>(at / kSimdWidth % 4);
    const float* corner = lattice + row_below(y) * stride + tile.first_x / 4 +
                          static_cast<std::ptrdiff_t>(at % kSimdWidth) + left_of(phase);
    auto weights = hn::LoadU(ints, reinterpret_cast<const std::int32_t*>(tile.weights) + at);
    Around a;
    for (const float* from : {corner, corner + 1, corner + stride, corner + stride + 1}) {
        const Float weight = hn::ConvertTo(tag, hn::And(weights, hn::Set(ints, 255))), value = load(from),
                    size = abs(value);
        const Mask counts = Float(0.0f) < weight;
        weights = hn::ShiftRight<8>(weights);
        a.sum = a.sum + weight;
        a.open = a.open + mix(Float(0.0f), weight, Float(0.0f) < value);
        a.ratio = a.ratio + weight * size;
        a.least = mix(a.least, min(a.least, size), counts);
        a.greatest = mix(a.greatest, max(a.greatest, size), counts);
    }
    return a;
}

// What an opening would bring the pixels in tile.asking: few of those beside each other ask, and its parts are many.
// Result: how many are left, those that it would bring nothing are left out.
std::size_t LightAskers(Tile& tile, const DirectLight& light, std::size_t asking) {
    const std::size_t lanes = hn::Lanes(Tag());
    const auto* const normal = tile.detailed ? tile.detail : tile.points + 3;
    std::size_t left = 0;
    for (std::size_t first = 0; first < asking; first += lanes) {
        HWY_ALIGN float values[6][hn::MaxLanes(Tag())], relative[hn::MaxLanes(Tag())];
        for (std::size_t i = 0; i < lanes; ++i) {
            const std::size_t pixel = tile.asking[std::min(first + i, asking - 1)];
            for (std::size_t v = 0; v < 3; ++v)
                values[v][i] = tile.points[v][pixel], values[v + 3][i] = normal[v][pixel];
        }
        const Vec3 to = Vec3(load(values[0]), load(values[1]), load(values[2])) - spread(light.position);
        Float own =
            from_parts(light, to, Vec3(load(values[3]), load(values[4]), load(values[5]))) * Float(light.unit_m2);
        if (light.air) own = own * passes_air(light, to);
        store(own, relative);
        for (std::size_t i = 0; i < std::min(lanes, asking - first); ++i) {
            tile.asking[left] = tile.asking[first + i];
            tile.relative[left] = relative[i];
            left += relative[i] > 0.0f ? 1 : 0;
        }
    }
    return left;
}

// Adds one luminaire's light to a tile's pixels where the grid's points agree. The web is read at pixels that ask, and
// where it changes by a tenth between the points; else a pixel takes theirs, within 0.2 %. edges: all pixels of a
// square of 4 × 4 ask if a surface in it is turned away, whose shadow may be narrow. Result: how many pixels are left,
// in tile.asking, square by square.
std::size_t LightTile(Tile& tile, const DirectLight& light, const LatticePoints& lattice, bool edges,
                      std::size_t planes) {
    const Tag tag;
    // A pixel that a grid point of another mind has no more of than this follows the others.
    constexpr float kOpinion = 0.05f;
    const Mask none = Float(0.0f) < Float(0.0f);
    const bool soft = light.parts != nullptr;
    const float radius = soft ? light.parts->radius_m : 0.0f;
    std::size_t asking = 0;
    HWY_ALIGN float contribution[kSquare * kSimdWidth];
    for (std::size_t group = 0; group < kTilePixels; group += kSquare * kSimdWidth) {
        bool any = false;
        for (std::size_t i = 0; i < kSimdWidth; i += hn::Lanes(tag)) {
            Vec3 to[kSquare];
            Float share[kSquare];
            Mask edge = none;
            const auto look = [&](std::size_t v) {
                const Points points = points_at(tile.points, group + v * kSimdWidth + i);
                to[v] = position_of(points, 0) - spread(light.position);
                share[v] = falloff(to[v], normal_of(points, 0));
            };
            const auto lit_normal = [&](std::size_t v) {  // normal maps included
                const std::size_t at = group + v * kSimdWidth + i;
                const auto* const n = tile.detailed ? tile.detail : tile.points + 3;
                return Vec3(load(n[0] + at), load(n[1] + at), load(n[2] + at));
            };
            const auto faces = [&](std::size_t v) {
                if (!soft) return Float(0.0f) < share[v];
                return dot(to[v], normal_of(points_at(tile.points, group + v * kSimdWidth + i), 0)) < Float(radius);
            };
            for (std::size_t v = 0; edges && v < kSquare; ++v) {
                look(v);
                edge = hn::Or(edge, hn::AndNot(faces(v), Float(0.0f) < load(tile.depth + group + v * kSimdWidth + i)));
            }
            for (std::size_t v = 0; v < kSquare; ++v) {
                const std::size_t at = group + v * kSimdWidth + i;
                Mask wanted = Float(0.0f) < load(tile.depth + at), agree = none, seen = none, steep = none;
                store(Float(0.0f), contribution + v * kSimdWidth + i);
                Float ratio, through(1.0f);
                if (lattice.ratio != nullptr) {
                    const Around around = around_pixels(tile, at, lattice.ratio, lattice.stride);
                    const Mask one_surface = hn::AndNot(edge, Float(static_cast<float>(kPoorSum) - 0.5f) < around.sum),
                               light_there = hn::And(Float(0.0f) < around.open, Float(kNoLight) < around.greatest);
                    wanted = hn::And(wanted, hn::Or(hn::Not(one_surface), light_there));
                    seen = around.sum * Float(1.0f - kOpinion) < around.open;
                    agree = hn::And(one_surface, hn::Or(seen, around.open < around.sum * Float(kOpinion)));
                    steep = hn::And(Float(0.002f) < around.greatest,
                                    around.least < around.greatest * Float(soft ? 0.8f : 0.9f));
                    ratio = around.ratio / max(around.sum, Float(1.0f));
                    if (lattice.through != nullptr) {
                        constexpr float kEven = 0.95f;
                        const Around passed = around_pixels(tile, at, lattice.through, lattice.stride);
                        agree = hn::AndNot(passed.least < passed.greatest * Float(kEven), agree);
                        through = passed.ratio / max(passed.sum, Float(1.0f));
                        if (soft) {  // what is seen of it changes evenly between points
                            constexpr float kPenumbra = 0.8f;
                            agree = hn::And(one_surface, passed.greatest - passed.least < Float(kPenumbra));
                            seen = Float(0.0f) < passed.ratio;
                        }
                    }
                }
                if (hn::AllFalse(tag, wanted)) continue;
                if (!edges) look(v);
                if (tile.detailed) share[v] = falloff(to[v], lit_normal(v));
                wanted = hn::And(wanted, faces(v));
                const Mask lit = hn::And(wanted, hn::And(agree, seen)), casts_ray = hn::AndNot(agree, wanted);
                if (hn::AllFalse(tag, hn::Or(lit, casts_ray))) continue;
                const Mask exact = soft ? hn::AndNot(casts_ray, steep) : hn::Or(casts_ray, steep);
                Float relative;
                if (soft)
                    relative = hn::AllFalse(tag, exact) ? ratio * even_falloff(*light.parts, to[v], lit_normal(v))
                                                        : from_parts(light, to[v], lit_normal(v));
                else
                    relative = hn::AllFalse(tag, exact)
                                   ? ratio * share[v]
                                   : web_ratio(light.web, turned(light.light_from_world, to[v])) * share[v];
                relative = relative * Float(light.unit_m2);
                if (light.air) relative = relative * passes_air(light, to[v]);
                const Float shown = hn::IfThenElseZero(lit, (relative * through).raw);
                for (std::size_t k = 0; k < planes; ++k)
                    store(load(tile.light[k] + at) + shown * Float(light.weight[static_cast<int>(k)]),
                          tile.light[k] + at);
                store(hn::IfThenElseZero(casts_ray, soft ? Float(1.0f).raw : relative.raw),
                      contribution + v * kSimdWidth + i);  // of an opening: see LightAskers

                any |= !hn::AllFalse(tag, casts_ray);
            }
        }
        for (std::size_t k = 0; any && k < kSquare * kSimdWidth; ++k) {
            const std::size_t at = k % kSquare * kSimdWidth + k / kSquare;
            tile.asking[asking] = static_cast<std::uint16_t>(group + at);
            tile.relative[asking] = contribution[at];
            asking += contribution[at] > 0.0f ? 1 : 0;
        }
    }
    return soft ? LightAskers(tile, light, asking) : asking;
}

// Tile -> picture. adds: to what is there.
void StoreTile(const Tile& tile, const GBuffer& s, Planes& planes, bool adds) {
    const Tag tag;
    for (std::size_t k = 0; k < planes.size(); ++k) {
        for (int row = 0; row < std::min(kTileRows, s.height - tile.first_y); ++row) {
            float* to = planes[k].data() + static_cast<std::size_t>(tile.first_y + row) * s.row_length +
                        static_cast<std::size_t>(tile.first_x);
            for (std::size_t i = 0; i < kSimdWidth; i += hn::Lanes(tag)) {
                const float* from = tile.light[k] + 4 * static_cast<std::size_t>(row) * kSimdWidth + i;
                Raw sum[4] = {hn::Zero(tag), hn::Zero(tag), hn::Zero(tag), hn::Zero(tag)};
                if (adds) hn::LoadInterleaved4(tag, to + 4 * i, sum[0], sum[1], sum[2], sum[3]);
                for (std::size_t p = 0; p < 4; ++p) sum[p] = hn::Add(sum[p], hn::LoadU(tag, from + p * kSimdWidth));
                hn::StoreInterleaved4(sum[0], sum[1], sum[2], sum[3], tag, to + 4 * i);
            }
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(DirectPoints);
HWY_EXPORT(FillTile);
HWY_EXPORT(LightTile);
HWY_EXPORT(StoreTile);

void direct_points(const DirectLight& light, const Points& points, std::size_t count, float* relative, float* ratio) {
    HWY_DYNAMIC_DISPATCH(DirectPoints)(light, points, count, relative, ratio);
}

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
            if (HWY_DYNAMIC_DISPATCH(FillTile)(tile, gbuffer, screen.to_pixels.weights.data())) {
                const std::uint64_t beams = beams_at(some, tile.least, tile.greatest);
                for (std::size_t k = 0; k < some.size(); ++k) {
                    if ((beams >> k & 1u) == 0) continue;
                    const auto points_of = [&](const Planes& planes) {
                        return every_pixel || planes.empty() ? nullptr : planes[k].data() + grid.at(0, 0);
                    };
                    const float* const through =
                        some[k].parts || geometry.transmissive() ? points_of(lattice.through) : nullptr;
                    const std::size_t asking = HWY_DYNAMIC_DISPATCH(LightTile)(
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
            [&](const Tile& tile) {
                HWY_DYNAMIC_DISPATCH(StoreTile)
                (tile, gbuffer, out, first > 0);
            });
    }
}

}  // namespace gonio::lighting
#endif
