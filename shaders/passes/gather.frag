// Indirect illuminance of one bounce per candela of peak: the sum over a list of VPLs in a uniform block.
// GRID undefined: every pixel sums the whole block. GRID: the target holds 4 × 4 tiles; tile (a, b) holds the grid points
// (4i+a, 4j+b) of a grid of STEP pixels and sums only the VPLs of its own block (interleaved sampling, Segovia 2006), so
// that all pixels of one draw read the same VPL at the same time.
#include "shared/layouts.h"
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
#include "lib/vpl.glsl"
layout(std140, binding = 0) uniform VplBlock { Vpl vpls[GONIO_MAX_VPLS_PER_BLOCK]; };
layout(location = 1) uniform int vpl_count;
layout(location = 2) uniform float weight;      // blocks of an interleaved list stand for 16 times themselves
layout(location = 3) uniform ivec2 tile;        // GRID: (a, b)
layout(location = 4) uniform ivec2 tile_origin; // GRID: first pixel of the tile in the target
layout(location = 0) out vec4 out_indirect;     // rgb, 1/m²: lux per cd of peak
void main() {
    ivec2 size = textureSize(gbuffer_depth, 0);
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef GRID
    ivec2 grid = (pixel - tile_origin) * 4 + tile;
    pixel = min(grid * STEP + STEP / 2, size - 1);
#endif
    Surface s = surface_at(pixel, vec2(size));
    out_indirect = vec4(0.0);
    if (!s.hit) return;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < vpl_count; ++k) {
        vec3 d = s.position - vpls[k].position_area.xyz;
        sum += vpls[k].intensity.rgb * vpl_geometry(d, vpls[k].normal.xyz, s.normal, vpls[k].position_area.w);
    }
    out_indirect = vec4(sum * weight, 1.0);
}
