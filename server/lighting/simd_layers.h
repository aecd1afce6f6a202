// Half floats as layers hold them, for SIMD lanes. Included after simd.h and as it is.

using HalfBits = hn::Rebind<std::uint16_t, Tag>;
using Halves = hn::Rebind<hwy::float16_t, Tag>;

HWY_INLINE Float from_half(hn::Vec<HalfBits> bits) {
    return hn::PromoteTo(Tag(), hn::BitCast(Halves(), bits));
}
HWY_INLINE hn::Vec<HalfBits> to_half(Float x) {  // what is greater becomes 65,504
    return hn::BitCast(HalfBits(), hn::DemoteTo(Halves(), min(x, Float(65504.0f)).raw));
}
HWY_INLINE Vec3 load_rgb(const std::uint16_t* pixels) {
    hn::Vec<HalfBits> r, g, b, a;
    hn::LoadInterleaved4(HalfBits(), pixels, r, g, b, a);
    return {from_half(r), from_half(g), from_half(b)};
}
HWY_INLINE void store_rgb(const Vec3& rgb, std::uint16_t* pixels) {
    const HalfBits bits;
    hn::StoreInterleaved4(to_half(rgb.x), to_half(rgb.y), to_half(rgb.z), hn::Set(bits, std::uint16_t{0x3c00}), bits,
                          pixels);
}
// A term of LayerSum (server/lighting/layers.h).
HWY_INLINE hn::Vec<IntTag> to_fixed_point(Float value, Float steps, Float cap) {
    return hn::NearestInt(max(min(value * steps, cap), -cap).raw);
}
HWY_INLINE void add_fixed_point(Float value, Float steps, Float cap, std::int32_t* sum) {
    const IntTag ints;
    hn::StoreU(hn::Add(hn::LoadU(ints, sum), to_fixed_point(value, steps, cap)), ints, sum);
}
// What a term shows at `count` pixels from `first` on, a multiple of the SIMD lanes, added to three sums.
HWY_INLINE void add_pixels(const LayerTerm& term, float cap, std::size_t first, std::size_t count,
                           std::int32_t* const* sums) {
    const std::uint16_t *direct = term.direct_pixels(), *indirect = term.indirect_pixels();
    for (std::size_t i = 0; i < count && direct != nullptr; i += hn::Lanes(Tag())) {
        const Float value = from_half(hn::LoadU(HalfBits(), direct + first + i));
        for (int k = 0; k < 3; ++k) add_fixed_point(value, Float(term.steps[k]), Float(cap), sums[k] + i);
    }
    for (std::size_t i = 0; i < count && indirect != nullptr; i += hn::Lanes(Tag())) {
        const Vec3 rgb = load_rgb(indirect + 4 * (first + i));
        add_fixed_point(rgb.x, Float(term.steps.x), Float(cap), sums[0] + i);
        add_fixed_point(rgb.y, Float(term.steps.y), Float(cap), sums[1] + i);
        add_fixed_point(rgb.z, Float(term.steps.z), Float(cap), sums[2] + i);
    }
}
