#include "server/lighting/kernels.h"

#include <algorithm>

#include "server/lighting/layers.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/lighting/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::lighting {
namespace HWY_NAMESPACE {

#include "server/lighting/simd.h"
#include "server/lighting/simd_layers.h"

void ToHalves(const float* from, std::size_t count, std::uint16_t* to) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) hn::StoreU(to_half(load(from + i)), HalfBits(), to + i);
}
void RgbToHalves(const float* r, const float* g, const float* b, std::size_t count, std::uint16_t* to) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag()))
        store_rgb({load(r + i), load(g + i), load(b + i)}, to + 4 * i);
}
void FromHalves(const std::uint16_t* from, std::size_t count, float* to) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) store(from_half(hn::LoadU(HalfBits(), from + i)), to + i);
}
void AddHalves(const std::uint16_t* from, std::size_t count, float* to) {
    const Tag tag;
    const std::size_t simd_lanes = hn::Lanes(tag), whole = count / simd_lanes * simd_lanes;
    for (std::size_t i = 0; i < whole; i += simd_lanes)
        store(load(to + i) + from_half(hn::LoadU(HalfBits(), from + i)), to + i);
    HWY_ALIGN float last[kSimdWidth] = {};
    HWY_ALIGN std::uint16_t halves[kSimdWidth] = {};
    std::copy(from + whole, from + count, halves);
    store(from_half(hn::LoadU(HalfBits(), halves)), last);
    for (std::size_t i = whole; i < count; ++i) to[i] += last[i - whole];
}
void AddScaled(const float* from, float weight, std::size_t count, float* to) {
    const std::size_t simd_lanes = hn::Lanes(Tag()), whole = count / simd_lanes * simd_lanes;
    for (std::size_t i = 0; i < whole; i += simd_lanes) store(load(to + i) + load(from + i) * Float(weight), to + i);
    for (std::size_t i = whole; i < count; ++i) to[i] += from[i] * weight;
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::lighting
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::lighting {

HWY_EXPORT(RgbToHalves);
HWY_EXPORT(ToHalves);
HWY_EXPORT(FromHalves);
HWY_EXPORT(AddHalves);
HWY_EXPORT(AddScaled);

void to_halves(const float* from, std::size_t count, std::uint16_t* to) {
    HWY_DYNAMIC_DISPATCH(ToHalves)(from, count, to);
}
void rgb_to_halves(const float* r, const float* g, const float* b, std::size_t count, std::uint16_t* to) {
    HWY_DYNAMIC_DISPATCH(RgbToHalves)(r, g, b, count, to);
}
void from_halves(const std::uint16_t* from, std::size_t count, float* to) {
    HWY_DYNAMIC_DISPATCH(FromHalves)(from, count, to);
}
void add_halves(const std::uint16_t* from, std::size_t count, float* to) {
    HWY_DYNAMIC_DISPATCH(AddHalves)(from, count, to);
}
void add_scaled(const float* from, float weight, std::size_t count, float* to) {
    HWY_DYNAMIC_DISPATCH(AddScaled)(from, weight, count, to);
}

}  // namespace gonio::lighting
#endif
