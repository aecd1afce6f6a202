// Photometric webs (server/scene/web_buffer.h) for SIMD lanes. Included after simd.h and as it is.

// Where x falls on a web's axis (shaders/lib/web_buffer.glsl for SIMD lanes): cell + fraction; outside: whether it
// lies beyond. even: its angles are equally spaced. Seven parameters: an axis, its table, and vectors.
HWY_INLINE Float web_cell(bool even, const float* axis, int n, const float* table, int buckets, Float x,
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
    const layouts::WebHeader& header = layouts::web_header(web.words);
    const auto n_v = static_cast<int>(header.n_v), n_h = static_cast<int>(header.n_h),
               buckets = static_cast<int>(header.table);
    const float *values = layouts::web_values(web.words), *ratios = values + web_ratios(header);
    const Vec2 angles = web_angles(static_cast<int>(header.goniometer), d);
    Mask outside = Float(0.0f) < Float(0.0f);
    const Float v = web_cell(web.even_v, values, n_v, values + web_v_cells(header), buckets, angles.x, outside);
    if (web.symmetric) {
        const auto cell = hn::Min(hn::ConvertTo(ints, v.raw), hn::Set(ints, n_v - 2));
        const Float low = hn::GatherIndex(tag, ratios, cell), high = hn::GatherIndex(tag, ratios + 1, cell);
        return hn::IfThenZeroElse(outside, (low + (high - low) * (v - Float(hn::ConvertTo(tag, cell)))).raw);
    }
    const Float h =
        web_cell(web.even_h, values + web_h(header), n_h, values + web_h_cells(header), buckets, angles.y, outside);
    const auto v_cell = hn::Min(hn::ConvertTo(ints, v.raw), hn::Set(ints, n_v - 2)),
               h_cell = hn::Min(hn::ConvertTo(ints, h.raw), hn::Set(ints, n_h - 2));
    const Float a = v - Float(hn::ConvertTo(tag, v_cell)), b = h - Float(hn::ConvertTo(tag, h_cell));
    const auto at = hn::Add(hn::Mul(h_cell, hn::Set(ints, n_v)), v_cell);
    const Float c00 = hn::GatherIndex(tag, ratios, at), c10 = hn::GatherIndex(tag, ratios + 1, at);
    const Float c01 = hn::GatherIndex(tag, ratios + n_v, at), c11 = hn::GatherIndex(tag, ratios + n_v + 1, at);
    const Float near_h = c00 + (c10 - c00) * a, far_h = c01 + (c11 - c01) * a;
    return hn::IfThenZeroElse(outside, (near_h + (far_h - near_h) * b).raw);
}
