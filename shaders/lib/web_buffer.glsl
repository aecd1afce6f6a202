// GLSL only: the photometric web in a storage buffer, looked up bilinearly. Written by server/scene/web_buffer.cpp.
#include "shared/layouts.h"
layout(std430, binding = 1) readonly buffer WebBuffer {
    WebHeader web;
    float web_values[];
};

// Result: where x falls on an axis of n values: cell + fraction, or -1 outside the range.
// UNIFORM_WEB: the values are equally spaced. Otherwise the table holds, for equal buckets of the range, the cell of the
// bucket's start; it is made so fine that 8 steps reach every cell.
float web_cell(int base, int n, int table_base, float x) {
    float low = web_values[base];
    float high = web_values[base + n - 1];
    // Angles of float directions may overshoot the range by rounding.
    if (x < low - 2e-6 || x > high + 2e-6) return -1.0;
    float share = clamp((x - low) / (high - low), 0.0, 1.0);
#ifdef UNIFORM_WEB
    return share * float(n - 1);
#else
    int i = int(web_values[table_base + min(int(share * float(web.table)), int(web.table) - 1)]);
    for (int step = 0; step < 8; ++step) {
        if (i + 1 >= n - 1 || x < web_values[base + i + 1]) break;
        ++i;
    }
    float start = web_values[base + i];
    return float(i) + clamp((x - start) / (web_values[base + i + 1] - start), 0.0, 1.0);
#endif
}

// Result: I(d) / I_peak, 0..1. d: luminaire frame, any length > 0.
float web_ratio(vec3 d) {
    vec2 angles = web_angles(int(web.goniometer), d);
    int n_v = int(web.n_v);
    int n_h = int(web.n_h);
    float v_cell = web_cell(0, n_v, int(web_v_cells(web)), angles.x);
    float h_cell = web_cell(int(web_h(web)), n_h, int(web_h_cells(web)), angles.y);
    if (v_cell < 0.0 || h_cell < 0.0) return 0.0;
    int v = min(int(v_cell), n_v - 2);
    int h = min(int(h_cell), n_h - 2);
    float a = v_cell - float(v);
    float b = h_cell - float(h);
    int corner = int(web_ratios(web)) + h * n_v + v;
    return mix(mix(web_values[corner], web_values[corner + 1], a),
               mix(web_values[corner + n_v], web_values[corner + n_v + 1], a), b);
}
