// GLSL only: how far two surface points may share their indirect light.

// Result: the width of one pixel at a point, m.
float pixel_width(vec3 position, ivec2 size) {
    return 2.0 * length(eye_up.xyz) / float(size.y) * max(dot(position + light_from_eye, eye_forward.xyz), 0.0);
}

// Result: 0..1; 1 on the same plane. scale: distance between the points that is still near, m.
float same_surface(Surface a, Surface b, float scale) {
    if (!b.hit) return 0.0;
    float facing = max(0.0, dot(a.normal, b.normal));
    float facing4 = facing * facing * facing * facing;
    float off_plane = abs(dot(a.normal, b.position - a.position)) / max(scale, 1e-12);
    return facing4 * facing4 * exp(-4.0 * off_plane * off_plane) + 1e-7;
}
