// Indirect light at the pixels of captures, and of the live picture while it rests (server/lighting/final_gather.h).
#include <algorithm>
#include <glm/gtc/packing.hpp>
#include <limits>

#include "server/lighting/surfel_light.h"
#include "server/render/passes/passes.h"

namespace gonio {
namespace {

constexpr auto kLivePasses = static_cast<unsigned>(std::size(lighting::kLivePasses));

bool there(const PassContext& context) {
    return context.transport != nullptr && context.transport->surface->surfels.count > 0 && context.bounces != 0;
}

// Light without a layer, and where it comes from.
struct Whole {
    Besides* shown;
    const transport::Irradiance* irradiance;
    float unit;  // of `shown` in that of `irradiance`
};
std::vector<Whole> wholes(const PassContext& context, PixelLight& light) {
    std::vector<Whole> found;
    const auto add = [&](Besides& shown, const transport::Irradiance& irradiance, float unit) {
        if (shown.unit_lx[1] > 0.0f && !irradiance.indirect.empty()) found.push_back({&shown, &irradiance, unit});
    };
    add(light.emitted, context.transport->emitted, light.emitted.unit_lx[1]);
    add(light.summed, light.summed_list.irradiance, 1.0f);
    return found;
}

// light: of a luminaire whose links that end nearby take its direct light where they end, and from which, if it is a
// narrow beam at rest, VPLs bring what comes from further away; else null, with gpu.
lighting::GatherSource source_of(const PassContext& context, const Light* light, const LightGpu* gpu,
                                 const transport::Irradiance& irradiance, const Surfaces& surfaces,
                                 const lighting::GridWeights& weights) {
    const transport::Surfels& surfels = context.transport->surface->surfels;
    lighting::GatherSource source;
    const float share = 1.0f - irradiance.narrow;
    std::vector<glm::vec4> sent;
    const std::span<const glm::vec4> none, indirect = context.bounces == 1 ? none : irradiance.indirect;
    transport::radiosity(surfels, share, irradiance.direct, indirect, sent, context.pool);
    transport::make_table(sent, source.sent, context.pool);
    const bool by_vpls = light != nullptr && irradiance.narrow > 0.0f && gpu->has_exact();
    if (irradiance.narrow > 0.0f) {  // few links would meet where it comes from
        source.besides = lighting::irradiance_at_grid(surfaces.grid, weights,
                                                      by_vpls ? gpu->exact.by_vpls : irradiance.first, context.pool);
        for (std::vector<float>& plane : source.besides) {
            for (float& value : plane) value *= irradiance.narrow;
        }
    }
    if (light != nullptr) {
        source.direct = irradiance.direct;
        source.ends = {direct_light_of(context, *light, *gpu), source.direct, share,
                       by_vpls ? irradiance.narrow : 0.0f};
    }
    return source;
}

// Result: whether a light has a layer and light in it.
bool layered(const PassContext& context, std::span<LightGpu* const> lights, std::size_t i) {
    return context.layers[i] >= 0 && !lights[i]->irradiance.indirect.empty();
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
    const bool exact = lights.size() <= lighting::kMostExactLights;
    const bool precise = context.target.kind == TargetKind::precise;
    const float greatest = precise ? std::numeric_limits<float>::max() : 65504.0f;  // that a layer holds
    lighting::FinalGather gather{precise ? lighting::kPrecisePass : lighting::kStillPass};
    std::vector<int> layers;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!layered(context, lights, i)) continue;
        gather.sources.push_back(source_of(context, exact ? &context.scene.lights[i] : nullptr, lights[i],
                                           lights[i]->irradiance, surfaces, weights));
        layers.push_back(context.layers[i]);
    }
    const std::vector<Whole> besides = wholes(context, light);
    for (const Whole& whole : besides) {
        gather.sources.push_back(source_of(context, nullptr, nullptr, *whole.irradiance, surfaces, weights));
        whole.shown->pixels[1].resize(4 * s.depth.size());
    }
    const auto width = static_cast<std::size_t>(s.width);
    std::vector<std::vector<float>> values(layers.size(),
                                           std::vector<float>(4 * width * static_cast<std::size_t>(s.height), 1.0f));
    const auto keep = [&](std::size_t source, int y, std::span<const glm::vec4> row) {
        if (source >= layers.size()) {
            const Whole& whole = besides[source - layers.size()];
            to_halves(row, whole.unit, whole.shown->pixels[1].data() + 4 * s.row_length * static_cast<std::size_t>(y));
            return;
        }
        float* to = values[source].data() + 4 * width * static_cast<std::size_t>(y);
        for (std::size_t x = 0; x < width; ++x) {
            for (int k = 0; k < 3; ++k) to[4 * x + static_cast<std::size_t>(k)] = glm::clamp(row[x][k], 0.0f, greatest);
        }
    };
    while (!lighting::continue_gather(s, surfaces.grid, *context.transport, gather, keep, context.pool)) {
    }
    for (std::size_t i = 0; i < layers.size(); ++i) to_texture(context.target.indirect, layers[i], s, values[i]);
    return {};
}

