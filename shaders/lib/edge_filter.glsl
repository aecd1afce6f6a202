// FXAA 3.11 (Lottes 2011), of luma alone. Whoever includes this has defined float luma_at(ivec2 pixel): gamma-encoded
// luma, 0..1, beyond the picture that of its border.

// Result: how many pixels from `at` along an edge it ends, and in y how far the light of both sides has then left `middle`.
vec2 edge_end(ivec2 at, ivec2 along, ivec2 across, float middle, float least) {
    float off = 0.0f;
    for (int k = 1; k <= 8; ++k) {
        ivec2 there = at + along * k;
        off = 0.5f * (luma_at(there) + luma_at(there + across)) - middle;
        if (abs(off) >= least) return vec2(float(k), off);
    }
    return vec2(8.0f, off);
}

// Result: the luma to show at a pixel. Where no edge crosses it, its own.
float edge_filtered(ivec2 at) {
    float here = luma_at(at);
    float n = luma_at(at + ivec2(0, -1)), s = luma_at(at + ivec2(0, 1));
    float w = luma_at(at + ivec2(-1, 0)), e = luma_at(at + ivec2(1, 0));
    float low = min(min(min(n, s), min(w, e)), here), high = max(max(max(n, s), max(w, e)), here);
    if (high - low < max(0.042f, 0.25f * high)) return here;
    float nw = luma_at(at + ivec2(-1, -1)), ne = luma_at(at + ivec2(1, -1));
    float sw = luma_at(at + ivec2(-1, 1)), se = luma_at(at + ivec2(1, 1));
    float rows = abs(nw - 2.0f * w + sw) + 2.0f * abs(n - 2.0f * here + s) + abs(ne - 2.0f * e + se);
    float columns = abs(nw - 2.0f * n + ne) + 2.0f * abs(w - 2.0f * here + e) + abs(sw - 2.0f * s + se);
    bool level = rows >= columns;
    ivec2 along = level ? ivec2(1, 0) : ivec2(0, 1), across = level ? ivec2(0, 1) : ivec2(1, 0);
    float before = level ? n : w, after = level ? s : e;
    bool first = abs(before - here) >= abs(after - here);
    if (first) across = -across;
    float other = first ? before : after, middle = 0.5f * (here + other), least = 0.25f * abs(other - here);
    vec2 back = edge_end(at, -along, across, middle, least), forth = edge_end(at, along, across, middle, least);
    vec2 near = back.x < forth.x ? back : forth;
    // Of a straight edge, at the end where this pixel's side gives way.
    float covered = (near.y < 0.0f) != (here < middle) ? max(0.5f - near.x / (back.x + forth.x), 0.0f) : 0.0f;
    // Of what is smaller than a pixel.
    float mean = (2.0f * (n + s + w + e) + nw + ne + sw + se) / 12.0f;
    float apart = min(abs(mean - here) / (high - low), 1.0f), smoothed = apart * apart * (3.0f - 2.0f * apart);
    return mix(here, other, max(covered, 0.75f * smoothed * smoothed));
}
