// Cube-map reflective shadow map: what the light sees in each direction. Neither aim, profile nor level enter.
#include "lib/octahedral.glsl"
#include "lib/material.glsl"
in vec3 position;  // relative to the light, m
in vec3 normal;
in vec2 uv;
layout(location = 0) out float out_radial_depth;  // distance from the light, m
layout(location = 1) out vec2 out_normal;         // octahedral, world, turned to the light
layout(location = 2) out vec4 out_albedo;         // linear reflectance
#ifdef SEED
layout(location = 3) out vec4 out_position;       // the seed technique stores it, as its paper does
#endif
void main() {
    vec4 color = material_base_color(uv);
#ifdef MASKED
    if (color.a < alpha_cutoff) discard;
#endif
#ifdef TRANSMISSIVE
    if (is_passed(transparency(color, uv))) discard;
#endif
    out_radial_depth = length(position);
    out_normal = octahedral_encode(surface_normal(normal, position));
    out_albedo = vec4(color.rgb, 1.0);
#ifdef SEED
    out_position = vec4(position, 1.0);
#endif
}
