#include "server/lighting/direct_tile.h"

#include <algorithm>

#include "server/lighting/material_table.h"
#include "shaders/shared/layouts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/direct_tile.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// After the two above: once for each instruction set.
#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_air.h"
#include "server/lighting/simd_materials.h"
#include "server/lighting/simd_pixels.h"
#include "server/lighting/simd_web.h"
#include "server/lighting/simd_web_parts.h"

// Light in the picture's measure: what the haze lets pass on its way of what would come there; to: from the luminaire.
HWY_INLINE Float arriving(const DirectLight& light, const Vec3& to, Float undimmed) {
    const Float relative = undimmed * Float(light.unit_m2);
    if (!light.air) return relative;
    const Float y(light.position.y);
    return relative * air_passes(light.air, sqrt(dot(to, to)), y, y + to.y);
}

void SoftPoints(const DirectLight& light, const Points& points, std::size_t count, float* relative, float* ratio) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        const Vec3 to = position_of(points, at) - spread(light.position), n = normal_of(points, at);
        const Float light_there = from_parts(light, to, n);
        store(arriving(light, to, light_there), relative + i);
        if (ratio != nullptr) store(light_there / even_falloff(*light.parts, to, n), ratio + i);
    }
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
        store(dark ? Float(0.0f) : arriving(light, to, value * share), relative + i);
        if (ratio != nullptr) store(value, ratio + i);
    }
}

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
        const Vec3 n(load(values[3]), load(values[4]), load(values[5]));
        store(arriving(light, to, from_parts(light, to, n)), relative);
        for (std::size_t i = 0; i < std::min(lanes, asking - first); ++i) {
            tile.asking[left] = tile.asking[first + i];
            tile.relative[left] = relative[i];
            left += relative[i] > 0.0f ? 1 : 0;
        }
    }
    return left;
}

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
                relative = arriving(light, to[v], relative);
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

bool fill_tile(Tile& tile, const GBuffer& gbuffer, const std::uint32_t* weights) {
    return HWY_DYNAMIC_DISPATCH(FillTile)(tile, gbuffer, weights);
}

std::size_t light_tile(Tile& tile, const DirectLight& light, const LatticePoints& lattice, bool edges,
                       std::size_t planes) {
    return HWY_DYNAMIC_DISPATCH(LightTile)(tile, light, lattice, edges, planes);
}

void store_tile(const Tile& tile, const GBuffer& gbuffer, Planes& planes, bool adds) {
    HWY_DYNAMIC_DISPATCH(StoreTile)(tile, gbuffer, planes, adds);
}

}  // namespace gonio::lighting
#endif
