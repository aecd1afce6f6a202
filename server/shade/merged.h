// Many luminaires as one: while the camera or several of them move they share one direct pass and one solve of the
// transport. What it shows agrees with the luminaires' own layers (docs/rendering.md).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "server/shade/screen.h"

namespace gonio::shade {

// One of a list's luminaires.
struct MergedLight {
    glm::vec3 position;  // local, m
    glm::mat3 light_from_world;
    Web web;
    glm::vec3 weight;  // over the list's `reference`
    float beam_cos;    // dark where the angle from its photometric zero has a smaller cosine
};

struct MergedList {
    std::vector<MergedLight> lights;  // those with weight, kMostMerged at most
    float reference = 0.0f;           // the greatest weight, cd; what the list's light is measured per; 0: all are dark
};
inline constexpr std::size_t kMostMerged = 64;  // bits of a mask

// Scratch of merged_direct: per luminaire I / I_peak at every point of ScreenGrid::grid, negative where it is hidden.
using Lattice = Planes;
// out: direct illuminance of all luminaires, per cd of the list's reference × unit_m2, rgb and 1 in half floats,
// surfaces.row_length pixels a row. A shadow ray goes to each luminaire from every grid point; a pixel whose grid
// points agree takes their answer, the others send their own. screen: of one point per 4 × 4 pixels.
void merged_direct(const Surfaces& surfaces, const ScreenGrid& screen, const trace::Geometry& geometry,
                   const MergedList& list, float unit_m2, Lattice& lattice, std::vector<std::uint16_t>& out,
                   Pool& pool);

}  // namespace gonio::shade
