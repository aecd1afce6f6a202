// The default technique's light: the CPU's passes between the G-buffer and the layers (server/shade).
#include <algorithm>
#include <array>
#include <cmath>

#include "server/render/passes/passes.h"
#include "server/render/passes/screen.h"
#include "server/scene/apply.h"
#include "server/shade/display.h"
#include "server/shade/raster.h"
#include "server/shade/refine.h"

namespace gonio {

// What a layer of a luminaire depends on.
using Revisions = std::array<std::uint64_t, 7>;
static Revisions revisions(const Scene& scene, const Light& light) {
    return {light.id,           light.position_rev, light.aim_rev, light.profile_rev,
            scene.geometry_rev, scene.camera_rev,   scene.samples};
}

// The CPU's side of one target: what it reads of the G-buffer, and what it made of it per light.
struct ScreenLight {
    shade::Surfaces surfaces;
    shade::ScreenGrid grid;
    std::vector<shade::Occlusion> occlusion;  // by layer
    std::vector<std::uint16_t> halves;        // scratch: what is uploaded
    std::vector<float> floats;
    std::vector<shade::PointLight> points;  // by layer, of meters
    // Where layers stay on the CPU: half floats, surfaces.row_length pixels a row.
    struct Layers {
        std::vector<std::uint16_t> direct;    // 1 per pixel
        std::vector<std::uint16_t> indirect;  // 4 per pixel
        std::uint64_t gathered = 0;           // counts gathers
        Revisions of{};                       // what the last one read
        int rounds = 0, fade = 0;  // of its refinement: rounds that are complete, steps of fading to the first
        unsigned shown = 0;
    };
    std::vector<Layers> layers;
    // The luminaire that is being refined, one at a time.
    shade::Refinement refinement;
    int refining = -1;                 // layer
    std::uint64_t refined_gather = 0;  // its `gathered` when that began
    shade::Raster raster;              // of it, where the G-buffer is read from GL, the colours only
    std::shared_ptr<std::vector<std::uint8_t>> nv12;
    std::vector<std::shared_ptr<std::vector<std::uint8_t>>> pictures;  // made before; those nobody holds are used again
};

namespace {

// Figures per setting: docs/performance.md.
constexpr shade::Quality kLive{4, true, 4, 512, 2, 16.0f};
constexpr shade::Quality kStill{1, true, 4, 512, 3, 16.0f};
constexpr shade::Quality kPrecise{1, false, 2, 1024, 4, 16.0f};

const shade::Quality& quality_of(TargetKind kind) {
    return kind == TargetKind::live ? kLive : kind == TargetKind::still ? kStill : kPrecise;
}

shade::LightView view_of(const PassContext& context, const Light& light, const LightGpu& gpu) {
    return {context.traced,
            *gpu.rays,
            gpu.vpls,
            light.position - context.traced.origin(),
            glm::dmat3(glm::mat3_cast(light.world_from_light)),
            shade::web_of(gpu.web->words.data()),
            context.looks,
            context.geometry.layer_unit_m2()};
}

}  // namespace

namespace {

void set_view(const PassContext& context) {
    const Target& target = context.target;
    shade::look_through(context.eye, context.traced, context.geometry.near_m(), target.width_px, target.height_px,
                        target.screen->surfaces);
}

void set_grid(const PassContext& context) {
    shade::Quality quality = quality_of(context.target.kind);
    const Effort& effort = kEfforts[context.effort];
    if (context.effort > 0) {
        quality.node_vpls = effort.node_vpls;
        quality.near_rays = effort.near_rays;
    }
    if (!context.occluded) {
        quality.node_vpls = quality.near_rays = 0;
        quality.kappa = 1.0f;  // the kernel bounded by the area alone
    }
    ScreenLight& screen = *context.target.screen;
    shade::make_grid(screen.surfaces, quality, screen.grid, context.pool);
}

}  // namespace

PassRun run_raster(const PassContext& context) {
    ScreenLight& screen = *context.target.screen;
    set_view(context);
    const unsigned drawn = shade::draw_surfaces(context.clusters, context.looks, context.target.emissive,
                                                screen.surfaces, screen.raster, context.pool);
    set_grid(context);
    return {0, drawn};
}

PassRun run_grid(const PassContext& context) {
    const Target& target = context.target;
    ScreenLight& screen = *target.screen;
    set_view(context);
    shade::Surfaces& s = screen.surfaces;
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glPixelStorei(GL_PACK_ROW_LENGTH, static_cast<GLint>(s.row_length));
    const auto bytes = static_cast<GLsizei>(s.depth.size() * 4);
    glGetTextureImage(target.depth.id(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, bytes, s.depth.data());
    glGetTextureImage(target.normal.id(), 0, GL_RG, GL_SHORT, bytes, s.normal.data());
    if (context.layers_on_cpu) {
        shade::Raster& raster = screen.raster;
        raster.albedo.resize(s.depth.size() * 4);
        glGetTextureImage(target.albedo.id(), 0, GL_RGBA, GL_HALF_FLOAT, static_cast<GLsizei>(raster.albedo.size() * 2),
                          raster.albedo.data());
        if (target.emissive) {
            raster.emission.resize(s.depth.size() * 4);
            glGetTextureImage(target.emission.id(), 0, GL_RGBA, GL_FLOAT,
                              static_cast<GLsizei>(raster.emission.size() * 4), raster.emission.data());
        }
    }
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    set_grid(context);
    return {};
}

PassRun run_vpl(const PassContext& context, const Light& light, LightGpu& gpu) {
    gpu.vpls = shade::cast(*gpu.rays, context.traced, light.position - context.traced.origin(),
                           glm::dmat3(glm::mat3_cast(light.world_from_light)), context.pool);
    return {};
}

PassRun run_occlusion(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    ScreenLight& screen = *context.target.screen;
    screen.occlusion.resize(std::max(screen.occlusion.size(), static_cast<std::size_t>(layer) + 1));
    screen.occlusion[static_cast<std::size_t>(layer)] =
        shade::trace_occlusion(screen.grid, view_of(context, light, gpu), context.pool);
    return {};
}

namespace {

ScreenLight::Layers& layers_of(ScreenLight& screen, int layer) {
    screen.layers.resize(std::max(screen.layers.size(), static_cast<std::size_t>(layer) + 1));
    return screen.layers[static_cast<std::size_t>(layer)];
}

// values: surfaces.row_length pixels a row.
void upload(const gl::Texture& array, const shade::Surfaces& s, int layer, GLenum format, GLenum type,
            const void* values) {
    glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, static_cast<GLint>(s.row_length));
    glTextureSubImage3D(array.id(), 0, 0, 0, layer, s.width, s.height, 1, format, type, values);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
}

}  // namespace

PassRun run_direct_rays(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const Target& target = context.target;
    ScreenLight& screen = *target.screen;
    const shade::Surfaces& s = screen.surfaces;
    const glm::vec3 position(light.position - context.traced.origin());
    shade::direct_light(
        s, context.traced,
        {position, light_from_world(light), shade::web_of(gpu.web->words.data()), context.geometry.layer_unit_m2()},
        target.kind != TargetKind::live, screen.floats, context.pool);
    if (target.kind == TargetKind::precise) {
        upload(target.direct, s, layer, GL_RED, GL_FLOAT, screen.floats.data());
        return {};
    }
    std::vector<std::uint16_t>& halves = context.layers_on_cpu ? layers_of(screen, layer).direct : screen.halves;
    halves.resize(screen.floats.size());
    context.pool.run(s.height, [&](int row) {
        const std::size_t at = static_cast<std::size_t>(row) * s.row_length;
        shade::to_halves(screen.floats.data() + at, s.row_length, halves.data() + at);
    });
    if (!context.layers_on_cpu) upload(target.direct, s, layer, GL_RED, GL_HALF_FLOAT, halves.data());
    return {};
}

PassRun run_direct_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const Eye& eye = context.eye;
    const glm::dvec3 normal = -eye.forward, point = eye.position + eye.forward;
    const glm::dvec3 d = point - light.position;
    const double d2 = glm::dot(d, d), cosine = -glm::dot(d, normal) / std::sqrt(d2);
    float value = 0.0f;
    if (d2 > 0.0 && cosine > 0.0 && gpu.web->peak_cd > 0.0f) {
        const glm::dvec3 in_light = glm::transpose(glm::dmat3(glm::mat3_cast(light.world_from_light))) * d;
        const double ratio =
            ies::intensity(light.profile->photometry.web, {in_light.x, in_light.y, in_light.z}).in(cd) /
            light.profile->max_cd;
        const glm::vec3 local = context.traced.local(point);
        const glm::vec3 from = local + glm::vec3(normal) * (4.0f * context.traced.step_off(local));
        if (ratio > 0.0 && !context.traced.occluded(from, context.traced.local(light.position)))
            value = static_cast<float>(ratio * cosine / d2);
    }
    value *= context.geometry.layer_unit_m2();
    glTextureSubImage3D(context.target.direct.id(), 0, 0, 0, layer, 1, 1, 1, GL_RED, GL_FLOAT, &value);
    return {};
}

