#include "server/lighting/surfel_light.h"

#include <array>
#include <cmath>
#include <limits>

namespace gonio::lighting {
namespace {

// 1: all light falls on so few surfels that their centres are no fair sample of it.
float spot_share(const transport::Surfels& surfels, const std::vector<float>& direct) {
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < surfels.count; ++i) {
        const double flux = static_cast<double>(direct[i]) * static_cast<double>(surfels.area_m2[i]);
        sum += flux, squares += flux * flux;
    }
    return squares > 0.0 ? 1.0f - glm::smoothstep(8.0f, 32.0f, static_cast<float>(sum * sum / squares)) : 1.0f;
}

constexpr float kNearRadii = 4.0f;
// The distance from surfels to a luminaire, or to the nearest of some points of its opening.
class Nearness {
public:
    Nearness(const transport::Surfels& surfels, const DirectLight& luminaire)
        : surfels_(surfels), luminaire_(luminaire) {
        const float near_m = kNearRadii * surfels.radius_m + (luminaire.parts ? luminaire.parts->radius_m : 0.0f);
        near_m2_ = near_m * near_m;
    }
    // Result: m; infinite where it is surely beyond kNearRadii, as it is nearly everywhere.
    float distance_m(std::size_t i) const {
        const glm::vec3 from = surfels_.position(i) - luminaire_.position;
        const float from_m2 = glm::dot(from, from);
        return from_m2 > near_m2_ ? std::numeric_limits<float>::infinity() : least_m(from, std::sqrt(from_m2));
    }

private:
    float least_m(const glm::vec3& from, float least_m) const {
        if (luminaire_.parts)
            for (const glm::vec3& point : luminaire_.parts->few)
                least_m = std::min(least_m, glm::distance(from, point));
        return least_m;
    }
    const transport::Surfels& surfels_;
    const DirectLight& luminaire_;
    float near_m2_;
};
// 1: the distance is less than that between surfels so far apart, 0: it is kNearRadii times as much.
float near_share(float distance_m, float spacing_m) {
    return 1.0f - glm::smoothstep(2.0f, kNearRadii, distance_m / spacing_m);
}

}  // namespace

bool takes_flux(const transport::Surfels& surfels, const DirectLight& luminaire, const std::vector<float>& direct) {
    const Nearness nearness(surfels, luminaire);
    for (std::size_t i = 0; i < surfels.count; ++i) {
        if (nearness.distance_m(i) < kNearRadii * surfels.radius_m) return true;
    }
    return spot_share(surfels, direct) > 0.0f;
}

