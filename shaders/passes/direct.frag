// Direct illuminance per candela of peak in units of the layers: the web itself, the inverse square law, the cosine and the shadow cube.
#include "lib/air.glsl"
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
#include "lib/web.glsl"
#include "lib/web_buffer.glsl"
layout(location = 1) uniform mat3 light_from_world;
layout(location = 2) uniform float near_m;
layout(location = 3) uniform float shadow_texel;  // 2 / face size
layout(binding = 0) uniform samplerCubeShadow shadow;  // depth = near / axis distance, compare >=
layout(location = 4) uniform float unit_m2;   // the layers' unit (GpuScene::layer_unit_m2)
layout(location = 5) uniform float greatest;  // that the layer can hold
#ifdef DETAIL
layout(binding = 1) uniform sampler2D gbuffer_detail;
#endif
#ifdef HAZE
layout(location = 6) uniform vec3 air;  // extinction, 1/m; 1 / the layer's height, 1/m; its floor below the luminaire, m
float air_passes(vec3 p) {
    vec2 heights = max((vec2(0.0, p.y) - air.z) * air.y, vec2(0.0));
    return exp(-air.x * length(p) * layer_mean(min(heights.x, heights.y), max(heights.x, heights.y)));
}
#endif
layout(location = 0) out float out_direct;  // lux per cd of peak × m²

// The receiver is moved along its normal so far that its plane lies before every depth it is compared with. In face
// coordinates (s, t) a plane's near / axis distance is linear, with slopes of the normal's components across the face's
// axis; the filter reads texels up to one texel away on both. Derived in docs/stability.md.
float visibility(vec3 p, vec3 n) {
    vec3 a = abs(p);
    float distance = max(max(a.x, a.y), a.z);
    vec3 m = abs(n);
    float along = a.x == distance ? m.x : a.y == distance ? m.y : m.z;
    vec3 q = p + n * (distance * shadow_texel * (m.x + m.y + m.z - along + 0.1));
    float axis = max(max(abs(q.x), abs(q.y)), abs(q.z));
    return texture(shadow, vec4(q, near_m / axis));
}

void main() {
    Surface s = surface_at(ivec2(gl_FragCoord.xy));
    out_direct = 0.0;
    if (!s.hit) return;
    float d2 = max(dot(s.position, s.position), 1e-12);
    float cosine = -dot(s.normal, s.position) * inversesqrt(d2);
    if (cosine <= 0.0) return;
#ifdef DETAIL
    vec3 detail = octahedral_decode(texelFetch(gbuffer_detail, ivec2(gl_FragCoord.xy), 0).rg);
    cosine = -dot(detail, s.position) * inversesqrt(d2);
    if (cosine <= 0.0) return;
#endif
    float ratio = web_ratio(light_from_world * s.position);
    if (ratio <= 0.0) return;
#ifdef HAZE
    ratio *= air_passes(s.position);
#endif
    out_direct = min(ratio * cosine / d2 * visibility(s.position, s.normal) * unit_m2, greatest);
}
