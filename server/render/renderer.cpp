#include "server/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "server/lighting/screen.h"
#include "server/render/coarse_light.h"
#include "server/render/inspect.h"
#include "server/render/pipeline.h"
#include "server/render/timers.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/shown_scene.h"
#include "server/scene/web_buffer.h"

namespace gonio {

struct Renderer::InFlight {
    gl::Fence fence;
    gl::Buffer readback;
    Timers timers;
    bool picture = false;  // it comes through `readback`; else `frame` has it already
    FinishedFrame frame;
};

Renderer::Renderer(const gl::Context& context, DirectLight direct_light)
    : direct_by_rays_(direct_light == DirectLight::rays ||
                      (direct_light == DirectLight::automatic && context.software())) {
    glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
}
Renderer::~Renderer() = default;

void Renderer::inspect_with(std::function<void(const Inspected&)> visit) {
    inspector_ = std::move(visit);
}

// Brings GPU objects in line with the scene: geometry, lights' maps, the live target.
void Renderer::prepare(const Scene& scene, bool live, bool bounces) {
    prepare_geometry(scene, live);
    // Where shaders shade, rays want a G-buffer of the CPU's for what is summed and for what rests alone.
    prepare_drawn(direct_by_rays_ || refines_ || scene.lights.size() > kMostLayers);
    if (bodies_) bodies_->place(scene, traced_->origin());
    if (scene.technique == Technique::standard && bounces) prepare_transport(scene);
    // Drops the luminaires of scenes that were captured or metered earlier. Those of the live picture stay meanwhile:
    // its next frame would light them anew.
    for (auto& [id, gpu] : lights_) gpu.live &= !live;
    std::erase_if(lights_, [&](const auto& entry) {
        const bool gone = !entry.second.live && std::none_of(scene.lights.begin(), scene.lights.end(),
                                                             [&](const Light& l) { return l.id == entry.first; });
        if (gone) pass_cache_.forget_light(entry.first);
        return gone;
    });
    for (const Light& light : scene.lights) {
        LightGpu& gpu = lights_[light.id];
        gpu.live |= live;
        if (gpu.rsm_fbo.id() == 0) gpu.rsm_size = rsm_size_;
        if (gpu.profile != light.shining()) {
            std::weak_ptr<const WebGpu>& cached = webs_[light.shining().get()];
            gpu.web = cached.lock();
            if (!gpu.web) cached = gpu.web = make_web(light.shining());
            gpu.profile = light.shining();
        }
        const SlotRef reached{Slot::reached, 0, light.id};
        if (!pass_cache_.holds(reached, {light.profile_rev, light.aim_rev})) {
            pass_cache_.hold(reached, {light.profile_rev, light.aim_rev});
            gpu.reached = reached_faces(gpu.web->tables->lit, glm::mat3_cast(light.world_from_light));
        }
    }
    std::erase_if(webs_, [](const auto& entry) { return entry.second.expired(); });
    if (live) prepare_target(scene);
}

void Renderer::prepare_drawn(bool clustered) {
    if (!drawn_ || (clustered && !drawn_->clustered)) drawn_ = lighting::make_drawn(traced_, clustered);
    if (drawn_->bodies && !bodies_)
        bodies_ = std::make_unique<ShownBodies>(geometry_->asset().bodies, *drawn_->bodies, *geometry_);
}

void Renderer::prepare_target(const Scene& scene) {
    // Even sides, as NV12 wants them.
    const double scale = scene.technique == Technique::standard ? kQualityLevels[quality_level_].scale : 1.0;
    const auto scaled = [&](int side_px) {
        return scale < 1.0 ? std::max(16, static_cast<int>(std::lround(side_px * scale / 2.0)) * 2) : side_px;
    };
    const int wide = scaled(scene.width_px), high = scaled(scene.height_px);
    // What a layer takes of pixels, on the CPU and as textures, and of surfels. Where shaders shade the limit holds for
    // each memory: textures and the cube of depths are in the GPU's, what the final gather is at in the other.
    constexpr std::size_t kPixelBytes = 28, kTexelBytes = 10, kGatheredBytes = 8, kSurfelBytes = 100;
    const std::size_t cube = shadow_size_of(scene.lights.size()), pixels = std::size_t{1} * wide * high,
                      of_surfels = transport_ ? transport_->surface->surfels.count * kSurfelBytes : 0;
    const std::size_t one = direct_by_rays_ ? kPixelBytes * pixels + of_surfels
                                            : std::max(kTexelBytes * pixels + 6 * sizeof(float) * cube * cube,
                                                       kGatheredBytes * pixels + of_surfels);
    layer_count_ = std::clamp<std::size_t>(layer_bytes_ / one, 1, kMostLayers);
    if (scene.technique != Technique::standard) layer_count_ = kMostLayers;
    keep_layers(scene);
    const std::size_t layers = std::clamp<std::size_t>(scene.lights.size(), 1, layer_count_);
    if (live_.width_px != wide || live_.height_px != high || live_.layer_count < static_cast<int>(layers) ||
        live_.emissive != geometry_->emissive() || bool(live_.detail) != geometry_->detailed()) {
        pass_cache_.forget_target(live_.id);
        live_ = make_target(next_target_++, TargetKind::live, wide, high, layers, geometry_->emissive(),
                            !direct_by_rays_, geometry_->detailed());
        live_screen_ = std::make_unique<ScreenLight>();
    }
}

FrameInputs Renderer::inputs_of(const Scene& scene, const Target& target, ScreenLight& screen, const Eye& eye) {
    FrameInputs inputs{{programs_, *geometry_, scene, target, eye, *traced_, drawn_->clusters, drawn_->material_table,
                        pool_, screen.scratch, pass_cache_, transport_.get()},
                       screen,
                       scene.view,
                       direct_by_rays_,
                       generation_,
                       layers_of(scene, target)};
    inputs.layers = inputs.layer_of;
    if (scene.technique == Technique::standard) inputs.haze = haze_of(scene, traced_->origin());
    if (bodies_ && (inputs.bodies_stand = bodies_->in_view(eye)) != 0) inputs.bodies = bodies_.get();
    inputs.probes = &probes_;
    inputs.haze_points = &haze_points_;
    for (const Light& light : scene.lights) inputs.lights.push_back(&lights_.at(light.id));
    if (target.id == live_.id) {
        inputs.samples_per_pixel = refines_ ? kSamplesPerPixel : 1;
        inputs.in_sum = &in_sum_;
        inputs.quality_level = quality_level_;
    }
    return inputs;
}

// Whether the final gather has what it would refine: luminaires' own layers, and they are shown.
bool Renderer::gathers(const Scene& scene) const {
    return !merged_ && scene.view < View::mask && scene.view != View::direct;
}

namespace {

// Whether a luminaire's direct light in the live picture is still that of few rays, or of a shadow cube; one that is
// out does not show.
bool direct_left(const FrameInputs& in, std::size_t i) {
    const Light& light = in.scene.lights[i];
    const bool rough = in.shades_on_cpu() || (in.gathers_by_gl() && !light.sun);
    return rough && in.layers[i] >= 0 && in.view != View::indirect &&
           light_weight(in.scene, light) != glm::dvec3(0.0) && !in.wants_each_pixel(light);
}

bool edges_wanted(const FrameInputs& in) {
    return shows_lit_surfaces(in.view) && edges_left(in.context());
}

}  // namespace

bool Renderer::refine(const Scene& asked, const std::function<bool()>& interrupted) {
    const std::optional<Scene> other = shown_scene(asked, asked.view);
    const Scene& scene = other ? *other : asked;
    if (scene.technique != Technique::standard) return false;
    prepare(scene, true);  // a capture of an older scene may have been here
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    if (edges_wanted(inputs)) {
        std::vector<Pass> passes = build_pipeline(inputs);
        const SlotRef wanted[] = {{Slot::grid, live_.id}};
        execute(passes, wanted, pass_cache_);
        return continue_antialias(inputs.context(), *live_screen_, interrupted);
    }
    if (!own_->builder->done()) {  // another generation will come: nothing is worth tracing twice
        std::this_thread::sleep_for(std::chrono::milliseconds(interrupted() ? 0 : 4));
        return newer_transport();
    }
    if (!in_sum_.empty()) {
        in_sum_.clear();
        return true;
    }
    if (gathers(scene))  // else no frame would count them down
        for (std::size_t i = 0; i < scene.lights.size(); ++i)
            if (inputs.layers[i] >= 0 && inputs.lights[i]->irradiance.frames_left > 0) return true;
    if (!inputs.merged) {
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            if (!direct_left(inputs, i)) continue;
            if (interrupted()) return false;
            inputs.want_each_pixel(scene.lights[i]);
            return true;
        }
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            if (inputs.layers[i] >= 0 && first_bounce_left(inputs.context(), *inputs.lights[i]))
                return continue_first_bounce(inputs.context(), scene.lights[i], *inputs.lights[i], interrupted);
        }
    }
    if (!gathers(scene)) return false;
    if (inputs.gathers_by_gl()) {  // its surfaces, which frames have no need of
        std::vector<Pass> passes = build_pipeline(inputs);
        const SlotRef wanted[] = {{Slot::grid, live_.id, 0}, {Slot::weights, live_.id, 0}};
        execute(passes, wanted, pass_cache_);
    }
    return continue_final_gather(inputs.context(), inputs.lights, *live_screen_, interrupted);
}

