// Shadow edges in the direct light of one luminaire: a pixel that a shadow's edge may cross gets the share of its
// samples that see the luminaire.
#pragma once

#include <span>
#include <vector>

#include "server/lighting/antialias.h"
#include "server/lighting/direct.h"

namespace gonio::lighting {

// light: one float a pixel, as of direct_light with a shadow ray from each pixel's centre. Where of two neighbours on a
// surface one is lit and one is dark, n samples decide for both. They are those that show what the pixel's centre does
// (edges), on its plane. The cosine and the distance stay the centre's. Seven parameters: a luminaire, a picture and
// its light. Render thread.
void sample_shadow_edges(const GBuffer& gbuffer, const trace::Geometry& geometry, const DirectLight& luminaire,
                         const Edges& edges, unsigned n, std::vector<float>& light, Pool& pool);

// Direct light of many luminaires with all their shadows' edges: the sum of their light × weight. A shadow ray goes
// from each pixel to each of them, and n where its shadow's edge may cross the pixel. out: 3 planes, as of
// direct_light. Eight parameters: those of direct_light and what edges are. Render thread.
void direct_light_with_edges(const GBuffer& gbuffer, const ScreenGrid& screen, const trace::Geometry& geometry,
                             std::span<const DirectLight> luminaires, const Edges& edges, unsigned n, Planes& out,
                             Pool& pool);

// Pixels that stand for samples of other surfaces (Edges::mixed) get the mean of the direct light of all, with a shadow
// ray from each such sample to each luminaire. The planes of light are as of direct_light. Render thread.
void light_mixed_pixels(const GBuffer& gbuffer, const trace::Geometry& geometry,
                        std::span<const DirectLight> luminaires, const Edges& edges, Planes& light, Pool& pool);

}  // namespace gonio::lighting
