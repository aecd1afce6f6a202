// The last step on the CPU: irradiance layers, weights and reflectance to the NV12 picture that the encoder takes, in
// one pass over the pixels; what shaders/passes/composite.frag and nv12.frag do on a GPU, from the same maths.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "server/shade/pool.h"

namespace gonio::shade {

// One luminaire's light at the pixels, in half floats, and what it is multiplied by.
struct Layer {
    const std::uint16_t* direct = nullptr;    // 1 per pixel, lux per cd of peak
    const std::uint16_t* indirect = nullptr;  // 4 per pixel, rgb and 1, likewise
    glm::vec3 weight{0.0f};                   // cd of peak × level × colour …
};

// Arrays hold row_length pixels a row, a multiple of 4·kLanes, rows from the bottom.
struct Display {
    int width = 0, height = 0;  // even
    std::size_t row_length = 0;
    std::span<const Layer> layers;
    bool direct = true, indirect = true;    // which light is shown
    float gain = 1.0f;                      // on the reflected light
    const std::uint16_t* albedo = nullptr;  // half floats, 4 per pixel: linear reflectance
    const float* emission = nullptr;        // 4 per pixel, cd/m²; null: nothing emits or it is not shown
    const float* depth = nullptr;           // 0: no surface
    float ev100 = 0.0f;
};

// nv12: width × height · 3/2 bytes, rows from the top.
void to_nv12(const Display& display, std::uint8_t* nv12, Pool& pool);

}  // namespace gonio::shade
