// Indirect light at the pixels of captures, and of the live picture while it rests (server/shade/final_gather.h).
#include <algorithm>
#include <glm/gtc/packing.hpp>
#include <limits>

#include "server/render/passes/passes.h"
#include "server/render/passes/screen_light.h"
#include "server/shade/surfel_light.h"

namespace gonio {
namespace {

constexpr auto kLivePasses = static_cast<unsigned>(std::size(shade::kLivePasses));

bool there(const PassContext& context) {
    return context.transport != nullptr && context.transport->surface->surfels.count > 0 && context.bounces != 0;
}

bool emits(const PassContext& context) {
    return context.target.emissive && !context.transport->emitted.indirect.empty() &&
           context.target.screen->emitted_unit_lx[1] > 0.0f;
}

// light: null: emissive surfaces. exact: links that end nearby take its direct light where they end.
shade::GatherSource source_of(const PassContext& context, const Light* light, const LightGpu* gpu,
                              const transport::Irradiance& irradiance, bool exact) {
    const ScreenLight& screen = *context.target.screen;
    const transport::Surfels& surfels = context.transport->surface->surfels;
    const bool one = context.bounces == 1;
    shade::GatherSource source;
    source.share = 1.0f - irradiance.narrow;
    std::vector<glm::vec4> lit = irradiance.direct, sent;
    for (glm::vec4& value : lit) value *= source.share;
    transport::radiosity(surfels, lit, one ? std::span<const glm::vec4>() : irradiance.indirect, sent, context.pool);
    transport::make_table(sent, source.sent, context.pool);
    if (irradiance.narrow > 0.0f) {  // few links would meet where it comes from
        source.besides = shade::irradiance_at_grid(screen.grid, screen.weights, irradiance.first, context.pool);
        for (std::vector<float>& plane : source.besides) {
            for (float& value : plane) value *= irradiance.narrow;
        }
    }
    if (light != nullptr && exact) {
        source.light = {context.traced.local(light->position), light_from_world(*light),
                        shade::web_of(gpu->web->words.data()), context.geometry.layer_unit_m2()};
        source.direct = irradiance.direct;
    }
    return source;
}

bool lit(const LightGpu& gpu) {
    return !gpu.irradiance.indirect.empty();
}

void to_texture(const gl::Texture& array, int layer, const shade::Surfaces& s, const std::vector<float>& rgba) {
    glTextureSubImage3D(array.id(), 0, 0, 0, layer, s.width, s.height, 1, GL_RGBA, GL_FLOAT, rgba.data());
}

}  // namespace

PassRun run_final_gather(const PassContext& context, std::span<LightGpu* const> lights) {
    if (!there(context)) return {};
    ScreenLight& screen = *context.target.screen;
    const shade::Surfaces& s = screen.surfaces;
    const bool precise = context.target.kind == TargetKind::precise;
    const float greatest = precise ? std::numeric_limits<float>::max() : 65504.0f;  // that a layer holds
    shade::FinalGather gather{precise ? shade::kPrecisePass : shade::kStillPass};
    std::vector<int> layers;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lit(*lights[i])) continue;
        gather.sources.push_back(source_of(context, &context.scene.lights[i], lights[i], lights[i]->irradiance,
                                           lights.size() <= shade::kMostExactLights));
        layers.push_back(static_cast<int>(i));
    }
    const std::size_t luminaires = layers.size();
    if (emits(context))
        gather.sources.push_back(source_of(context, nullptr, nullptr, context.transport->emitted, false));
    const auto width = static_cast<std::size_t>(s.width);
    std::vector<std::vector<float>> values(gather.sources.size(),
                                           std::vector<float>(4 * width * static_cast<std::size_t>(s.height), 1.0f));
    const auto keep = [&](std::size_t source, int y, std::span<const glm::vec4> row) {
        const float unit = source < luminaires ? 1.0f : screen.emitted_unit_lx[1];
        float* to = values[source].data() + 4 * width * static_cast<std::size_t>(y);
        for (std::size_t x = 0; x < width; ++x) {
            for (int k = 0; k < 3; ++k)
                to[4 * x + static_cast<std::size_t>(k)] = glm::clamp(row[x][k] / unit, 0.0f, greatest);
        }
    };
    while (!shade::continue_gather(s, screen.grid, *context.transport, gather, keep, context.pool)) {
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i < luminaires)
            to_texture(context.target.indirect, layers[i], s, values[i]);
        else
            to_texture(context.target.emitted, 1, s, values[i]);
    }
    return {};
}

