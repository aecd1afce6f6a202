#include "server/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <set>
#include <thread>
#include <utility>

#include "server/lighting/screen.h"
#include "server/render/indirect_estimate.h"
#include "server/render/inspect.h"
#include "server/render/pipeline.h"
#include "server/render/timers.h"
#include "server/scene/apply.h"
#include "server/scene/web_buffer.h"

namespace gonio {

struct Renderer::InFlight {
    gl::Fence fence;
    gl::Buffer readback;
    int width_px = 0, height_px = 0;
    v1::FrameReport report;
    Timers timers;
    std::int64_t drained_ns = 0;
    bool picture = false;                                   // it comes through `readback`
    std::shared_ptr<const std::vector<std::uint8_t>> nv12;  // or it is here already
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

namespace {

// Transports outlive their renderer: one that is made after the GPU was lost goes on with them. Of the scene that is
// shown, and of one more that is captured meanwhile. Render thread.
struct Known {
    std::shared_ptr<const SceneAsset> asset;
    transport::SurfelSettings surfels;
    unsigned links = 0;
    bool cells = false;
    std::vector<glm::vec3> seeds;
    std::shared_ptr<transport::Builder> builder;
};
std::deque<Known>& known_transports() {
    static std::deque<Known> known;
    if (known.size() > 2) known.pop_front();
    return known;
}

}  // namespace

// Brings GPU objects in line with the scene: geometry, lights' maps, the live target.
void Renderer::prepare(const Scene& scene, bool live, bool bounces) {
    if (!geometry_ || &geometry_->asset() != scene.asset.get()) {
        geometry_ = std::make_unique<GpuScene>(scene.asset);
        traced_ = trace::geometry_of(scene);
        builder_.reset();
        transport_.reset();
        ++generation_;
        drawn_.reset();
        if (scene.drawn && scene.drawn->geometry == traced_) drawn_ = scene.drawn;
        if (live) std::erase_if(known_transports(), [&](const Known& one) { return one.asset != scene.asset; });
    }
    // Where shaders shade, rays want a G-buffer of the CPU's for what is summed and for what rests alone.
    const bool clustered = direct_by_rays_ || refines_ || scene.lights.size() > kMostLayers;
    if (!drawn_ || (clustered && !drawn_->clustered)) drawn_ = lighting::make_drawn(traced_, clustered);
    if (scene.technique == Technique::standard && bounces) prepare_transport(scene);
    std::erase_if(lights_, [&](const auto& entry) {
        const bool gone = live && std::none_of(scene.lights.begin(), scene.lights.end(),
                                               [&](const Light& l) { return l.id == entry.first; });
        if (gone) pass_cache_.forget_light(entry.first);
        return gone;
    });
    for (const Light& light : scene.lights) {
        LightGpu& gpu = lights_[light.id];
        if (gpu.rsm_fbo.id() == 0) gpu.rsm_size = rsm_size_;
        if (gpu.profile != light.profile) {
            std::weak_ptr<const WebGpu>& cached = webs_[light.profile.get()];
            gpu.web = cached.lock();
            if (!gpu.web) cached = gpu.web = make_web(light.profile);
            gpu.profile = light.profile;
        }
        const SlotRef reached{Slot::reached, 0, light.id};
        if (!pass_cache_.holds(reached, {light.profile_rev, light.aim_rev})) {
            pass_cache_.hold(reached, {light.profile_rev, light.aim_rev});
            gpu.reached = reached_faces(gpu.web->tables->lit, glm::mat3_cast(light.world_from_light));
        }
    }
    std::erase_if(webs_, [](const auto& entry) { return entry.second.expired(); });
    if (!live) return;
    // Even sides, as NV12 wants them.
    const double scale = scene.technique == Technique::standard ? kQualityLevels[quality_level_].scale : 1.0;
    const auto scaled = [&](int side_px) {
        return scale < 1.0 ? std::max(16, static_cast<int>(std::lround(side_px * scale / 2.0)) * 2) : side_px;
    };
    const int wide = scaled(scene.width_px), high = scaled(scene.height_px);
    // What a layer takes of pixels, on the CPU and as textures, of surfels, and of its cube of depths.
    constexpr std::size_t kPixelBytes = 28, kSurfelBytes = 100;
    const auto cube = static_cast<std::size_t>(shadow_size_of(scene.lights.size()));
    const std::size_t one = static_cast<std::size_t>(wide) * static_cast<std::size_t>(high) * kPixelBytes +
                            (transport_ ? transport_->surface->surfels.count * kSurfelBytes : 0) +
                            (direct_by_rays_ ? 0 : 6 * sizeof(float) * cube * cube);
    layer_count_ = std::clamp<std::size_t>(layer_bytes_ / one, 1, kMostLayers);
    if (scene.technique != Technique::standard) layer_count_ = kMostLayers;
    keep_layers(scene);
    const int layers = static_cast<int>(std::clamp<std::size_t>(scene.lights.size(), 1, layer_count_));
    if (live_.width_px != wide || live_.height_px != high || live_.layer_count < layers ||
        live_.emissive != geometry_->emissive()) {
        pass_cache_.forget_target(live_.id);
        live_ = make_target(next_target_++, TargetKind::live, wide, high, static_cast<std::size_t>(layers),
                            geometry_->emissive(), !direct_by_rays_);
        live_screen_ = std::make_unique<ScreenLight>();
    }
}

// Which luminaires have a layer, where not all can: those that have, and those that change, as long as they fit; where
// they do not, half of those that changed longest ago go first, so that not every one that comes makes another one go.
void Renderer::keep_layers(const Scene& scene) {
    const Revision last = std::exchange(layered_rev_, scene.scene_rev);
    if (scene.lights.size() <= layer_count_) {
        layered_.clear();
        in_sum_.clear();
        return;
    }
    if (last == scene.scene_rev && layered_.size() == layer_count_) return;
    const auto take_from = [&](std::uint32_t id) {
        std::replace(layered_.begin(), layered_.end(), id, std::uint32_t{0});
        if (const auto gpu = lights_.find(id); gpu != lights_.end()) {
            LightGpu bare;
            bare.web = gpu->second.web;
            bare.profile = gpu->second.profile;
            gpu->second = std::move(bare);
        }
        pass_cache_.forget_light(id);
        in_sum_.clear();  // the sum is made anew with it
    };
    while (layered_.size() > layer_count_) {  // the picture is larger than it was
        if (layered_.back() != 0) take_from(layered_.back());
        layered_.pop_back();
    }
    layered_.resize(layer_count_, 0);
    std::vector<std::pair<Revision, std::uint32_t>> kept;
    std::vector<const Light*> coming;
    for (const Light& light : scene.lights) {
        const Revision placed = std::max({light.position_rev, light.aim_rev, light.profile_rev}),
                       changed = std::max(placed, light.level_rev);
        if (std::find(layered_.begin(), layered_.end(), light.id) != layered_.end())
            kept.emplace_back(changed, light.id);
        else if (changed > last && last > 0)
            coming.push_back(&light);
        else if (!lights_.at(light.id).irradiance.indirect.empty())
            take_from(light.id);  // when all had one
        if (placed > last) in_sum_.erase(light.id);
    }
    for (const std::uint32_t id : std::vector(layered_)) {
        const bool here = std::any_of(kept.begin(), kept.end(), [&](const auto& one) { return one.second == id; });
        if (id != 0 && !here) take_from(id);
    }
    if (scene.lights_rev > last) in_sum_.clear();
    if (coming.size() > layer_count_) {  // the sum follows them
        in_sum_.clear();
        return;
    }
    const std::size_t all = kept.size() + coming.size();
    if (all > layer_count_) {
        std::sort(kept.begin(), kept.end());
        const std::size_t going = std::max(all - layer_count_, kept.size() / 2);
        for (std::size_t i = 0; i < going; ++i) take_from(kept[i].second);
    }
    for (const Light* light : coming) {
        *std::find(layered_.begin(), layered_.end(), 0u) = light->id;
        // Until the picture rests the sum goes on with what it was summed at, and its layer shows the difference.
        const auto was = weights_.find(light->id);
        const bool in_place = std::max({light->position_rev, light->aim_rev, light->profile_rev}) <= last;
        if (in_place && was != weights_.end() && scene.lights_rev <= last) in_sum_[light->id] = was->second;
    }
}

// By light: its layer of a target, -1: it is summed.
std::vector<int> Renderer::layers_of(const Scene& scene, const Target& target) const {
    std::vector<int> layers(scene.lights.size());
    const std::size_t fit = target.id == live_.id ? layer_count_ : kMostLayers;
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const auto own = std::find(layered_.begin(), layered_.end(), scene.lights[i].id);
        layers[i] = layers.size() <= fit    ? static_cast<int>(i)
                    : own != layered_.end() ? static_cast<int>(own - layered_.begin())
                                            : -1;
    }
    return layers;
}

void Renderer::prepare_transport(const Scene& scene) {
    auto& known = known_transports();
    const auto own = std::find_if(known.begin(), known.end(), [&](const Known& one) {
        return one.asset == scene.asset && one.surfels == surfels_ && one.links == links_ &&
               (one.cells || direct_by_rays_);
    });
    std::vector<glm::vec3> places = {traced_->local(scene.camera.eye)};
    for (const Light& light : scene.lights) places.push_back(traced_->local(light.position));
    const auto begin = [&] {
        builder_ = std::make_shared<transport::Builder>(traced_, seeds_, surfels_,
                                                        std::min(links_, transport::kMostBlockLinks), transport_beside_,
                                                        !direct_by_rays_);
        if (transport_beside_) builder_->hold(!watched_);
        if (own != known.end()) known.erase(own);
        known.push_back({scene.asset, surfels_, links_, !direct_by_rays_, seeds_, builder_});
    };
    if (!builder_ && own != known.end()) {
        builder_ = own->builder;
        seeds_ = own->seeds;
        if (transport_beside_) builder_->hold(!watched_);
    } else if (!builder_) {
        seeds_ = places;
        begin();
    }
    // Those for narrow beams are made where there is one.
    if (links_ > transport::kMostBlockLinks &&
        std::any_of(scene.lights.begin(), scene.lights.end(), [&](const Light& light) {
            const auto gpu = lights_.find(light.id);
            return gpu != lights_.end() && gpu->second.irradiance.narrow > 0.0f;
        }))
        builder_->want(links_);
    if (!transport_beside_) builder_->wait();
    // A luminaire or an eye has come to where no light could go before.
    if (builder_->done() && builder_->newest() && seeded_rev_ != scene.scene_rev) {
        seeded_rev_ = scene.scene_rev;
        const std::size_t before = seeds_.size();  // a place next to one of them has had its turn
        for (const glm::vec3& place : places) {
            const bool new_here = std::none_of(seeds_.begin(), seeds_.end(), [&](const glm::vec3& seed) {
                return glm::distance(seed, place) < 0.02f * traced_->extent();
            });
            if (new_here && seeds_.size() < places.size() + kMostLaterSeeds &&
                !transport::reaches(*builder_->newest(), place))
                seeds_.push_back(place);
        }
        if (seeds_.size() > before) {
            begin();
            if (!transport_beside_) builder_->wait();
        }
    }
    auto newest = builder_->newest();
    if (newest == transport_ || (!newest && transport_ && &transport_->surface->geometry->asset() == scene.asset.get()))
        return;
    transport_ = std::move(newest);
    ++generation_;
}

void Renderer::set_watched(bool watched) {
    watched_ = watched;
    if (builder_ && transport_beside_) builder_->hold(!watched);
}

bool Renderer::ready(const Scene& scene) {
    if (scene.technique != Technique::standard) return true;
    prepare(scene, false);
    builder_->hold(false);
    return builder_->done() && !newer_transport();
}

FrameInputs Renderer::inputs_of(const Scene& scene, const Target& target, ScreenLight& screen, const Eye& eye) {
    FrameInputs inputs{programs_,
                       *geometry_,
                       scene,
                       target,
                       screen,
                       pass_cache_,
                       eye,
                       {},
                       scene.view,
                       *traced_,
                       drawn_->clusters,
                       drawn_->material_table,
                       pool_,
                       direct_by_rays_,
                       transport_.get(),
                       generation_,
                       layers_of(scene, target),
                       {}};
    if (target.id == live_.id) inputs.in_sum = in_sum_;
    for (const Light& light : scene.lights) inputs.lights.push_back(&lights_.at(light.id));
    if (target.id == live_.id) inputs.quality_level = quality_level_;
    return inputs;
}

// Whether the final gather has what it would refine: luminaires' own layers, and they are shown.
bool Renderer::gathers(const Scene& scene) const {
    return !merged_ && scene.view < View::mask && scene.view != View::direct;
}

namespace {

// Whether a luminaire's direct light in the live picture is still that of few rays; one that is out does not show.
bool direct_left(const FrameInputs& in, std::size_t i) {
    const Light& light = in.scene.lights[i];
    return in.shades_on_cpu() && in.layers[i] >= 0 && in.view != View::indirect &&
           light_weight(in.scene, light) != glm::dvec3(0.0) && !in.each_pixel(light);
}

}  // namespace

bool Renderer::refine(const Scene& scene, const std::function<bool()>& interrupted) {
    if (scene.technique != Technique::standard) return false;
    prepare(scene, true);  // a capture of an older scene may have been here
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    if (!builder_->done()) {  // another generation will come: nothing is worth tracing twice
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
        execute(
            passes, wanted, pass_cache_, [](std::size_t) {}, [](std::size_t) {});
    }
    return continue_final_gather(inputs.context(), inputs.lights, *live_screen_, interrupted);
}

bool Renderer::refined(const Scene& scene) {
    if (scene.technique != Technique::standard || !refines_) return true;
    prepare(scene, true);
    if (!builder_->done() || newer_transport() || !in_sum_.empty()) return false;
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
    const PassContext context = inputs.context();
    if (gathers(scene) && final_gather_left(context, inputs.lights, live_screen_->light)) return false;
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        if (direct_left(inputs, i)) return false;
        if (inputs.layers[i] >= 0 && first_bounce_left(context, *inputs.lights[i])) return false;
    }
    return true;
}

