// A picture's haze. Its light is found along the rays of every fourth pixel and comes to the others from the four
// around them that are as far away. Around a luminaire it grows as 1 / distance, and each pixel has a ray of its own.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/lighting/airlight.h"
#include "server/lighting/screen.h"

namespace gonio::lighting {

// The rays of a picture's pixels, or of those of its grid: every kStep-th from the third on.
struct AirView {
    int width = 0, height = 0, step = 1;
    float far_m = 0.0f;  // how far rays go that meet nothing
    AirRays rays;        // row by row
    std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};
void look_into_air(const GBuffer& gbuffer, int step, float far_m, AirView& view, Pool& pool);

// Of a luminaire's airlight, its pixels less what comes to them of the rays around. They are a square of pixels about
// the luminaire, row by row, that fades to 0 at its edge. Units: the airlight's.
struct NearAir {
    static constexpr int kHalf_px = 16;
    int x = 0, y = 0, width = 0, height = 0;  // 0: it is not in the picture
    std::vector<float> values;
    float most = 0.0f;  // of them
};
// Airlight along a view's rays and near its luminaire.
struct Beam {
    std::vector<float> rays;
    NearAir near;
};
void beam_of(const GBuffer& gbuffer, const AirView& view, const AirlightSource& source, unsigned samples, Beam& out,
             Pool& pool);

// Light of a picture's haze: rgb in the shape of the view, cd/m², and what is added near luminaires.
struct AirLight {
    struct Near {
        const NearAir* air;
        glm::vec3 weight;
    };
    std::span<const std::vector<float>> planes;
    std::span<const Near> near;
};
// A picture's haze: 4 half floats a pixel, GBuffer::row_length pixels a row: light, × unit, and what passes of the
// light behind it.
struct AirPicture {
    std::vector<std::uint16_t> halves;
    float unit = 0.0f;
    std::array<std::uint64_t, 2> passes_of{};  // what the light that passes was computed of
};
// passes_of: of which surfaces and haze; where the picture is of the same, what passes is not computed again. Seven
// parameters: through what, along what, how much light, which of it is new, and where it goes.
void show_air(const GBuffer& gbuffer, const Air& air, const AirView& view, const AirLight& light,
              const std::array<std::uint64_t, 2>& passes_of, AirPicture& picture, Pool& pool);

}  // namespace gonio::lighting
