#include "server/lighting/vpl_rays.h"

#include <numbers>

#include "server/trace/sampler.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::lighting {

VplRays::VplRays(std::shared_ptr<const Profile> of_profile, unsigned count) : profile(std::move(of_profile)) {
    const auto tables = shared_tables_of(*profile);
    const DirectionTable& directions = tables->directions;
    const double peak_cd = profile->peak_cd;
    if (directions.dark() || !(peak_cd > 0.0)) return;
    const unsigned n = (count + kSubsets - 1) / kSubsets * kSubsets;
    rays.reserve(n);
    constexpr std::uint32_t kFirstSeed = 0x2545f491u, kSecondSeed = 0x9e3779b9u;
    for (unsigned i = 0; i < n; ++i) {
        // Consecutive parts of an Owen-scrambled Sobol sequence are stratified each for itself.
        double density = 0.0;
        const glm::dvec3 d = directions.draw(trace::scrambled_pair(i, kFirstSeed, kSecondSeed), density);
        Ray ray{glm::vec3(d), 0.0f};
        if (density > 0.0) {
            ray.flux_lm_per_cd = static_cast<float>(ies::intensity(profile->photometry.web, {d.x, d.y, d.z}).in(cd) /
                                                    peak_cd / (n * density));
        }
        rays.push_back(ray);
    }
}

transport::Fan fan_of(const VplRays& rays, int packet, const trace::Geometry& geometry, const DirectLight& light,
                      float reach_m) {
    transport::Fan fan;
    const glm::mat3 world_from_light = glm::transpose(light.light_from_world);
    const float start = geometry.step_off(light.position);
    const VplRays::Ray* ray = &rays.rays[static_cast<std::size_t>(packet) * trace::kPacket];
    for (int i = 0; i < trace::kPacket; ++i) {
        const glm::vec3 d = world_from_light * ray[i].direction;
        const glm::vec3 off =
            light.parts ? light.parts->few[static_cast<unsigned>(i * 5 + packet) % kFewPoints] : glm::vec3(0.0f);
        fan.rays.set(i, light.position + off + d * start, d, reach_m);
        if (ray[i].flux_lm_per_cd > 0.0f) fan.active |= 1u << i;
    }
    return fan;
}

std::vector<Vpl> cast(const VplRays& rays, const trace::Geometry& geometry, const DirectLight& light, Pool& pool) {
    std::vector<Vpl> vpls(rays.rays.size());
    pool.run(static_cast<int>(rays.rays.size()) / trace::kPacket, [&](int packet) {
        const transport::Fan fan = fan_of(rays, packet, geometry, light);
        trace::SurfaceHit hits[trace::kPacket];
        const unsigned met = geometry.closest(fan.rays, fan.active, hits);
        const VplRays::Ray* ray = &rays.rays[static_cast<std::size_t>(packet) * trace::kPacket];
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((met >> i & 1u) == 0) continue;
            const trace::SurfaceHit& hit = hits[i];
            const float taken = (light.air ? transmittance(light.air, light.position, hit.position) : 1.0f) *
                                shading_ratio(fan.rays.along(i), hit.normal, hit.geometric);
            vpls[static_cast<std::size_t>(packet * trace::kPacket + i)] = {
                hit.position, hit.normal,
                hit.tint * hit.albedo * (taken * ray[i].flux_lm_per_cd / std::numbers::pi_v<float>)};
        }
    });
    return vpls;
}

glm::vec3 from_vpls(const trace::Geometry& geometry, const Haze& absorption, std::span<const Vpl> vpls,
                    const glm::vec3& point, const glm::vec3& normal, const glm::vec3& geometric,
                    float surfel_radius_m) {
    const glm::vec3 from = point + geometric * (4.0f * geometry.step_off(point));
    glm::vec3 sum(0.0f);
    const auto add = [&](const glm::vec3& light, const glm::vec3& passed) { sum += light * passed; };
    trace::ShadowRays<glm::vec3, decltype(add)> rays(geometry, add);
    for (const Vpl& vpl : vpls) {
        const glm::vec3 d = vpl.position - point;
        float share = vpl_share(glm::length(d), surfel_radius_m) * glsl::vpl_geometry(-d, vpl.normal, normal, 0.0f);
        if (!(share > 0.0f)) continue;
        if (absorption)
            share *= static_cast<float>(transmittance(absorption, glm::dvec3(point), glm::dvec3(vpl.position)));
        rays.add(from, vpl.position + vpl.normal * (4.0f * geometry.step_off(vpl.position)) - from, 1.0f,
                 vpl.intensity * share);
    }
    rays.send();
    return sum;
}

}  // namespace gonio::lighting
