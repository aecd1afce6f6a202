// Haze for SIMD lanes. Included after simd.h and as it is, where hwy/contrib/math is there.

HWY_INLINE Float exp(Float x) {
    return hn::Exp(Tag(), x.raw);
}
#define float Float
namespace {
#include "shaders/lib/air.glsl"
}  // namespace
#undef float

// What passes a straight way of this length between two heights; below the floor the haze is as at the floor.
HWY_INLINE Float air_passes(const Air& air, Float length, Float a, Float b) {
    const Float depth = length * Float(-air.extinction_per_m);
    if (!(air.per_height > 0.0f)) return exp(depth);
    const Float per(air.per_height), floor(air.floor_m), none(0.0f);
    return exp(depth * layer_mean(max((min(a, b) - floor) * per, none), max((max(a, b) - floor) * per, none)));
}
