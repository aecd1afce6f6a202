// Direct illuminance per candela of peak: the web itself, the inverse square law, the cosine and the shadow cube.
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
#include "lib/web.glsl"
#include "lib/web_buffer.glsl"
layout(location = 1) uniform mat3 light_from_world;
layout(location = 2) uniform float near_m;
layout(location = 3) uniform float shadow_texel;  // 2 / face size
layout(binding = 0) uniform samplerCubeShadow shadow;  // depth = near / axis distance, compare >=
layout(location = 0) out float out_direct;  // 1/m²: lux per cd of peak

// The receiver is moved along its normal by what one shadow texel spans there (times the sine, because the depth error
// of a texel is its width times the tangent), so that a lit plane does not shadow itself at any angle.
float visibility(vec3 p, vec3 n, float cosine) {
    float distance = max(max(abs(p.x), abs(p.y)), abs(p.z));
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
    vec3 q = p + n * (distance * shadow_texel * (1.2 * sine + 0.1));
    float axis = max(max(abs(q.x), abs(q.y)), abs(q.z));
    return texture(shadow, vec4(q, near_m / axis));
}

void main() {
    Surface s = surface_at(ivec2(gl_FragCoord.xy), vec2(textureSize(gbuffer_depth, 0)));
    out_direct = 0.0;
    if (!s.hit) return;
    float d2 = max(dot(s.position, s.position), 1e-12);
    float cosine = -dot(s.normal, s.position) * inversesqrt(d2);
    if (cosine <= 0.0) return;
    float ratio = web_ratio(light_from_world * s.position);
    if (ratio <= 0.0) return;
    out_direct = ratio * cosine / d2 * visibility(s.position, s.normal, cosine);
}
