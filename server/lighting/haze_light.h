// What haze scatters of a luminaire's light onto surfaces, once: the sum of its airlight over the directions from which
// a surface receives it. Airlight grows without bound towards the luminaire, as 1 / sin of the angle between:
// directions are spread evenly over that angle.
#pragma once

#include <vector>

#include "server/lighting/airlight.h"
#include "server/transport/transport.h"

namespace gonio::lighting {

// out: illuminance at each surfel per candela of peak × unit_m2. Found at every sixteenth surfel, along sixteen rays;
// at the others it is the mean of those around them, twice. far_m: how far rays go that meet nothing. Render thread.
void haze_at_surfels(const transport::Surfels& surfels, const trace::Geometry& geometry, const AirlightSource& source,
                     float far_m, std::vector<float>& out, Pool& pool);
// The same at one point, along 4,096 rays. start: of its rays, a step off its surface.
float haze_at_point(const glm::vec3& point, const glm::vec3& normal, const glm::vec3& start,
                    const trace::Geometry& geometry, const AirlightSource& source, float far_m, Pool& pool);

}  // namespace gonio::lighting
