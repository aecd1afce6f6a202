// Interleaved grid -> grid: each grid point averages the 4 × 4 window around it, which holds all 16 VPL subsets, over the
// points that lie on its own surface. The points' surfaces are written beside, for the upsampling.
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
#include "lib/edge.glsl"
layout(binding = 0) uniform sampler2D tiles;  // 4 × 4 tiles as gather.frag writes them
layout(location = 3) uniform ivec2 grid_size;
layout(location = 4) uniform ivec2 tile_size;
layout(location = 0) out vec4 out_indirect;  // rgb as gathered
layout(location = 1) out vec4 out_position;  // light-relative, m; a: 1 where the grid point has a surface
layout(location = 2) out vec4 out_normal;
void main() {
    ivec2 size = textureSize(gbuffer_depth, 0);
    ivec2 grid = ivec2(gl_FragCoord.xy);
    Surface s = surface_at(min(grid * STEP + STEP / 2, size - 1), vec2(size));
    out_indirect = vec4(0.0);
    out_position = vec4(s.position, s.hit ? 1.0 : 0.0);
    out_normal = vec4(s.normal, 0.0);
    if (!s.hit) return;
    float scale = STEP * 4.0 * pixel_width(s.position, size);
    vec4 sum = vec4(0.0);
    for (int j = -2; j <= 1; ++j) {
        for (int i = -2; i <= 1; ++i) {
            ivec2 other = clamp(grid + ivec2(i, j), ivec2(0), grid_size - 1);
            Surface o = surface_at(min(other * STEP + STEP / 2, size - 1), vec2(size));
            float weight = same_surface(s, o, scale);
            ivec2 at = (other % 4) * tile_size + other / 4;
            sum += weight * vec4(texelFetch(tiles, at, 0).rgb, 1.0);
        }
    }
    out_indirect = vec4(sum.rgb / max(sum.a, 1e-6), 1.0);
}
