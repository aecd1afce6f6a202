// Direct light at the surfels of a scene: where its transport starts (server/transport).
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "server/base/pool.h"
#include "server/lighting/direct.h"
#include "server/lighting/vpl_rays.h"
#include "server/transport/transport.h"

namespace gonio::lighting {

// out: direct illuminance of each surfel per candela of peak × unit_m2, with a ray from the luminaire where light could
// reach it. It is that of the surfel's centre, or, where surfels crowd around this luminaire, the mean of the four
// points of its cell. Of an opening a ray comes from one of its points, another for each surfel, or four where it is
// near. Render thread.
void direct_at_surfels(const transport::Surfels& surfels, const trace::Geometry& geometry, const DirectLight& light,
                       std::vector<float>& out, Pool& pool);

// The same at some points. Their arrays and the results end on whole vectors of kSimdWidth. Of the surfaces,
// `geometric` has the unit normals. Points marked in `left_out` get no ray, and their results mean nothing; empty: all
// get one. Any thread.
void direct_at_points(const Points& points, std::span<const glm::vec3> geometric, const trace::Geometry& geometry,
                      const DirectLight& light, float* out, std::span<const std::uint8_t> left_out);

// Links see the light of surfels; those that end nearby take a luminaire's direct light where they end.
struct EndLight {
    DirectLight light;
    std::span<const glm::vec4> at_surfels;  // its direct light
    float share = 1.0f;                     // of it, what the surfels' radiosity holds
    float narrow = 0.0f;                    // of it, what comes by VPLs from afar (vpl_share)
};
struct LinkEnds {
    std::vector<float> points[6];  // as of Points
    std::vector<glm::vec3> normal;
    std::vector<std::uint16_t> surfel;
    std::vector<std::uint32_t> of;  // which of the caller's receivers the link is of
    std::vector<float> length_m, passed, direct;

    void clear();
    // Ray i's, which meets a surfel; for the receiver'th of the caller's. passes: what air that absorbs lets arrive.
    // Six parameters: which of what was met, and for whom.
    void add(const transport::Fan& fan, const trace::HitPacket& hits, int i, std::uint16_t id, float passes,
             std::uint32_t receiver);
    // adds(of, what the link's end sends besides its surfel) for each end with such light. Any thread.
    void each(const transport::Transport::Surface& surface, const EndLight& light,
              const std::function<void(std::uint32_t, const glm::vec3&)>& adds);
};
// How far a link is followed to what is nearby, in radii of a surfel.
inline constexpr float kExactRadii = 2.0f;

// Centres of surfels miss what falls between them: a spot that is smaller than they lie apart, and the light of a
// luminaire that is nearer to a surface. There the luminaire's rays count. Each brings its flux to the surfel that
// links find where it ends, over the area on which links meet that surfel; panes stop rays as often as links. Result:
// whether there is such light.
bool takes_flux(const transport::Surfels& surfels, const DirectLight& luminaire, const std::vector<float>& direct);
// out: as of direct_at_surfels. rays: of the luminaire's profile. Render thread.
void take_flux(const VplRays& rays, const transport::Transport& transport, const DirectLight& luminaire,
               std::vector<float>& out, Pool& pool);

}  // namespace gonio::lighting
