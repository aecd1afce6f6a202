// Light that haze scatters: single scattering of luminaires along rays. How far a luminaire's light goes is kept as a
// map of distances. Its intensity, the inverse square law, the transmittance and the phase function are evaluated where
// a ray is sampled. That is evenly in angle about the luminaire (Kulla and Fajardo 2012, "Importance Sampling
// Techniques for Path Tracing in Participating Media").
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/lighting/air.h"
#include "server/lighting/direct.h"
#include "server/lighting/screen.h"

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
};
// Rays, arrays of a multiple of kSimdWidth: where they start, local, m; their directions, unit; how far they go, m; and
// where in its step each takes its samples, 0 to 1.
struct AirRays {
    std::vector<float> from[3], along[3], far, shift;
    void resize(std::size_t count);
    void set(std::size_t i, const glm::vec3& start, const glm::vec3& direction, float far_m, float shift_ratio);
    std::size_t size() const { return far.size(); }
};

// out: what each ray collects of the luminaire's light, scattered once towards its start: luminance per candela of peak
// × unit_m2. samples: of the cone in which it is bright; outside half of them. Any thread. Six parameters: who
// shines, along what, which part, how well, and where it goes.
void airlight(const AirlightSource& source, const AirRays& rays, std::size_t first, std::size_t count, unsigned samples,
              float* out);

// The rays of a picture's pixels, or of those of its grid: every kStep-th from the third on.
struct AirView {
    int width = 0, height = 0, step = 1;
    AirRays rays;  // row by row
    std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};
// far_m: of rays that meet nothing.
void look_into_air(const GBuffer& gbuffer, int step, float far_m, AirView& view, Pool& pool);

// A picture's haze: 4 half floats a pixel, GBuffer::row_length pixels a row: light, × unit, and what passes of the
// light behind it.
struct AirPicture {
    std::vector<std::uint16_t> halves;
    float unit = 0.0f;
    std::array<std::uint64_t, 2> passes_of{};  // what the light that passes was computed of
};
// planes: rgb in the shape of the view, cd/m². Pixels between points take those around them that are as far away.
// passes_of: of which surfaces and haze; where the picture is of the same, what passes is not computed again. Seven
// parameters: through what, along what, how much light, which of it is new, and where it goes.
void show_air(const GBuffer& gbuffer, const Air& air, const AirView& view, const Planes& planes,
              const std::array<std::uint64_t, 2>& passes_of, AirPicture& picture, Pool& pool);

}  // namespace gonio::lighting
