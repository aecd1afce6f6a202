// What is seen through a transmissive surface takes its tint: blended by multiplication with the G-buffer behind.
#include "lib/material.glsl"
in vec2 uv;
layout(location = 1) out vec4 out_albedo;
#ifdef EMISSIVE
layout(location = 2) out vec4 out_emissive;
#endif
void main() {
    vec4 color = material_base_color(uv);
#ifdef MASKED
    if (color.a < alpha_cutoff) discard;
#endif
    Transparency own = transparency(color, uv);
    if (!is_passed(own)) discard;
    out_albedo = vec4(own.tint, 1.0);
#ifdef EMISSIVE
    out_emissive = vec4(own.tint, 1.0);
#endif
}
