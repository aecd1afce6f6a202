// Haze for SIMD lanes. Included after simd.h and as it is, where hwy/contrib/math is there.

HWY_INLINE Float exp(Float x) {
    return hn::Exp(Tag(), x.raw);
}

// The mean of the haze's density over a straight way between two heights, of that at the floor (haze.cpp's
// mean_density; below the floor it is as at the floor).
HWY_INLINE Float mean_density(const Air& air, Float a, Float b) {
    const Float per(air.per_height), floor(air.floor_m);
    const Float low = max((min(a, b) - floor) * per, Float(0.0f)), high = max((max(a, b) - floor) * per, Float(0.0f)),
                x = high - low;
    const Float series = Float(1.0f) - x * (Float(0.5f) - x * Float(1.0f / 6.0f)),
                whole = (Float(1.0f) - exp(-x)) / max(x, Float(1e-6f));
    return exp(-low) * mix(whole, series, x < Float(0.02f));
}
// What passes a straight way of this length between two heights.
HWY_INLINE Float air_passes(const Air& air, Float length, Float a, Float b) {
    const Float depth = length * Float(-air.extinction_per_m);
    return exp(air.per_height > 0.0f ? depth * mean_density(air, a, b) : depth);
}
