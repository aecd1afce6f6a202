#include "server/shade/kernels.h"

#include <algorithm>
#include <cmath>

#include "server/shade/looks.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/shade/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::shade {
namespace HWY_NAMESPACE {

#include "server/shade/lanes.h"
#include "server/shade/look_lanes.h"
#include "server/shade/web_lanes.h"

// A place on a surface; likeness: how like it a point of a grid is.
struct Place {
    Vec3 position, normal;
    Float per_near;
    Float likeness(const Points& points, std::ptrdiff_t at) const {
        const Vec3 q(load(points.x + at), load(points.y + at), load(points.z + at));
        const Vec3 n(load(points.nx + at), load(points.ny + at), load(points.nz + at));
        return surface_likeness(dot(normal, n), dot(normal, q - position) * per_near);
    }
};
HWY_INLINE Float per_near_of(Float depth, float near_per_depth) {
    return Float(1.0f) / max(depth * Float(near_per_depth), Float(1e-30f));
}
HWY_INLINE Place place_at(const GridRows& grid, std::ptrdiff_t at, float near_per_depth) {
    const Points& p = grid.points;
    return {Vec3(load(p.x + at), load(p.y + at), load(p.z + at)),
            Vec3(load(p.nx + at), load(p.ny + at), load(p.nz + at)),
            per_near_of(load(grid.depth + at), near_per_depth)};
}

// The point that a pixel of this column shows; z: its depth, m.
HWY_INLINE Vec3 surface_point(const Rays& rays, const glm::vec3& start, Float column, Float z) {
    return spread(rays.eye) + Vec3(Float(start.x) + column * Float(rays.right.x),
                                   Float(start.y) + column * Float(rays.right.y),
                                   Float(start.z) + column * Float(rays.right.z)) *
                                  z;
}

// Unoccluded illuminance per candela of peak × unit_m2 at p; n: the normal there.
HWY_INLINE Float arrives(const DirectLight& light, const Vec3& p, const Vec3& n) {
    const Vec3 to = p - spread(light.position);
    const Float d2 = max(dot(to, to), Float(1e-12f));
    const Float cosine = -dot(n, to) * inversesqrt(d2);
    const Mask lit = Float(0.0f) < cosine;
    if (hn::AllFalse(Tag(), lit)) return Float(0.0f);
    const Float value = web_ratio(light.web, turned(light.light_from_world, to)) * cosine / d2 * Float(light.unit_m2);
    return hn::IfThenElseZero(lit, value.raw);
}

void DirectRow(const DirectLight& light, int y, int width, const Rays& rays, const float* depth,
               const std::uint32_t* normal, float* lux_per_cd) {
    const Tag tag;
    const IntTag ints;
    const glm::vec3 start = rays.corner + static_cast<float>(y) * rays.up;
    for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(tag))) {
        const Raw d = hn::LoadU(tag, depth + x);
        const Vec3 p = surface_point(rays, start, hn::ConvertTo(tag, hn::Iota(ints, x)),
                                     Float(rays.near_m) / max(Float(d), Float(1e-30f)));
        const Vec3 n = unpack_normal(hn::LoadU(ints, reinterpret_cast<const std::int32_t*>(normal) + x));
        hn::StoreU(hn::IfThenElseZero(hn::Gt(d, hn::Zero(tag)), arrives(light, p, n).raw), tag, lux_per_cd + x);
    }
}

