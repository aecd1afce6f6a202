// Grid -> pixels: joint bilateral upsampling of the filtered grid. A pixel that none of its four grid points resembles
// takes the most alike of the sixteen around it.
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
#include "lib/edge.glsl"
layout(binding = 0) uniform sampler2D grid_values;
layout(binding = 1) uniform sampler2D grid_position;
layout(binding = 2) uniform sampler2D grid_normal;
layout(location = 3) uniform ivec2 grid_size;
layout(location = 0) out vec4 out_indirect;

Surface grid_surface(ivec2 grid) {
    vec4 position = texelFetch(grid_position, grid, 0);
    return Surface(position.xyz, texelFetch(grid_normal, grid, 0).xyz, position.a > 0.0);
}

void main() {
    ivec2 size = textureSize(gbuffer_depth, 0);
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Surface s = surface_at(pixel, vec2(size));
    out_indirect = vec4(0.0);
    if (!s.hit) return;
    vec2 at = (vec2(pixel) - float(STEP / 2)) / float(STEP);
    ivec2 base = ivec2(floor(at));
    vec2 f = at - vec2(base);
    float scale = 2.0 * STEP * pixel_width(s.position, size);
    vec4 sum = vec4(0.0);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            ivec2 grid = clamp(base + ivec2(i, j), ivec2(0), grid_size - 1);
            Surface o = grid_surface(grid);
            float bilinear = (i == 0 ? 1.0 - f.x : f.x) * (j == 0 ? 1.0 - f.y : f.y) + 1e-3;
            sum += bilinear * same_surface(s, o, scale) * vec4(texelFetch(grid_values, grid, 0).rgb, 1.0);
        }
    }
    if (sum.a < 0.02) {
        float best = 0.0;
        for (int j = -1; j < 3; ++j) {
            for (int i = -1; i < 3; ++i) {
                ivec2 grid = clamp(base + ivec2(i, j), ivec2(0), grid_size - 1);
                Surface o = grid_surface(grid);
                float alike = same_surface(s, o, scale);
                if (alike > best) {
                    best = alike;
                    sum = vec4(texelFetch(grid_values, grid, 0).rgb, 1.0);
                }
            }
        }
    }
    out_indirect = vec4(sum.rgb / max(sum.a, 1e-6), 1.0);
}
