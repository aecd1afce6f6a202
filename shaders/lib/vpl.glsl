// Irradiance from a virtual point light, and the flux it carries (docs/rendering.md; the seed paper's equation 3 made
// photometric by the solid angle and 1/pi that its text leaves out).

// Result: the geometry factor in m^-2 between a Lambertian point (normal n_p) and a receiver (normal n), d = receiver
// minus point, m, not normalised. area_over_pi: represented area / pi, m²: it bounds the 1/d⁴ singularity (the point is
// read as a small disc), exact for distances large against sqrt(area). 0 gives the bare kernel of the seed paper.
float vpl_geometry(vec3 d, vec3 n_p, vec3 n, float area_over_pi) {
    float d2 = dot(d, d);
    float cosines = max(0.0f, dot(n_p, d)) * max(0.0f, -dot(n, d));
    return cosines / max(d2 * (d2 + area_over_pi), 1e-36f);
}

// Result: the surface area in m² that one texel sees: solid_angle (sr) at a distance (m) on a surface met at an angle
// whose cosine is cosine. Grazing texels are bounded at 50 times the frontal area.
float texel_area(float solid_angle, float distance, float cosine) {
    return solid_angle * distance * distance / max(cosine, 0.02f);
}

// Result: Rec. 709 luminance of linear RGB.
float luminance(vec3 rgb) { return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z; }
