// GLSL only: where on a surface a pixel of the G-buffer lies, packed.
struct TrianglePoint {
    uint triangle;
    uint back;  // 1: it is seen
    vec2 uv;    // barycentric
};

// Result: 1 + 2 × triangle + back, so that 0 is no surface; u and v, 16 bits each.
uvec2 pack_triangle_point(TrianglePoint point) {
    return uvec2(1u + 2u * point.triangle + point.back, packUnorm2x16(point.uv));
}
TrianglePoint unpack_triangle_point(uvec2 words) {
    return TrianglePoint((words.x - 1u) >> 1, (words.x - 1u) & 1u, unpackUnorm2x16(words.y));
}
