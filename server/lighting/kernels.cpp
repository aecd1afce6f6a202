#include "server/lighting/kernels.h"

#include <algorithm>
#include <cmath>

#include "server/lighting/layers.h"
#include "server/lighting/material_table.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_layers.h"
#include "server/lighting/simd_materials.h"
#include "server/lighting/simd_pixels.h"

void ToHalves(const float* from, std::size_t count, std::uint16_t* to) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) hn::StoreU(to_half(load(from + i)), HalfBits(), to + i);
}
void RgbToHalves(const float* r, const float* g, const float* b, std::size_t count, std::uint16_t* to) {
    const HalfBits bits;
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag()))
        hn::StoreInterleaved4(to_half(load(r + i)), to_half(load(g + i)), to_half(load(b + i)),
                              hn::Set(bits, std::uint16_t{0x3c00}), bits, to + 4 * i);
}
void FromHalves(const std::uint16_t* from, std::size_t count, float* to) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) store(from_half(hn::LoadU(HalfBits(), from + i)), to + i);
}

void WeightsRow(const Points& grid, std::ptrdiff_t stride, const Rays& rays, float near_per_depth,
                const WeightedRow& row) {
    const auto [y, width, depth, normal, weights, poor] = row;
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
            const Float z = Float(rays.near_m) / max(Float(d[phase]), Float(1e-30f));
            const Vec3 p = surface_point(rays, start, column_of(x + phase), z), n = unpack_normal(packed[phase]);
            const Float per_near = Float(1.0f) / max(z * Float(near_per_depth), Float(1e-30f));
            const std::ptrdiff_t left = x / 4 + left_of(phase);
            const float along_x =
                phase < 2 ? 0.5f + 0.25f * static_cast<float>(phase) : 0.25f * static_cast<float>(phase - 2);
            Float sum, weight[4];
            for (int corner = 0; corner < 4; ++corner) {
                const std::ptrdiff_t at = (low + corner / 2) * stride + left + corner % 2;
                const float bilinear =
                    (corner % 2 == 0 ? 1.0f - along_x : along_x) * (corner / 2 == 0 ? 1.0f - along_y : along_y) + 1e-3f;
                const Float off = dot(n, place_of(grid, at) - p) * per_near;
                weight[corner] = edge_stopping_weight(dot(n, normal_of(grid, at)), off) * Float(bilinear);
                sum = sum + weight[corner];
            }
            const Mask shown = hn::Gt(d[phase], hn::Zero(tag)), good = hn::Ge(sum.raw, hn::Set(tag, kPoorWeight)),
                       any = hn::Ge(sum.raw, hn::Set(tag, kLeastWeight));
            poorly =
                hn::Add(poorly, hn::IfThenElseZero(hn::RebindMask(ints, hn::AndNot(good, shown)), hn::Set(ints, 1)));
            const Float scale = hn::IfThenElseZero(
                hn::And(any, shown), (mix(Float(127.0f), Float(255.0f), good) / max(sum, Float(kLeastWeight))).raw);
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
    const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(tag));
    const std::ptrdiff_t low = row_below(y);
    HWY_ALIGN float plane[3][4 * kSimdWidth];
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
        RgbToHalves(plane[0], plane[1], plane[2], static_cast<std::size_t>(4 * lanes), out + 4 * x);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(WeightsRow);
HWY_EXPORT(UpsampleRow);
HWY_EXPORT(RgbToHalves);
HWY_EXPORT(ToHalves);
HWY_EXPORT(FromHalves);

void weights_row(const Points& grid, std::ptrdiff_t stride, const Rays& rays, float near_per_depth,
                 const WeightedRow& row) {
    HWY_DYNAMIC_DISPATCH(WeightsRow)(grid, stride, rays, near_per_depth, row);
}
void upsample_row(const float* const* values, std::ptrdiff_t stride, int y, int width, const std::uint32_t* weights,
                  std::uint16_t* out) {
    HWY_DYNAMIC_DISPATCH(UpsampleRow)(values, stride, y, width, weights, out);
}
void to_halves(const float* from, std::size_t count, std::uint16_t* to) {
    HWY_DYNAMIC_DISPATCH(ToHalves)(from, count, to);
}
void rgb_to_halves(const float* r, const float* g, const float* b, std::size_t count, std::uint16_t* to) {
    HWY_DYNAMIC_DISPATCH(RgbToHalves)(r, g, b, count, to);
}
void from_halves(const std::uint16_t* from, std::size_t count, float* to) {
    HWY_DYNAMIC_DISPATCH(FromHalves)(from, count, to);
}

}  // namespace gonio::lighting
#endif