unsigned final_gather_passes(const PassContext& context, std::span<LightGpu* const> lights) {
    if (!there(context)) return 0;
    ScreenLight& screen = *context.target.screen;
    unsigned least = kLivePasses;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (lit(*lights[i])) least = std::min(least, layer_of(screen, static_cast<int>(i)).passes);
    }
    return emits(context) ? std::min(least, screen.emitted_passes) : least;
}

bool final_gather_left(const PassContext& context, std::span<LightGpu* const> lights) {
    return there(context) && final_gather_passes(context, lights) < kLivePasses;
}

std::uint64_t final_gathers(const Target& target) {
    return target.screen->gathered;
}

bool continue_final_gather(const PassContext& context, std::span<LightGpu* const> lights,
                           const std::function<bool()>& interrupted) {
    if (!final_gather_left(context, lights)) return false;
    ScreenLight& screen = *context.target.screen;
    ScreenLight::Gathering& own = screen.gathering;
    const shade::Surfaces& s = screen.surfaces;
    const unsigned passes = final_gather_passes(context, lights);
    // Those that have had the fewest passes, from the same light as when it began.
    const std::size_t emitted = lights.size();
    std::vector<std::pair<std::size_t, std::uint64_t>> wanted;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const shade::LightLayer& layer = layer_of(screen, static_cast<int>(i));
        if (lit(*lights[i]) && layer.passes == passes) wanted.emplace_back(i, layer.version);
    }
    const std::size_t luminaires = wanted.size();
    if (emits(context) && screen.emitted_passes == passes) wanted.emplace_back(emitted, screen.emitted_version);
    if (!own.work || own.wanted != wanted) {
        own.work = std::make_unique<shade::FinalGather>();
        own.work->pass = shade::kLivePasses[passes];
        own.wanted = wanted;
        own.webs.clear();
        own.pixels.assign(wanted.size(), std::vector<std::uint16_t>(4 * s.depth.size(), 0));
        for (const auto& [i, version] : wanted) {
            if (i != emitted) own.webs.push_back(lights[i]->web);
            own.work->sources.push_back(i == emitted
                                            ? source_of(context, nullptr, nullptr, context.transport->emitted, false)
                                            : source_of(context, &context.scene.lights[i], lights[i],
                                                        lights[i]->irradiance, luminaires <= shade::kMostExactLights));
        }
    }
    const auto keep = [&](std::size_t source, int y, std::span<const glm::vec4> row) {
        const float unit = source < luminaires ? 1.0f : screen.emitted_unit_lx[1];
        std::uint16_t* to = own.pixels[source].data() + 4 * s.row_length * static_cast<std::size_t>(y);
        for (std::size_t x = 0; x < row.size(); ++x) {
            for (int k = 0; k < 3; ++k)
                to[4 * x + static_cast<std::size_t>(k)] =
                    glm::packHalf1x16(glm::clamp(row[x][k] / unit, 0.0f, 65504.0f));
            to[4 * x + 3] = glm::packHalf1x16(1.0f);
        }
    };
    while (!shade::continue_gather(s, screen.grid, *context.transport, *own.work, keep, context.pool)) {
        if (interrupted()) return false;
    }
    for (std::size_t k = 0; k < wanted.size(); ++k) {
        const std::size_t i = wanted[k].first;
        std::vector<std::uint16_t>& pixels = own.pixels[k];
        if (!context.layers_on_cpu) {
            const bool light = i != emitted;
            upload(light ? context.target.indirect : context.target.emitted, s, light ? static_cast<int>(i) : 1,
                   GL_RGBA, GL_HALF_FLOAT, pixels.data());
        }
        if (i == emitted) {
            screen.emitted_passes = passes + 1;
            screen.emitted[1] = std::move(pixels);
            continue;
        }
        shade::LightLayer& layer = layer_of(screen, static_cast<int>(i));
        layer.passes = passes + 1;
        layer.version = ++screen.writes;
        if (context.layers_on_cpu) layer.gathered = std::move(pixels);
    }
    own = {};
    ++screen.gathered;
    return true;
}

}  // namespace gonio
