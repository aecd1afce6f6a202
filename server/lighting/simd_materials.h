// What surfaces look like, for SIMD lanes: normals and textures (material_table.h). Included after simd.h and as it is.

// Unit vectors as the G-buffer holds them: octahedral, 2 snorm16 (shaders/lib/octahedral.glsl for SIMD lanes).
HWY_INLINE hn::Vec<IntTag> pack_normal(const Vec3& n) {
    const IntTag ints;
    const Float per_sum = Float(1.0f) / (abs(n.x) + abs(n.y) + abs(n.z));
    const Float x = n.x * per_sum, y = n.y * per_sum;
    const Float folded_x = hn::CopySign((Float(1.0f) - abs(y)).raw, x.raw),
                folded_y = hn::CopySign((Float(1.0f) - abs(x)).raw, y.raw);
    const Mask below = n.z < Float(0.0f);
    const auto a = hn::NearestInt((mix(x, folded_x, below) * Float(32767.0f)).raw),
               b = hn::NearestInt((mix(y, folded_y, below) * Float(32767.0f)).raw);
    return hn::Or(hn::And(a, hn::Set(ints, 0xffff)), hn::ShiftLeft<16>(b));
}
HWY_INLINE Vec3 unpack_normal(hn::Vec<IntTag> packed) {
    const Tag tag;
    const Raw scale = hn::Set(tag, 1.0f / 32767.0f);
    const Float x = hn::Mul(hn::ConvertTo(tag, hn::ShiftRight<16>(hn::ShiftLeft<16>(packed))), scale);
    const Float y = hn::Mul(hn::ConvertTo(tag, hn::ShiftRight<16>(packed)), scale);
    const Float z = Float(1.0f) - abs(x) - abs(y), fold = max(-z, Float(0.0f));
    const Vec3 n(Float(hn::Sub(x.raw, hn::CopySign(fold.raw, x.raw))),
                 Float(hn::Sub(y.raw, hn::CopySign(fold.raw, y.raw))), z);
    return n * inversesqrt(dot(n, n));
}

// The normal that a normal map's texel gives. n: the front's, unit; side: of the tangent, 0: there is none.
HWY_INLINE Vec3 mapped_normal(const Vec3& n, const Vec3& along, Float side, Float scale, const Vec3& texel) {
    constexpr float kLeastUp = 0.01f;
    const Vec3 flat = along - n * dot(n, along), tangent = flat * inversesqrt(max(dot(flat, flat), Float(1e-12f)));
    const Vec3 up(n.y * tangent.z - n.z * tangent.y, n.z * tangent.x - n.x * tangent.z,
                  n.x * tangent.y - n.y * tangent.x);
    const Float x = (texel.x * Float(2.0f) - Float(1.0f)) * scale, y = (texel.y * Float(2.0f) - Float(1.0f)) * scale,
                z = max(texel.z * Float(2.0f) - Float(1.0f), Float(kLeastUp));
    const Vec3 own = tangent * (x * abs(side)) + up * (y * side) + n * z;
    return own * inversesqrt(max(dot(own, own), Float(1e-12f)));
}

// A texture's texels on one level, bilinear. uv: 0 … 1; where it repeats, the first texel follows the last.
// Nine vectors that stay in registers.
HWY_INLINE Vec3 texels_at(const MaterialTable& material_table, const std::int32_t* texture, hn::Vec<IntTag> texture_at,
                          hn::Vec<IntTag> width_px, hn::Vec<IntTag> height_px, hn::Vec<IntTag> level, const Vec2& uv,
                          Mask repeat_s, Mask repeat_t) {
    const Tag tag;
    const IntTag ints;
    const auto one = hn::Set(ints, 1);
    const auto width = hn::Max(hn::Shr(width_px, level), one), height = hn::Max(hn::Shr(height_px, level), one);
    const auto between = [&](Float at, hn::Vec<IntTag> count, Mask repeat, hn::Vec<IntTag>& low,
                             hn::Vec<IntTag>& high) {
        const Float x = at * Float(hn::ConvertTo(tag, count)) - Float(0.5f);
        const Raw floor = hn::Floor(x.raw);
        const auto again = hn::RebindMask(ints, repeat);
        const auto last = hn::Sub(count, one), zero = hn::Zero(ints);
        low = hn::ConvertTo(ints, floor);
        high = hn::Add(low, one);
        low = hn::IfThenElse(hn::Lt(low, zero), hn::IfThenElseZero(again, last), low);
        high = hn::IfThenElse(hn::Gt(high, last), hn::IfThenElse(again, zero, last), high);
        low = hn::Min(low, last);
        return x - Float(floor);
    };
    hn::Vec<IntTag> x0, x1, y0, y1;
    const Float a = between(uv.x, width, repeat_s, x0, x1), b = between(uv.y, height, repeat_t, y0, y1);
    const auto first = hn::GatherIndex(ints, texture + 5, hn::Add(texture_at, level));
    const auto* texels = reinterpret_cast<const std::int32_t*>(material_table.texels.data());
    const auto at = [&](hn::Vec<IntTag> x, hn::Vec<IntTag> y) {
        const auto word = hn::GatherIndex(ints, texels, hn::Add(first, hn::Add(hn::Mul(y, width), x)));
        const auto part = [&](hn::Vec<IntTag> bits, float most) -> Float {
            const Float root = Float(hn::ConvertTo(tag, bits)) * Float(1.0f / most);
            return root * root;
        };
        const auto eleven = hn::Set(ints, 2047);
        return Vec3(part(hn::And(word, eleven), 2047.0f), part(hn::And(hn::ShiftRight<11>(word), eleven), 2047.0f),
                    part(hn::And(hn::ShiftRight<22>(word), hn::Set(ints, 1023)), 1023.0f));
    };
    const Vec3 t00 = at(x0, y0), t10 = at(x1, y0), t01 = at(x0, y1), t11 = at(x1, y1);
    const Vec3 near_row = t00 + (t10 - t00) * a, far_row = t01 + (t11 - t01) * a;
    return near_row + (far_row - near_row) * b;
}

