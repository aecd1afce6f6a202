// The indirect light of the default technique: direct light at surfels, every bounce among them, and from there to the
// target's points (server/transport, server/lighting/grid_light.h).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "server/lighting/screen.h"
#include "server/lighting/surfel_light.h"
#include "server/lighting/vpl_rays.h"
#include "server/render/passes/passes.h"
#include "server/scene/scene.h"
#include "server/trace/haze_path.h"

namespace gonio {
namespace {

using transport::Stand;
using transport::Transport;

constexpr unsigned kVplsAtRest = 1024;  // of the picture

const lighting::VplRays& rays_of(const Light& light, const LightGpu& gpu, unsigned count) {
    std::shared_ptr<const lighting::VplRays>& rays = gpu.web->rays;
    if (!rays || rays->rays.size() != count) rays = std::make_shared<const lighting::VplRays>(light.shining(), count);
    return *rays;
}

}  // namespace

void light_surfels(const PassContext& context, const Light& light, const LightGpu& gpu, const Transport& transport,
                   std::vector<float>& out) {
    const transport::Surfels& surfels = transport.surface->surfels;
    const lighting::DirectLight direct = direct_light_of(context, light, gpu);
    lighting::direct_at_surfels(surfels, context.traced, direct, out, context.pool);
    if (!light.sun && light.shining()->flux_lm > 0.0 && lighting::takes_flux(surfels, direct, out))
        lighting::take_flux(rays_of(light, gpu, kVplsAtRest), transport, direct, out, context.pool);
}

PassRun run_surfels(const PassContext& context, const Light& light, LightGpu& gpu) {
    gpu.surfel_direct.clear();
    gpu.exact = {};
    gpu.moves = true;
    if (context.has_surfels()) light_surfels(context, light, gpu, *context.transport, gpu.surfel_direct);
    return {};
}

namespace {

// One bounce after the other while it moves, all of them when it rests. What better links, or a better first bounce,
// find of light that rests comes into the live picture, where it is shown, over some frames.
void solve_light(const PassContext& context, const lighting::GridWeights& weights, bool moves, bool shown_now,
                 std::span<const glm::vec4> exact, transport::Irradiance& light) {
    constexpr unsigned kFadeFrames = 8;
    const Transport& transport = *context.transport;
    const transport::Links& links = transport.links;
    // Links, or an exact first bounce; and the quality level, whose change shows at once.
    const std::array<std::size_t, 2> with = {links.per_surfel() + 2 * links.reversed.size() + (exact.empty() ? 0 : 1),
                                             context.quality_level};
    const bool live = context.target.kind == TargetKind::live,
               fades = live && shown_now && !moves && light.with[1] == with[1];
    if (!fades || light.frames_left == 0 || light.with != with) {
        std::vector<glm::vec4> shown;
        if (fades && (light.converged || light.frames_left > 0)) shown = light.indirect;
        std::span<const std::uint8_t> seen;
        if (live && context.layers_on_cpu) seen = weights.seen;  // of this frame's camera
        transport::Accuracy accuracy = moves && live && !context.rests ? transport::kMoving : transport::kAtRest;
        accuracy.links = kQualityLevels[context.quality_level].links;
        if (moves || light.with != with) light.resumes = false;  // it is another light, or has other links
        do {
            transport::solve(transport.surface->surfels, links, exact, seen, accuracy, light, context.pool);
        } while (light.resumes && !live);  // captures and meters have no frame rate to keep
        light.with = with;
        light.frames_left = !shown.empty() && shown.size() == light.indirect.size() ? kFadeFrames : 0;
        if (light.frames_left > 0) light.becomes = std::exchange(light.indirect, std::move(shown));
    }
    if (light.frames_left > 0) {
        const float share = 1.0f / static_cast<float>(light.frames_left--);
        for (std::size_t i = 0; i < light.indirect.size(); ++i)
            light.indirect[i] += share * (light.becomes[i] - light.indirect[i]);
        light.converged = light.frames_left == 0 && !light.resumes;
    }
    if (light.frames_left == 0) light.becomes.clear();
}

}  // namespace

PassRun run_solve(const PassContext& context, LightGpu& gpu, const lighting::GridWeights& weights) {
    const bool moves = std::exchange(gpu.moves, false);
    if (!context.has_surfels() || gpu.surfel_direct.empty()) {
        gpu.irradiance = {};
        gpu.irradiance.converged = true;
        return {};
    }
    const std::size_t count = context.transport->surface->surfels.count;
    gpu.irradiance.direct.resize(count);
    context.pool.run_chunks(count, 4096, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i)
            gpu.irradiance.direct[i] = glm::vec4(glm::vec3(gpu.surfel_direct[i]), 0.0f);
    });
    gpu.irradiance.haze.clear();
    if (context.haze && gpu.surfel_haze.size() == count)
        for (const float lux : gpu.surfel_haze) gpu.irradiance.haze.emplace_back(glm::vec3(lux), 0.0f);
    solve_light(context, weights, moves, !context.merged,
                gpu.has_exact() ? std::span<const glm::vec4>(gpu.exact.first) : std::span<const glm::vec4>(),
                gpu.irradiance);
    return {};
}

