// Meshes into the camera's view (CUBE undefined) or into the faces of a cube map, one layer per instance.
#include "shared/layouts.h"
#include "lib/cube.glsl"
layout(location = 0) in vec3 in_position;  // mesh space, m
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec2 in_uv;
layout(location = 3) in vec4 in_row0;      // DrawInstance
layout(location = 4) in vec4 in_row1;
layout(location = 5) in vec4 in_row2;
layout(location = 6) in uint in_face;
#ifdef VERTEX_COLORS
layout(location = 8) in vec4 in_color;
out vec4 vertex_color;
#endif
#ifdef NORMAL_MAP
layout(location = 9) in vec4 in_tangent;
out vec4 tangent;
#endif
#if defined(CELLS) || defined(TRANSMISSIVE)
layout(location = 7) in uint in_first_triangle;
#endif
#ifdef TRANSMISSIVE
flat out uint pane_triangle;
#endif
#ifdef CELLS
out vec3 mesh_position;
flat out uint first_triangle;
#endif
layout(location = 0) uniform mat4 clip_from_local;  // camera only: world axes, camera-relative -> clip
layout(location = 1) uniform float near_m;          // cube only; depth = near / axis distance (reversed, infinite)
out vec3 position;  // world axes, relative to the camera or the light, m
out vec3 normal;
out vec2 uv;
void main() {
    vec4 p = vec4(in_position, 1.0);
    position = vec3(dot(in_row0, p), dot(in_row1, p), dot(in_row2, p));
    mat3 m = transpose(mat3(in_row0.xyz, in_row1.xyz, in_row2.xyz));
    // Cofactors: the inverse transpose without its division, so that flattened meshes stay finite.
    normal = cross(m[1], m[2]) * in_normal.x + cross(m[2], m[0]) * in_normal.y + cross(m[0], m[1]) * in_normal.z;
    uv = in_uv;
#ifdef VERTEX_COLORS
    vertex_color = in_color;
#endif
#ifdef NORMAL_MAP
    tangent = vec4(normalize(m * in_tangent.xyz), in_tangent.w);
#endif
#ifdef TRANSMISSIVE
    pane_triangle = in_first_triangle;
#endif
#ifdef CELLS
    mesh_position = in_position;
    first_triangle = in_first_triangle;
#endif
#ifdef CUBE
    vec3 q = cube_project(int(in_face), position);
    gl_Position = vec4(q.xy, near_m, q.z);
    gl_Layer = int(in_face);
#else
    gl_Position = clip_from_local * vec4(position, 1.0);
#endif
}
