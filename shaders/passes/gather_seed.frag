// The seed paper's own indirect pass: every fragment at full resolution draws SAMPLES cube directions, each with separate
// fetches of the stored position, normal, flux and mask, and sums its equation 3 without bounding the singularity.
// The photometric factors its text leaves out are in: solid angle per direction, and 1/pi.
// DISK: directions around the receiver's own direction (Dachsbacher & Stamminger 2005) instead of the whole sphere.
#include "shared/layouts.h"
#include "lib/octahedral.glsl"
#include "lib/surface.glsl"
#include "lib/vpl.glsl"
layout(std140, binding = 0) uniform SeedBlock { vec4 directions[GONIO_MAX_SEED_DIRECTIONS]; };  // sphere: unit; disk: r, cos, sin
layout(location = 1) uniform int sample_count;
layout(location = 2) uniform float mask_lod;       // the level of the RSM's own resolution: it stays in the cache
layout(binding = 0) uniform samplerCube rsm_position;
layout(binding = 1) uniform samplerCube rsm_normal;
layout(binding = 2) uniform samplerCube rsm_flux;  // albedo: the flux per unit of I · d_omega
layout(binding = 3) uniform samplerCube mask;
layout(location = 4) uniform float unit_m2;   // as direct.frag
layout(location = 5) uniform float greatest;
layout(location = 0) out vec4 out_indirect;

// Result: a rotation that differs from pixel to pixel (uniform quaternion from three hashed numbers, Shoemake 1992).
mat3 pixel_rotation(uvec2 pixel) {
    vec3 u;
    for (uint k = 0u; k < 3u; ++k) {
        // PCG output permutation of the pixel's number (Jarzynski & Olano 2020).
        uint h = ((k * 4099u + pixel.y) * 8191u + pixel.x) * 747796405u + 2891336453u;
        h = ((h >> ((h >> 28u) + 4u)) ^ h) * 277803737u;
        u[k] = float((h >> 22u ^ h) >> 8) / 16777216.0;
    }
    float a = 6.2831853 * u.y, b = 6.2831853 * u.z;
    vec4 q = vec4(sqrt(1.0 - u.x) * sin(a), sqrt(1.0 - u.x) * cos(a), sqrt(u.x) * sin(b), sqrt(u.x) * cos(b));
    vec3 i = q.xyz;
    return mat3(1.0 - 2.0 * (i.y * i.y + i.z * i.z), 2.0 * (i.x * i.y + i.z * q.w), 2.0 * (i.x * i.z - i.y * q.w),
                2.0 * (i.x * i.y - i.z * q.w), 1.0 - 2.0 * (i.x * i.x + i.z * i.z), 2.0 * (i.y * i.z + i.x * q.w),
                2.0 * (i.x * i.z + i.y * q.w), 2.0 * (i.y * i.z - i.x * q.w), 1.0 - 2.0 * (i.x * i.x + i.y * i.y));
}

void main() {
    Surface s = surface_at(ivec2(gl_FragCoord.xy));
    out_indirect = vec4(0.0);
    if (!s.hit) return;
    mat3 turn = pixel_rotation(uvec2(gl_FragCoord.xy));
#ifdef DISK
    vec3 axis = normalize(s.position);
    vec3 tangent = normalize(abs(axis.y) < 0.9 ? cross(axis, vec3(0, 1, 0)) : cross(axis, vec3(1, 0, 0)));
    vec3 bitangent = cross(axis, tangent);
    vec2 spin = normalize(turn[0].xy + vec2(1e-9));
#endif
    vec3 sum = vec3(0.0);
    for (int k = 0; k < sample_count; ++k) {
#ifdef DISK
        // Radius r = xi on a unit disk one unit ahead: area pdf 1 / (2 pi r), solid angle per area cos³.
        vec3 xi = directions[k].xyz;
        vec2 e = vec2(xi.y * spin.x - xi.z * spin.y, xi.y * spin.y + xi.z * spin.x) * xi.x;
        vec3 direction = axis + e.x * tangent + e.y * bitangent;
        float solid_angle = 6.2831853 * xi.x * pow(1.0 + xi.x * xi.x, -1.5);
#else
        vec3 direction = turn * directions[k].xyz;
        float solid_angle = 12.566370614;
#endif
        // Explicit levels: neighbouring fragments look in unrelated directions, their derivatives mean nothing.
        vec3 p = textureLod(rsm_position, direction, 0.0).xyz;
        vec3 n = octahedral_decode(textureLod(rsm_normal, direction, 0.0).rg);
        vec3 flux = textureLod(rsm_flux, direction, 0.0).rgb;
        float ratio = textureLod(mask, direction, mask_lod).g;
        sum += flux * (ratio * solid_angle * vpl_geometry(s.position - p, n, s.normal, 0.0));
    }
    out_indirect = vec4(min(sum * (unit_m2 / (3.14159265358979 * float(sample_count))), vec3(greatest)), 1.0);
}