v1::TransportStats Renderer::transport_stats() {
    if (builder_) builder_->hold(false);
    v1::TransportStats stats;
    stats.set_ready(builder_ && builder_->done());
    if (const auto newest = builder_ && builder_->newest() ? builder_->newest() : transport_) {
        stats.set_surfels(static_cast<std::uint32_t>(newest->surface->surfels.count));
        stats.set_links_per_surfel(newest->links.per_surfel());
        stats.set_bytes(static_cast<double>(newest->bytes()));
        stats.set_seconds(newest->seconds);
    }
    return stats;
}

v1::FrameReport Renderer::run(const FrameInputs& inputs, std::vector<SlotRef> wanted, Timers& timers) {
    std::vector<Pass> passes = build_pipeline(inputs);
    gl::Query before;
    v1::FrameReport report;
    std::vector<v1::PassReport> rows = execute(
        passes, wanted, pass_cache_,
        [&](std::size_t row) {
            if (passes[row].on_gpu) before = Timers::stamp();
        },
        [&](std::size_t row) {
            if (passes[row].on_gpu) timers.passes.emplace_back(row, std::pair(std::move(before), Timers::stamp()));
            if (inspector_) inspect_slot(inputs, passes[row].writes, inspector_);
        });
    report.set_scene_rev(inputs.scene.scene_rev);
    for (v1::PassReport& row : rows) *report.add_passes() = std::move(row);
    // Asked again nothing would run, unless luminaires' own layers or more bounces are to follow.
    const bool seed = inputs.scene.technique != Technique::standard;
    const bool all = !inputs.merged && (seed || outdated(build_pipeline(inputs), wanted, pass_cache_).empty());
    if (inputs.target.id == live_.id) settled_ = all;
    report.set_settled(all && (seed || !builder_ || builder_->done()));
    return report;
}

