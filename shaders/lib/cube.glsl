// Cube maps in GL's own face order and orientation (GL 4.5 core, table 8.19): +X -X +Y -Y +Z -Z.
// st are face coordinates in [-1, 1]; texel (i, j) of an n×n face is centred at (2(i+½)/n - 1, 2(j+½)/n - 1).

// Result: the direction through st on a face, not normalised: its component along the face's axis is ±1.
vec3 cube_direction(int face, vec2 st) {
    if (face == 0) return vec3(1.0f, -st.y, -st.x);
    if (face == 1) return vec3(-1.0f, -st.y, st.x);
    if (face == 2) return vec3(st.x, 1.0f, st.y);
    if (face == 3) return vec3(st.x, -1.0f, -st.y);
    if (face == 4) return vec3(st.x, -st.y, 1.0f);
    return vec3(-st.x, -st.y, -1.0f);
}

// Result: a linear map of p so that (x/z, y/z) are the face's st and z is the distance along its axis, m.
vec3 cube_project(int face, vec3 p) {
    if (face == 0) return vec3(-p.z, -p.y, p.x);
    if (face == 1) return vec3(p.z, -p.y, -p.x);
    if (face == 2) return vec3(p.x, p.z, p.y);
    if (face == 3) return vec3(p.x, -p.z, -p.y);
    if (face == 4) return vec3(p.x, -p.y, p.z);
    return vec3(-p.x, -p.y, -p.z);
}

// Result: the face that a direction (any length > 0) falls on.
int cube_face(vec3 d) {
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z) return d.x >= 0.0f ? 0 : 1;
    if (a.y >= a.z) return d.y >= 0.0f ? 2 : 3;
    return d.z >= 0.0f ? 4 : 5;
}

// Result: the solid angle in sr between the face's centre and the corner st (signed like st.x · st.y).
float cube_corner_solid_angle(vec2 st) {
    return atan(st.x * st.y, sqrt(st.x * st.x + st.y * st.y + 1.0f));
}

// Result: the exact solid angle in sr of texel (i, j) of an n×n face: the four-corner difference. All 6n² sum to 4 pi.
float cube_texel_solid_angle(int i, int j, int n) {
    float step = 2.0f / float(n);
    vec2 a = vec2(float(i), float(j)) * step - vec2(1.0f);
    vec2 b = a + vec2(step);
    return cube_corner_solid_angle(b) - cube_corner_solid_angle(vec2(a.x, b.y)) - cube_corner_solid_angle(vec2(b.x, a.y)) +
           cube_corner_solid_angle(a);
}

// The same by the midpoint rule, for large n where the difference above cancels: relative error below 1/n² (n ≥ 16).
float cube_texel_solid_angle_midpoint(vec2 st, int n) {
    float r2 = 1.0f + dot(st, st);
    return 4.0f / (float(n) * float(n) * r2 * sqrt(r2));
}
