// Direct light at the surfels of a scene: where its transport starts (server/transport).
#pragma once

#include <vector>

#include "server/pool.h"
#include "server/shade/kernels.h"
#include "server/transport/surfels.h"

namespace gonio::shade {

// out: direct illuminance of each surfel per candela of peak × unit_m2, from its centre, with a ray from the luminaire
// where light could reach it. Render thread.
void direct_at_surfels(const transport::Surfels& surfels, const trace::Geometry& geometry, const DirectLight& light,
                       std::vector<float>& out, Pool& pool);

}  // namespace gonio::shade