// Whether the picture is made of all luminaires at once, and which own layers follow in this frame. While the camera
// moves, or more luminaires than would be quicker one by one, it is; when they rest one luminaire after the other is
// made on its own, those at level 0 last, and with the last of them the picture is theirs.
void Renderer::choose_layers(FrameInputs& inputs) {
    const Scene& scene = inputs.scene;
    const Revision last = inputs.seen_rev = std::exchange(last_rev_, scene.scene_rev);
    const bool merged_before = std::exchange(merged_, false);
    if (!inputs.can_merge()) return;
    const std::vector<Pass> passes = build_pipeline(inputs);
    const std::set<SlotRef> old = outdated(passes, wanted_slots(inputs, true), pass_cache_);
    // Shaders have each luminaire's own light by the way, once it is solved.
    const bool by_gl = inputs.gathers_by_gl(), grid_moves = !by_gl && old.contains({Slot::grid, live_.id, 0});
    std::vector<std::pair<bool, std::uint32_t>> waiting;  // dark, id
    std::size_t stale = 0;
    for (const Light& light : scene.lights) {
        const bool is_old = by_gl ? old.contains({Slot::solve, 0, light.id})
                                  : old.contains({Slot::direct, live_.id, light.id}) ||
                                        old.contains({Slot::gather, live_.id, light.id});
        if (!is_old) continue;
        ++stale;
        const bool rests = std::max({light.position_rev, light.aim_rev, light.profile_rev}) <= last;
        if (rests) waiting.emplace_back(light_weight(scene, light) == glm::dvec3(0.0), light.id);
    }
    const bool many = stale > (by_gl ? 4 : 2) + inputs.layered() / 4;
    merged_ = grid_moves ? stale > 0 : stale > 1 && (merged_before || many);
    inputs.merged = merged_;
    if (merged_) {  // the sum is made anew, or what moves was never in it
        in_sum_.clear();
        inputs.in_sum.clear();
    }
    if (!merged_ || grid_moves || waiting.empty()) return;
    // What is shown comes first: the solve of all at once to its end.
    const std::set<SlotRef> left = outdated(build_pipeline(inputs), wanted_slots(inputs, true), pass_cache_);
    if (left.contains({Slot::merged_solve, live_.id, 0}) && !left.contains({Slot::merged, live_.id, 0})) return;
    // In turn, so that none that goes on moving holds up the others.
    std::sort(waiting.begin(), waiting.end());
    const bool dark = waiting.front().first;
    const auto end = std::find_if(waiting.begin(), waiting.end(), [&](const auto& one) { return one.first != dark; });
    const auto next = std::upper_bound(waiting.begin(), end, std::pair(dark, refilled_));
    refilled_ = next != end ? next->second : waiting.front().second;
    inputs.refill.push_back(refilled_);
}

