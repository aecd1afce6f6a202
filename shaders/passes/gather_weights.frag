// How a pixel sees the surfels: how much each of the sixteen around it counts (server/transport/solve.h, weigh).
#include "lib/around.glsl"
#include "lib/triangle_point.glsl"
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
layout(binding = 10) uniform usampler2D gbuffer_cell;
layout(std430, binding = 2) readonly buffer TriangleBlock { CellTriangle triangles[]; };  // CellMap::Table
layout(std430, binding = 3) readonly buffer CellBlock { uint cells[]; };            // two a word
layout(std430, binding = 4) readonly buffer SurfelBlock { SurfelDisc surfels[]; };  // one more: zeros
layout(location = 1) uniform uint surfel_count;
layout(location = 2) uniform float per_reach2;  // 1 / distance² beyond which a surfel counts nothing
layout(location = 0) out uvec4 out_weights;     // sixteen of 8 bits, relative to the greatest
layout(location = 1) out uint out_surfel;       // whose surfels around they are of; GONIO_NO_SURFEL: none

uint surfel_at(TrianglePoint point) {
    CellTriangle own = triangles[point.triangle];
    uvec2 at = min(uvec2(point.uv * float(own.side)), uvec2(own.side - 1u));
    uint cell = own.first + point.back * own.side * own.side + at.y * own.side + at.x;
    return half_word(cells[cell >> 1], cell);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    out_weights = uvec4(0u);
    out_surfel = GONIO_NO_SURFEL;
    uvec2 words = texelFetch(gbuffer_cell, pixel, 0).xy;
    if (words.x == 0u) return;
    if ((words.x & GONIO_BODY) != 0u) {  // its six sides (server/lighting/body_sides.h)
        out_surfel = surfel_count + (words.x & ~GONIO_BODY);
        vec3 n = surface_at(pixel).normal;
        for (uint k = 0u; k < 3u; ++k)
            set_weight(out_weights, 2u * k + (n[k] < 0.0 ? 1u : 0u), uint(n[k] * n[k] * 255.0 + 0.5));
        return;
    }
    uint own = surfel_at(unpack_triangle_point(words));
    if (own >= surfel_count) return;
    out_surfel = own;
    Surface s = surface_at(pixel);
    float weights[GONIO_AROUND];
    float greatest = 0.0;
    for (uint k = 0u; k < GONIO_AROUND; ++k) {
        SurfelDisc other = surfels[surfel_around(own, k)];
        vec3 d = other.position.xyz - s.position, m = other.normal.xyz;
        float off = dot(d, s.normal), off_other = dot(d, m), agree = max(dot(m, s.normal) - 0.45, 0.0);
        float near = max(1.0 - (dot(d, d) + 8.0 * (off * off + off_other * off_other)) * per_reach2, 0.0);
        weights[k] = near * near * agree;
        greatest = max(greatest, weights[k]);
    }
    if (greatest < 1e-6) {  // alone, and not much like the point
        set_weight(out_weights, 0u, 255u);
        return;
    }
    for (uint k = 0u; k < GONIO_AROUND; ++k)
        set_weight(out_weights, k, uint(weights[k] / greatest * 255.0 + 0.5));
}
