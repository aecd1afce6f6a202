#include "server/shade/vpl_rays.h"

#include <numbers>

#include "server/trace/sampler.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::shade {
VplRays::VplRays(std::shared_ptr<const Profile> profile, unsigned count)
    : VplRays(std::make_shared<const trace::DirectionTable>(std::move(profile)), count) {}

VplRays::VplRays(std::shared_ptr<const trace::DirectionTable> directions, unsigned count)
    : table(std::move(directions)), asked(count) {
    const double peak_cd = table->profile()->max_cd;
    if (table->dark() || !(peak_cd > 0.0)) return;
    const unsigned n = (count + kSubsets - 1) / kSubsets * kSubsets;
    rays.reserve(n);
    constexpr std::uint32_t kFirstSeed = 0x2545f491u, kSecondSeed = 0x9e3779b9u;
    for (unsigned i = 0; i < n; ++i) {
        // Consecutive blocks of an Owen-scrambled Sobol sequence are stratified each for itself.
        double density = 0.0;
        const glm::dvec3 d = table->draw(trace::scrambled_pair(i, kFirstSeed, kSecondSeed), density);
        Ray ray{glm::vec3(d), 0.0f};
        if (density > 0.0) {
            ray.flux_lm_per_cd = static_cast<float>(
                ies::intensity(table->profile()->photometry.web, {d.x, d.y, d.z}).in(cd) / peak_cd / (n * density));
        }
        rays.push_back(ray);
    }
}

std::vector<Vpl> cast(const VplRays& rays, const trace::Geometry& geometry, const glm::vec3& position,
                      const glm::mat3& world_from_light, Pool& pool) {
    std::vector<Vpl> vpls(rays.rays.size());
    // A luminaire mounted on a surface does not light the spot it hides: its rays start a step away.
    const float start = geometry.step_off(position);
    const int packets = static_cast<int>(rays.rays.size()) / trace::kPacket;
    pool.run(packets, [&](int packet) {
        trace::RayPacket query;
        trace::SurfaceHit hits[trace::kPacket];
        unsigned active = 0;
        const VplRays::Ray* ray = &rays.rays[static_cast<std::size_t>(packet) * trace::kPacket];
        for (int i = 0; i < trace::kPacket; ++i) {
            const glm::vec3 d = world_from_light * ray[i].direction;
            query.set(i, position + d * start, d);
            if (ray[i].flux_lm_per_cd > 0.0f) active |= 1u << i;
        }
        const unsigned met = geometry.closest(query, active, hits);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((met >> i & 1u) == 0) continue;
            const trace::SurfaceHit& hit = hits[i];
            vpls[static_cast<std::size_t>(packet * trace::kPacket + i)] = {
                hit.position, hit.normal, hit.albedo * (ray[i].flux_lm_per_cd / std::numbers::pi_v<float>)};
        }
    });
    return vpls;
}

glm::vec3 from_vpls(const trace::Geometry& geometry, std::span<const Vpl> vpls, const glm::vec3& point,
                    const glm::vec3& normal, const glm::vec3& geometric, float surfel_radius_m) {
    const glm::vec3 from = point + geometric * (4.0f * geometry.step_off(point));
    glm::vec3 sum(0.0f), brings[trace::kPacket];
    trace::RayPacket rays;
    int waiting = 0;
    const auto send = [&] {
        const unsigned hidden = waiting > 0 ? geometry.occluded(rays, (1u << waiting) - 1u) : 0u;
        for (int i = 0; i < waiting; ++i) {
            if ((hidden >> i & 1u) == 0) sum += brings[i];
        }
        waiting = 0;
    };
    for (const Vpl& vpl : vpls) {
        const glm::vec3 d = vpl.position - point;
        const float share =
            vpl_share(glm::length(d), surfel_radius_m) * glsl::vpl_geometry(-d, vpl.normal, normal, 0.0f);
        if (!(share > 0.0f)) continue;
        brings[waiting] = vpl.intensity * share;
        rays.set(waiting, from, vpl.position + vpl.normal * (4.0f * geometry.step_off(vpl.position)) - from, 1.0f);
        if (++waiting == trace::kPacket) send();
    }
    send();
    return sum;
}

}  // namespace gonio::shade
