// GLSL only: where on a surface a pixel of the G-buffer lies, packed.
struct CellPlace {
    uint triangle;
    uint back;  // 1: it is seen
    vec2 uv;    // barycentric
};

// Result: 1 + 2 × triangle + back, so that 0 is no surface; u and v, 16 bits each.
uvec2 pack_cell_place(CellPlace place) {
    return uvec2(1u + 2u * place.triangle + place.back, packUnorm2x16(place.uv));
}
CellPlace unpack_cell_place(uvec2 words) {
    return CellPlace((words.x - 1u) >> 1, (words.x - 1u) & 1u, unpackUnorm2x16(words.y));
}
