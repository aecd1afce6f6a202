// Shadow cube of alpha-masked and transmissive meshes: depth only, holes cut out, and what lets more than half of the
// light pass. Opaque meshes need no fragment shader.
#include "lib/material.glsl"
in vec2 uv;
void main() {
    vec4 color = material_base_color(uv);
#ifdef MASKED
    if (color.a < alpha_cutoff) discard;
#endif
#ifdef TRANSMISSIVE
    if (is_passed(transparency(color, uv))) discard;
#endif
}