bool Renderer::refined(const Scene& asked) {
    const std::optional<Scene> other = shown_scene(asked, asked.view);
    const Scene& scene = other ? *other : asked;
    if (scene.technique != Technique::standard || !refines_) return true;
    prepare(scene, true);
    if (!own_->builder->done() || newer_transport() || !in_sum_.empty()) return false;
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    const PassContext context = inputs.context();
    if (edges_wanted(inputs)) return false;
    if (gathers(scene) && final_gather_left(context, inputs.lights, live_screen_->light)) return false;
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        if (direct_left(inputs, i)) return false;
        if (inputs.layers[i] >= 0 && first_bounce_left(context, *inputs.lights[i])) return false;
    }
    return true;
}

v1::FrameReport Renderer::run(const FrameInputs& inputs, std::vector<SlotRef> wanted, Timers& timers) {
    std::vector<Pass> passes = build_pipeline(inputs);
    gl::Query before;
    v1::FrameReport report;
    inputs.screen.solved = {};
    std::vector<v1::PassReport> rows = execute(
        passes, wanted, pass_cache_,
        [&](std::size_t row) {
            if (passes[row].on_gpu) before = Timers::stamp();
        },
        [&](std::size_t row) {
            if (passes[row].on_gpu) timers.passes.emplace_back(row, std::pair(std::move(before), Timers::stamp()));
            if (inspector_) inspect_slot(inputs, passes[row].writes, inspector_);
        });
    if (inputs.screen.solved.bounces > 0) solved_ = inputs.screen.solved;
    report.set_scene_rev(inputs.scene.scene_rev);
    for (v1::PassReport& row : rows) *report.add_passes() = std::move(row);
    // Asked again nothing would run, unless luminaires' own layers or more bounces are to follow.
    const bool seed = inputs.scene.technique != Technique::standard;
    const bool all = !inputs.merged && (seed || outdated(build_pipeline(inputs), wanted, pass_cache_).empty());
    if (inputs.target.id == live_.id) settled_ = all;
    report.set_settled(all && (seed || !own_ || own_->builder->done()));
    return report;
}