PassRun run_solve_merged(const PassContext& context, Merged& merged, const lighting::GridWeights& weights) {
    const bool moves = std::exchange(merged.moves, false);
    if (!context.has_surfels() || merged.irradiance.direct.empty()) {
        merged.irradiance.indirect.clear();
        merged.irradiance.converged = true;
        return {};
    }
    solve_light(context, weights, moves, true, {}, merged.irradiance);
    return {};
}

PassRun run_gather_weights(const PassContext& context, const Surfaces& surfaces, lighting::GridWeights& weights) {
    if (!context.has_surfels()) {
        weights = {};
        return {};
    }
    const bool drawn_here = (context.layers_on_cpu || context.gathers) && !context.clusters.empty();
    std::optional<lighting::BodiesAround> bodies;
    if (context.bodies != nullptr) {
        context.bodies->find_sides(context.transport->surface, context.pool);
        bodies.emplace(context.bodies->posed(), context.bodies->sides());
    }
    lighting::find_surfels(surfaces.gbuffer, drawn_here ? &surfaces.raster : nullptr, context.material_table,
                           bodies ? &*bodies : nullptr, surfaces.grid, *context.transport, weights, context.pool);
    return {};
}

bool shows_bodies(const PassContext& context) {
    return context.bodies != nullptr && context.has_surfels() && !context.bodies->sides().empty();
}

std::vector<glm::vec4> at_bodies(const PassContext& context, std::span<const glm::vec4> surfels,
                                 const transport::Irradiance& light, bool bounced) {
    std::vector<glm::vec4> sent;
    if (!light.direct.empty())
        transport::radiosity(context.transport->surface->surfels, context.transport->links.passed, 1.0f, light.direct,
                             bounced ? std::span<const glm::vec4>(light.indirect) : std::span<const glm::vec4>(), sent,
                             context.pool);
    return context.bodies->sides().with_sides(surfels, sent);
}

bool first_bounce_left(const PassContext& context, const LightGpu& gpu) {
    return context.has_surfels() && gpu.irradiance.narrow > 0.0f &&
           gpu.exact.next < context.transport->surface->surfels.count;
}

