// VPL flux of every RSM texel: rho · I(omega) · d_omega per candela of peak (lm/cd), and the area it represents.
#include "lib/cube.glsl"
#include "lib/octahedral.glsl"
#include "lib/vpl.glsl"
layout(location = 1) uniform float mask_lod;
layout(location = 2) uniform int size;
layout(binding = 0) uniform samplerCube mask;        // IES light mask
layout(binding = 1) uniform samplerCube radial_depth;
layout(binding = 2) uniform samplerCube normals;
layout(binding = 3) uniform samplerCube albedo;
in vec2 ndc;
flat in int face;
layout(location = 0) out vec4 out_flux;  // rgb: lm per cd of peak; a: area / pi, m²
void main() {
    vec3 direction = cube_direction(face, ndc);
    float depth = texture(radial_depth, direction).r;
    float solid_angle = cube_texel_solid_angle(int(gl_FragCoord.x), int(gl_FragCoord.y), size);
    float ratio = textureLod(mask, direction, mask_lod).g;
    vec3 n = octahedral_decode(texture(normals, direction).rg);
    float cosine = -dot(n, normalize(direction));
    float lit = depth > 0.0 ? 1.0 : 0.0;  // 0: the direction leaves the scene
    out_flux = vec4(texture(albedo, direction).rgb * (lit * ratio * solid_angle),
                    texel_area(solid_angle, depth, cosine) / 3.14159265358979);
}
