// Unit vectors as two numbers in [-1, 1] (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent
// Unit Vectors", section 3). In 16-bit snorm the angle error is below 0.005 degrees.

vec2 octahedral_encode(vec3 n) {
    vec2 p = vec2(n.x, n.y) / (abs(n.x) + abs(n.y) + abs(n.z));
    if (n.z >= 0.0f) return p;
    return vec2((1.0f - abs(p.y)) * (p.x >= 0.0f ? 1.0f : -1.0f), (1.0f - abs(p.x)) * (p.y >= 0.0f ? 1.0f : -1.0f));
}

vec3 octahedral_decode(vec2 e) {
    vec3 n = vec3(e.x, e.y, 1.0f - abs(e.x) - abs(e.y));
    float t = max(-n.z, 0.0f);
    n.x += n.x >= 0.0f ? -t : t;
    n.y += n.y >= 0.0f ? -t : t;
    return normalize(n);
}