namespace {

// Those of a sun, most of whose light falls outside: drawn among the surfels by the flux that each takes. Its parts are
// stratified each for itself.
std::vector<lighting::Vpl> sun_vpls(const PassContext& context, const LightGpu& gpu, unsigned count) {
    const transport::Surfels& surfels = context.transport->surface->surfels;
    std::vector<double> running = {0.0};  // sums of flux, for each lux of its multiplier × the layers' unit
    for (std::size_t i = 0; i < surfels.count; ++i)
        running.push_back(running.back() + static_cast<double>(gpu.irradiance.direct[i].g * surfels.area_m2[i]));
    if (!(running.back() > 0.0)) return {};
    const unsigned each = count / lighting::kSubsets;
    const double flux = running.back() / static_cast<double>(context.geometry.layer_unit_m2()) / count;
    std::vector<lighting::Vpl> vpls;
    for (unsigned k = 0; k < each * lighting::kSubsets; ++k) {
        const double at = (k % each + (k / each + 0.5) / lighting::kSubsets) / each * running.back();
        const auto above = std::upper_bound(running.begin() + 1, running.end() - 1, at);
        const auto i = static_cast<std::size_t>(above - running.begin() - 1);
        vpls.push_back(
            {surfels.position(i), surfels.normal(i), surfels.albedo[i] * static_cast<float>(flux / std::numbers::pi)});
    }
    return vpls;
}

std::vector<lighting::Vpl> cast_vpls(const PassContext& context, const Light& light, LightGpu& gpu, unsigned count) {
    if (light.sun) return sun_vpls(context, gpu, count);
    return lighting::cast(rays_of(light, gpu, count), context.traced, direct_light_of(context, light, gpu),
                          context.pool);
}

}  // namespace

bool continue_first_bounce(const PassContext& context, const Light& light, LightGpu& gpu,
                           const std::function<bool()>& interrupted) {
    constexpr std::size_t kPart = 2048, kChunk = 128;
    const transport::Surfels& surfels = context.transport->surface->surfels;
    if (gpu.exact.next == 0) {
        gpu.exact.vpls = cast_vpls(context, light, gpu, kVplsAtRest);
        gpu.exact.first.assign(surfels.count, glm::vec4(0.0f));
        gpu.exact.by_vpls = gpu.exact.first;
    }
    const transport::Links& links = context.transport->links;
    const auto sends = [&](std::size_t j, std::size_t i) {
        const float length_m = glm::distance(surfels.position(i), surfels.position(j));
        return links.passes(j) * surfels.albedo[j] *
               (gpu.irradiance.direct[j].g * (1.0f - lighting::vpl_share(length_m, surfels.radius_m)));
    };
    if (gpu.exact.next == 0 && links.crowded) {
        for (std::size_t n = 0; n < surfels.all_crowded.size(); ++n) {
            const std::size_t j = surfels.all_crowded[n].id;
            if (gpu.irradiance.direct[j].g > 0.0f)
                links.crowded->each(n, [&](std::size_t i, float form_factor) {
                    gpu.exact.first[i] += glm::vec4(form_factor * sends(j, i), 0.0f);
                });
        }
    }
    const auto nearby = [&](std::size_t i) {
        glm::vec3 sum(0.0f);
        for (const auto& set : links.sets) {
            for (unsigned k = 0; k < set->count; ++k) {
                const std::size_t j = set->ids[i * set->count + k];
                if (j != surfels.count && gpu.irradiance.direct[j].g > 0.0f && !surfels.crowded(j)) sum += sends(j, i);
            }
        }
        return sum / static_cast<float>(std::max(links.per_surfel(), 1u));
    };
    const float unit_m2 = context.geometry.layer_unit_m2();
    const Haze absorption = absorption_of(context.haze);
    while (gpu.exact.next < surfels.count) {
        if (interrupted()) return false;
        const std::size_t begin = gpu.exact.next, end = std::min(begin + kPart, surfels.count);
        context.pool.run_chunks(end - begin, kChunk, [&](std::size_t from, std::size_t count) {
            for (std::size_t i = begin + from; i < begin + from + count; ++i) {
                const glm::vec3 far =
                    lighting::from_vpls(context.traced, absorption, gpu.exact.vpls, surfels.position(i),
                                        surfels.normal(i), surfels.geometric[i], surfels.radius_m);
                gpu.exact.by_vpls[i] = glm::vec4(far * unit_m2, 0.0f);
                gpu.exact.first[i] += gpu.exact.by_vpls[i] + glm::vec4(nearby(i), 0.0f);
            }
        });
        gpu.exact.next = end;
    }
    return true;
}