void SquaresRow(const Rays& rays, int y, int width, float off_m, float off_per_depth, const float* const* depth,
                const std::uint32_t* normal, const float* const* lux_per_cd, Square* squares, float* from_x,
                float* from_y, float* from_z) {
    const Tag tag;
    const IntTag ints;
    const glm::vec3 start = rays.corner + static_cast<float>(y) * rays.up;
    for (int x = 0; x < width; x += 4 * static_cast<int>(hn::Lanes(tag))) {
        Raw d[4][4], least = hn::Set(tag, 1.0f), greatest = hn::Zero(tag);
        for (int row = 0; row < 4; ++row) {
            hn::LoadInterleaved4(tag, depth[row] + x, d[row][0], d[row][1], d[row][2], d[row][3]);
            Raw lux[4];
            hn::LoadInterleaved4(tag, lux_per_cd[row] + x, lux[0], lux[1], lux[2], lux[3]);
            for (const Raw& value : lux) least = hn::Min(least, value), greatest = hn::Max(greatest, value);
        }
        // near / depth is linear on a plane.
        const auto off_plane = [&](int row, int column, int side) {
            return hn::Abs(hn::Sub(hn::Add(d[row][column], d[row + side][column + side]),
                                   hn::Add(d[row][column + side], d[row + side][column])));
        };
        const Raw off = hn::Max(off_plane(0, 0, 3), hn::Max(hn::Max(off_plane(0, 0, 1), off_plane(0, 2, 1)),
                                                            hn::Max(off_plane(2, 0, 1), off_plane(2, 2, 1))));
        const Mask plane =
            hn::And(hn::Gt(least, hn::Zero(tag)), hn::Le(off, hn::Mul(d[0][0], hn::Set(tag, kOffPlane))));
        const auto kind = hn::IfThenElseZero(
            hn::RebindMask(ints, hn::Gt(greatest, hn::Zero(tag))),
            hn::IfThenElse(hn::RebindMask(ints, plane), hn::Set(ints, static_cast<std::int32_t>(Square::plane)),
                           hn::Set(ints, static_cast<std::int32_t>(Square::mixed))));
        const hn::Rebind<std::uint8_t, Tag> bytes;
        hn::StoreU(hn::DemoteTo(bytes, kind), bytes, reinterpret_cast<std::uint8_t*>(squares) + x / 4);
        hn::Vec<IntTag> packed[4];
        hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(normal) + x, packed[0], packed[1], packed[2],
                             packed[3]);
        const Float z = Float(rays.near_m) / max(Float(d[1][1]), Float(1e-30f));
        const Float column = hn::MulAdd(hn::ConvertTo(tag, hn::Iota(ints, 0)), hn::Set(tag, 4.0f),
                                        hn::Set(tag, static_cast<float>(x + 1)));
        const Vec3 from = surface_point(rays, start, column, z) +
                          unpack_normal(packed[1]) * (Float(off_m) + z * Float(off_per_depth));
        store(from.x, from_x + x / 4), store(from.y, from_y + x / 4), store(from.z, from_z + x / 4);
    }
}

void DirectPoints(const DirectLight& light, const Points& points, std::size_t count, float* lux_per_cd) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag()))
        store(arrives(light, Vec3(load(points.x + i), load(points.y + i), load(points.z + i)),
                      Vec3(load(points.nx + i), load(points.ny + i), load(points.nz + i))),
              lux_per_cd + i);
}

void ToHalves(const float* from, std::size_t count, std::uint16_t* to) {
    const Tag tag;
    const hn::Rebind<hwy::float16_t, Tag> halves;
    const hn::RebindToUnsigned<decltype(halves)> bits;
    for (std::size_t i = 0; i < count; i += hn::Lanes(tag))
        hn::StoreU(hn::BitCast(bits, hn::DemoteTo(halves, hn::Min(hn::LoadU(tag, from + i), hn::Set(tag, 65504.0f)))),
                   bits, to + i);
}

void FromHalves(const std::uint16_t* from, std::size_t count, float* to) {
    const Tag tag;
    const hn::Rebind<hwy::float16_t, Tag> halves;
    for (std::size_t i = 0; i < count; i += hn::Lanes(tag))
        hn::StoreU(hn::PromoteTo(tag, hn::LoadU(halves, reinterpret_cast<const hwy::float16_t*>(from) + i)), tag,
                   to + i);
}

// The lower left of the four grid points around pixels 4k + phase of a row is point k + this one.
HWY_INLINE std::ptrdiff_t left_of(int phase) {
    return phase < 2 ? -1 : 0;
}
HWY_INLINE std::ptrdiff_t row_below(int y) {
    return y >= 2 ? (y - 2) / 4 : -1;
}