PassRun run_gather(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const Target& target = context.target;
    ScreenLight& screen = *target.screen;
    const shade::Surfaces& s = screen.surfaces;
    const shade::Planes planes = shade::gather_grid(screen.grid, view_of(context, light, gpu),
                                                    screen.occlusion[static_cast<std::size_t>(layer)], context.pool);
    if (screen.grid.quality.step > 1) {
        if (context.layers_on_cpu) {
            ScreenLight::Layers& own = layers_of(screen, layer);
            ++own.gathered;
            own.of = revisions(context.scene, light);
            own.rounds = own.fade = 0;
            own.shown = 0;
        }
        std::vector<std::uint16_t>& halves = context.layers_on_cpu ? layers_of(screen, layer).indirect : screen.halves;
        shade::upsample(s, screen.grid, planes, halves, context.pool);
        if (!context.layers_on_cpu) upload(target.indirect, s, layer, GL_RGBA, GL_HALF_FLOAT, halves.data());
        return {};
    }
    const float greatest = target.kind == TargetKind::precise ? 3e38f : 65504.0f;  // what the layer can hold
    screen.floats.resize(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height) * 4);
    context.pool.run(s.height, [&](int row) {
        float* to = screen.floats.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(s.width) * 4;
        for (int x = 0; x < s.width; ++x, to += 4) {
            const auto at = static_cast<std::size_t>(screen.grid.grid.at(x, row));
            for (std::size_t k = 0; k < 3; ++k) to[k] = std::min(planes[k][at], greatest);
            to[3] = 1.0f;
        }
    });
    glTextureSubImage3D(target.indirect.id(), 0, 0, 0, layer, s.width, s.height, 1, GL_RGBA, GL_FLOAT,
                        screen.floats.data());
    return {};
}

