// One bounce: every texel gathers what the texels around it send, along cosine-distributed directions; of several
// sources of light at once, which share the rays. Any thread.
#pragma once

#include <span>

#include "server/bake/air.h"
#include "server/bake/atlas.h"
#include "server/bake/work.h"

namespace gonio::bake {

struct GatherSettings {
    int directions = 256;  // of a texel, a multiple of 32
    std::uint32_t seed = 1;
    AirSettings air;
};

// What is gathered of one source of light: what leaves each texel, and what the air scatters.
struct GatheredAir {
    const trace::Luminaire* luminaire = nullptr;  // null: only surfaces send
    const AirVolume* volume = nullptr;
};

// leaving: ρE of each texel, texel by texel the sources side by side, lm/m². air: of each source; or empty. Sets the
// irradiance, likewise, lx, and of each half the difference of two half-streams in luminance; 0 of invalid texels. E is
// the mean of ρE over the directions, since they are distributed as their cosine; what the ray meets is read at its
// nearest texel. Result: false if a stop came before.
bool gather(const Atlas& atlas, const trace::Geometry& geometry, const GatherSettings& settings,
            std::span<const glm::vec3> leaving, std::span<const GatheredAir> air, std::size_t sources,
            std::span<glm::vec3> irradiance, std::span<float> error, Work& work);

}  // namespace gonio::bake
