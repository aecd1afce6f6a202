// Direct light at the surfels of a scene: where its transport starts (server/transport).
#pragma once

#include <span>
#include <vector>

#include "server/pool.h"
#include "server/shade/direct.h"
#include "server/shade/vpl_rays.h"
#include "server/transport/transport.h"

namespace gonio::shade {

// out: direct illuminance of each surfel per candela of peak × unit_m2, from its centre, with a ray from the luminaire
// where light could reach it. Render thread.
void direct_at_surfels(const transport::Surfels& surfels, const trace::Geometry& geometry, const DirectLight& light,
                       std::vector<float>& out, Pool& pool);

// The same at some points, whose arrays end on whole vectors of kLanes and their results too. geometric: normals of the
// surfaces that they lie on, unit. Any thread.
void direct_at_points(const Points& points, std::span<const glm::vec3> geometric, const trace::Geometry& geometry,
                      const DirectLight& light, float* out);

// Centres of surfels miss what falls between them: a spot that is smaller than they lie apart, and the light of a
// luminaire that is nearer to a surface. There the luminaire's rays count, each with its flux over the areas of the
// surfels around its end: no flux is lost.
// Result: whether there is such light.
bool takes_flux(const transport::Surfels& surfels, const glm::vec3& light, const std::vector<float>& direct);
// out: as of direct_at_surfels. rays: of the luminaire's profile. Render thread.
void take_flux(const VplRays& rays, const transport::Transport::Surface& surface, const glm::vec3& light,
               const glm::mat3& world_from_light, float unit_m2, std::vector<float>& out, Pool& pool);

}  // namespace gonio::shade
