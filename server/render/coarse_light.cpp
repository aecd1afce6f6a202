#include "server/render/coarse_light.h"

#include <algorithm>
#include <cmath>

#include "server/scene/apply.h"
#include "server/trace/sources.h"

namespace gonio {
namespace {

using transport::Transport;

constexpr std::size_t kFewer = 4;          // surfels of the finer transport for one of the coarser
constexpr unsigned kCoarseLinks = 256;     // of a surfel
constexpr unsigned kComparedLinks = 2048;  // of the point

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
    do {
        transport::solve(surfels, plain.transport->links, {}, {}, transport::kAtRest, plain.light, context.pool);
    } while (plain.light.resumes);
    transport::radiosity(surfels, 1.0f - plain.light.narrow, plain.light.direct, plain.light.indirect, plain.sent,
                         context.pool);
    plain.mean_lx = 0.0;
    for (const glm::vec4& lux : plain.light.indirect)
        plain.mean_lx += trace::luminance(glm::dvec3(lux)) / static_cast<double>(surfels.count);
}

}  // namespace

Discrepancy discrepancy_of(const FrameInputs& inputs, const std::shared_ptr<const transport::Transport>& fine,
                           std::span<const glm::vec3> seeds, const transport::SurfelSettings& settings, bool waits,
                           CoarseLight& kept) {
    Discrepancy found;
    if (fine->surface->surfels.count == 0) return found;
    if (kept.beside != fine->surface) {
        kept = {};
        kept.beside = fine->surface;
        kept.builder = std::make_unique<transport::Builder>(fine->surface->geometry,
                                                            std::vector<glm::vec3>(seeds.begin(), seeds.end()),
                                                            coarser(settings), kCoarseLinks, !waits, false);
    }
    if (waits) kept.builder->wait();
    const std::shared_ptr<const Transport> coarse = kept.builder->newest();
    if (!coarse || !kept.builder->done() || coarse->surface->surfels.count == 0) return found;
    std::vector<glm::vec3> per_unit = weights_of(inputs);
    if (kept.scene_rev != inputs.scene.scene_rev || kept.per_unit != per_unit || kept.fine.transport != fine ||
        kept.coarse.transport != coarse) {
        light_up(inputs, per_unit, fine, true, kept.fine);
        light_up(inputs, per_unit, coarse, false, kept.coarse);
        kept.scene_rev = inputs.scene.scene_rev;
        kept.per_unit = std::move(per_unit);
    }
    found.known = true;
    const glm::vec3 p = inputs.traced.local(inputs.eye.position + inputs.eye.forward), n = -inputs.eye.forward,
                    from = p + n * (4.0f * inputs.traced.step_off(p));
    const transport::Surfels& surfels = fine->surface->surfels;
    trace::HitPacket hits;
    std::uint16_t ids[trace::kPacket], coarse_ids[trace::kPacket];
    double met = 0.0, lost = 0.0, taken = 0.0;
    const Haze haze = inputs.context().haze;
    for (unsigned k = 0; k < kComparedLinks; k += trace::kPacket) {
        const transport::Fan fan = transport::make_fan(from, n, n, transport::fan_directions(1, k));
        const unsigned bits = transport::follow(fan, inputs.traced, surfels, *fine->surface->cells, hits, ids);
        transport::follow(fan, inputs.traced, coarse->surface->surfels, *coarse->surface->cells, hits, coarse_ids);
        for (int i = 0; i < trace::kPacket; ++i) {
            if ((bits >> i & 1u) == 0) continue;
            met += 1.0;
            if (ids[i] == surfels.count) lost += 1.0;
            if (haze)
                taken += 1.0 - transmittance(haze, glm::dvec3(from), glm::dvec3(fan.rays.at(i, hits.distance[i])));
            if (ids[i] == surfels.count || coarse_ids[i] == coarse->surface->surfels.count) continue;
            const auto luminance_of = [](const glm::vec4& v) { return trace::luminance(glm::dvec3(v)); };
            const double off = luminance_of(kept.coarse.sent[coarse_ids[i]]) - luminance_of(kept.fine.sent[ids[i]]);
            found.difference_lx += off / kComparedLinks;
            found.mean_difference_lx += std::abs(off) / kComparedLinks;
        }
    }
    found.difference_lx = std::abs(found.difference_lx);
    found.scene_lx = kept.fine.mean_lx;
    found.missing = met > 0.0 ? lost / met : 0.0;
    found.dimmed = met > 0.0 ? taken / met : 0.0;
    return found;
}

}  // namespace gonio
