// IES light mask (seed paper §4.3, listing 2): per direction R = I in cd, G = I / I_peak, B = 1 where it emits at all.
// R and G are the mean over the texel by SUB × SUB midpoints, by 12 × 12 where the edge of a beam crosses it.
#include "lib/cube.glsl"
#include "lib/web.glsl"
#include "lib/web_buffer.glsl"
layout(location = 1) uniform mat3 light_from_world;
layout(location = 2) uniform float peak_cd;
layout(location = 3) uniform int size;
in vec2 ndc;
flat in int face;
layout(location = 0) out vec4 out_mask;

// Result: the mean over the texel by n × n midpoints, weighted by solid angle.
float texel_mean(int n) {
    float sum = 0.0;
    float weights = 0.0;
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            vec2 st = ndc + (vec2(i, j) + 0.5 - 0.5 * float(n)) * (2.0 / float(size * n));
            float weight = cube_texel_solid_angle_midpoint(st, size);
            sum += weight * web_ratio(light_from_world * cube_direction(face, st));
            weights += weight;
        }
    }
    return sum / weights;
}

void main() {
    float ratio = texel_mean(SUB);
    float least = ratio;
    float greatest = ratio;
    for (int k = 0; k < 4; ++k) {
        vec2 corner = ndc + vec2(k % 2 == 0 ? -1.0 : 1.0, k / 2 == 0 ? -1.0 : 1.0) / float(size);
        float value = web_ratio(light_from_world * cube_direction(face, corner));
        least = min(least, value);
        greatest = max(greatest, value);
    }
    if (greatest - least > 0.1) ratio = texel_mean(12);
    out_mask = vec4(ratio * peak_cd, ratio, ratio > 0.0 ? 1.0 : 0.0, 1.0);
}
