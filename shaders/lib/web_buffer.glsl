// GLSL only: the photometric web in a storage buffer, looked up bilinearly. Layout written by server/render/web_buffer.cpp:
// header, then v angles, h angles, first-cell tables of v and h, then intensity / peak, h-major.
layout(std430, binding = 1) readonly buffer WebBuffer {
    uint web_goniometer;   // 0 C, 1 B, 2 A
    uint web_n_v;
    uint web_n_h;
    uint web_table;        // entries of each first-cell table
    float web_values[];
};

// Result: the cell index i with values[base+i] <= x < values[base+i+1], or -1 outside the range. The table holds, for
// equal buckets of the range, the cell of the bucket's start; it is made so fine that 8 steps reach every cell.
int web_cell(int base, int n, int table_base, float x) {
    float low = web_values[base];
    float high = web_values[base + n - 1];
    // Angles of float directions may overshoot the range by rounding.
    if (x < low - 2e-6 || x > high + 2e-6) return -1;
    float bucket = clamp((x - low) / (high - low), 0.0, 1.0) * float(web_table);
    int i = int(web_values[table_base + min(int(bucket), int(web_table) - 1)]);
    for (int step = 0; step < 8; ++step) {
        if (i + 1 >= n - 1 || x < web_values[base + i + 1]) break;
        ++i;
    }
    return i;
}

// Result: I(d) / I_peak, 0..1. d: luminaire frame, any length > 0.
float web_ratio(vec3 d) {
    vec2 angles = web_angles(int(web_goniometer), d);
    int n_v = int(web_n_v);
    int n_h = int(web_n_h);
    int v_base = 0;
    int h_base = n_v;
    int table_base = n_v + n_h;
    int candela_base = table_base + 2 * int(web_table);
    int v = web_cell(v_base, n_v, table_base, angles.x);
    int h = web_cell(h_base, n_h, table_base + int(web_table), angles.y);
    if (v < 0 || h < 0) return 0.0;
    float v0 = web_values[v_base + v];
    float h0 = web_values[h_base + h];
    float a = clamp((angles.x - v0) / (web_values[v_base + v + 1] - v0), 0.0, 1.0);
    float b = clamp((angles.y - h0) / (web_values[h_base + h + 1] - h0), 0.0, 1.0);
    int corner = candela_base + h * n_v + v;
    return mix(mix(web_values[corner], web_values[corner + 1], a),
               mix(web_values[corner + n_v], web_values[corner + n_v + 1], a), b);
}
