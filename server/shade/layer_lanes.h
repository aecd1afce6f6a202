// Half floats as layers hold them, for SIMD lanes. Included inside HWY_NAMESPACE after lanes.h, once per instruction
// set; therefore without an include guard and without a namespace of its own.

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
// A term of LayerSum (server/shade/layers.h).
HWY_INLINE hn::Vec<IntTag> whole_quanta(Float value, Float quanta, Float cap) {
    return hn::NearestInt(max(min(value * quanta, cap), -cap).raw);
}
HWY_INLINE void add_quanta(Float value, Float quanta, Float cap, std::int32_t* sum) {
    const IntTag ints;
    hn::StoreU(hn::Add(hn::LoadU(ints, sum), whole_quanta(value, quanta, cap)), ints, sum);
}
// Adds `count` values of a layer, a multiple of the lanes, to three sums, each with its own factor.
HWY_INLINE void add_direct(const std::uint16_t* light, const glm::vec3& quanta, float cap, std::size_t count,
                           std::int32_t* const* sums) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const Float value = from_half(hn::LoadU(HalfBits(), light + i));
        for (int k = 0; k < 3; ++k) add_quanta(value, Float(quanta[k]), Float(cap), sums[k] + i);
    }
}
HWY_INLINE void add_rgb(const std::uint16_t* light, const glm::vec3& quanta, float cap, std::size_t count,
                        std::int32_t* const* sums) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(Tag())) {
        const Vec3 rgb = load_rgb(light + 4 * i);
        add_quanta(rgb.x, Float(quanta.x), Float(cap), sums[0] + i);
        add_quanta(rgb.y, Float(quanta.y), Float(cap), sums[1] + i);
        add_quanta(rgb.z, Float(quanta.z), Float(cap), sums[2] + i);
    }
}
