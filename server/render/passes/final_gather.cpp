// Indirect light at the pixels of captures, and of the live picture while it rests (server/lighting/final_gather.h).
#include <algorithm>
#include <glm/gtc/packing.hpp>
#include <limits>

#include "server/lighting/surfel_light.h"
#include "server/render/passes/passes.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

constexpr auto kLivePasses = static_cast<unsigned>(std::size(lighting::kLivePasses));

bool there(const PassContext& context) {
    return context.has_surfels() && context.bounces != 0;
}

// Light that is gathered, and what for: a layer, or light without one.
struct Receiver {
    SlotRef gather;  // its light before
    const transport::Irradiance* irradiance;
    std::size_t light = 0;       // of a layer: its index
    Besides* besides = nullptr;  // else
    float unit = 1.0f;           // of `besides` in that of `irradiance`
};
// Luminaires first.
std::vector<Receiver> receivers(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light) {
    std::vector<Receiver> found;
    const std::uint32_t target = context.target.id;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const transport::Irradiance& irradiance = lights[i]->irradiance;
        if (context.layers[i] >= 0 && !irradiance.indirect.empty())
            found.push_back({{Slot::gather, target, context.scene.lights[i].id}, &irradiance, i});
    }
    const auto add = [&](SlotRef slot, const transport::Irradiance& irradiance, Besides& to, float unit) {
        if (to.unit_lx[1] > 0.0f && !irradiance.indirect.empty()) found.push_back({slot, &irradiance, 0, &to, unit});
    };
    add({Slot::emitted, target}, context.transport->emitted, light.emitted, light.emitted.unit_lx[1]);
    add({Slot::gather, target, kSummed}, light.summed_list.irradiance, light.summed, 1.0f);
    return found;
}

SlotRef refined(const Receiver& receiver) {
    return {Slot::refined, receiver.gather.target, receiver.gather.light};
}

// Result: how many passes it has had.
unsigned passes_of(const PassCache& pass_cache, const Receiver& receiver) {
    unsigned passes = kLivePasses;
    while (passes > 0 && !pass_cache.holds(refined(receiver), {pass_cache.version(receiver.gather), passes})) --passes;
    return passes;
}

unsigned fewest_passes(const PassCache& pass_cache, std::span<const Receiver> receivers) {
    unsigned least = kLivePasses;
    for (const Receiver& receiver : receivers) least = std::min(least, passes_of(pass_cache, receiver));
    return least;
}

// exact: links of a luminaire that end nearby take its direct light where they end, and of a narrow beam at rest VPLs
// bring what comes from further away.
lighting::GatherSource source_of(const PassContext& context, const Receiver& from, std::span<LightGpu* const> lights,
                                 bool exact, const Surfaces& surfaces, const lighting::GridWeights& weights) {
    const transport::Surfels& surfels = context.transport->surface->surfels;
    const transport::Irradiance& irradiance = *from.irradiance;
    lighting::GatherSource source;
    const float share = 1.0f - irradiance.narrow;
    std::vector<glm::vec4> sent;
    const std::span<const glm::vec4> none, indirect = context.bounces == 1 ? none : irradiance.indirect;
    transport::radiosity(surfels, context.transport->links.passed, share, irradiance.direct, indirect, sent,
                         context.pool);
    transport::make_table(sent, source.sent, context.pool);
    // Of what the air scatters, the part that `besides` has not.
    const auto add_haze = [&](float part) {
        if (irradiance.haze.empty() || !(part > 0.0f)) return;
        std::span<const glm::vec4> scattered = irradiance.haze;
        std::vector<glm::vec4> with_bodies;  // they have none of it
        if (shows_bodies(context)) scattered = with_bodies = context.bodies->sides().with_sides(scattered, {});
        const lighting::Planes haze = lighting::irradiance_at_grid(surfaces.grid, weights, scattered, context.pool);
        if (source.besides.empty()) source.besides.assign(haze.size(), std::vector<float>(haze[0].size(), 0.0f));
        for (std::size_t k = 0; k < haze.size(); ++k)
            for (std::size_t p = 0; p < haze[k].size(); ++p) source.besides[k][p] += part * haze[k][p];
    };
    const LightGpu* gpu = exact && from.besides == nullptr ? lights[from.light] : nullptr;
    const bool by_vpls = gpu != nullptr && irradiance.narrow > 0.0f && gpu->has_exact();
    if (irradiance.narrow > 0.0f) {  // few links would meet where it comes from
        std::span<const glm::vec4> first = by_vpls ? gpu->exact.by_vpls : irradiance.first;
        std::vector<glm::vec4> with_bodies;
        if (shows_bodies(context)) first = with_bodies = at_bodies(context, first, irradiance, false);
        source.besides = lighting::irradiance_at_grid(surfaces.grid, weights, first, context.pool);
        for (std::vector<float>& plane : source.besides) {
            for (float& value : plane) value *= irradiance.narrow;
        }
    }
    add_haze(by_vpls || !(irradiance.narrow > 0.0f) ? 1.0f : 1.0f - irradiance.narrow);
    if (gpu != nullptr) {
        source.direct = irradiance.direct;
        source.ends = {direct_light_of(context, context.scene.lights[from.light], *gpu), source.direct, share,
                       by_vpls ? irradiance.narrow : 0.0f};
    }
    return source;
}

// values × 1/unit -> 4 half floats a pixel.
void to_halves(std::span<const glm::vec4> values, float unit, std::uint16_t* to) {
    for (const glm::vec4& value : values) {
        for (int k = 0; k < 3; ++k) *to++ = glm::packHalf1x16(glm::clamp(value[k] / unit, 0.0f, 65504.0f));
        *to++ = glm::packHalf1x16(1.0f);
    }
}

