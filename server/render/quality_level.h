// How much work a live frame of the default technique is.
#pragma once

#include <array>

namespace gonio {

struct QualityLevel {
    double scale;     // of the picture's sides
    unsigned links;   // of each surfel that the solve follows, at most
    bool own_points;  // server/lighting/screen.h
    double cost;      // a frame's time over that of the first, about (docs/notebook/performance.md)
};

// From all that is wanted downwards. Relative times: cornell, everything recomputed.
inline constexpr std::array<QualityLevel, 5> kQualityLevels = {{
    {1.0, ~0u, true, 1.0},
    {1.0, 128, false, 0.75},
    {0.75, 128, false, 0.5},
    {0.5, 128, false, 0.33},
    {0.375, 128, false, 0.22},
}};

}  // namespace gonio
