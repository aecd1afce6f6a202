// Direct light of luminaires: at points, and at the pixels of a picture, of one luminaire or of many in one pass.
// Visibility is the same over most of a picture: it is asked at the grid's points, and at the pixels between those that
// do not agree.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>

#include "server/lighting/air.h"
#include "server/lighting/screen.h"
#include "server/lighting/soft_light.h"
#include "server/scene/web_buffer.h"

namespace gonio::lighting {

// A luminaire. Its light is measured in unit_m2: illuminance per candela of its peak × unit_m2, a ratio.
struct DirectLight {
    glm::vec3 position;  // local, m
    glm::mat3 light_from_world;
    PackedWeb web;
    float unit_m2;
    float beam_cos = -1.0f;  // dark where the angle from its photometric zero has a smaller cosine
    glm::vec3 weight{1.0f};  // what it counts in each plane of a picture
    bool sun = false;        // `position` is far beyond the scene (server/scene/sun.h)
    Air air;                 // on its way; of a sun none
    std::shared_ptr<const SoftParts> parts = nullptr;  // of its luminous opening; null: a point
    float fineness = 4.0f;  // how many times the size of a part a receiver is away, at least, as far as there are parts
};

// At `count` points, a multiple of kSimdWidth. relative: light in that measure if nothing stands between, 0 where it
// comes from behind; ratio: I / I_peak, or null. Of an opening: what to multiply even_falloff() with.
// Any thread.
void direct_points(const DirectLight& light, const Points& points, std::size_t count, float* relative,
                   float* ratio = nullptr);

// Sixteen shadow rays to a luminaire, of the points in `active` (bit i: point i), which a picture shows. depth: along
// the view axis, m. Result: bits of those that nothing stops. passed: where the scene has transmissive surfaces: what
// they let pass, by luminance. Any thread.
// targets: where each ray ends, local, m; null: at light.position.
unsigned unhidden(const trace::Geometry& geometry, const DirectLight& light, const GBuffer& gbuffer,
                  const Points& points, const float* depth, unsigned active, float* passed,
                  const glm::vec3* targets = nullptr);

// Scratch of direct_light.
struct Lattice {
    Planes ratio;    // per luminaire I / I_peak at every point of ScreenGrid::grid, negative where it is hidden
    Planes through;  // likewise: what transmissive surfaces let pass, and what is seen of an opening; empty where the
                     // scene has none
    std::vector<std::uint8_t> first;  // of one opening, by pixel: what its first ray says (FirstRay)
};
// out: 1 or 3 planes, surfaces.row_length floats a row: the sum of all luminaires' light × weight. A shadow ray goes to
// each luminaire from every point of the grid. Of more than four luminaires, it goes from every other point first. A
// pixel whose points agree takes their answer. The others send their own
// ray, so a shadow narrower than the grid may be lost. With every_pixel, a ray goes from each pixel that light could
// reach. What is lit, by what, and where the sum and the scratch are: eight parameters. Render thread.
void direct_light(const GBuffer& gbuffer, const ScreenGrid& screen, const trace::Geometry& geometry,
                  std::span<const DirectLight> lights, bool every_pixel, Planes& out, Lattice& lattice, Pool& pool);

}  // namespace gonio::lighting
