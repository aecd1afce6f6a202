// GLSL only: the material of the mesh being drawn.
layout(location = 2) uniform vec4 base_color;     // linear reflectance
layout(location = 3) uniform vec3 emissive_nit;   // cd/m²
layout(location = 4) uniform float alpha_cutoff;  // MASKED only
layout(binding = 0) uniform sampler2D base_color_texture;  // sRGB decoded by the sampler
layout(binding = 1) uniform sampler2D emissive_texture;

#ifdef VERTEX_COLORS
in vec4 vertex_color;  // linear
#endif

vec4 material_base_color(vec2 uv) {
    vec4 color = base_color;
#ifdef VERTEX_COLORS
    color *= vertex_color;
#endif
#ifdef TEXTURED
    color *= texture(base_color_texture, uv);
#endif
    return color;
}

#ifdef NORMAL_MAP
in vec4 tangent;  // world, along u; w: Mesh::tangents
layout(location = 5) uniform float normal_scale;
layout(binding = 2) uniform sampler2D normal_texture;

// Result: the unit normal that the normal map gives. n: the surface's, turned to the viewer.
vec3 mapped_normal(vec3 n, vec2 uv) {
    const float least_up = 0.01;
    vec3 front = gl_FrontFacing ? n : -n, flat_tangent = tangent.xyz - front * dot(front, tangent.xyz);
    vec3 t = flat_tangent * inversesqrt(max(dot(flat_tangent, flat_tangent), 1e-12)), up = cross(front, t) * tangent.w;
    vec3 own = texture(normal_texture, uv).xyz * 2.0 - 1.0;
    vec3 mapped = normalize(t * (own.x * normal_scale) + up * (own.y * normal_scale) + front * max(own.z, least_up));
    return gl_FrontFacing ? mapped : -mapped;
}
#endif

#ifdef TRANSMISSIVE
// trace::Transparency, and how it is found.
#include "lib/pass_threshold.glsl"
layout(location = 7) uniform vec2 pane;  // x: transmission, y: 1 where alpha says what is covered
layout(location = 8) uniform int pane_sample;
layout(binding = 3) uniform sampler2D transmission_texture;
flat in uint pane_triangle;  // of the instance, the first
struct Transparency {
    float share;
    vec3 tint;
};
Transparency transparency(vec4 color, vec2 uv) {
    float covered = pane.y > 0.5 ? clamp(color.a, 0.0, 1.0) : 1.0, passes = pane.x;
#ifdef TRANSMISSION_TEXTURED
    passes *= texture(transmission_texture, uv).r;
#endif
    float share = 1.0 - covered * (1.0 - passes);
    return Transparency(share, (vec3(1.0 - covered) + covered * passes * color.rgb) / max(share, 1e-6));
}
// Whether the fragment is not seen but what lies behind it.
bool is_passed(Transparency own) {
    return pass_threshold(pane_triangle + uint(gl_PrimitiveID), pane_sample) < own.share;
}
#endif

// Result: the unit shading normal, turned to the viewer; a degenerate one falls back to the triangle's own plane.
vec3 surface_normal(vec3 interpolated, vec3 position) {
    float l2 = dot(interpolated, interpolated);
    vec3 n = l2 > 1e-30 ? interpolated * inversesqrt(l2) : normalize(cross(dFdx(position), dFdy(position)) + vec3(1e-30));
    return gl_FrontFacing ? n : -n;
}
