// A luminaire's light as rays: the reflective shadow map sampled where the light goes, instead of on a grid. A fixed
// set of points is warped to the profile's distribution of intensity. So each VPL glides with its ray when the
// luminaire moves or turns, and nothing is dealt anew.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "server/base/pool.h"
#include "server/lighting/direct.h"
#include "server/lighting/kernels.h"
#include "server/trace/sources.h"
#include "server/transport/links.h"

namespace gonio::lighting {

inline constexpr unsigned kSubsets = 16;
inline constexpr float kLinksAloneRadii = 2.0f, kVplsAloneRadii = 8.0f;  // in radii of surfels

// The rays of a profile in its luminaire's frame. Immutable.
struct VplRays {
    std::shared_ptr<const Profile> profile;
    struct Ray {
        glm::vec3 direction;   // unit
        float flux_lm_per_cd;  // what it carries per candela of the profile's peak
    };
    std::vector<Ray> rays;  // kSubsets equal subsets, every one a stratified sample of its own; a dark profile: none

    VplRays(std::shared_ptr<const Profile> profile, unsigned count);
};

// Result: rays 16 × packet … + 15 of a luminaire, as far as reach_m. It does not light the spot that it is mounted on:
// they start step_off() away; of an opening each at another point.
transport::Fan fan_of(const VplRays& rays, int packet, const trace::Geometry& geometry, const DirectLight& light,
                      float reach_m = std::numeric_limits<float>::infinity());

// A surface is as bright as the light on its shading normal says, which normal maps and smooth shading turn away from
// the surface that takes the flux. Result: the first over the second, 0 to 4: less at grazing rays, which bring little.
// along: the ray's, unit. geometric: towards its start.
inline float shading_ratio(const glm::vec3& along, const glm::vec3& shading, const glm::vec3& geometric) {
    return glm::clamp(-glm::dot(along, shading) / glm::max(-glm::dot(along, geometric), 1e-3f), 0.0f, 4.0f);
}

// One virtual point light: where a ray of a luminaire ends; dark if it leaves the scene. World axes.
struct Vpl {
    glm::vec3 position{0.0f};   // local, m
    glm::vec3 normal{0.0f};     // unit; all zero where there is none
    glm::vec3 intensity{0.0f};  // along the normal, rgb, per candela of the profile's peak, sr^-1 · lm/cd
};
// Result: those of a luminaire, in the rays' order. Render thread.
std::vector<Vpl> cast(const VplRays& rays, const trace::Geometry& geometry, const DirectLight& light, Pool& pool);

// The first bounce of a narrow beam comes by VPLs from afar and along links from nearby, where VPLs would be spikes.
// Result: the VPLs' share, 0..1, over a distance; of a pixel and of the surfels around it nearly the same.
inline float vpl_share(float distance_m, float surfel_radius_m) {
    return glm::smoothstep(kLinksAloneRadii, kVplsAloneRadii, distance_m / surfel_radius_m);
}

// Result: irradiance at a surface point, per candela of peak, 1/m²: of all VPLs that it sees, each with its share. A
// ray goes to each. absorption: of the air between (absorption_of()), local. Any thread. Seven parameters: what stands
// in the way, what shines, and on what.
glm::vec3 from_vpls(const trace::Geometry& geometry, const Haze& absorption, std::span<const Vpl> vpls,
                    const glm::vec3& point, const glm::vec3& normal, const glm::vec3& geometric, float surfel_radius_m);

}  // namespace gonio::lighting