void Renderer::begin_frame(const Scene& scene, std::int64_t drained_ns) {
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
    auto frame = std::make_unique<InFlight>();
    frame->drained_ns = drained_ns;
    frame->width_px = live_.width_px;
    frame->height_px = live_.height_px;
    frame->report = run(inputs, wanted_slots(inputs, true), frame->timers);
    frame->report.set_width_px(static_cast<std::uint32_t>(live_.width_px));
    frame->report.set_height_px(static_cast<std::uint32_t>(live_.height_px));
    frame->report.set_effort(static_cast<std::uint32_t>(quality_level_));
    if (transport_ && scene.technique == Technique::standard) {
        frame->report.set_links(transport_->links.per_surfel());
        frame->report.set_refined_rounds(
            merged_ ? 0 : final_gather_passes(inputs.context(), inputs.lights, live_screen_->light));
    }
    const auto& passes = frame->report.passes();
    frame->picture = std::any_of(passes.begin(), passes.end(),
                                 [](const auto& row) { return row.name() == "nv12" && row.state() == "ran"; });
    frame->nv12 = std::exchange(live_screen_->composed.nv12, nullptr);
    if (frame->picture) {
        const std::size_t bytes =
            static_cast<std::size_t>(live_.width_px) * static_cast<std::size_t>(live_.height_px / 2 * 3);
        if (bytes != readback_bytes_) {
            free_readbacks_.clear();
            readback_bytes_ = bytes;
        }
        if (free_readbacks_.empty()) {
            free_readbacks_.push_back(
                gl::make_buffer("readback", bytes, nullptr, GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT));
        }
        frame->readback = std::move(free_readbacks_.back());
        free_readbacks_.pop_back();
        glBindFramebuffer(GL_READ_FRAMEBUFFER, live_.nv12_fbo.id());
        glBindBuffer(GL_PIXEL_PACK_BUFFER, frame->readback.id());
        glPixelStorei(GL_PACK_ALIGNMENT, 1);
        glReadPixels(0, 0, live_.width_px, live_.height_px / 2 * 3, GL_RED, GL_UNSIGNED_BYTE, nullptr);
        glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    }
    if (!frame->nv12) {
        frame->fence = gl::Fence::insert();
        glFlush();
    }
    in_flight_.push_back(std::move(frame));
}

