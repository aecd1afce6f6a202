// Goniometer angles of a direction in the luminaire frame (photometric zero on -Z, C0 on +X; see ies/web.h).

// Result: (v, h) in radians. goniometer: 0 Type C, 1 Type B, 2 Type A. d: any length > 0.
// Type C measures v by atan of the two legs: acos loses half the digits near nadir.
vec2 web_angles(int goniometer, vec3 d) {
    if (goniometer == 0) {
        float h = atan(d.y, d.x);
        return vec2(atan(sqrt(d.x * d.x + d.y * d.y), -d.z), mix(h, h + 6.28318530717958648f, h < 0.0f));
    }
    if (goniometer == 1) return vec2(atan(d.x, -d.z), atan(-d.y, sqrt(d.x * d.x + d.z * d.z)));
    return vec2(atan(d.x, sqrt(d.y * d.y + d.z * d.z)), atan(-d.y, -d.z));
}
