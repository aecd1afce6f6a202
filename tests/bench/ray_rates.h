// How many rays a second the machine traces, by kind, as the default technique sends them and with nothing of its
// passes beside them.
#pragma once

#include <string>

namespace gonio::bench {

struct RayRates {
    std::string scene;
    double shadow_per_s = 0.0;  // to the luminaire from 4 × 4 neighbouring blocks of 2 × 2 pixels: direct light
    double link_per_s = 0.0;    // from surfels, sixteen of one a packet, and which surfels they meet
};
// Result: of a scene of bench_asset with its own luminaire, 800 × 800, on all threads. About two seconds.
RayRates measure_rays(const std::string& scene);

}  // namespace gonio::bench
