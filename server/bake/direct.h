// Direct irradiance of one luminaire at all texels: its web, its opening in parts, shadow rays, and the air between.
// Any thread.
#pragma once

#include <span>

#include "server/bake/atlas.h"
#include "server/bake/work.h"
#include "server/scene/haze.h"
#include "server/trace/sources.h"

namespace gonio::bake {

struct DirectSettings {
    bool openings = true;     // light comes from luminous openings, not from points
    double part = 0.25;       // of a rectangle: greatest part over its distance; 0.25: within 2 %, 0.125: 0.5 %
    int opening_points = 32;  // of other shapes, even
    std::uint32_t seed = 1;
    Haze haze;
};

inline constexpr int kMostParts = 1024;  // of a rectangle, at one texel

// An opening has four parts at least, and where some of their rays are stopped eight times as many.
// Sets of each texel the mean of two half-streams of samples, lx, and half their difference; 0 of invalid ones. The
// luminaire's weight is left out. Result: false if a stop came before.
bool direct_light(const Atlas& atlas, const trace::Geometry& geometry, const trace::Luminaire& luminaire,
                  const DirectSettings& settings, std::span<float> mean, std::span<float> error, Work& work);

}  // namespace gonio::bake