void take_flux(const VplRays& rays, const transport::Transport& transport, const DirectLight& luminaire,
               std::vector<float>& out, Pool& pool) {
    const transport::Transport::Surface& surface = *transport.surface;
    const glm::vec3& light = luminaire.position;
    const transport::Surfels& surfels = surface.surfels;
    const float everywhere = spot_share(surfels, out);
    // Without a spot only near surfels take flux. Cells end within a radius of their surfel's centre.
    const float reach_m =
        everywhere > 0.0f ? std::numeric_limits<float>::infinity() : (kNearRadii + 1.0f) * surfels.radius_m;
    struct End {
        std::uint16_t surfel;  // `count`: none
        float taken = 1.0f;    // of its flux: what haze lets pass to there, as the surfel's shading normal takes it
    };
    std::vector<End> ends(rays.rays.size());
    pool.run(static_cast<int>(ends.size() / trace::kPacket), [&](int packet) {
        const std::size_t first = static_cast<std::size_t>(packet) * trace::kPacket;
        const transport::Fan fan = fan_of(rays, packet, *surface.geometry, luminaire, reach_m);
        trace::HitPacket hits;
        std::uint16_t ids[trace::kPacket];
        transport::follow(fan, *surface.geometry, surfels, *surface.cells, hits, ids);
        for (std::size_t i = 0; i < trace::kPacket; ++i) {
            End& end = ends[first + i];
            end.surfel = ids[i];
            if (ids[i] == surfels.count) continue;
            const int ray = static_cast<int>(i);
            const glm::vec3 along = fan.rays.along(ray), plane = glm::normalize(hits.normal(ray));
            end.taken =
                shading_ratio(along, surfels.detailed_normal(ids[i]), glm::dot(along, plane) < 0.0f ? plane : -plane);
            if (luminaire.air) end.taken *= transmittance(luminaire.air, light, fan.rays.at(ray, hits.distance[i]));
        }
    });
    // In all the luminaire's flux, though few rays may meet the beam.
    double all = 0.0;
    for (const VplRays::Ray& ray : rays.rays) all += static_cast<double>(ray.flux_lm_per_cd);
    const float right = all > 0.0 ? static_cast<float>(rays.profile->flux_lm / rays.profile->peak_cd / all) : 0.0f;
    std::vector<float> flux(surfels.count, 0.0f), landed(surfels.count, 0.0f);
    for (std::size_t i = 0; i < ends.size(); ++i) {
        const std::size_t id = ends[i].surfel;
        if (id == surfels.count || !(transport.met_m2[id] > 0.0f)) continue;
        flux[id] += rays.rays[i].flux_lm_per_cd * right * luminaire.unit_m2 * ends[i].taken;
        landed[id] += 1.0f;
    }
    struct Near {
        double rays_lm = 0.0, shown_lm = 0.0, landed = 0.0;  // flux as rays land and as it is lit, and rays
    };
    const Nearness nearness(surfels, luminaire);
    std::vector<float> near(surfels.count, 0.0f);
    const auto take = [&](std::size_t first, std::size_t count) {
        Near found;
        for (std::size_t i = first; i < first + count; ++i) {
            const float from_m = nearness.distance_m(i);
            if (!(landed[i] > 0.0f || everywhere > 0.0f || std::isfinite(from_m))) continue;
            near[i] = near_share(from_m, surfels.radius_m);
            // A few rays say less than the centre, however near; so do all rays where surfels are small for the way.
            const float instead = glm::smoothstep(4.0f, 16.0f, landed[i]) * near_share(from_m, surfels.spacing_m[i]);
            const float taken = landed[i] > 0.0f ? flux[i] / transport.met_m2[i] : 0.0f;
            if (landed[i] > 0.0f || everywhere > 0.0f) out[i] = glm::mix(out[i], taken, std::max(everywhere, instead));
            found.rays_lm += static_cast<double>(near[i] * flux[i]);
            found.shown_lm += static_cast<double>(near[i] * out[i] * transport.met_m2[i]);
            found.landed += static_cast<double>(near[i] * landed[i]);
        }
        return found;
    };
    const Near all_near =
        pool.reduce_chunks(surfels.count, transport::kSurfelsAJob, Near(), take, [](Near a, const Near& b) {
            return Near{a.rays_lm + b.rays_lm, a.shown_lm + b.shown_lm, a.landed + b.landed};
        });
    // Few rays meet each surfel near the luminaire, but all of them together tell the flux there.
    if (!(all_near.shown_lm > 0.0)) return;
    const float right_near =
        glm::mix(1.0f, glm::clamp(static_cast<float>(all_near.rays_lm / all_near.shown_lm), 0.5f, 2.0f),
                 glm::smoothstep(16.0f, 64.0f, static_cast<float>(all_near.landed)));
    for (std::size_t i = 0; i < surfels.count; ++i)
        if (near[i] > 0.0f) out[i] *= glm::mix(1.0f, right_near, near[i]);
}

void direct_at_points(const Points& points, std::span<const glm::vec3> geometric, const trace::Geometry& geometry,
                      const DirectLight& light, float* out, std::span<const std::uint8_t> left_out) {
    // A luminaire on a surface does not light what it is mounted on, nor is it hidden by it.
    constexpr float kStart = 1e-5f;
    direct_points(light, points, (geometric.size() + kSimdWidth - 1) / kSimdWidth * kSimdWidth, out);
    std::vector<float> seen;  // of an opening
    if (light.parts) seen.assign(geometric.size(), 0.0f);
    const auto take = [&](std::size_t i, const glm::vec3& passed) {
        if (light.parts)
            seen[i] += trace::luminous(passed);
        else
            out[i] *= trace::luminous(passed);
    };
    trace::ShadowRays<std::size_t, decltype(take)> rays(geometry, take);
    for (std::size_t i = 0; i < geometric.size(); ++i) {
        if (!(out[i] > 0.0f) || (!left_out.empty() && left_out[i] != 0)) continue;
        const glm::vec3 p(points.x[i], points.y[i], points.z[i]);
        const glm::vec3 from = p + geometric[i] * (4.0f * geometry.step_off(p));
        // Rays to an opening: to a point of it each, or to four where it is near.
        const unsigned count = light.parts && glm::distance(p, light.position) < 4.0f * light.parts->radius_m ? 4 : 1;
        float sent = 0.0f;
        for (unsigned k = 0; k < count; ++k) {
            const glm::vec3 source =
                light.position + (light.parts ? light.parts->few[(i * 7 + k * 5) % kFewPoints] : glm::vec3(0.0f));
            if (glm::dot(source - p, geometric[i]) <= 0.0f) continue;
            const glm::vec3 along = from - source;
            sent += 1.0f;
            if (light.sun)
                rays.add(from, -along, 1.0f, i);
            else
                rays.add(source + along * kStart, along, 1.0f - 2.0f * kStart, i);
        }
        out[i] = sent > 0.0f ? out[i] / sent : 0.0f;
    }
    rays.send();
    for (std::size_t i = 0; i < seen.size(); ++i) out[i] *= seen[i];
}

