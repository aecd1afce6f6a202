// Captures: the picture in tiles, each rendered like a small live frame through a window of the view.
#include <algorithm>
#include <cmath>
#include <glm/gtc/packing.hpp>

#include "server/render/pipeline.h"
#include "server/render/renderer.h"
#include "server/render/timers.h"
#include "server/scene/false_color.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/shown_scene.h"

namespace gonio {
namespace {

// Work of one tile, in seed samples: about a quarter of a second on two cores. What a pixel of the default technique
// costs in them was measured: VPLs are cheap, rays are not. kRaySamples: a shadow ray to one of many luminaires.
constexpr double kTileSamples = 16e6;
constexpr double kPreciseSamples = 300.0, kStillSamples = 60.0, kRaySamples = 3.0;
// Pixels around a tile that its interleaved gather filters with and throws away.
constexpr int kMargin = 4;

// Whether a capture lights its luminaires as one: it shows their sum alone, and they are too many for links that take
// direct light of their own (final_gather.h). A sum's bounces are never negative: a difference has layers.
bool sums(const Scene& scene, View view) {
    return !shows_difference(scene, view) && scene.technique == Technique::standard && shows_lit_surfaces(view) &&
           scene.lights.size() > lighting::kMostExactLights;
}

int tile_side(const Scene& scene, View view, bool raw) {
    if (!shows_lit_surfaces(view)) return 4096;
    const auto lights = static_cast<double>(std::clamp<std::size_t>(scene.lights.size(), 1, kMostLayers));
    const double one = scene.technique != Technique::standard ? scene.samples : raw ? kPreciseSamples : kStillSamples;
    const double samples =
        sums(scene, view) ? one + kRaySamples * static_cast<double>(scene.lights.size()) : one * lights;
    const int side = static_cast<int>(std::sqrt(kTileSamples / samples));
    return std::clamp(side, 32, 1024) & ~3;  // whole dither cells
}

// Adds a tile's report: what ran in any tile ran, times and draws add up.
void add_report(v1::FrameReport& sum, const v1::FrameReport& tile) {
    if (sum.passes_size() == 0) {
        sum = tile;
        return;
    }
    for (int i = 0; i < sum.passes_size(); ++i) {
        v1::PassReport& row = *sum.mutable_passes(i);
        const v1::PassReport& other = tile.passes(i);
        if (other.state() != "ran") continue;
        row.set_state("ran");
        row.set_faces(row.faces() + other.faces());
        row.set_draws(row.draws() + other.draws());
        row.set_cpu_ms(row.cpu_ms() + other.cpu_ms());
        row.set_gpu_ms(row.gpu_ms() + other.gpu_ms());
    }
}

// Pixels of a picture, from its top left.
struct Rectangle {
    int x, y, width, height;
};

// Reads a tile's texture (rows from the bottom) and copies all but its margin into the picture's rectangle.
template <typename T>
void copy_tile(GLuint texture, GLenum type, int margin, std::vector<T>& picture, int picture_width,
               const Rectangle& to_fill) {
    const auto [x, y, width, height] = to_fill;
    const int stride = width + 2 * margin;
    std::vector<T> values(std::size_t{4} * stride * (height + 2 * margin));
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glGetTextureImage(texture, 0, GL_RGBA, type, values.size() * sizeof(T), values.data());
    for (int row = 0; row < height; ++row) {
        const T* from = values.data() + std::size_t{4} * ((margin + height - 1 - row) * stride + margin);
        std::copy_n(from, 4 * width, picture.data() + std::size_t{4} * ((y + row) * picture_width + x));
    }
}

// The same of the haze.
void copy_haze(const ScreenLight& screen, int margin, CapturedPicture& picture, const Rectangle& to_fill) {
    const lighting::AirPicture& air = screen.air.picture;
    const std::size_t row_length = screen.surfaces.gbuffer.row_length;
    picture.haze.resize(std::size_t{3} * picture.width_px * picture.height_px);
    for (int row = 0; row < to_fill.height; ++row) {
        const std::size_t from = (margin + to_fill.height - 1 - row) * row_length + margin,
                          to = std::size_t{1} * (to_fill.y + row) * picture.width_px + to_fill.x;
        for (std::size_t x = 0; x < static_cast<std::size_t>(to_fill.width); ++x)
            for (std::size_t k = 0; k < 3; ++k)
                picture.haze[3 * (to + x) + k] = air.unit * glm::unpackHalf1x16(air.halves[4 * (from + x) + k]);
    }
}

}  // namespace

std::unique_ptr<CaptureJob> Renderer::begin_capture(const Scene& scene, View view, int width_px, int height_px,
                                                    bool raw) {
    auto job = std::make_unique<CaptureJob>();
    job->scene = shown_scene(scene, view).value_or(scene);
    job->view = view;
    job->raw = raw;
    job->tile_px = tile_side(scene, view, raw);
    job->started_ns = monotonic_ns();
    job->picture = std::make_shared<CapturedPicture>();
    job->picture->width_px = width_px;
    job->picture->height_px = height_px;
    const std::size_t values = std::size_t{4} * width_px * height_px;
    if (raw)
        job->picture->values.resize(values);
    else
        job->picture->rgba8.resize(values);
    return job;
}

// The first bounces of a capture's lights in the scene's order, as far as they are. They are kept with the capture,
// because frames of another scene between its steps forget its lights.
struct FirstBounces {
    std::shared_ptr<const transport::Transport> transport;  // whose surfels they are of
    std::vector<LightGpu::Exact> of;
};

// The first bounce of up to eight narrow lights, as a picture that rests has it, in steps. Where the transport becomes
// better meanwhile it begins anew. What takes more than a minute of work is left out. Result: whether that is done.
bool Renderer::continue_first_bounces(CaptureJob& job, const FrameInputs& inputs) {
    constexpr std::size_t kMostLights = 8;
    constexpr std::int64_t kStepNs = 250'000'000, kMostNs = 60'000'000'000;
    const Scene& scene = job.scene;
    if (scene.lights.size() > kMostLights || scene.technique != Technique::standard || job.bounces == 0 ||
        (job.view != View::beauty && job.view != View::indirect))
        return true;
    const std::int64_t began_ns = monotonic_ns();
    std::vector<SlotRef> solved;
    for (const Light& light : scene.lights) solved.push_back({Slot::solve, 0, light.id});
    std::vector<Pass> passes = build_pipeline(inputs);
    execute(passes, solved, pass_cache_);
    if (!job.first_bounces) job.first_bounces = std::make_shared<FirstBounces>();
    FirstBounces& kept = *job.first_bounces;
    if (kept.transport != transport_) kept = {transport_, std::vector<LightGpu::Exact>(scene.lights.size())};
    for (std::size_t i = 0; i < scene.lights.size(); ++i)
        if (inputs.lights[i]->exact.next < kept.of[i].next)
            inputs.lights[i]->exact = kept.of[i];
        else if (inputs.lights[i]->exact.next > kept.of[i].next)
            kept.of[i] = inputs.lights[i]->exact;  // the live picture had it
    if (job.next_tile > 0 || job.first_bounce_ns > kMostNs) return true;
    const auto late = [&] { return monotonic_ns() > began_ns + kStepNs; };
    bool done = true;
    for (std::size_t i = 0; i < scene.lights.size() && done; ++i) {
        if (!first_bounce_left(inputs.context(), *inputs.lights[i])) continue;
        done = continue_first_bounce(inputs.context(), scene.lights[i], *inputs.lights[i], late);
        kept.of[i] = inputs.lights[i]->exact;
    }
    job.first_bounce_ns += monotonic_ns() - began_ns;
    return done;
}

bool Renderer::continue_capture(CaptureJob& job) {
    CapturedPicture& picture = *job.picture;
    const int columns = job.columns(), rows = job.rows();
    const int x = job.next_tile % columns * job.tile_px,
              y = job.next_tile / columns * job.tile_px;  // from the top left
    const int width = std::min(job.tile_px, picture.width_px - x),
              height = std::min(job.tile_px, picture.height_px - y);
    const bool whole = columns == 1 && rows == 1;
    const int margin = whole ? 0 : kMargin;
    const int target_width = width + 2 * margin, target_height = height + 2 * margin;

    const bool as_one = sums(job.scene, job.view);
    prepare(job.scene, false, job.view < View::mask && job.view != View::direct);
    prepare_drawn(direct_by_rays_ || job.samples_per_pixel > 1);
    const Target target = make_target(next_target_++, job.raw ? TargetKind::precise : TargetKind::still, target_width,
                                      target_height, as_one ? 0 : std::min(job.scene.lights.size(), kMostLayers),
                                      geometry_->emissive(), false, geometry_->detailed());
    Eye eye = eye_of(job.scene.camera, picture.width_px, picture.height_px);
    eye.window_centre = {(2.0 * x + width) / picture.width_px - 1.0, 1.0 - (2.0 * y + height) / picture.height_px};
    eye.window_half = {static_cast<double>(target_width) / picture.width_px,
                       static_cast<double>(target_height) / picture.height_px};
    ScreenLight screen;
    FrameInputs inputs = inputs_of(job.scene, target, screen, eye);
    inputs.view = job.view;
    inputs.bounces = job.bounces;
    inputs.samples_per_pixel = job.samples_per_pixel;
    if (as_one) {
        inputs.shares_sum = true;
        std::fill(inputs.layer_of.begin(), inputs.layer_of.end(), -1);
        if (!captured_sum_) captured_sum_ = std::make_unique<Merged>();
        screen.light.summed_list = std::move(*captured_sum_);
    }
    if (!continue_first_bounces(job, inputs)) {
        pass_cache_.forget_target(target.id);
        return false;
    }
    gl::Texture values;
    gl::Framebuffer values_fbo;
    if (job.raw) {
        values = gl::make_texture_2d("capture values", GL_RGBA32F, target_width, target_height, gl::Filter::nearest);
        values_fbo = gl::make_framebuffer("capture values", {values.id()}, 0);
        inputs.raw = values_fbo.id();
    }
    Timers timers;
    v1::FrameReport report = run(inputs, wanted_slots(inputs, false), timers);
    if (as_one) *captured_sum_ = std::move(screen.light.summed_list);
    const Rectangle tile{x, y, width, height};
    if (job.raw && inputs.haze && shows_air(job.view)) copy_haze(screen, margin, picture, tile);
    if (job.raw)
        copy_tile(values.id(), GL_FLOAT, margin, picture.values, picture.width_px, tile);
    else
        copy_tile(target.display.id(), GL_UNSIGNED_BYTE, margin, picture.rgba8, picture.width_px, tile);
    timers.resolve(report);
    pass_cache_.forget_target(target.id);
    job.failure = failure_of(report);
    if (!job.failure.empty()) return true;
    add_report(picture.report, report);
    picture.report.set_frame_ms(static_cast<double>(monotonic_ns() - job.started_ns) * 1e-6);
    return ++job.next_tile == columns * rows;
}

CapturedPicture Renderer::live_picture() {
    CapturedPicture picture;
    if (live_.display.id() == 0) return picture;
    picture.width_px = live_.width_px;
    picture.height_px = live_.height_px;
    picture.rgba8.resize(std::size_t{4} * live_.width_px * live_.height_px);
    copy_tile(live_.display.id(), GL_UNSIGNED_BYTE, 0, picture.rgba8, live_.width_px,
              {0, 0, live_.width_px, live_.height_px});
    return picture;
}

std::shared_ptr<const CapturedPicture> Renderer::capture(const Scene& scene, View view, int width_px, int height_px,
                                                         bool raw, int bounces, unsigned samples_per_pixel) {
    const std::unique_ptr<CaptureJob> job = begin_capture(scene, view, width_px, height_px, raw);
    job->bounces = bounces;
    job->samples_per_pixel = samples_per_pixel;
    while (!continue_capture(*job)) {
    }
    if (!job->failure.empty()) throw gl::ProgramError(job->failure);
    return job->picture;
}

}  // namespace gonio
