// Scene-linear light -> what a display shows, once, at the end.

// Result: display-linear value of a luminance in cd/m² at exposure EV100: 1 is the brightest that ISO 12232's saturation
// sensitivity leaves unclipped (Lmax = 1.2 · 2^EV100).
vec3 expose(vec3 luminance_nit, float ev100) { return luminance_nit / (1.2f * exp2(ev100)); }

// Result: x below 0.7, then a shoulder that reaches 1 only at infinity, with continuous slope.
float shoulder(float x) {
    float knee = 0.7f;
    return x < knee ? x : 1.0f - (1.0f - knee) * exp(-(x - knee) / (1.0f - knee));
}

// Result: the sRGB encoding (IEC 61966-2-1) of a linear value in 0..1.
float srgb_encode(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * pow(x, 1.0f / 2.4f) - 0.055f; }

// Result: what is added to gamma-encoded values at a pixel (x, y >= 0, rows counted from the bottom) before they become 8
// bits: ordered dither of half a code value, which hides the bands that 8 bits leave in dark gradients.
float display_dither(int x, int y) {
    int u = x & 3, v = y & 3;
    int bayer = ((u ^ v) & 1) * 8 + (v & 1) * 4 + (((u ^ v) >> 1) & 1) * 2 + (v >> 1);
    return ((float(bayer) + 0.5f) / 16.0f - 0.5f) / 255.0f;
}

// Result: gamma-encoded R'G'B' of a display-linear colour for 8 bits at that pixel.
vec3 encode_display(vec3 display, int x, int y) {
    vec3 encoded = vec3(srgb_encode(shoulder(display.x)), srgb_encode(shoulder(display.y)), srgb_encode(shoulder(display.z)));
    return encoded + vec3(display_dither(x, y));
}

// What an 8-bit picture shows where there is no surface, gamma-encoded.
float background_shade() { return 0.02f; }

// Result: Y', Cb, Cr in 0..1 (BT.709, limited range: Y' 16..235, C 16..240 of 255) of gamma-encoded R'G'B' in 0..1.
vec3 ycbcr_709(vec3 rgb) {
    float y = 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
    return vec3((16.0f + 219.0f * y) / 255.0f, (128.0f + 224.0f * (rgb.z - y) / 1.8556f) / 255.0f,
                (128.0f + 224.0f * (rgb.x - y) / 1.5748f) / 255.0f);
}
