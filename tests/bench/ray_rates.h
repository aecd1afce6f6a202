// How many rays a second the machine traces, by kind, as the passes of the default technique send them and with
// nothing of those passes beside them.
#pragma once

#include <string>

#include "tests/bench/cpu_picture.h"

namespace gonio::bench {

struct RayRates {
    std::string scene;
    double shadow_per_s = 0.0;  // to the luminaire from 4 × 4 neighbouring blocks of 2 × 2 pixels: direct light
    double vpl_per_s = 0.0;     // from sixteen nodes to one VPL: occlusion
    double short_per_s = 0.0;   // to what is nearest within near_reach, from 4 × 4 grid points: near light
};
// Result: of a scene of bench_asset with its own luminaire, 800 × 800, on all threads. About a second.
RayRates measure_rays(const std::string& scene);

// Result: how many rays the occlusion's nodes send: to those of the VPLs they ask that could light them.
std::size_t vpl_rays_of(const CpuPicture& picture);

}  // namespace gonio::bench