namespace {
// The first round differs most from the live picture: it comes in so many steps, without a pop.
constexpr int kFadeSteps = 4;
}  // namespace

bool continue_refinement(const PassContext& context, const Light& light, const LightGpu& gpu, int layer, int rounds,
                         const std::function<bool()>& interrupted) {
    ScreenLight& screen = *context.target.screen;
    ScreenLight::Layers& own = layers_of(screen, layer);
    if (own.fade > 0 && own.fade < kFadeSteps) {
        ++own.fade;
        ++own.shown;
        return true;
    }
    if (screen.refining != layer || screen.refined_gather != own.gathered) {
        screen.refining = layer;
        screen.refined_gather = own.gathered;
        screen.refinement.start(rounds);
    }
    if (!screen.refinement.continue_with(screen.surfaces, view_of(context, light, gpu), context.pool, interrupted))
        return false;
    own.rounds = screen.refinement.rounds_done();
    own.fade = std::max(own.fade, 1);
    ++own.shown;
    return true;
}

PassRun run_refine(const PassContext& context, int layer) {
    ScreenLight& screen = *context.target.screen;
    const ScreenLight::Layers& own = layers_of(screen, layer);
    // Of what lies between the layer as it is and the mean, so that the steps are even.
    const float share = 1.0f / static_cast<float>(kFadeSteps + 1 - own.fade);
    screen.refinement.mean(share, layers_of(screen, layer).indirect, context.pool);
    return {};
}

