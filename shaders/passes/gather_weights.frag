// How a pixel sees the surfels: how much each of the sixteen around it counts (server/transport/solve.h, weigh).
#include "shared/layouts.h"
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
layout(binding = 10) uniform usampler2D gbuffer_cell;
layout(std430, binding = 2) readonly buffer TriangleBlock { uvec2 triangles[]; };  // CellMap::Table
layout(std430, binding = 3) readonly buffer CellBlock { uint cells[]; };           // two a word
layout(std430, binding = 4) readonly buffer SurfelBlock { vec4 surfels[]; };       // position, normal; one more: zeros
layout(std430, binding = 5) readonly buffer AroundBlock { uint around[]; };        // sixteen a surfel, two a word
layout(location = 1) uniform uint surfel_count;
layout(location = 2) uniform float per_reach2;  // 1 / distance² beyond which a surfel counts nothing
layout(location = 0) out uvec4 out_weights;     // sixteen of 8 bits, relative to the greatest
layout(location = 1) out uint out_surfel;       // whose surfels around they are of; GONIO_NO_SURFEL: none

uint half_word(uint word, uint which) { return bitfieldExtract(word, int(16u * (which & 1u)), 16); }

uint surfel_at(uvec2 place) {
    uint triangle = (place.x - 1u) >> 1;
    uvec2 own = triangles[triangle];
    vec2 uv = unpackUnorm2x16(place.y);
    uvec2 at = min(uvec2(uv * float(own.y)), uvec2(own.y - 1u));
    uint cell = own.x + ((place.x - 1u) & 1u) * own.y * own.y + at.y * own.y + at.x;
    return half_word(cells[cell >> 1], cell);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    out_weights = uvec4(0u);
    out_surfel = GONIO_NO_SURFEL;
    uvec2 place = texelFetch(gbuffer_cell, pixel, 0).xy;
    if (place.x == 0u) return;
    uint own = surfel_at(place);
    if (own >= surfel_count) return;
    out_surfel = own;
    Surface s = surface_at(pixel, vec2(textureSize(gbuffer_depth, 0)));
    float weights[16];
    float greatest = 0.0;
    for (uint k = 0u; k < 16u; ++k) {
        uint id = half_word(around[8u * own + (k >> 1)], k);
        vec3 d = surfels[2u * id].xyz - s.position, m = surfels[2u * id + 1u].xyz;
        float off = dot(d, s.normal), off_other = dot(d, m), agree = max(dot(m, s.normal) - 0.45, 0.0);
        float near = max(1.0 - (dot(d, d) + 8.0 * (off * off + off_other * off_other)) * per_reach2, 0.0);
        weights[k] = near * near * agree;
        greatest = max(greatest, weights[k]);
    }
    if (greatest < 1e-6) {  // alone, and not much like the place
        out_weights.x = 255u;
        return;
    }
    for (uint k = 0u; k < 16u; ++k)
        out_weights[k >> 2] |= uint(weights[k] / greatest * 255.0 + 0.5) << (8u * (k & 3u));
}