std::optional<FinishedFrame> Renderer::finish_frame(bool wait) {
    if (in_flight_.empty()) return std::nullopt;
    InFlight& frame = *in_flight_.front();
    constexpr GLuint64 kStep = 1'000'000'000;
    while (frame.fence && !frame.fence.wait(wait ? kStep : 0)) {
        if (!wait) return std::nullopt;
    }
    FinishedFrame done;
    done.width_px = frame.width_px;
    done.height_px = frame.height_px;
    done.drained_ns = frame.drained_ns;
    done.nv12 = std::move(frame.nv12);
    if (frame.picture) {
        const std::size_t bytes =
            static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px / 2 * 3);
        auto pixels = std::make_shared<std::vector<std::uint8_t>>(bytes);
        glGetNamedBufferSubData(frame.readback.id(), 0, static_cast<GLsizeiptr>(bytes), pixels->data());
        done.nv12 = std::move(pixels);
        if (bytes == readback_bytes_) free_readbacks_.push_back(std::move(frame.readback));
    }
    done.rendered_ns = monotonic_ns();
    done.report = std::move(frame.report);
    frame.timers.resolve(done.report);
    done.report.set_frame_ms(static_cast<double>(done.rendered_ns - done.drained_ns) * 1e-6);
    in_flight_.pop_front();
    return done;
}