void Renderer::begin_frame(const Scene& asked, std::int64_t drained_ns) {
    const std::optional<Scene> other = shown_scene(asked, asked.view);
    const Scene& scene = other ? *other : asked;
    prepare(scene, true);
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    weights_.clear();
    if (inputs.layered() < scene.lights.size()) {
        for (const Light& light : scene.lights) weights_.emplace(light.id, own_weight(light));
    } else {
        live_screen_->light.summed = {};
    }
    choose_layers(inputs);
    auto in_flight = std::make_unique<InFlight>();
    FinishedFrame* frame = &in_flight->frame;
    frame->drained_ns = drained_ns;
    frame->width_px = live_.width_px;
    frame->height_px = live_.height_px;
    frame->report = run(inputs, wanted_slots(inputs, true), in_flight->timers);
    frame->report.set_width_px(live_.width_px);
    frame->report.set_height_px(live_.height_px);
    frame->report.set_effort(quality_level_);
    if (transport_ && scene.technique == Technique::standard) {
        frame->report.set_samples_per_pixel(shows_edges(inputs.context()) ? inputs.samples_per_pixel : 1);
        frame->report.set_links(transport_->links.per_surfel());
        frame->report.set_refined_rounds(
            merged_ ? 0 : final_gather_passes(inputs.context(), inputs.lights, live_screen_->light));
    }
    const auto& passes = frame->report.passes();
    in_flight->picture = std::any_of(passes.begin(), passes.end(),
                                     [](const auto& row) { return row.name() == "nv12" && row.state() == "ran"; });
    frame->nv12 = std::exchange(live_screen_->composed.nv12, nullptr);
    if (in_flight->picture) {
        const std::size_t bytes = std::size_t{1} * live_.width_px * (live_.height_px / 2 * 3);
        if (bytes != readback_bytes_) {
            free_readbacks_.clear();
            readback_bytes_ = bytes;
        }
        if (free_readbacks_.empty())
            free_readbacks_.push_back(
                gl::make_buffer("readback", bytes, nullptr, GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT));
        in_flight->readback = std::move(free_readbacks_.back());
        free_readbacks_.pop_back();
        glBindFramebuffer(GL_READ_FRAMEBUFFER, live_.nv12_fbo.id());
        glBindBuffer(GL_PIXEL_PACK_BUFFER, in_flight->readback.id());
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glReadPixels(0, 0, live_.width_px, live_.height_px / 2 * 3, GL_RED, GL_UNSIGNED_BYTE, nullptr);
        glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    }
    if (!frame->nv12) {
        in_flight->fence = gl::insert_fence();
        glFlush();
    }
    in_flight_.push_back(std::move(in_flight));
}

