// Haze: what it scatters of luminaires' light and of that of surfaces, onto surfels and towards the eye.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/gtc/packing.hpp>

#include "server/lighting/air_picture.h"
#include "server/lighting/glow.h"
#include "server/lighting/haze_light.h"
#include "server/lighting/kernels.h"
#include "server/render/passes/passes.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

constexpr int kMapSide = 176;  // texels of DistanceMap
constexpr unsigned kLiveSamples = 7, kStillSamples = 64;

lighting::AirlightSource source_of(const PassContext& context, const Light& light, const LightGpu& gpu) {
    return {direct_light_of(context, light, gpu), &gpu.distances, gpu.web->tables->core_cos};
}

// The same as surfaces receive it. What is scattered again on its way to them is neither taken from it nor added, as
// between surfaces: in even light the two are the same. Only what the air absorbs is lost.
lighting::AirlightSource source_onto_surfaces(const PassContext& context, const Light& light, const LightGpu& gpu) {
    lighting::AirlightSource source = source_of(context, light, gpu);
    source.beyond_ratio = 1.0f - source.light.air.albedo;
    source.least_m = 1e-6f;  // rays are spread over the angle about the luminaire, and its 1/h is no peak
    return source;
}

// How far rays go that meet nothing, m.
float beyond(const PassContext& context) {
    return std::max(1e4f, 10.0f * context.traced.extent());
}

// Along the view's rays and near the luminaire, cd/m² per candela of peak × the layers' unit.
void beam_of(const PassContext& context, const Light& light, const LightGpu& gpu, const Surfaces& surfaces,
             const lighting::AirView& view, lighting::Beam& out) {
    if (light.sun) {
        out.near = {};
        out.rays.assign(view.rays.size(), 0.0f);
        return;
    }
    const unsigned samples = context.target.kind == TargetKind::live ? kLiveSamples : kStillSamples;
    lighting::beam_of(surfaces.gbuffer, view, source_of(context, light, gpu), samples, out, context.pool);
}

}  // namespace

PassRun run_distances(const PassContext& context, const Light& light, LightGpu& gpu) {
    gpu.distances = {};
    if (!light.sun)
        lighting::trace_distances(direct_light_of(context, light, gpu), context.traced, kMapSide, gpu.distances,
                                  context.pool);
    return {};
}

PassRun run_haze_points(const PassContext& context, lighting::HazePoints& points) {
    points = context.has_surfels() ? lighting::haze_points(context.transport->surface->surfels, context.pool)
                                   : lighting::HazePoints();
    return {};
}

PassRun run_haze_surfels(const PassContext& context, const Light& light, LightGpu& gpu) {
    gpu.surfel_haze.clear();
    gpu.moves = true;
    if (!context.has_surfels() || light.sun) return {};
    lighting::haze_at_surfels(context.transport->surface->surfels, *context.haze_points, context.traced,
                              source_onto_surfaces(context, light, gpu), beyond(context), gpu.surfel_haze,
                              context.pool);
    return {};
}

double haze_at_point(const PassContext& context, const Light& light, const LightGpu& gpu) {
    if (light.sun || !context.haze) return 0.0;
    const glm::vec3 p = context.traced.local(context.eye.position + context.eye.forward), n(-context.eye.forward),
                    start = p + n * (4.0f * context.traced.step_off(p));
    const float found = lighting::haze_at_point(p, n, start, context.traced, source_onto_surfaces(context, light, gpu),
                                                beyond(context), context.pool);
    return static_cast<double>(found / context.geometry.layer_unit_m2());
}

lighting::AirBox air_box_of(const PassContext& context) {
    return lighting::air_box(context.traced, context.traced.local(context.eye.position));
}

PassRun run_probes(const PassContext& context, lighting::Probes& probes) {
    probes = context.has_surfels()
                 ? lighting::make_probes(*context.transport->surface, air_box_of(context), context.pool)
                 : lighting::Probes();
    return {};
}

PassRun run_air_view(const PassContext& context, const Surfaces& surfaces, lighting::AirView& view) {
    const bool live = context.target.kind == TargetKind::live;
    lighting::look_into_air(surfaces.gbuffer, live ? lighting::kStep : 1, beyond(context), view, context.pool);
    return {};
}

PassRun run_seen_probes(const PassContext& context, std::vector<std::uint8_t>& seen) {
    seen = lighting::seen_probes(*context.probes, context.traced, context.traced.local(context.eye.position),
                                 context.pool);
    return {};
}

PassRun run_airlight(const PassContext& context, const Light& light, const LightGpu& gpu, const Surfaces& surfaces,
                     const lighting::AirView& view, lighting::Beam& out) {
    beam_of(context, light, gpu, surfaces, view, out);
    return {};
}