namespace {

// Indirect irradiance at the grid's points.
lighting::Planes gathered(const PassContext& context, const Surfaces& surfaces, const lighting::GridWeights& weights,
                          const transport::Irradiance& light) {
    std::span<const glm::vec4> surfels;
    if (context.has_surfels() && !light.indirect.empty() && context.bounces != 0)
        surfels = context.bounces == 1 ? light.first : light.indirect;
    std::vector<glm::vec4> with_bodies;
    if (!surfels.empty() && shows_bodies(context))
        surfels = with_bodies = at_bodies(context, surfels, light, context.bounces != 1);
    return lighting::irradiance_at_grid(surfaces.grid, weights, surfels, context.pool);
}

}  // namespace

PassRun run_gather(const PassContext& context, const LightGpu& gpu, int layer, const Surfaces& surfaces,
                   const lighting::GridWeights& weights, Layers& layers) {
    const lighting::Planes planes = gathered(context, surfaces, weights, gpu.irradiance);
    lighting::LightLayer& own = layers.at(layer);
    own.gathered = {};
    if (context.layers_on_cpu) {
        for (std::size_t k = 0; k < 3; ++k) {
            own.indirect[k].resize(planes[k].size() / lighting::kSimdWidth * lighting::kSimdWidth);
            lighting::to_halves(planes[k].data(), own.indirect[k].size(), own.indirect[k].data());
        }
        return {};
    }
    std::vector<std::uint16_t>& halves = context.scratch.halves;
    lighting::upsample(surfaces.gbuffer, surfaces.grid, planes, halves, context.pool);
    upload(context.target.indirect, surfaces.gbuffer, layer, GL_RGBA, GL_HALF_FLOAT, halves.data());
    return {};
}

PassRun run_gather_emitted(const PassContext& context, const Surfaces& surfaces, const lighting::GridWeights& weights,
                           Besides& emitted) {
    const transport::Irradiance none, &light = context.has_surfels() ? context.transport->emitted : none;
    for (const int part : {0, 1}) {
        if (context.gathers) {  // run_besides does
            transport::Table table;
            transport::make_table(part != 0 ? light.indirect : light.direct, table, context.pool);
            emitted.unit_lx[part] = table.unit;
            emitted.pixels[part].clear();
            continue;
        }
        lighting::Planes planes;
        if (part != 0)
            planes = gathered(context, surfaces, weights, light);
        else if (shows_bodies(context) && !light.direct.empty())
            planes = lighting::irradiance_at_grid(surfaces.grid, weights,
                                                  context.bodies->sides().with_emitted(light.direct), context.pool);
        else
            planes = lighting::irradiance_at_grid(surfaces.grid, weights, light.direct, context.pool);
        float greatest = 0.0f;
        for (const auto& plane : planes) greatest = std::max(greatest, *std::max_element(plane.begin(), plane.end()));
        emitted.unit_lx[part] = greatest / 1000.0f;  // half floats hold the rest to 2^-24 of it
        if (!(greatest > 1e-30f)) continue;          // 1 / unit stays finite
        for (auto& plane : planes) {
            for (float& value : plane) value *= 1000.0f / greatest;
        }
        lighting::upsample(surfaces.gbuffer, surfaces.grid, planes, emitted.pixels[part], context.pool);
    }
    return {};
}

PassRun run_gather_merged(const PassContext& context, const Surfaces& surfaces, const lighting::GridWeights& weights,
                          Merged& merged, Besides* summed) {
    if (summed == nullptr) {
        merged.indirect = gathered(context, surfaces, weights, merged.irradiance);
        return {};
    }
    if (context.gathers)
        summed->pixels[1].clear();  // run_besides gathers it
    else
        lighting::upsample(surfaces.gbuffer, surfaces.grid, gathered(context, surfaces, weights, merged.irradiance),
                           summed->pixels[1], context.pool);
    summed->unit_lx[1] = merged.reference / context.geometry.layer_unit_m2();
    return {};
}