void to_texture(const gl::Texture& array, int layer, const lighting::GBuffer& s, const std::vector<float>& rgba) {
    glTextureSubImage3D(array.id(), 0, 0, 0, layer, s.width, s.height, 1, GL_RGBA, GL_FLOAT, rgba.data());
}

}  // namespace

PassRun run_final_gather(const PassContext& context, std::span<LightGpu* const> lights, const Surfaces& surfaces,
                         const lighting::GridWeights& weights, PixelLight& light) {
    if (!there(context)) return {};
    const lighting::GBuffer& s = surfaces.gbuffer;
    const bool precise = context.target.kind == TargetKind::precise;
    const float greatest = precise ? std::numeric_limits<float>::max() : 65504.0f;  // that a layer holds
    lighting::FinalGather gather{precise ? lighting::kPrecisePass : lighting::kStillPass};
    const std::size_t width = s.width;
    const std::vector<Receiver> all = receivers(context, lights, light);
    std::vector<std::vector<float>> values(all.size());  // of layers
    for (std::size_t i = 0; i < all.size(); ++i) {
        gather.sources.push_back(
            source_of(context, all[i], lights, lights.size() <= lighting::kMostExactLights, surfaces, weights));
        if (all[i].besides == nullptr)
            values[i].assign(4 * width * s.height, 1.0f);
        else if (precise)
            all[i].besides->precise[1].assign(4 * s.depth.size(), 1.0f);
        else
            all[i].besides->pixels[1].resize(4 * s.depth.size());
    }
    const auto keep = [&](std::size_t source, int y, std::span<const glm::vec4> row) {
        const auto [besides, unit] = std::pair(all[source].besides, all[source].unit);
        const std::size_t at = 4 * s.row_length * static_cast<std::size_t>(y);
        if (besides != nullptr && !precise) return to_halves(row, unit, besides->pixels[1].data() + at);
        float* to = besides != nullptr ? besides->precise[1].data() + at : values[source].data() + 4 * width * y;
        for (std::size_t x = 0; x < width; ++x) {
            for (int k = 0; k < 3; ++k) to[4 * x + k] = glm::clamp(row[x][k] / unit, 0.0f, greatest);
        }
    };
    while (!lighting::continue_gather(s, surfaces.grid, *context.transport, gather, keep, context.pool)) {
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (all[i].besides == nullptr) to_texture(context.target.indirect, context.layers[all[i].light], s, values[i]);
    }
    return {};
}

unsigned final_gather_passes(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light) {
    return there(context) ? fewest_passes(context.pass_cache, receivers(context, lights, light)) : 0;
}

bool final_gather_left(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light) {
    return there(context) && final_gather_passes(context, lights, light) < kLivePasses;
}

bool continue_final_gather(const PassContext& context, std::span<LightGpu* const> lights, ScreenLight& screen,
                           const std::function<bool()>& interrupted) {
    if (!final_gather_left(context, lights, screen.light)) return false;
    Gathering& own = screen.gathering;
    PassCache& pass_cache = context.pass_cache;
    const Surfaces& surfaces = screen.surfaces;
    const lighting::GBuffer& s = surfaces.gbuffer;
    // Those that have had the fewest passes, from the same light as when it began.
    std::vector<Receiver> wanted = receivers(context, lights, screen.light);
    const unsigned passes = fewest_passes(pass_cache, wanted);
    std::erase_if(wanted, [&](const Receiver& one) { return passes_of(pass_cache, one) != passes; });
    std::vector<std::uint64_t> key = {passes};
    std::size_t luminaires = 0;
    for (const Receiver& one : wanted) {
        key.insert(key.end(), {one.gather.light, pass_cache.version(one.gather)});
        luminaires += one.besides == nullptr ? 1 : 0;
    }
    const SlotRef at_work{Slot::gathering, context.target.id};
    if (!own.work || !pass_cache.holds(at_work, key)) {
        pass_cache.hold(at_work, std::move(key));
        own = {std::make_unique<lighting::FinalGather>(), {}, {}};
        own.work->pass = lighting::kLivePasses[passes];
        own.pixels.assign(wanted.size(), std::vector<std::uint16_t>(4 * s.depth.size(), 0));
        for (const Receiver& one : wanted) {
            if (one.besides == nullptr) own.webs.push_back(lights[one.light]->web);
            own.work->sources.push_back(
                source_of(context, one, lights, luminaires <= lighting::kMostExactLights, surfaces, screen.weights));
        }
    }
    const auto keep = [&](std::size_t source, int y, std::span<const glm::vec4> row) {
        to_halves(row, wanted[source].unit, own.pixels[source].data() + 4 * s.row_length * y);
    };
    while (!lighting::continue_gather(s, surfaces.grid, *context.transport, *own.work, keep, context.pool)) {
        if (interrupted()) return false;
    }
    for (std::size_t k = 0; k < wanted.size(); ++k) {
        const Receiver& one = wanted[k];
        pass_cache.hold(refined(one), {pass_cache.version(one.gather), passes + 1});
        const int layer = one.besides == nullptr ? context.layers[one.light] : -1;
        if (one.besides != nullptr)
            one.besides->pixels[1] = std::move(own.pixels[k]);
        else if (context.layers_on_cpu)
            screen.light.layers.at(layer).gathered = std::move(own.pixels[k]);
        else
            upload(context.target.indirect, s, layer, GL_RGBA, GL_HALF_FLOAT, own.pixels[k].data());
    }
    own = {};
    return true;
}

}  // namespace gonio
