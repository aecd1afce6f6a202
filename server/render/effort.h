// How much work a live frame of the default technique is.
#pragma once

#include <array>

namespace gonio {

struct Effort {
    double scale;        // of the picture's sides
    unsigned vpls;       // at most; fewer if the scene asks for fewer
    unsigned node_vpls;  // server/shade/screen.h
    float close_share;   // likewise
    float second_share;  // likewise
    double cost;         // a frame's time over that of the first, about (docs/performance.md)
};

// From all that is wanted downwards. Relative times: cornell, everything recomputed.
inline constexpr std::array<Effort, 5> kEfforts = {{
    {1.0, 1u << 16, 512, 0.07f, 1.0f / 16.0f, 1.0},
    {1.0, 2048, 256, 0.0f, 0.0f, 0.64},
    {0.75, 2048, 256, 0.0f, 0.0f, 0.39},
    {0.5, 1024, 256, 0.0f, 0.0f, 0.21},
    {0.375, 1024, 128, 0.0f, 0.0f, 0.13},
}};

// Rounds of a still picture's refinement, of all luminaires together: some ten seconds on two cores at 800 × 800 in a
// simple scene.
inline constexpr int kRefineRounds = 10;

}  // namespace gonio
