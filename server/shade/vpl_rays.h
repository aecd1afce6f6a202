// A luminaire's light as rays: the reflective shadow map sampled where the light goes, instead of on a grid. A fixed
// set of points is warped to the profile's distribution of intensity, so that each VPL glides with its ray when the
// luminaire moves or turns and nothing is dealt anew.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "server/pool.h"
#include "server/shade/kernels.h"
#include "server/trace/sources.h"

namespace gonio::shade {

inline constexpr unsigned kSubsets = 16;

// The rays of a profile in its luminaire's frame. Immutable.
struct VplRays {
    std::shared_ptr<const trace::DirectionTable> table;
    unsigned asked = 0;       // rays that the constructor was asked for
    unsigned per_subset = 0;  // rays of each of kSubsets subsets, every one a stratified sample of its own
    struct Ray {
        glm::vec3 direction;   // unit
        float flux_lm_per_cd;  // what it carries per candela of the profile's peak
        float solid_angle_sr;  // what it stands for
    };
    std::vector<Ray> rays;  // subset by subset

    VplRays(std::shared_ptr<const Profile> profile, unsigned count);
    VplRays(std::shared_ptr<const trace::DirectionTable> table, unsigned count);
};

// What the rays of a luminaire met: VPLs relative to the luminaire, world axes, in the rays' order; those that left the
// scene are dark.
struct VplCast {
    std::vector<Vpl> vpls;
    unsigned per_subset = 0;
};
// position: local. Render thread.
VplCast cast(const VplRays& rays, const trace::Geometry& geometry, const glm::dvec3& position,
             const glm::dmat3& world_from_light, Pool& pool);

// Result: irradiance at a surface point from all of the VPLs that it sees, per candela of peak, 1/m², with a ray to
// each. light: local place of the luminaire. Any thread.
glm::vec3 from_vpls(const trace::Geometry& geometry, std::span<const Vpl> vpls, const glm::vec3& light,
                    const glm::vec3& point, const glm::vec3& normal, const glm::vec3& geometric);

}  // namespace gonio::shade