unsigned final_gather_passes(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light) {
    if (!there(context)) return 0;
    unsigned least = kLivePasses;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (layered(context, lights, i)) least = std::min(least, light.layers.at(context.layers[i]).passes);
    }
    for (const Whole& whole : wholes(context, light)) least = std::min(least, whole.shown->passes);
    return least;
}

bool final_gather_left(const PassContext& context, std::span<LightGpu* const> lights, PixelLight& light) {
    return there(context) && final_gather_passes(context, lights, light) < kLivePasses;
}

bool continue_final_gather(const PassContext& context, std::span<LightGpu* const> lights, ScreenLight& screen,
                           const std::function<bool()>& interrupted) {
    PixelLight& light = screen.light;
    if (!final_gather_left(context, lights, light)) return false;
    Gathering& own = screen.gathering;
    const Surfaces& surfaces = screen.surfaces;
    const lighting::GBuffer& s = surfaces.gbuffer;
    const unsigned passes = final_gather_passes(context, lights, light);
    // Those that have had the fewest passes, from the same light as when it began.
    const std::vector<Whole> besides = wholes(context, light);
    std::vector<std::pair<std::size_t, std::uint64_t>> wanted;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!layered(context, lights, i)) continue;
        const lighting::LightLayer& layer = light.layers.at(context.layers[i]);
        if (layer.passes == passes) wanted.emplace_back(i, layer.version);
    }
    const std::size_t luminaires = wanted.size();
    for (std::size_t k = 0; k < besides.size(); ++k) {
        if (besides[k].shown->passes == passes) wanted.emplace_back(lights.size() + k, besides[k].shown->version);
    }
    if (!own.work || own.wanted != wanted) {
        own.work = std::make_unique<lighting::FinalGather>();
        own.work->pass = lighting::kLivePasses[passes];
        own.wanted = wanted;
        own.webs.clear();
        own.pixels.assign(wanted.size(), std::vector<std::uint16_t>(4 * s.depth.size(), 0));
        const bool exact = luminaires <= lighting::kMostExactLights;
        for (std::size_t k = 0; k < wanted.size(); ++k) {
            const std::size_t i = wanted[k].first;
            const bool whole = k >= luminaires;
            if (!whole) own.webs.push_back(lights[i]->web);
            own.work->sources.push_back(source_of(
                context, !whole && exact ? &context.scene.lights[i] : nullptr, whole ? nullptr : lights[i],
                whole ? *besides[i - lights.size()].irradiance : lights[i]->irradiance, surfaces, screen.weights));
        }
    }
    const auto keep = [&](std::size_t source, int y, std::span<const glm::vec4> row) {
        const float unit = source < luminaires ? 1.0f : besides[wanted[source].first - lights.size()].unit;
        to_halves(row, unit, own.pixels[source].data() + 4 * s.row_length * static_cast<std::size_t>(y));
    };
    while (!lighting::continue_gather(s, surfaces.grid, *context.transport, *own.work, keep, context.pool)) {
        if (interrupted()) return false;
    }
    for (std::size_t k = 0; k < wanted.size(); ++k) {
        std::vector<std::uint16_t>& pixels = own.pixels[k];
        if (k >= luminaires) {
            Besides& shown = *besides[wanted[k].first - lights.size()].shown;
            shown.passes = passes + 1;
            shown.pixels[1] = std::move(pixels);
            continue;
        }
        const int index = context.layers[wanted[k].first];
        lighting::LightLayer& layer = light.layers.at(index);
        layer.passes = passes + 1;
        layer.version = ++light.layers.writes;
        if (context.layers_on_cpu)
            layer.gathered = std::move(pixels);
        else
            upload(context.target.indirect, s, index, GL_RGBA, GL_HALF_FLOAT, pixels.data());
    }
    own = {.completed = own.completed + 1};
    return true;
}

}  // namespace gonio
