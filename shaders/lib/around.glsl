// GLSL only: the surfels around a surfel, and how much each counts at a pixel.
#include "shared/layouts.h"
layout(std430, binding = 5) readonly buffer AroundBlock { uint around[]; };  // GONIO_AROUND a surfel, two a word

uint half_word(uint word, uint which) { return bitfieldExtract(word, int(16u * (which & 1u)), 16); }
uint surfel_around(uint own, uint k) {
    uint at = GONIO_AROUND * own + k;
    return half_word(around[at >> 1], at);
}

// Weights of GONIO_AROUND surfels, 8 bits each.
uint weight_of(uvec4 weights, uint k) { return bitfieldExtract(weights[k >> 2], int(8u * (k & 3u)), 8); }
void set_weight(inout uvec4 weights, uint k, uint weight) { weights[k >> 2] |= weight << (8u * (k & 3u)); }
