// Irradiance of the pixels: of the surfels around each (gather_weights.frag).
#include "lib/around.glsl"
layout(binding = 0) uniform usampler2D weights;
layout(binding = 1) uniform usampler2D surfel;
layout(std430, binding = 6) readonly buffer IrradianceBlock { HalfIrradiance irradiance[]; };  // transport::Table
layout(location = 1) uniform float unit;      // of its values in the layer's
layout(location = 2) uniform float greatest;  // that the layer can hold
layout(location = 0) out vec4 out_irradiance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint own = texelFetch(surfel, pixel, 0).r;
    out_irradiance = vec4(0.0, 0.0, 0.0, 1.0);
    if (own == GONIO_NO_SURFEL) return;
    uvec4 bytes = texelFetch(weights, pixel, 0);
    vec3 sum = vec3(0.0);
    float all = 0.0;
    for (uint k = 0u; k < GONIO_AROUND; ++k) {
        float weight = float(weight_of(bytes, k));
        if (weight == 0.0) continue;
        HalfIrradiance halves = irradiance[surfel_around(own, k)];
        sum += weight * vec3(unpackHalf2x16(halves.red_green), unpackHalf2x16(halves.blue).x);
        all += weight;
    }
    out_irradiance.rgb = min(sum / all * unit, vec3(greatest));
}