namespace {

constexpr unsigned kLinksPerPart = kMeterLinks / kMeterParts;

Stand stand_of(const PassContext& context) {
    const glm::dvec3 &eye = context.eye.position, &forward = context.eye.forward;
    return {context.traced, context.traced.local(eye + forward), -forward};
}

// Result: the surfels that a meter's links lead to, the same for all light, and the ends of those nearby. Air that
// absorbs takes from each link what its own length costs.
MeterLight& links_of(const Stand& point, const PassContext& context, MeterLight& links) {
    if (!links.ids.empty()) return links;
    const Transport::Surface& surface = *context.transport->surface;
    const transport::Surfels& surfels = surface.surfels;
    const Haze absorption = absorption_of(context.haze);
    const auto passes = [&](const glm::vec3& end) {
        return absorption ? static_cast<float>(transmittance(absorption, glm::dvec3(point.start), glm::dvec3(end)))
                          : 1.0f;
    };
    links.ids.resize(kMeterLinks);
    links.passed.assign(kMeterLinks, 1.0f);
    links.rays = transport::rays_to_crowded(*context.transport, context.traced, point);
    std::vector<bool> by_ray(surfels.count + 1, false);
    for (transport::ToCrowded& ray : links.rays) {
        by_ray[ray.surfel] = true;
        ray.form_factor *= passes(surfels.position(ray.surfel));
    }
    trace::HitPacket hits;
    for (unsigned k = 0; k < kMeterLinks; k += trace::kPacket) {
        const transport::Fan fan = transport::make_fan(point.start, point.n, point.n, transport::fan_directions(1, k));
        const unsigned met =
            transport::follow(fan, context.traced, surfels, *surface.cells, hits, links.ids.data() + k);
        for (int i = 0; i < trace::kPacket; ++i) {
            std::uint16_t& id = links.ids[k + static_cast<unsigned>(i)];
            if ((met >> i & 1u) == 0 || id == surfels.count) continue;
            float& passed = links.passed[k + static_cast<unsigned>(i)];
            passed = passes(fan.rays.at(i, hits.distance[i]));
            if (by_ray[id])
                id = static_cast<std::uint16_t>(surfels.count);
            else if (hits.distance[i] < lighting::kVplsAloneRadii * surfels.radius_m)
                links.ends.add(fan, hits, i, id, passed, k / kLinksPerPart);
        }
    }
    return links;
}

void set_mean(PointLight& light) {
    for (const glm::dvec3& part : light.parts) light.light += part / static_cast<double>(kMeterParts);
}

// light: at the surfels, × unit; its direct part × share, because VPLs have the rest. Result: the parts of what comes
// after bounces.
PointLight bounced_at(const Stand& point, const PassContext& context, const transport::Irradiance& light, float share,
                      double unit, MeterLight& meter) {
    const transport::Surfels& surfels = context.transport->surface->surfels;
    const std::vector<std::uint16_t>& ids = links_of(point, context, meter).ids;
    PointLight found;
    const auto sent = [&](std::uint16_t id, float direct) {
        glm::vec4 sum = light.direct[id] * direct;
        if (context.bounces != 1) sum += light.indirect[id];
        return glm::dvec3(surfels.albedo[id] * glm::vec3(sum)) * unit;
    };
    for (unsigned k = 0; k < kMeterLinks; ++k)
        if (ids[k] != surfels.count)
            found.parts[k / kLinksPerPart] +=
                sent(ids[k], share) * static_cast<double>(meter.passed[k] / kLinksPerPart);
    glm::dvec3 by_rays(0.0);
    for (const transport::ToCrowded& ray : meter.rays) {
        const float by_vpls = (1.0f - share) * lighting::vpl_share(ray.length_m, surfels.radius_m);
        by_rays += sent(ray.surfel, 1.0f - by_vpls) * static_cast<double>(ray.form_factor);
    }
    for (glm::dvec3& part : found.parts) part += by_rays;
    return found;
}

}  // namespace