Refined refined(const Target& target, const Scene& scene, int layer, int rounds) {
    const ScreenLight& screen = *target.screen;
    const auto index = static_cast<std::size_t>(layer);
    if (index >= screen.layers.size()) return {};
    const ScreenLight::Layers& own = screen.layers[index];
    if (own.of != revisions(scene, scene.lights[index])) return {};
    return {own.shown, own.rounds >= rounds && own.fade == kFadeSteps, own.rounds};
}

PassRun run_layers(const Target& target, int layer) {
    ScreenLight& screen = *target.screen;
    const ScreenLight::Layers& layers = layers_of(screen, layer);
    // A part that no view has asked for yet is empty.
    if (!layers.direct.empty())
        upload(target.direct, screen.surfaces, layer, GL_RED, GL_HALF_FLOAT, layers.direct.data());
    if (!layers.indirect.empty())
        upload(target.indirect, screen.surfaces, layer, GL_RGBA, GL_HALF_FLOAT, layers.indirect.data());
    return {};
}

PassRun run_composite_cpu(const PassContext& context, View view, std::span<const LightGpu* const> lights) {
    ScreenLight& screen = *context.target.screen;
    const Scene& scene = context.scene;
    shade::Display display;
    display.width = screen.surfaces.width;
    display.height = screen.surfaces.height;
    display.row_length = screen.surfaces.row_length;
    display.direct = view != View::indirect;
    display.indirect = view != View::direct;
    display.gain = view == View::indirect ? static_cast<float>(scene.view_gain) : 1.0f;
    display.albedo = screen.raster.albedo.data();
    if (context.target.emissive && view == View::beauty) display.emission = screen.raster.emission.data();
    display.depth = screen.surfaces.depth.data();
    display.ev100 = static_cast<float>(scene.exposure_ev100);
    std::vector<shade::Layer> layers;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const glm::vec3 weight(light_weight(scene, scene.lights[i]) *
                               static_cast<double>(lights[i]->web->peak_cd / context.geometry.layer_unit_m2()));
        const ScreenLight::Layers& light = layers_of(screen, static_cast<int>(i));
        if (weight != glm::vec3(0.0f)) layers.push_back({light.direct.data(), light.indirect.data(), weight});
    }
    display.layers = layers;
    const std::size_t bytes =
        static_cast<std::size_t>(display.width) * static_cast<std::size_t>(display.height) / 2 * 3;
    auto& pictures = screen.pictures;
    std::erase_if(pictures, [&](const auto& picture) { return picture->size() != bytes; });
    auto free =
        std::find_if(pictures.begin(), pictures.end(), [](const auto& picture) { return picture.use_count() == 1; });
    if (free == pictures.end())
        free = pictures.insert(pictures.end(), std::make_shared<std::vector<std::uint8_t>>(bytes));
    screen.nv12 = *free;
    shade::to_nv12(display, screen.nv12->data(), context.pool);
    return {};
}

const std::vector<std::uint8_t>* made_nv12(const Target& target) {
    return target.screen->nv12.get();
}

std::shared_ptr<const std::vector<std::uint8_t>> take_nv12(const Target& target) {
    return std::move(target.screen->nv12);
}

PassRun run_gather_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer) {
    const Eye& eye = context.eye;
    std::vector<shade::PointLight>& points = context.target.screen->points;
    points.resize(context.scene.lights.size());
    shade::PointLight& found = points[static_cast<std::size_t>(layer)];
    found = shade::at_point(view_of(context, light, gpu), eye.position + eye.forward - context.traced.origin(),
                            -eye.forward);
    const glm::vec4 value(glm::vec3(found.light * static_cast<double>(context.geometry.layer_unit_m2())), 1.0f);
    glTextureSubImage3D(context.target.indirect.id(), 0, 0, 0, layer, 1, 1, 1, GL_RGBA, GL_FLOAT, &value[0]);
    return {};
}

const shade::PointLight& point_light(const Target& target, std::size_t layer) {
    return target.screen->points.at(layer);
}

std::shared_ptr<ScreenLight> make_screen_light() {
    return std::make_shared<ScreenLight>();
}

}  // namespace gonio
