// Light that haze scatters: single scattering of luminaires along rays. How far a luminaire's light goes is kept as a
// map of distances. Its intensity, the inverse square law, the transmittance and the phase function are evaluated where
// a ray is sampled. That is evenly in angle about the luminaire (Kulla and Fajardo 2012, "Importance Sampling
// Techniques for Path Tracing in Participating Media").
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "server/lighting/air.h"
#include "server/lighting/direct.h"

namespace gonio::lighting {

// How far a luminaire's light goes before an opaque surface, by direction: Lambert's azimuthal equal-area projection
// about its photometric zero, of the cone that it shines into.
struct DistanceMap {
    int side = 0;        // texels; 0: none, nothing stops its light
    float spread = 2.0;  // 1 - the cosine of the cone's half-angle: 2 is the whole sphere
    std::vector<float> metres;
};
// Of transmissive surfaces as many texels as light passes are open. Render thread.
void trace_distances(const DirectLight& light, const trace::Geometry& geometry, int side, DistanceMap& map, Pool& pool);

// A luminaire as haze scatters it.
struct AirlightSource {
    DirectLight light;             // with its air
    const DistanceMap* distances;  // null: nothing stops it
    float core_cos = -1.0f;        // of the cone in which it is bright (LightTables::core_cos)
    float beyond_ratio = 1.0f;     // of the extinction, where it counts on the way from the air to the rays' starts
    float least_m = 1e-3f;         // a ray through the luminaire counts as if it passed so far from it
};
// Rays, arrays of a multiple of kSimdWidth: starts, local, m; directions, unit; how far they go, m; and where in its
// step each takes its samples, 0 to 1.
struct AirRays {
    std::vector<float> from[3], along[3], far, shift;
    std::vector<float> pixel_rad;  // each is the mean of a square so wide about it; 0: a line
    void resize(std::size_t count);
    void set(std::size_t i, const glm::vec3& start, const glm::vec3& direction, float far_m, float shift_ratio,
             float wide_rad = 0.0f);
    std::size_t size() const { return far.size(); }
};

// out: what each ray collects of the luminaire's light, scattered once towards its start: luminance per candela of peak
// × unit_m2. Samples: of the cone in which it is bright; outside half of them, and half more where there is no such
// cone. Any thread. Six parameters: who shines, along what, which part, how well, and where it goes.
void airlight(const AirlightSource& source, const AirRays& rays, std::size_t first, std::size_t count, unsigned samples,
              float* out);

}  // namespace gonio::lighting