std::vector<glm::vec3> Renderer::live_illuminance(const Scene& scene, bool indirect) {
    const std::vector<int> layers = layers_of(scene, live_);
    std::vector<glm::vec3> weights(static_cast<std::size_t>(live_.layer_count), glm::vec3(0.0f));  // cd
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const Light& light = scene.lights[i];
        const auto summed = in_sum_.find(light.id);
        if (layers[i] >= 0)
            weights[static_cast<std::size_t>(layers[i])] =
                glm::vec3((light_weight(scene, light) -
                           (summed != in_sum_.end() ? scene.master_ratio * summed->second : glm::dvec3(0.0))) *
                          static_cast<double>(lights_.at(light.id).web->peak_cd));
    }
    if (direct_by_rays_ && scene.technique == Technique::standard) {
        const Eye eye;
        FrameInputs inputs = inputs_of(scene, live_, *live_screen_, eye);
        inputs.merged = merged_;
        return cpu_illuminance(inputs.context(), weights, indirect, live_screen_->surfaces, live_screen_->light);
    }
    std::vector<glm::vec3> sum(static_cast<std::size_t>(live_.width_px) * static_cast<std::size_t>(live_.height_px));
    std::vector<glm::vec3> layer(sum.size());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    const float unit_lx = live_screen_->besides_unit_lx[indirect ? 1 : 0];
    const bool besides = geometry_->emissive() || scene.lights.size() > layer_count_ || merged_;
    if (unit_lx > 0.0f && besides && scene.technique == Technique::standard) {
        glGetTextureSubImage(live_.besides.id(), 0, 0, 0, indirect ? 1 : 0, live_.width_px, live_.height_px, 1, GL_RGB,
                             GL_FLOAT, static_cast<GLsizei>(layer.size() * sizeof(glm::vec3)), layer.data());
        for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += unit_lx * layer[p];
    }
    for (std::size_t i = 0; i < weights.size() && !(indirect && merged_); ++i) {
        const glm::vec3 weight = weights[i] / geometry_->layer_unit_m2();
        if (weight == glm::vec3(0.0f)) continue;
        glGetTextureSubImage(indirect ? live_.indirect.id() : live_.direct.id(), 0, 0, 0, static_cast<GLint>(i),
                             live_.width_px, live_.height_px, 1, GL_RGB, GL_FLOAT,
                             static_cast<GLsizei>(layer.size() * sizeof(glm::vec3)), layer.data());
        for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += weight * (indirect ? layer[p] : glm::vec3(layer[p].r));
    }
    return sum;
}