std::optional<FinishedFrame> Renderer::finish_frame(bool wait) {
    if (in_flight_.empty()) return std::nullopt;
    InFlight& in_flight = *in_flight_.front();
    constexpr GLuint64 kStep = 1'000'000'000;
    while (in_flight.fence && !gl::passed(in_flight.fence, wait ? kStep : 0)) {
        if (!wait) return std::nullopt;
    }
    FinishedFrame done = std::move(in_flight.frame);
    if (in_flight.picture) {
        const std::size_t bytes = std::size_t{1} * done.width_px * (done.height_px / 2 * 3);
        auto pixels = std::make_shared<std::vector<std::uint8_t>>(bytes);
        glGetNamedBufferSubData(in_flight.readback.id(), 0, static_cast<GLsizeiptr>(bytes), pixels->data());
        done.nv12 = std::move(pixels);
        if (bytes == readback_bytes_) free_readbacks_.push_back(std::move(in_flight.readback));
    }
    done.rendered_ns = monotonic_ns();
    in_flight.timers.resolve(done.report);
    done.report.set_frame_ms(static_cast<double>(done.rendered_ns - done.drained_ns) * 1e-6);
    in_flight_.pop_front();
    return done;
}

std::vector<glm::vec3> Renderer::live_beams(const Scene& scene) {
    const Eye eye;
    FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    inputs.merged = merged_;
    return shown_beams(inputs.context(), inputs.lights, live_screen_->surfaces, live_screen_->light, live_screen_->air);
}

std::vector<glm::vec3> Renderer::live_illuminance(const Scene& asked, bool indirect) {
    const std::optional<Scene> other = shown_scene(asked, asked.view);
    const Scene& scene = other ? *other : asked;
    const Eye eye;
    FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    inputs.merged = merged_;
    std::vector<glm::vec3> weights(live_.layer_count, glm::vec3(0.0f));  // cd
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        if (inputs.layers[i] < 0) continue;
        weights[inputs.layers[i]] =
            glm::vec3(inputs.layer_weight(scene.lights[i]) * peak_of(inputs, scene.lights[i], *inputs.lights[i]));
    }
    if (inputs.shades_on_cpu())
        return cpu_illuminance(inputs.context(), weights, indirect, live_screen_->surfaces, live_screen_->light);
    std::vector<glm::vec3> sum(std::size_t{1} * live_.width_px * live_.height_px), layer(sum.size());
    const auto read = [&](const gl::Texture& array, int index) {
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glGetTextureSubImage(array.id(), 0, 0, 0, index, live_.width_px, live_.height_px, 1, GL_RGB, GL_FLOAT,
                             layer.size() * sizeof(glm::vec3), layer.data());
    };
    const int part = indirect ? 1 : 0;
    const float unit_lx = live_screen_->besides_unit_lx[part];
    if (unit_lx > 0.0f && inputs.has_besides()) {
        read(live_.besides, part);
        for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += unit_lx * layer[p];
    }
    for (std::size_t i = 0; i < weights.size() && !(indirect && merged_); ++i) {
        const glm::vec3 weight = weights[i] / geometry_->layer_unit_m2();
        if (weight == glm::vec3(0.0f)) continue;
        read(indirect ? live_.indirect : live_.direct, static_cast<int>(i));
        for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += weight * (indirect ? layer[p] : glm::vec3(layer[p].r));
    }
    return sum;
}

}  // namespace gonio
