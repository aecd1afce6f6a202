// G-buffer: normal, albedo and, where the scene has emitters, emitted luminance of the nearest surface.
#include "shared/layouts.h"
#include "lib/octahedral.glsl"
#include "lib/material.glsl"
in vec3 position;
in vec3 normal;
in vec2 uv;
layout(location = 0) out vec2 out_normal;  // octahedral, world
layout(location = 1) out vec4 out_albedo;  // linear reflectance
#ifdef EMISSIVE
layout(location = 2) out vec4 out_emissive;  // cd/m²
#endif
#ifdef DETAIL
layout(location = DETAIL) out vec2 out_detail;  // as out_normal, normal maps included
#endif
#ifdef CELLS
#ifdef BODY
flat in uint first_triangle;  // which part of a body it is
#else
#include "lib/cell.glsl"
#endif
layout(location = CELLS) out uvec2 out_cell;
#endif
void main() {
    vec4 color = material_base_color(uv);
#ifdef MASKED
    if (color.a < alpha_cutoff) discard;
#endif
#ifdef TRANSMISSIVE
    if (is_passed(transparency(color, uv))) discard;
#endif
    vec3 n = surface_normal(normal, position);
    out_normal = octahedral_encode(n);
#ifdef DETAIL
#ifdef NORMAL_MAP
    n = mapped_normal(n, uv);
#endif
    out_detail = octahedral_encode(n);
#endif
    out_albedo = vec4(color.rgb, 1.0);
#ifdef EMISSIVE
    vec3 emitted = emissive_nit;
#ifdef EMISSIVE_TEXTURED
    emitted *= texture(emissive_texture, uv).rgb;
#endif
#ifdef DARK_BACK
    if (!gl_FrontFacing) emitted = vec3(0.0);
#endif
    out_emissive = vec4(emitted, 1.0);
#endif
#ifdef BODY
#ifdef CELLS
    out_cell = uvec2(GONIO_BODY | first_triangle, 0u);
#endif
#elif defined(CELLS)
    out_cell = cell_of_fragment();
#endif
}
