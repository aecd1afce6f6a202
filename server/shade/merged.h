// Many luminaires as one: while the camera moves all of them share one list of VPLs, in proportion to what they give,
// and one direct pass. What it shows agrees with the luminaires' own layers but for sampling (docs/rendering.md).
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "server/shade/near_light.h"
#include "server/shade/screen.h"

namespace gonio::shade {

// A luminaire that shall share a list.
struct MergedSource {
    const VplRays& rays;
    const VplCast& vpls;
    Web web;              // its words outlive the list
    float beam_cos;       // dark where the angle from its photometric zero has a smaller cosine
    glm::dvec3 position;  // local, m
    glm::dmat3 world_from_light;
    glm::vec3 weight;  // cd of its peak × level × colour …, per channel, >= 0
};

// One of a list's luminaires.
struct MergedLight {
    glm::vec3 position;  // local, m
    glm::mat3 light_from_world;
    Web web;
    glm::vec3 weight;   // over the list's `reference`
    float luminance;    // of weight
    float rays_per_sr;  // that the list holds where the web is at its peak, in proportion to I elsewhere
    float beam_cos;     // dark where the angle from its photometric zero has a smaller cosine
};

struct MergedList {
    std::vector<MergedLight> lights;  // those with weight, kMostMerged at most
    float reference = 0.0f;           // the greatest weight, cd; what the list's light is measured per; 0: all are dark
    VplCast vpls;  // relative to the local origin; areas: what one of all luminaires' VPLs stands for
};
inline constexpr std::size_t kMostMerged = 64;  // bits of a mask

// Result: of each luminaire an aligned run of its rays, a power of two in proportion to its share of the light, so that
// it stays stratified, one at least in each subset; twice as many in all as one luminaire has. Fluxes are scaled to
// whole luminaires at their weights.
MergedList merge(std::span<const MergedSource> sources, Pool& pool);

// What add_near_light does for one luminaire: each ray that meets a surface looks at all luminaires there and sends its
// shadow ray to one of them, drawn in proportion to what they bring if nothing stands between.
void add_merged_near_light(const LightView& light, const Points& points, unsigned active, const Directions& about_z,
                           float kappa, NearSums& sums);

// Scratch of merged_direct: per luminaire I / I_peak at every point of ScreenGrid::grid, negative where it is hidden.
using Lattice = Planes;
// out: direct illuminance of all luminaires, per cd of the list's reference × unit_m2, rgb and 1 in half floats,
// surfaces.row_length pixels a row. A shadow ray goes to each luminaire from every grid point; a pixel whose grid
// points agree takes their answer, the others send their own. screen: of one point per 4 × 4 pixels.
void merged_direct(const Surfaces& surfaces, const ScreenGrid& screen, const trace::Geometry& geometry,
                   const MergedList& list, float unit_m2, Lattice& lattice, std::vector<std::uint16_t>& out,
                   Pool& pool);

}  // namespace gonio::shade
