// GLSL only: where on a surface a fragment lies, as server/transport/cell_map.h asks for it.
#include "shared/layouts.h"
#include "lib/triangle_point.glsl"
in vec3 mesh_position;
flat in uint first_triangle;  // of the instance
layout(location = 6) uniform uvec2 first;  // index, vertex: of the mesh
layout(std430, binding = 2) readonly buffer VertexBlock { MeshVertex vertices[]; };
layout(std430, binding = 3) readonly buffer IndexBlock { uint indices[]; };

vec3 corner(uint k) {
    uint at = first.y + indices[first.x + 3u * uint(gl_PrimitiveID) + k];
    return vec3(vertices[at].x, vertices[at].y, vertices[at].z);
}

uvec2 cell_of_fragment() {
    vec3 c = corner(0u), a = corner(1u) - c, b = corner(2u) - c, n = cross(a, b), d = mesh_position - c;
    float per_n2 = 1.0 / max(dot(n, n), 1e-30);
    vec2 uv = vec2(dot(cross(d, b), n), dot(cross(a, d), n)) * per_n2;
    return pack_triangle_point(TrianglePoint(first_triangle + uint(gl_PrimitiveID), gl_FrontFacing ? 0u : 1u, uv));
}