// color times the textures `image` (-1: none) at uv, as GL_LINEAR_MIPMAP_LINEAR. width: of a pixel, in texture sides.
HWY_INLINE Vec3 textured(const MaterialTable& material_table, hn::Vec<IntTag> image, const Vec2& uv, Float width,
                         const Vec3& color) {
    const Tag tag;
    const IntTag ints;
    static_assert(sizeof(MaterialTable::Texture) == 128);
    const auto zero = hn::Zero(ints);
    const Mask shown = hn::RebindMask(tag, hn::Gt(image, hn::Set(ints, -1)));
    const auto texture_at = hn::ShiftLeft<5>(hn::Max(image, zero));
    const auto* texture = reinterpret_cast<const std::int32_t*>(material_table.textures.data());
    const auto first = static_cast<std::size_t>(hn::GetLane(texture_at));
    const bool same = hn::AllTrue(ints, hn::Eq(texture_at, hn::Set(ints, static_cast<int>(first))));
    const auto field = [&](std::size_t word) {
        return same ? hn::Set(ints, texture[first + word]) : hn::GatherIndex(ints, texture + word, texture_at);
    };
    const auto width_px = field(0), height_px = field(1), last_level = field(4);
    const auto wrap_s = field(2), wrap_t = field(3);
    const auto is = [&](hn::Vec<IntTag> wrap, Wrap mode) {
        return hn::RebindMask(tag, hn::Eq(wrap, hn::Set(ints, static_cast<int>(mode))));
    };
    const Mask repeat_s = is(wrap_s, Wrap::repeat), repeat_t = is(wrap_t, Wrap::repeat);
    // A coordinate that is no number becomes 0: Max gives its second argument then.
    const auto bounded = [&](Float at, hn::Vec<IntTag> wrap, Mask repeat) {
        const Mask mirror = is(wrap, Wrap::mirror);
        if (!hn::AllFalse(tag, mirror)) {
            const Float turn = at - Float(2.0f) * Float(hn::Floor((at * Float(0.5f)).raw));  // 0 … 2
            at = mix(at, Float(1.0f) - abs(turn - Float(1.0f)), mirror);
        }
        return min(max(mix(at, at - Float(hn::Floor(at.raw)), repeat), Float(0.0f)), Float(1.0f));
    };
    const Vec2 within(bounded(uv.x, wrap_s, repeat_s), bounded(uv.y, wrap_t, repeat_t));
    // The level at which a pixel is one texel wide: log2 from a float's bits, linear within an octave.
    const Float wide = max(width * Float(hn::ConvertTo(tag, hn::Max(width_px, height_px))), Float(1.0f));
    const Float level =
        min(Float(hn::ConvertTo(tag, hn::BitCast(ints, wide.raw))) * Float(1.0f / 8388608.0f) - Float(127.0f),
            Float(hn::ConvertTo(tag, last_level)));
    const auto low = hn::ConvertTo(ints, level.raw);
    const Float share = level - Float(hn::ConvertTo(tag, low));
    Vec3 found = texels_at(material_table, texture, texture_at, width_px, height_px, low, within, repeat_s, repeat_t);
    if (!hn::AllTrue(tag, hn::Le(share.raw, hn::Set(tag, 1e-3f)))) {
        const auto high = hn::Min(hn::Add(low, hn::Set(ints, 1)), last_level);
        found = found +
                (texels_at(material_table, texture, texture_at, width_px, height_px, high, within, repeat_s, repeat_t) -
                 found) *
                    share;
    }
    return Vec3(mix(color.x, color.x * found.x, shown), mix(color.y, color.y * found.y, shown),
                mix(color.z, color.z * found.z, shown));
}
