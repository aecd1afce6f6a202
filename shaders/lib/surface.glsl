// GLSL only: the point a pixel shows, from the G-buffer.
layout(location = 8) uniform vec4 eye_right;    // xyz: world right × tan(fov/2) × aspect
layout(location = 9) uniform vec4 eye_up;       // xyz: world up × tan(fov/2)
layout(location = 10) uniform vec4 eye_forward; // xyz: world forward; w: near, m
layout(location = 11) uniform vec3 light_from_eye;  // light position minus eye position, m
layout(binding = 8) uniform sampler2D gbuffer_depth;   // near / distance along forward; 0: no surface
layout(binding = 9) uniform sampler2D gbuffer_normal;  // octahedral

struct Surface {
    vec3 position;  // relative to the light, world axes, m
    vec3 normal;    // unit
    bool hit;
};

Surface surface_at(ivec2 pixel) {
    float depth = texelFetch(gbuffer_depth, pixel, 0).r;
    vec2 at = (vec2(pixel) + 0.5) / vec2(textureSize(gbuffer_depth, 0)) * 2.0 - 1.0;
    Surface s;
    s.hit = depth > 0.0;
    vec3 ray = eye_forward.xyz + at.x * eye_right.xyz + at.y * eye_up.xyz;
    s.position = ray * (eye_forward.w / max(depth, 1e-30)) - light_from_eye;
    s.normal = octahedral_decode(texelFetch(gbuffer_normal, pixel, 0).rg);
    return s;
}