void WeightsRow(const GridRows& grid, int y, int width, const Rays& rays, float near_per_depth, const float* depth,
                const std::uint32_t* normal, std::uint32_t* weights, std::uint8_t* poor) {
    const Tag tag;
    const IntTag ints;
    const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
    const std::ptrdiff_t low = row_below(y);
    const float along_y = static_cast<float>(y - 2) * 0.25f - static_cast<float>(low);
    const glm::vec3 start = rays.corner + static_cast<float>(y) * rays.up;
    for (std::ptrdiff_t x = 0; x < width; x += 4 * lanes) {
        Raw d[4];
        hn::LoadInterleaved4(tag, depth + x, d[0], d[1], d[2], d[3]);
        hn::Vec<IntTag> packed[4];
        hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(normal) + x, packed[0], packed[1], packed[2],
                             packed[3]);
        hn::Vec<IntTag> result[4], poorly = hn::Zero(ints);
        for (int phase = 0; phase < 4; ++phase) {
            // The pixel's surface.
            const Float column = Float(hn::MulAdd(hn::ConvertTo(tag, hn::Iota(ints, 0)), hn::Set(tag, 4.0f),
                                                  hn::Set(tag, static_cast<float>(x + phase))));
            const Float z = Float(rays.near_m) / max(Float(d[phase]), Float(1e-30f));
            const Place pixel{surface_point(rays, start, column, z), unpack_normal(packed[phase]),
                              per_near_of(z, near_per_depth)};
            const std::ptrdiff_t left = x / 4 + left_of(phase);
            const float along_x =
                phase < 2 ? 0.5f + 0.25f * static_cast<float>(phase) : 0.25f * static_cast<float>(phase - 2);
            Float sum, weight[4];
            for (int corner = 0; corner < 4; ++corner) {
                const std::ptrdiff_t at = (low + corner / 2) * grid.stride + left + corner % 2;
                const float bilinear =
                    (corner % 2 == 0 ? 1.0f - along_x : along_x) * (corner / 2 == 0 ? 1.0f - along_y : along_y) + 1e-3f;
                weight[corner] = pixel.likeness(grid.points, at) * Float(bilinear);
                sum = sum + weight[corner];
            }
            const Mask shown = hn::Gt(d[phase], hn::Zero(tag)), good = hn::Ge(sum.raw, hn::Set(tag, kPoorlyAlike)),
                       any = hn::Ge(sum.raw, hn::Set(tag, kLeastAlike));
            poorly =
                hn::Add(poorly, hn::IfThenElseZero(hn::RebindMask(ints, hn::AndNot(good, shown)), hn::Set(ints, 1)));
            const Float scale = hn::IfThenElseZero(
                hn::And(any, shown), (mix(Float(127.0f), Float(255.0f), good) / max(sum, Float(kLeastAlike))).raw);
            const auto byte = [&](int corner) { return hn::NearestInt((weight[corner] * scale).raw); };
            result[phase] = hn::Or(hn::Or(byte(0), hn::ShiftLeft<8>(byte(1))),
                                   hn::Or(hn::ShiftLeft<16>(byte(2)), hn::ShiftLeft<24>(byte(3))));
        }
        hn::StoreInterleaved4(result[0], result[1], result[2], result[3], ints,
                              reinterpret_cast<std::int32_t*>(weights) + x);
        const hn::Rebind<std::uint8_t, Tag> bytes;
        hn::StoreU(hn::DemoteTo(bytes, poorly), bytes, poor + x / 4);
    }
}