void LinkEnds::clear() {
    for (auto& values : points) values.clear();
    normal.clear(), surfel.clear(), of.clear(), length_m.clear(), passed.clear();
}

void LinkEnds::add(const transport::Fan& fan, const trace::HitPacket& hits, int i, std::uint16_t id, float passes,
                   std::uint32_t receiver) {
    const glm::vec3 p = fan.rays.at(i, hits.distance[i]), met = glm::normalize(hits.normal(i)),
                    n = glm::dot(met, fan.rays.along(i)) < 0.0f ? met : -met;
    for (int k = 0; k < 3; ++k) {
        points[k].push_back(p[k]);
        points[k + 3].push_back(n[k]);
    }
    normal.push_back(n), surfel.push_back(id), of.push_back(receiver), length_m.push_back(hits.distance[i]);
    passed.push_back(passes);
}

void LinkEnds::each(const transport::Transport::Surface& surface, const EndLight& light,
                    const std::function<void(std::uint32_t, const glm::vec3&)>& adds) {
    if (normal.empty()) return;
    const transport::Surfels& surfels = surface.surfels;
    direct.resize((normal.size() + kSimdWidth - 1) / kSimdWidth * kSimdWidth);
    for (auto& values : points) values.resize(direct.size(), 0.0f);
    for (std::size_t k = 0; k < normal.size() && surfels.detailed; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis) points[axis + 3][k] = surfels.facing[axis][surfel[k]];
    direct_at_points(points_at(points, 0), normal, *surface.geometry, light.light, direct.data(), {});
    for (std::size_t k = 0; k < normal.size(); ++k) {
        glm::vec3 sum(light.narrow * (1.0f - vpl_share(length_m[k], surfels.radius_m)) * direct[k]);
        if (length_m[k] < kExactRadii * surfels.radius_m)
            sum += light.share * (direct[k] - glm::vec3(light.at_surfels[surfel[k]]));
        if (sum != glm::vec3(0.0f)) adds(of[k], surfels.albedo[surfel[k]] * sum * passed[k]);
    }
}

void direct_at_surfels(const transport::Surfels& surfels, const trace::Geometry& geometry, const DirectLight& light,
                       std::vector<float>& out, Pool& pool) {
    constexpr std::size_t kChunk = 512, kCells = kChunk / transport::kCellPoints;
    static_assert(kChunk % kSimdWidth == 0 && kSimdWidth == transport::kPadding);
    out.resize(surfels.points[0].size());
    // Crowded surfels far from this luminaire lie around another one. Light from afar is even over such a small surfel,
    // so one ray to its centre is enough.
    constexpr float kFarSpacings = 12.0f;
    const float beside_m = light.parts ? light.parts->radius_m : 0.0f;
    std::vector<const transport::Surfels::Crowded*> near;
    std::vector<std::uint8_t> by_points(surfels.count, 0);
    for (const transport::Surfels::Crowded& one : surfels.all_crowded)
        if (!light.sun && glm::distance(surfels.position(one.id), light.position) - beside_m <
                              kFarSpacings * surfels.spacing_m[one.id])
            near.push_back(&one), by_points[one.id] = 1;
    pool.run_chunks(surfels.count, kChunk, [&](std::size_t first, std::size_t count) {
        const float* at[6];
        for (std::size_t k = 0; k < 3; ++k)
            at[k] = surfels.points[k].data() + first, at[k + 3] = surfels.facing[k].data() + first;
        direct_at_points({at[0], at[1], at[2], at[3], at[4], at[5]}, std::span(surfels.geometric).subspan(first, count),
                         geometry, light, out.data() + first, std::span(by_points).subspan(first, count));
    });
    pool.run_chunks(near.size(), kCells, [&](std::size_t first, std::size_t count) {
        std::array<std::array<float, kChunk>, 6> at{};
        std::array<float, kChunk> direct{};
        std::vector<glm::vec3> geometric(count * transport::kCellPoints);
        const std::span some = std::span(near).subspan(first, count);
        for (std::size_t i = 0; i < geometric.size(); ++i) {
            const auto& [id, points] = *some[i / transport::kCellPoints];
            const glm::vec3 &p = points.at[i % transport::kCellPoints], n = surfels.detailed_normal(id);
            for (int k = 0; k < 3; ++k) {
                at[static_cast<std::size_t>(k)][i] = p[k];
                at[static_cast<std::size_t>(k) + 3][i] = n[k];
            }
            geometric[i] = surfels.geometric[id];
        }
        direct_at_points(points_at(at.data(), 0), geometric, geometry, light, direct.data(), {});
        for (const transport::Surfels::Crowded* one : some) out[one->id] = 0.0f;
        for (std::size_t i = 0; i < geometric.size(); ++i) {
            const auto& [id, points] = *some[i / transport::kCellPoints];
            out[id] += points.share[i % transport::kCellPoints] * direct[i];
        }
    });
}

}  // namespace gonio::lighting