PassRun run_gather_emitted_point(const PassContext& context, MeterLight& meter) {
    constexpr std::uint32_t kSamplesPerPart = 256;
    std::array<PointLight, 2>& found = meter.emitted;
    found = {};
    if (!context.has_surfels() || context.transport->emitted.direct.empty()) return {};
    const Transport& transport = *context.transport;
    const Stand point = stand_of(context);
    const trace::Receiver at{point.p, point.start, point.n, point.n};
    std::optional<trace::World> in_air;  // that absorbs
    if (const Haze absorption = absorption_of(context.haze)) {
        in_air = transport.surface->emitters;
        in_air->haze = absorption;
    }
    context.pool.run(static_cast<int>(kMeterParts), [&](int part) {
        glm::dvec3& sum = found[0].parts[part];
        for (std::uint32_t k = 0; k < kSamplesPerPart; ++k) {
            trace::Sample sample(part, k);
            sum += glm::dvec3((in_air ? trace::trace_path_in_haze(*in_air, at, 0, sample)
                                      : trace::trace_path(transport.surface->emitters, at, 0, sample))
                                  .direct);
        }
        sum /= static_cast<double>(kSamplesPerPart);
    });
    set_mean(found[0]);
    if (context.bounces != 0) found[1] = bounced_at(point, context, transport.emitted, 1.0f, 1.0, meter);
    set_mean(found[1]);
    return {};
}

PassRun run_gather_point_summed(const PassContext& context, const Merged& merged, MeterLight& meter) {
    meter.summed[1] = {};
    if (!context.has_surfels() || merged.irradiance.indirect.empty() || context.bounces == 0) return {};
    const float unit_lx = merged.reference / context.geometry.layer_unit_m2();
    meter.summed[1] = bounced_at(stand_of(context), context, merged.irradiance, 1.0f,
                                 static_cast<double>(unit_lx) * context.scene.master_ratio, meter);
    set_mean(meter.summed[1]);
    return {};
}

PassRun run_gather_point(const PassContext& context, const Light& light, LightGpu& gpu, int layer, MeterLight& meter) {
    constexpr unsigned kVpls = 4096;
    static_assert(kLinksPerPart % trace::kPacket == 0 && lighting::kSubsets == kMeterParts);
    meter.layers.resize(context.scene.lights.size());
    PointLight& found = meter.layers[layer];
    found = {};
    if (!context.has_surfels() || gpu.irradiance.indirect.empty() || context.bounces == 0) return {};
    const transport::Surfels& surfels = context.transport->surface->surfels;
    const Stand point = stand_of(context);
    // Light that is all on few surfels, which few links meet, comes from VPLs.
    const float narrow = gpu.irradiance.narrow;
    constexpr double kLink = 1.0 / static_cast<double>(kLinksPerPart);
    found = bounced_at(point, context, gpu.irradiance, 1.0f - narrow, 1.0, meter);
    const double scattered = haze_at_point(context, light, gpu);
    meter.ends.each(*context.transport->surface,
                    {direct_light_of(context, light, gpu), gpu.irradiance.direct, 1.0f - narrow, narrow},
                    [&](std::uint32_t part, const glm::vec3& sent) { found.parts[part] += glm::dvec3(sent) * kLink; });
    const double unit_m2 = static_cast<double>(context.geometry.layer_unit_m2());
    for (glm::dvec3& part : found.parts) part = part / unit_m2 + scattered;
    if (narrow > 0.0f) {
        const std::vector<lighting::Vpl> vpls = cast_vpls(context, light, gpu, kVpls);
        const std::size_t each = vpls.size() / kMeterParts;
        for (std::size_t i = 0; i < kMeterParts; ++i) {
            found.parts[i] += glm::dvec3(lighting::from_vpls(context.traced, absorption_of(context.haze),
                                                             std::span(vpls).subspan(i * each, each), point.p, point.n,
                                                             point.n, surfels.radius_m)) *
                              static_cast<double>(narrow * static_cast<float>(kMeterParts));
        }
    }
    set_mean(found);
    return {};
}

}  // namespace gonio