void UpsampleRow(const float* const* values, std::ptrdiff_t stride, int y, int width, const std::uint32_t* weights,
                 std::uint16_t* out) {
    const Tag tag;
    const IntTag ints;
    const hn::Rebind<hwy::float16_t, Tag> halves;
    const hn::RebindToUnsigned<decltype(halves)> half_bits;
    const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
    const std::ptrdiff_t low = row_below(y);
    HWY_ALIGN float plane[3][4 * kLanes];
    for (std::ptrdiff_t x = 0; x < width; x += 4 * lanes) {
        hn::Vec<IntTag> packed[4];
        hn::LoadInterleaved4(ints, reinterpret_cast<const std::int32_t*>(weights) + x, packed[0], packed[1], packed[2],
                             packed[3]);
        Raw result[3][4];
        for (int phase = 0; phase < 4; ++phase) {
            const auto byte = [&](hn::Vec<IntTag> bits) -> Float {
                return hn::ConvertTo(tag, hn::And(bits, hn::Set(ints, 255)));
            };
            const Float weight[4] = {byte(packed[phase]), byte(hn::ShiftRight<8>(packed[phase])),
                                     byte(hn::ShiftRight<16>(packed[phase])), byte(hn::ShiftRight<24>(packed[phase]))};
            const Float per_sum = Float(1.0f) / max(weight[0] + weight[1] + weight[2] + weight[3], Float(1.0f));
            const std::ptrdiff_t at = low * stride + x / 4 + left_of(phase);
            for (int k = 0; k < 3; ++k) {
                const float* value = values[k] + at;
                const Float sum = weight[0] * load(value) + weight[1] * load(value + 1) +
                                  weight[2] * load(value + stride) + weight[3] * load(value + stride + 1);
                result[k][phase] = (sum * per_sum).raw;
            }
        }
        for (int k = 0; k < 3; ++k)
            hn::StoreInterleaved4(result[k][0], result[k][1], result[k][2], result[k][3], tag, plane[k]);
        for (std::ptrdiff_t i = 0; i < 4 * lanes; i += lanes) {
            const auto half = [&](const float* from) {
                return hn::BitCast(half_bits,
                                   hn::DemoteTo(halves, hn::Min(hn::Load(tag, from + i), hn::Set(tag, 65504.0f))));
            };
            hn::StoreInterleaved4(half(plane[0]), half(plane[1]), half(plane[2]),
                                  hn::Set(half_bits, std::uint16_t{0x3c00}), half_bits, out + 4 * (x + i));
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::shade
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::shade {

HWY_EXPORT(WeightsRow);
HWY_EXPORT(UpsampleRow);
HWY_EXPORT(DirectRow);
HWY_EXPORT(SquaresRow);
HWY_EXPORT(DirectPoints);
HWY_EXPORT(ToHalves);
HWY_EXPORT(FromHalves);

Web web_of(const std::uint32_t* words) {
    const std::size_t n_v = words[1], n_h = words[2];
    const auto* values = reinterpret_cast<const float*>(words + 4);
    const float* column = values + n_v + n_h + std::size_t{2} * words[3];
    const auto even = [](const float* axis, std::size_t n) {
        const double step =
            (static_cast<double>(axis[n - 1]) - static_cast<double>(axis[0])) / static_cast<double>(n - 1);
        for (std::size_t i = 0; i < n; ++i) {
            const double off =
                static_cast<double>(axis[i]) - static_cast<double>(axis[0]) - step * static_cast<double>(i);
            if (std::abs(off) > 1e-6) return false;
        }
        return true;
    };
    return {words, n_h == 2 && std::equal(column, column + n_v, column + n_v), even(values, n_v),
            even(values + n_v, n_h)};
}
void weights_row(const GridRows& grid, int y, int width, const Rays& rays, float near_per_depth, const float* depth,
                 const std::uint32_t* normal, std::uint32_t* weights, std::uint8_t* poor) {
    HWY_DYNAMIC_DISPATCH(WeightsRow)(grid, y, width, rays, near_per_depth, depth, normal, weights, poor);
}
void upsample_row(const float* const* values, std::ptrdiff_t stride, int y, int width, const std::uint32_t* weights,
                  std::uint16_t* out) {
    HWY_DYNAMIC_DISPATCH(UpsampleRow)(values, stride, y, width, weights, out);
}
void direct_row(const DirectLight& light, int y, int width, const Rays& rays, const float* depth,
                const std::uint32_t* normal, float* lux_per_cd) {
    HWY_DYNAMIC_DISPATCH(DirectRow)(light, y, width, rays, depth, normal, lux_per_cd);
}
void squares_row(const Rays& rays, int y, int width, float off_m, float off_per_depth, const float* const* depth,
                 const std::uint32_t* normal, const float* const* lux_per_cd, Square* squares, float* from_x,
                 float* from_y, float* from_z) {
    HWY_DYNAMIC_DISPATCH(SquaresRow)
    (rays, y, width, off_m, off_per_depth, depth, normal, lux_per_cd, squares, from_x, from_y, from_z);
}
void direct_points(const DirectLight& light, const Points& points, std::size_t count, float* lux_per_cd) {
    HWY_DYNAMIC_DISPATCH(DirectPoints)(light, points, count, lux_per_cd);
}
void to_halves(const float* from, std::size_t count, std::uint16_t* to) {
    HWY_DYNAMIC_DISPATCH(ToHalves)(from, count, to);
}
void from_halves(const std::uint16_t* from, std::size_t count, float* to) {
    HWY_DYNAMIC_DISPATCH(FromHalves)(from, count, to);
}

}  // namespace gonio::shade
#endif
