// Half floats as layers hold them, for SIMD lanes. Included inside HWY_NAMESPACE after lanes.h, once per instruction
// set; therefore without an include guard and without a namespace of its own.

using HalfBits = hn::Rebind<std::uint16_t, Tag>;
using Halves = hn::Rebind<hwy::float16_t, Tag>;

HWY_INLINE Float from_half(hn::Vec<HalfBits> bits) {
    return hn::PromoteTo(Tag(), hn::BitCast(Halves(), bits));
}
HWY_INLINE Vec3 load_rgb(const std::uint16_t* pixels) {
    hn::Vec<HalfBits> r, g, b, a;
    hn::LoadInterleaved4(HalfBits(), pixels, r, g, b, a);
    return {from_half(r), from_half(g), from_half(b)};
}
// A term of LayerSum (server/shade/layers.h).
HWY_INLINE hn::Vec<IntTag> whole_quanta(Float value, Float quanta, Float cap) {
    return hn::NearestInt(min(value * quanta, cap).raw);
}