PassRun run_airlight_summed(const PassContext& context, std::span<const LightGpu* const> lights,
                            const Surfaces& surfaces, ScreenAir& air) {
    air.summed_beams.assign(3, std::vector<float>(air.view.rays.size(), 0.0f));
    air.summed_near.clear();
    lighting::Beam own;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Light& light = context.scene.lights[i];
        const glm::vec3 weight(
            context.weight_in_sum(light, context.layers[i]) *
            (peak_of(context, light, *lights[i]) / static_cast<double>(context.geometry.layer_unit_m2())));
        if (weight == glm::vec3(0.0f)) continue;
        beam_of(context, light, *lights[i], surfaces, air.view, own);
        for (std::size_t k = 0; k < 3; ++k)
            lighting::add_scaled(own.rays.data(), weight[static_cast<int>(k)], own.rays.size(),
                                 air.summed_beams[k].data());
        if (own.near.width > 0) air.summed_near.push_back({std::move(own.near), weight});
    }
    return {};
}

PassRun run_glow(const PassContext& context, const lighting::Probes& probes, const transport::Irradiance& light,
                 bool emission, lighting::Glow& out) {
    out.clear();
    if (!context.has_surfels() || light.direct.empty() || context.bounces == 0) return {};
    static thread_local std::vector<glm::vec4> sent;  // this thread's, in jobs too
    transport::radiosity(context.transport->surface->surfels, {}, 1.0f, light.direct, light.indirect, sent,
                         context.pool);
    lighting::glow_of(probes, sent, emission, context.traced.local(context.eye.position),
                      static_cast<float>(context.haze.g), out, context.pool);
    return {};
}

namespace {

// What is added up, and its weight: values by ray, of one channel or of three, what is near luminaires, and glow.
struct Term {
    const std::vector<float>* planes[3];
    glm::vec3 weight;
};
struct GlowTerm {
    const lighting::Glow* glow;
    glm::vec3 weight;
};
struct Terms {
    std::vector<Term> rays;
    std::vector<lighting::AirLight::Near> near;
    std::vector<GlowTerm> glow;

    void add(const lighting::Beam& beam, const glm::vec3& weight) {
        if (weight == glm::vec3(0.0f)) return;
        rays.push_back({{&beam.rays, &beam.rays, &beam.rays}, weight});
        near.push_back({&beam.near, weight});
    }
    void add(const lighting::Planes& planes, const glm::vec3& weight) {
        if (weight != glm::vec3(0.0f) && planes.size() == 3)
            rays.push_back({{&planes[0], &planes[1], &planes[2]}, weight});
    }
    void add(const lighting::Glow& added, const glm::vec3& weight) {
        if (weight != glm::vec3(0.0f) && !added.empty()) glow.push_back({&added, weight});
    }
};

// Result: what adds up to a picture's haze; key: what it depends on. glow: of surfaces too.
Terms terms_of(const PassContext& context, std::span<const LightGpu* const> lights, const PixelLight& light,
               const ScreenAir& air, bool glow, std::vector<std::uint64_t>& key) {
    const std::uint32_t target = context.target.id;
    const auto version = [&](Slot slot, std::uint32_t id) { return context.pass_cache.version({slot, target, id}); };
    const float per_unit = 1.0f / context.geometry.layer_unit_m2(),
                master = static_cast<float>(context.scene.master_ratio);
    key = {version(Slot::air_view, 0),
           version(Slot::airlight, kSummed),
           version(Slot::glow, kSummed),
           version(Slot::glow, kEmitted),
           std::bit_cast<std::uint32_t>(master),
           context.scene.haze_rev,
           context.merged ? version(Slot::glow, 0) : 0};
    Terms terms;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Light& own = context.scene.lights[i];
        if (context.layers[i] < 0) continue;
        const auto layer = static_cast<std::size_t>(context.layers[i]);
        const glm::vec3 weight(context.layer_weight(own) *
                               (peak_of(context, own, *lights[i]) * static_cast<double>(per_unit)));
        key.insert(key.end(), {own.id, version(Slot::airlight, own.id),
                               context.merged ? 0 : version(Slot::glow, own.id), std::bit_cast<std::uint32_t>(weight.x),
                               std::bit_cast<std::uint32_t>(weight.y), std::bit_cast<std::uint32_t>(weight.z)});
        terms.add(air.beams[layer], weight);
        if (glow && !context.merged) terms.add(air.glow[layer], weight);
    }
    const bool summed = version(Slot::airlight, kSummed) > 0;
    if (summed) {
        terms.add(air.summed_beams, glm::vec3(master));
        for (const auto& [near, weight] : air.summed_near) terms.near.push_back({&near, master * weight});
    }
    if (!glow) return terms;
    if (context.merged) terms.add(air.merged_glow, glm::vec3(light.merged.reference * per_unit));
    if (summed) terms.add(air.summed_glow, glm::vec3(light.summed_list.reference * per_unit * master));
    if (version(Slot::glow, kEmitted) > 0 && !context.scene.emission_hidden)
        terms.add(air.emitted_glow, glm::vec3(1.0f));
    return terms;
}