v1::MeterReading Renderer::meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& unit_normal,
                                 MeterQuality quality, int bounces) {
    Scene metered = scene;
    if (quality == MeterQuality::rsm) metered.technique = Technique::standard;
    prepare(metered, false);
    const Target target =
        make_target(next_target_++, TargetKind::precise, 1, 1, std::min(metered.lights.size(), kMostLayers), false);
    // The eye stands one metre above the point and looks straight down at it.
    Eye eye;
    eye.position = point + unit_normal;
    eye.forward = -unit_normal;
    eye.right = glm::normalize(
        glm::cross(unit_normal, std::abs(unit_normal.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
    eye.up = glm::cross(eye.right, eye.forward);
    ScreenLight screen;
    FrameInputs inputs = inputs_of(metered, target, screen, eye);
    inputs.bounces = bounces;
    inputs.meter = quality == MeterQuality::rsm ? FrameInputs::Meter::rsm : FrameInputs::Meter::interactive;
    Timers timers;
    run(inputs, wanted_slots(inputs, false), timers);
    glm::dvec3 direct_lx(0.0), indirect_lx(0.0);
    double variance = 0.0, direct_variance = 0.0;  // of the luminance, lx²; luminaires are independent
    unsigned samples = 0;
    const auto photopic = [](const glm::dvec3& rgb) { return glm::dot(rgb, glm::dvec3(0.2126, 0.7152, 0.0722)); };
    const auto variance_of = [&](const PointLight& light, const glm::dvec3& weight) {
        double sum = 0.0, squares = 0.0;
        for (const glm::dvec3& part : light.parts) {
            const double part_lx = photopic(weight * part);
            sum += part_lx;
            squares += part_lx * part_lx;
        }
        constexpr double kParts = kMeterParts;
        return std::max(0.0, squares - sum * sum / kParts) / (kParts * (kParts - 1.0));
    };
    for (std::size_t i = 0; i < metered.lights.size(); ++i) {
        if (inputs.layers[i] < 0) continue;
        const LightGpu& gpu = *inputs.lights[i];
        const glm::dvec3 weight = light_weight(metered, metered.lights[i]) * static_cast<double>(gpu.web->peak_cd);
        float direct = 0.0f;
        glm::vec4 indirect(0.0f);
        const auto layer = static_cast<GLint>(inputs.layers[i]);
        glGetTextureSubImage(target.direct.id(), 0, 0, 0, layer, 1, 1, 1, GL_RED, GL_FLOAT, sizeof direct, &direct);
        glGetTextureSubImage(target.indirect.id(), 0, 0, 0, layer, 1, 1, 1, GL_RGBA, GL_FLOAT, sizeof indirect,
                             &indirect[0]);
        const double unit_m2 = static_cast<double>(geometry_->layer_unit_m2());
        direct_lx += weight * (static_cast<double>(direct) / unit_m2);
        const glm::dvec3 from_light = point - metered.lights[i].position;
        glm::dvec3 bounced = glm::dvec3(indirect) / unit_m2;
        if (quality != MeterQuality::rsm && metered.technique == Technique::standard)
            bounced = screen.meter.layers.at(static_cast<std::size_t>(layer)).light;
        if (quality == MeterQuality::rsm) {
            // Each half of the texels, doubled, is an estimate of its own; half their difference is the mean's error.
            const auto halves = checkerboard_irradiance(gpu.texels, from_light, unit_normal);
            bounced = halves[0] + halves[1];
            const double error = photopic(weight * (halves[0] - halves[1]));
            variance += error * error;
            samples += lit_texels(gpu.texels);
        } else if (metered.technique == Technique::standard) {
            variance += variance_of(screen.meter.layers.at(static_cast<std::size_t>(layer)), weight);
        }
        indirect_lx += weight * bounced;
    }
    if (quality != MeterQuality::rsm && metered.technique == Technique::standard) {
        samples = kMeterLinks;
        for (const auto& [direct, bounced] : {screen.meter.emitted, screen.meter.summed}) {
            direct_lx += direct.light;
            indirect_lx += bounced.light;
            direct_variance += variance_of(direct, glm::dvec3(1.0));
            variance += variance_of(bounced, glm::dvec3(1.0));
        }
    }
    pass_cache_.forget_target(target.id);
    v1::MeterReading reading;
    reading.set_direct_lx(photopic(direct_lx));
    reading.set_indirect_lx(photopic(indirect_lx));
    reading.set_total_lx(photopic(direct_lx + indirect_lx));
    for (int k = 0; k < 3; ++k) {
        reading.add_direct_rgb_lx(direct_lx[k]);
        reading.add_indirect_rgb_lx(indirect_lx[k]);
        reading.add_point_m(point[k]);
    }
    if (quality == MeterQuality::rsm || metered.technique == Technique::standard) {
        reading.set_direct_error_lx(std::sqrt(direct_variance));  // of luminaires 0: the web itself, evaluated
        // The transport's own error beside that of the point's links: measured against the reference
        // (docs/accuracy.md).
        constexpr double kTransportError = 0.02;
        const bool traced = quality != MeterQuality::rsm;
        reading.set_indirect_error_lx(
            std::sqrt(variance + (traced ? std::pow(kTransportError * reading.indirect_lx(), 2.0) : 0.0)));
        reading.set_bounces(!traced || bounces == 1 ? "1" : bounces == 0 ? "0" : "all");
    }
    reading.set_samples(samples);
    return reading;
}

}  // namespace gonio
