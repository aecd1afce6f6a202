// Photometric webs (server/scene/web_buffer.h) for SIMD lanes. Included inside HWY_NAMESPACE after simd.h, once per
// instruction set; therefore without an include guard and without a namespace of its own.

// Where x falls on a web's axis (shaders/lib/web_buffer.glsl for lanes): cell + fraction; outside: whether it lies
// beyond. even: its angles are equally spaced.
HWY_INLINE Float web_place(bool even, const float* axis, int n, const float* table, int buckets, Float x,
                           Mask& outside) {
    const Tag tag;
    const IntTag ints;
    const Float low(axis[0]), high(axis[n - 1]);
    outside =
        hn::Or(outside, hn::Or(hn::Lt(x.raw, (low - Float(2e-6f)).raw), hn::Gt(x.raw, (high + Float(2e-6f)).raw)));
    const Float share = min(max((x - low) / (high - low), Float(0.0f)), Float(1.0f));
    if (even) return share * Float(static_cast<float>(n - 1));
    const auto bucket = hn::Min(hn::ConvertTo(ints, hn::Mul(share.raw, hn::Set(tag, static_cast<float>(buckets)))),
                                hn::Set(ints, buckets - 1));
    auto cell = hn::ConvertTo(ints, hn::GatherIndex(tag, table, bucket));
    for (int step = 0; step < 8; ++step) {
        const auto next = hn::Min(hn::Add(cell, hn::Set(ints, 1)), hn::Set(ints, n - 1));
        const auto more = hn::And(hn::Ge(x.raw, hn::GatherIndex(tag, axis, next)),
                                  hn::RebindMask(tag, hn::Lt(next, hn::Set(ints, n - 1))));
        if (hn::AllFalse(tag, more)) break;
        cell = hn::IfThenElse(hn::RebindMask(ints, more), next, cell);
    }
    const Float start = hn::GatherIndex(tag, axis, cell),
                end = hn::GatherIndex(tag, axis, hn::Add(cell, hn::Set(ints, 1)));
    const Float fraction = min(max((x - start) / (end - start), Float(0.0f)), Float(1.0f));
    return Float(hn::ConvertTo(tag, cell)) + fraction;
}

// I(d) / I_peak; d: luminaire frame, any length > 0.
HWY_INLINE Float web_ratio(const PackedWeb& web, const Vec3& d) {
    const Tag tag;
    const IntTag ints;
    const std::uint32_t* words = web.words;
    const int n_v = static_cast<int>(words[1]), n_h = static_cast<int>(words[2]), buckets = static_cast<int>(words[3]);
    const float* values = reinterpret_cast<const float*>(words + 4);
    const Vec2 angles = web_angles(static_cast<int>(words[0]), d);
    Mask outside = Float(0.0f) < Float(0.0f);
    const Float v = web_place(web.even_v, values, n_v, values + n_v + n_h, buckets, angles.x, outside);
    if (web.symmetric) {
        const auto cell = hn::Min(hn::ConvertTo(ints, v.raw), hn::Set(ints, n_v - 2));
        const float* column = values + n_v + n_h + 2 * buckets;
        const Float low = hn::GatherIndex(tag, column, cell), high = hn::GatherIndex(tag, column + 1, cell);
        return hn::IfThenZeroElse(outside, (low + (high - low) * (v - Float(hn::ConvertTo(tag, cell)))).raw);
    }
    const Float h = web_place(web.even_h, values + n_v, n_h, values + n_v + n_h + buckets, buckets, angles.y, outside);
    const auto v_cell = hn::Min(hn::ConvertTo(ints, v.raw), hn::Set(ints, n_v - 2)),
               h_cell = hn::Min(hn::ConvertTo(ints, h.raw), hn::Set(ints, n_h - 2));
    const Float a = v - Float(hn::ConvertTo(tag, v_cell)), b = h - Float(hn::ConvertTo(tag, h_cell));
    const float* grid = values + n_v + n_h + 2 * buckets;
    const auto at = hn::Add(hn::Mul(h_cell, hn::Set(ints, n_v)), v_cell);
    const Float c00 = hn::GatherIndex(tag, grid, at), c10 = hn::GatherIndex(tag, grid + 1, at);
    const Float c01 = hn::GatherIndex(tag, grid + n_v, at), c11 = hn::GatherIndex(tag, grid + n_v + 1, at);
    const Float near_h = c00 + (c10 - c00) * a, far_h = c01 + (c11 - c01) * a;
    return hn::IfThenZeroElse(outside, (near_h + (far_h - near_h) * b).raw);
}
