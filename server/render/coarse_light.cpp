#include "server/render/coarse_light.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"
#include "server/transport/crowded.h"

namespace gonio {
namespace {

using transport::Transport;

constexpr std::size_t kFewer = 4;          // surfels of the finer transport for one of the coarser
constexpr unsigned kCoarseLinks = 256;     // of a surfel
constexpr unsigned kComparedLinks = 2048;  // of the point
constexpr float kSky_m = 1e5f;             // how far haze reaches along links that meet nothing

transport::SurfelSettings coarser(transport::SurfelSettings settings) {
    settings.spacing_m *= std::sqrt(static_cast<double>(kFewer));
    settings.least /= kFewer, settings.most /= kFewer, settings.bytes /= kFewer;
    return settings;
}

std::vector<glm::vec3> weights_of(const FrameInputs& inputs) {
    const double unit_m2 = static_cast<double>(inputs.geometry.layer_unit_m2());
    std::vector<glm::vec3> weights;
    for (std::size_t i = 0; i < inputs.lights.size(); ++i) {
        const Light& light = inputs.scene.lights[i];
        weights.emplace_back(light_weight(inputs.scene, light) * peak_of(inputs, light, *inputs.lights[i]) / unit_m2);
    }
    return weights;
}

// Fills the light of a transport. own: the luminaires' direct light at its surfels is known (LightGpu::surfel_direct).
void light_up(const FrameInputs& inputs, std::span<const glm::vec3> per_unit,
              std::shared_ptr<const Transport> transport, bool own, PlainLight& plain) {
    plain.transport = std::move(transport);
    const transport::Surfels& surfels = plain.transport->surface->surfels;
    const PassContext context = inputs.context();
    plain.light = {};
    plain.light.direct.assign(surfels.count, glm::vec4(0.0f));
    std::vector<float> found;
    for (std::size_t i = 0; i < inputs.lights.size(); ++i) {
        const Light& light = inputs.scene.lights[i];
        const LightGpu& gpu = *inputs.lights[i];
        const glm::vec3& weight = per_unit[i];
        if (weight == glm::vec3(0.0f)) continue;
        if (!own) light_surfels(context, light, gpu, *plain.transport, found);
        const std::vector<float>& per_candela = own ? gpu.surfel_direct : found;
        if (per_candela.size() < surfels.count) continue;
        for (std::size_t k = 0; k < surfels.count; ++k)
            plain.light.direct[k] += glm::vec4(weight * per_candela[k], 0.0f);
    }
    const transport::Irradiance& emitted = plain.transport->emitted;
    for (std::size_t k = 0; k < emitted.direct.size() && !inputs.scene.emission_hidden; ++k)
        plain.light.direct[k] += emitted.direct[k];
    transport::solve_to_the_end(surfels, plain.transport->links, plain.light, context.pool);
    const std::span<const float> passed = plain.transport->links.passed;
    transport::radiosity(surfels, passed, 1.0f - plain.light.narrow, plain.light.direct, plain.light.indirect,
                         plain.sent, context.pool);
    plain.mean_lx = 0.0;
    for (const glm::vec4& lux : plain.light.indirect)
        plain.mean_lx += trace::luminance(glm::dvec3(lux)) / static_cast<double>(surfels.count);
}

// Fills PlainLight::late of light that is solved: one bounce more tells what each surfel still lacks.
void find_late(PlainLight& plain, Pool& pool) {
    const transport::Surfels& surfels = plain.transport->surface->surfels;
    const float more = 1.0f / std::max(1.0f - plain.light.solved.rate, 1e-3f);
    transport::Bounces bounces(surfels, plain.transport->links, plain.light.direct, {}, {},
                               {transport::kAtRest.links, true, {}}, pool);
    std::vector<glm::vec4> lacks;
    bounces.bounce(plain.light.indirect, lacks);
    for (std::size_t k = 0; k < surfels.count; ++k) lacks[k] = more * glm::abs(lacks[k] - plain.light.indirect[k]);
    transport::radiosity(surfels, plain.transport->links.passed, 0.0f, plain.light.direct, lacks, plain.late, pool);
}

// How many surfaces light meets on the mean before it is absorbed, or leaves: `met` of it meets a further one.
double mean_legs(const transport::Surfels& surfels, double met) {
    double area_m2 = 0.0, going_on_m2 = 0.0;
    for (std::size_t i = 0; i < surfels.count; ++i) {
        const double m2 = static_cast<double>(surfels.area_m2[i]);
        area_m2 += m2;
        going_on_m2 += m2 * met * trace::luminance(glm::dvec3(surfels.albedo[i]));
    }
    return area_m2 > going_on_m2 ? area_m2 / (area_m2 - going_on_m2) : 1.0;
}

// The ends of a point's links at the finer surfels, and what those alone tell.
struct PointLinks {
    std::vector<transport::Fan> fans;
    std::vector<std::uint16_t> ids;  // kComparedLinks; the number of surfels: none
    std::vector<float> passed;       // what air that absorbs lets arrive; empty: it absorbs nothing
};
PointLinks links_of(const FrameInputs& inputs, const Transport& fine, const transport::Stand& at, Discrepancy& found) {
    const transport::Surfels& surfels = fine.surface->surfels;
    PointLinks links;
    links.ids.resize(kComparedLinks);
    trace::HitPacket hits;
    double met = 0.0, taken = 0.0, sends = 0.0, lost = 0.0;  // sends, lost: albedos
    const Haze haze = inputs.context().haze, absorption = absorption_of(haze);
    if (absorption) links.passed.resize(kComparedLinks);
    for (unsigned k = 0; k < kComparedLinks; k += trace::kPacket) {
        const transport::Fan& fan =
            links.fans.emplace_back(transport::make_fan(at.start, at.n, at.n, transport::fan_directions(1, k)));
        std::uint16_t* ids = links.ids.data() + k;
        unsigned walked = 0;
        const unsigned bits = transport::follow(fan, inputs.traced, surfels, *fine.surface->cells, hits, ids, &walked);
        for (int i = 0; i < trace::kPacket; ++i) {
            const bool meets = (bits >> i & 1u) != 0;
            const glm::vec3 end = fan.rays.at(i, meets ? hits.distance[i] : kSky_m);
            if (haze) taken += 1.0 - transmittance(haze, glm::dvec3(at.start), glm::dvec3(end));
            if (absorption)
                links.passed[k + static_cast<unsigned>(i)] =
                    static_cast<float>(transmittance(absorption, glm::dvec3(at.start), glm::dvec3(end)));
            if (!meets) continue;
            met += 1.0;
            if ((walked >> i & 1u) == 0) {
                sends += trace::luminance(glm::dvec3(surfels.albedo[ids[i]]));
            } else {
                trace::SurfaceHit hit;
                const bool front = glm::dot(fan.rays.along(i), hits.normal(i)) < 0.0f;
                if (inputs.traced.surface_at(static_cast<int>(hits.instance[i]), static_cast<int>(hits.triangle[i]),
                                             hits.u[i], hits.v[i], front, hit))
                    lost += trace::luminance(glm::dvec3(hit.albedo));
            }
        }
    }
    found.legs = mean_legs(surfels, met / kComparedLinks);
    found.missing = lost > 0.0 ? lost / (sends + lost) : 0.0;
    found.dimmed = taken / kComparedLinks;
    return links;
}

// What comes to a point by rays to crowded surfels; no link counts for those.
struct RaysTo {
    std::vector<transport::ToCrowded> rays;
    std::vector<bool> has;  // by surfel
    RaysTo(const Transport& transport, const trace::Geometry& geometry, const transport::Stand& at, float far)
        : rays(transport::rays_to_crowded(transport, geometry, at, far)), has(transport.surface->surfels.count, false) {
        for (const transport::ToCrowded& ray : rays) has[ray.surfel] = true;
    }
    double light_lx(std::span<const glm::vec4> sent) const {
        double sum = 0.0;
        for (const transport::ToCrowded& ray : rays)
            sum += static_cast<double>(ray.form_factor) * trace::luminance(glm::dvec3(sent[ray.surfel]));
        return sum;
    }
};

}  // namespace

Discrepancy discrepancy_of(const FrameInputs& inputs, const std::shared_ptr<const transport::Transport>& fine,
                           std::span<const glm::vec3> seeds, const transport::SurfelSettings& settings, bool waits,
                           CoarseLight& kept) {
    Discrepancy found;
    const transport::Surfels& surfels = fine->surface->surfels;
    if (surfels.count == 0) return found;
    if (kept.beside != fine->surface) {
        kept = {};
        kept.beside = fine->surface;
        kept.builder = std::make_unique<transport::Builder>(fine->surface->geometry,
                                                            std::vector<glm::vec3>(seeds.begin(), seeds.end()),
                                                            coarser(settings), kCoarseLinks, !waits, false);
    }
    const transport::Stand at(inputs.traced, inputs.traced.local(inputs.eye.position + inputs.eye.forward),
                              -inputs.eye.forward);
    const PointLinks links = links_of(inputs, *fine, at, found);
    if (waits) kept.builder->wait();
    const std::shared_ptr<const Transport> coarse = kept.builder->newest();
    if (!coarse || !kept.builder->done() || coarse->surface->surfels.count == 0) return found;
    // Where both are as few as there may be they say nothing of each other.
    if (2 * coarse->surface->surfels.count > surfels.count) return found;
    std::vector<glm::vec3> per_unit = weights_of(inputs);
    if (kept.scene_rev != inputs.scene.scene_rev || kept.per_unit != per_unit || kept.fine.transport != fine ||
        kept.made != coarse) {
        const PassContext context = inputs.context();
        light_up(inputs, per_unit, fine, true, kept.fine);
        find_late(kept.fine, context.pool);
        const Haze absorption = absorption_of(context.haze);
        kept.made = coarse;
        light_up(inputs, per_unit,
                 absorption ? std::make_shared<const Transport>(transport::in_air(*coarse, absorption, context.pool))
                            : coarse,
                 false, kept.coarse);
        kept.scene_rev = inputs.scene.scene_rev;
        kept.per_unit = std::move(per_unit);
    }
    found.known = true;
    found.scene_lx = kept.fine.mean_lx;
    const auto luminance_of = [](const glm::vec4& v) { return trace::luminance(glm::dvec3(v)); };
    // Crowded surfels lie twice as far apart in the coarser one.
    const RaysTo fine_rays(*fine, inputs.traced, at, transport::kFarSpacings),
        coarse_rays(*coarse, inputs.traced, at, 0.5f * transport::kFarSpacings);
    found.difference_lx = coarse_rays.light_lx(kept.coarse.sent) - fine_rays.light_lx(kept.fine.sent);
    found.late_lx = fine_rays.light_lx(kept.fine.late);
    found.late_share = static_cast<double>(kept.fine.light.solved.error);
    // By coarse surfel; all that rays find together, after the others.
    std::vector<double> patches(coarse->surface->surfels.count + 1, 0.0);
    patches.back() = found.difference_lx;
    trace::HitPacket hits;
    std::uint16_t coarse_ids[trace::kPacket];
    for (unsigned k = 0; k < kComparedLinks; k += trace::kPacket) {
        transport::follow(links.fans[k / trace::kPacket], inputs.traced, coarse->surface->surfels,
                          *coarse->surface->cells, hits, coarse_ids);
        for (unsigned i = 0; i < trace::kPacket; ++i) {
            const std::uint16_t id = links.ids[k + i], coarse_id = coarse_ids[i];
            if (id == surfels.count || coarse_id == coarse->surface->surfels.count) continue;
            const bool by_rays = fine_rays.has[id], coarse_by_rays = coarse_rays.has[coarse_id];
            const double off = ((coarse_by_rays ? 0.0 : luminance_of(kept.coarse.sent[coarse_id])) -
                                (by_rays ? 0.0 : luminance_of(kept.fine.sent[id]))) /
                               kComparedLinks;
            found.difference_lx += off;
            (by_rays || coarse_by_rays ? patches.back() : patches[coarse_id]) += off;
            if (const std::vector<float>& mean = fine->links.passed; !mean.empty() && !by_rays)
                found.absorbed_lx +=
                    (static_cast<double>(links.passed[k + i]) / std::max(static_cast<double>(mean[id]), 1e-30) - 1.0) *
                    luminance_of(kept.fine.sent[id]) / kComparedLinks;
            if (!by_rays) found.late_lx += luminance_of(kept.fine.late[id]) / kComparedLinks;
        }
    }
    found.difference_lx = std::abs(found.difference_lx);
    found.absorbed_lx = std::abs(found.absorbed_lx);
    found.patches_lx = std::sqrt(std::inner_product(patches.begin(), patches.end(), patches.begin(), 0.0));
    return found;
}

}  // namespace gonio
