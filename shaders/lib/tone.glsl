// Tone curves of pictures that are looked at, after three.js 0.187 (MIT). Arguments are display-linear: exposed, 1 what
// ISO 12232's saturation shows as white. Results are linear, 0..1. Written without branches: SIMD lanes run it too.

float tone_power(float x, float exponent) { return exp2(log2(max(x, 1e-10f)) * exponent); }
vec3 tone_clamped(vec3 x) {
    return vec3(min(max(x.x, 0.0f), 1.0f), min(max(x.y, 0.0f), 1.0f), min(max(x.z, 0.0f), 1.0f));
}

// The sigmoid of AgX (Sobotka; the polynomial of Wrensch) of a value's place between 2^-12.47393 and 2^4.026069.
float agx_sigmoid(float x) {
    float t = min(max((log2(max(x, 1e-10f)) + 12.47393f) * (1.0f / 16.499999f), 0.0f), 1.0f);
    float t2 = t * t, t4 = t2 * t2;
    return t4 * t2 * 15.5f - t4 * t * 40.14f + t4 * 31.96f - t2 * t * 6.868f + t2 * 0.4298f + t * 0.1191f - 0.00232f;
}

vec3 tone_agx(vec3 rgb) {
    vec3 wide = vec3(dot(vec3(0.6274f, 0.3293f, 0.0433f), rgb), dot(vec3(0.0691f, 0.9195f, 0.0113f), rgb),
                     dot(vec3(0.0164f, 0.0880f, 0.8956f), rgb));  // Rec. 2020
    float r = agx_sigmoid(dot(vec3(0.856627153f, 0.0951212405f, 0.0482516061f), wide));
    float g = agx_sigmoid(dot(vec3(0.137318973f, 0.761241991f, 0.101439036f), wide));
    float b = agx_sigmoid(dot(vec3(0.111898213f, 0.0767994186f, 0.811302368f), wide));
    vec3 bent = vec3(r, g, b);
    vec3 shown = vec3(tone_power(dot(vec3(1.12710058f, -0.110606643f, -0.0164939387f), bent), 2.2f),
                      tone_power(dot(vec3(-0.141329763f, 1.15782370f, -0.0164939387f), bent), 2.2f),
                      tone_power(dot(vec3(-0.141329763f, -0.110606643f, 1.25193641f), bent), 2.2f));
    return tone_clamped(vec3(dot(vec3(1.6605f, -0.5876f, -0.0728f), shown), dot(vec3(-0.1246f, 1.1329f, -0.0083f), shown),
                             dot(vec3(-0.0182f, -0.1006f, 1.1187f), shown)));
}

// Hill's fit of the ACES RRT and sRGB ODT. The factor 1/0.6 is the one that it is used with.
float aces_fit(float x) {
    return (x * (x + 0.0245786f) - 0.000090537f) / (x * (x * 0.983729f + 0.4329510f) + 0.238081f);
}
vec3 tone_aces(vec3 rgb) {
    float gain = 1.0f / 0.6f;
    vec3 x = rgb * gain;
    vec3 bent = vec3(aces_fit(dot(vec3(0.59719f, 0.35458f, 0.04823f), x)), aces_fit(dot(vec3(0.07600f, 0.90834f, 0.01566f), x)),
                     aces_fit(dot(vec3(0.02840f, 0.13383f, 0.83777f), x)));
    return tone_clamped(vec3(dot(vec3(1.60475f, -0.53108f, -0.07367f), bent), dot(vec3(-0.10208f, 1.10813f, -0.00605f), bent),
                             dot(vec3(-0.00327f, -0.07276f, 1.07602f), bent)));
}

// Khronos PBR Neutral.
vec3 tone_neutral(vec3 rgb) {
    float least = min(rgb.x, min(rgb.y, rgb.z));
    float off = min(least, 0.08f) - min(least, 0.08f) * min(least, 0.08f) * 6.25f;
    vec3 x = rgb - vec3(off, off, off);
    float peak = max(x.x, max(x.y, x.z));
    // Below 0.76 this is the peak itself.
    float shown = min(peak, 0.76f) + 0.24f - 0.0576f / (max(peak, 0.76f) - 0.52f);
    float share = 1.0f / (max(peak - shown, 0.0f) * 0.15f + 1.0f);
    float scale = shown / max(peak, 1e-10f);
    return tone_clamped(x * (scale * share) + vec3(shown * (1.0f - share), shown * (1.0f - share), shown * (1.0f - share)));
}
