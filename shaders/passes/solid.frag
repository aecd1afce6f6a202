// Wires of the photometric solid, brighter where they face the light's axis.
in vec3 normal;
layout(location = 2) uniform vec3 color;
layout(location = 0) out vec4 out_color;
void main() {
    float shading = 0.6 + 0.4 * abs(normalize(normal + vec3(1e-9)).y);
    out_color = vec4(color * shading, 1.0);
}
