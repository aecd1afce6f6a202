// Texture lookups on the CPU, as GL does them at level 0: texels decoded from sRGB, but for values, then filtered.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include "ies/core/srgb.h"
#include "server/scene/asset.h"

namespace gonio::trace {

// Result: linear value of an sRGB-encoded byte.
inline float srgb_decode(std::uint8_t byte) {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> values{};
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = static_cast<float>(linear_of_srgb(static_cast<double>(i) / 255.0));
        return values;
    }();
    return table[byte];
}

// Result: linear rgb and alpha, bilinear. uv: glTF's, (0, 0) at the first texel's corner.
inline glm::vec4 sample(const Image& image, glm::vec2 uv, Wrap wrap_s, Wrap wrap_t) {
    const auto between = [](float x, int size, Wrap mode, int& low, int& high) {
        const bool repeat = mode == Wrap::repeat;
        if (mode == Wrap::mirror) x = 1.0f - std::abs(x - 2.0f * std::floor(0.5f * x) - 1.0f);
        x = repeat ? x - std::floor(x) : std::clamp(x, 0.0f, 1.0f);
        if (!(x >= 0.0f)) x = 0.0f;  // a coordinate that is no number
        const float at = x * static_cast<float>(size) - 0.5f;
        const int cell = static_cast<int>(std::floor(at));
        const auto wrap = [&](int i) { return repeat ? (i % size + size) % size : std::clamp(i, 0, size - 1); };
        low = wrap(cell);
        high = wrap(cell + 1);
        return at - std::floor(at);
    };
    int x0, x1, y0, y1;
    const float a = between(uv.x, image.width_px, wrap_s, x0, x1);
    const float b = between(uv.y, image.height_px, wrap_t, y0, y1);
    const auto texel = [&](int x, int y) {
        const std::uint8_t* p = &image.rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                                             static_cast<std::size_t>(x)) *
                                            4];
        if (image.linear) return glm::vec4(p[0], p[1], p[2], p[3]) / 255.0f;
        return glm::vec4(srgb_decode(p[0]), srgb_decode(p[1]), srgb_decode(p[2]), static_cast<float>(p[3]) / 255.0f);
    };
    return glm::mix(glm::mix(texel(x0, y0), texel(x1, y0), a), glm::mix(texel(x0, y1), texel(x1, y1), a), b);
}

}  // namespace gonio::trace
