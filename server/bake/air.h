// Light of luminaires that the air scatters once along a ray: sampled in steps, with shadow rays or a coarse volume of
// what reaches the air. Any thread.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/bake/work.h"
#include "server/scene/haze.h"
#include "server/trace/sources.h"

namespace gonio::bake {

struct AirSettings {
    Haze haze;
    int steps = 30;            // samples along a ray
    bool even = false;         // even steps, as of the seed; else equiangular about the luminaire
    bool shadow_rays = false;  // exact visibility at each step; else where the volume does not know it
    bool openings = true;      // the volume's and the steps' light comes from points of the opening
};

// Light of a luminaire that reaches the air, on a grid over the scene.
struct AirVolume {
    glm::ivec3 size{0};
    glm::dvec3 low{0.0}, cell{1.0};  // local, m: of the first centre, and from one to the next
    std::vector<float> passed;       // visibility times transmittance, 0..1: for air near the luminaire
    std::vector<float> lx;           // the same times I/d²: for the rest, where it is smooth

    // Result: trilinear. Nothing beyond the bounds of all surfaces. Nothing either where light reaches some of the
    // eight places around and others not: an edge of a shadow, or a wall, is between them. values: one of the two.
    std::optional<double> at(const std::vector<float>& values, const glm::dvec3& local) const;
};

inline constexpr int kVolumeSide = 48;     // cells along the scene's longest side
inline constexpr double kNearCells = 3.0;  // from the opening: I/d² is taken from there on as the volume has it

// Result: its centres; an empty volume if a stop came before.
AirVolume air_volume(const trace::Geometry& geometry, const trace::Luminaire& luminaire, const AirSettings& settings,
                     Work& work);

// Result: luminance that the air scatters towards `from` along a ray, cd/m², of the luminaire without its weight. The
// length, m, is that to the surface that the ray meets. random: in [0, 1), shifts the steps. Equiangular sampling is
// Kulla and Fajardo 2012, "Importance Sampling Techniques for Path Tracing in Participating Media".
double scattered_in(const trace::Geometry& geometry, const trace::Luminaire& luminaire, const AirVolume& volume,
                    const AirSettings& settings, const glm::dvec3& from, const glm::dvec3& along, double length,
                    double random, std::uint64_t& rays);

}  // namespace gonio::bake
