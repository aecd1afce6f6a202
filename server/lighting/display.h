// The last step on the CPU: irradiance layers, weights and reflectance to the NV12 picture that the encoder takes. It
// is one pass over the pixels. On a GPU, shaders/passes/composite.frag and nv12.frag do the same from the same maths.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "server/base/pool.h"
#include "server/lighting/layers.h"
#include "server/scene/view.h"

namespace gonio::lighting {

struct Edges;
struct ShiningPixel;

// Arrays hold row_length pixels a row, a multiple of 4·kSimdWidth, rows from the bottom. Light is in display units
// where the reflectance is 1: display-linear value, 1 the brightest that is not clipped.
struct Display {
    int width = 0, height = 0;  // even
    std::size_t row_length = 0;
    // Light of luminaires kept apart, at the pixels, in steps: what was summed before, null for nothing, plus the
    // layers.
    const std::int32_t* kept_pixels[3] = {};
    std::span<const LayerTerm> layers;
    float cap = 0.0f;  // of each term, fixed-point steps
    float per_step = 0.0f;
    // Indirect light on the grid, in units; no planes: none.
    struct OnGrid {
        const GBuffer* gbuffer = nullptr;
        const ScreenGrid* screen = nullptr;
        const Planes* planes = nullptr;
        float unit = 0.0f;  // display units per value
    } on_grid;
    // Light of all others in half floats, 4 per pixel: rgb and 1; in units per channel.
    struct Others {
        const std::uint16_t* halves;
        glm::vec3 units;
    };
    std::span<const Others> others;
    const std::uint16_t* albedo = nullptr;  // half floats, 4 per pixel: linear reflectance
    const float* emission = nullptr;        // 4 per pixel, cd/m²; null: nothing emits or it is not shown
    const float* depth = nullptr;           // 0: no surface
    float ev100 = 0.0f;
    Tone tone = Tone::knee;
    glm::mat3 white{1.0f};  // display-linear to display-linear, before the tone curve (server/scene/white_balance.h)
    // Haze before the surfaces (AirPicture): 4 half floats a pixel, light × air_unit cd/m² and what passes; null: none.
    const std::uint16_t* air = nullptr;
    float air_unit = 0.0f;
    std::span<const ShiningPixel> openings;  // of luminaires, by row and column (opening_pixels.h)
    const Edges* edges = nullptr;  // pixels of several surfaces (antialias.h); null: each is what its centre shows
};

// nv12: width × height · 3/2 bytes, rows from the top.
void to_nv12(const Display& display, std::uint8_t* nv12, Pool& pool);

}  // namespace gonio::lighting
