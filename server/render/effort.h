// How much work a live frame of the default technique is.
#pragma once

#include <array>

namespace gonio {

struct Effort {
    double scale;        // of the picture's sides
    float second_share;  // server/shade/screen.h
    double cost;         // a frame's time over that of the first, about (docs/performance.md)
};

// From all that is wanted downwards. Relative times: cornell, everything recomputed.
inline constexpr std::array<Effort, 5> kEfforts = {{
    {1.0, 1.0f / 16.0f, 1.0},
    {1.0, 0.0f, 0.9},
    {0.75, 0.0f, 0.6},
    {0.5, 0.0f, 0.4},
    {0.375, 0.0f, 0.3},
}};

}  // namespace gonio