// Result: what the rays of the view collect; it stands until this thread asks again.
const lighting::Planes& sum_of(const PassContext& context, const Terms& terms, const ScreenAir& view) {
    const lighting::AirRays& rays = view.view.rays;
    static thread_local lighting::Planes kept(3);
    static thread_local lighting::Glow kept_glow;
    lighting::Planes& sum = kept;  // this thread's, in jobs too
    lighting::Glow& glow = kept_glow;
    for (std::vector<float>& plane : sum) plane.resize(rays.size());
    glow.assign(terms.glow.empty() ? 0 : context.probes->size(), glm::vec3(0.0f));
    for (const auto& [own, weight] : terms.glow)
        for (std::size_t i = 0; i < std::min(own->size(), glow.size()); ++i) glow[i] += weight * (*own)[i];
    if (!glow.empty()) lighting::hide_unseen(*context.probes, view.seen_probes, glow);
    const lighting::PackedGlow packed = lighting::pack_glow(glow);
    const lighting::Air air = lighting::air_of(context.haze);
    constexpr std::size_t kChunk = 64 * lighting::kSimdWidth;
    context.pool.run_chunks(rays.size(), kChunk, [&](std::size_t first, std::size_t size) {
        float* const rgb[3] = {sum[0].data(), sum[1].data(), sum[2].data()};
        for (std::size_t k = 0; k < 3; ++k) {
            std::fill_n(rgb[k] + first, size, 0.0f);
            for (const Term& term : terms.rays) {
                if (term.planes[k]->size() < rays.size()) continue;
                lighting::add_scaled(term.planes[k]->data() + first, term.weight[static_cast<int>(k)], size,
                                     rgb[k] + first);
            }
        }
        if (!glow.empty()) lighting::add_glow(*context.probes, packed, air, rays, first, size, rgb);
        for (float* const plane : rgb)
            for (std::size_t i = first; i < first + size; ++i) plane[i] = std::max(plane[i], 0.0f);
    });
    return sum;
}

}  // namespace

const lighting::AirPicture* air_picture(const PassContext& context, View view, std::span<const LightGpu* const> lights,
                                        const Surfaces& surfaces, const PixelLight& light, ScreenAir& air) {
    if (!context.haze || !shows_air(view) || surfaces.gbuffer.depth.empty()) return nullptr;
    std::vector<std::uint64_t> key;
    const Terms terms = terms_of(context, lights, light, air, true, key);
    const SlotRef made{Slot::air_picture, context.target.id};
    if (context.pass_cache.holds(made, key)) return &air.picture;
    const std::array<std::uint64_t, 2> passes_of{key[0], context.scene.haze_rev};
    context.pass_cache.hold(made, std::move(key));
    lighting::show_air(surfaces.gbuffer, lighting::air_of(context.haze), air.view,
                       {sum_of(context, terms, air), terms.near}, passes_of, air.picture, context.pool);
    return &air.picture;
}

std::vector<glm::vec3> shown_beams(const PassContext& context, std::span<const LightGpu* const> lights,
                                   const Surfaces& surfaces, const PixelLight& light, const ScreenAir& air) {
    const lighting::GBuffer& s = surfaces.gbuffer;
    std::vector<glm::vec3> beams(std::size_t{1} * s.width * s.height, glm::vec3(0.0f));
    if (!context.haze || s.depth.empty()) return beams;
    std::vector<std::uint64_t> key;
    const Terms terms = terms_of(context, lights, light, air, false, key);
    lighting::AirPicture picture;
    lighting::show_air(s, lighting::air_of(context.haze), air.view, {sum_of(context, terms, air), terms.near}, {},
                       picture, context.pool);
    const auto rows = static_cast<std::size_t>(s.height), columns = static_cast<std::size_t>(s.width);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x)
            for (std::size_t k = 0; k < 3; ++k)
                beams[y * columns + x][static_cast<int>(k)] =
                    picture.unit * glm::unpackHalf1x16(picture.halves[4 * (y * s.row_length + x) + k]);
    return beams;
}

}  // namespace gonio
