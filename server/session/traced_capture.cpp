#include "server/session/traced_capture.h"

#include <algorithm>
#include <cmath>

#include "server/base/clock.h"
#include "server/scene/apply.h"
#include "server/scene/false_color.h"
#include "server/scene/scene.h"
#include "server/scene/shown_scene.h"
#include "server/scene/white_balance.h"
#include "server/trace/denoise.h"
#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

constexpr double kRefineSeconds = 0.25;  // between two reports of progress

trace::Quantity quantity_of(View view) {
    switch (view) {
        case View::direct:
            return trace::Quantity::radiance_direct;
        case View::indirect:
            return trace::Quantity::radiance_indirect;
        case View::illuminance:
            return trace::Quantity::irradiance;
        default:
            return trace::Quantity::radiance;
    }
}

// Result: the value of the view in its unit: an rgb of cd/m², or lux or cd/m² three times.
glm::vec3 view_value(const glm::vec3& traced, View view, double gain) {
    if (view == View::illuminance || view == View::luminance) return glm::vec3(glsl::luminance(traced));
    return view == View::indirect ? traced * static_cast<float>(gain) : traced;
}

std::uint8_t byte_of(float encoded) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(encoded, 0.0f, 1.0f) * 255.0f));
}

// Result: gamma-encoded R'G'B' of an exposed colour, as shaders/passes/composite.frag has it.
glm::vec3 look_of(const glm::vec3& exposed, Tone tone, const glm::mat3& white) {
    glm::vec3 shown = glm::max(white * exposed, 0.0f);
    if (tone == Tone::knee) shown = {glsl::shoulder(shown.x), glsl::shoulder(shown.y), glsl::shoulder(shown.z)};
    if (tone == Tone::aces) shown = glsl::tone_aces(shown);
    if (tone == Tone::agx) shown = glsl::tone_agx(shown);
    if (tone == Tone::neutral) shown = glsl::tone_neutral(shown);
    shown = glm::min(shown, 1.0f);
    return {glsl::srgb_encode(shown.x), glsl::srgb_encode(shown.y), glsl::srgb_encode(shown.z)};
}

// Pixels of illuminance or luminance in their colours, with isolux lines as shaders/passes/composite.frag draws them.
void develop_false_color(const std::vector<float>& values, const Scene& scene, const CaptureRequest& request,
                         CapturedPicture& picture) {
    const layouts::FalseColorBlock block =
        color_block(false_color_of(scene, request.view), shows_difference(scene, request.view));
    const auto value_at = [&](std::size_t pixel) {
        const float* traced = &values[4 * pixel];
        return view_value(glm::vec3(traced[0], traced[1], traced[2]) / traced[3], request.view, 1.0).x;
    };
    const auto width = static_cast<std::size_t>(picture.width_px);
    for (std::size_t i = 0; i < values.size() / 4; ++i) {
        const float coverage = values[4 * i + 3];
        const float value = coverage > 0.0f ? value_at(i) : 0.0f;
        glm::vec3 color = false_color(block, value);
        int line = 0;
        if (block.marks.y > 0.0f && coverage > 0.0f) {
            const int own = levels_reached(block, value);
            const auto look = [&](std::size_t beside) {
                if (!(values[4 * beside + 3] > 0.0f)) return;
                const int other = levels_reached(block, value_at(beside));
                if (other != own) line = std::max(own, other);
            };
            if (i % width + 1 < width) look(i + 1);
            if (i >= width) look(i - width);
        }
        if (line > 0) color = glm::vec3(glsl::luminance(color) > 0.5f ? 0.0f : 1.0f);
        color = glm::mix(glm::vec3(glsl::background_shade()), color, coverage);
        for (int k = 0; k < 3; ++k) picture.rgba8[4 * i + static_cast<std::size_t>(k)] = byte_of(color[k]);
        picture.rgba8[4 * i + 3] = line > 0 ? static_cast<std::uint8_t>(line) : 255;
    }
}

// What is traced for a view: the scene, or what it shows in its place: light that comes and light that goes.
struct Part {
    std::shared_ptr<const trace::World> world;
    float sign = 1.0f;
    bool lit = true;
};
std::vector<Part> parts_of(const std::shared_ptr<const trace::World>& world, const Scene& scene, View view) {
    const std::optional<Scene> shown = shown_scene(scene, view);
    if (!shown) return {{world}};
    std::vector<Part> parts;
    const std::array<Scene, 2> halves = signed_parts(*shown);
    for (const Scene& half : halves) {
        const bool lit = std::ranges::any_of(
            half.lights, [&](const Light& light) { return light_weight(half, light) != glm::dvec3(0.0); });
        if (lit) parts.push_back({trace::make_world(half, world.get()), &half == &halves[0] ? 1.0f : -1.0f});
    }
    if (parts.empty()) parts.push_back({trace::make_world(halves[0], world.get()), 1.0f, false});
    return parts;
}

// Replaces the colours of values. Result: trace::Denoised::noise.
double put_denoised(std::vector<float>& values, const trace::DenoisePlanes& planes, const trace::Settings& settings) {
    const trace::Denoised denoised = trace::denoise(planes, settings.threads, settings.idle);
    for (std::size_t i = 0; i < values.size(); ++i)
        if (i % 4 < 3) values[i] = denoised.radiance[i / 4][static_cast<int>(i % 4)];
    return denoised.noise;
}

struct TracedPart {
    std::vector<float> values, haze;
    trace::Progress progress;
    std::optional<double> denoised_noise;
};

// Result: nothing if stopped.
std::optional<TracedPart> trace_part(const Part& part, const Scene& scene, const CaptureRequest& request,
                                     trace::Settings settings, const std::stop_token& stop,
                                     const std::function<void(const trace::Progress&)>& each) {
    trace::PictureRequest asked;
    asked.camera = scene.camera;
    asked.width_px = request.width_px;
    asked.height_px = request.height_px;
    asked.quantity = quantity_of(request.view);
    asked.antialias = request.samples_per_pixel > 1;
    asked.planes = request.denoise;
    if (request.denoise) settings.min_passes = trace::kLeastDenoised;
    if (!part.lit) {  // it only tells where surfaces are
        settings.bounces = 0;
        settings.max_passes = trace::kLeastPassesOfNoise;
    }
    trace::Picture traced(part.world, asked, settings);
    TracedPart result;
    do {
        result.progress = traced.refine(kRefineSeconds, stop);
        if (!part.lit) result.progress.noise = 0.0, result.progress.noise_reached = true;
        each(result.progress);
    } while (!result.progress.complete && !stop.stop_requested());
    if (stop.stop_requested()) return std::nullopt;
    result.values = traced.values();
    result.haze = traced.haze();
    if (request.denoise) result.denoised_noise = put_denoised(result.values, traced.planes(), request.settings);
    return result;
}

// Of four floats each fourth is a coverage, which is the same in all.
void add(std::vector<float>& values, const std::vector<float>& more, float sign) {
    values.resize(more.size());
    for (std::size_t i = 0; i < more.size(); ++i) values[i] = i % 4 < 3 ? values[i] + sign * more[i] : more[i];
}

}  // namespace

std::optional<TracedCapture> trace_capture(const std::shared_ptr<const trace::World>& world, const Scene& scene,
                                           const CaptureRequest& request, std::stop_token stop,
                                           const std::function<void(const trace::Progress&)>& each) {
    const std::vector<Part> parts = parts_of(world, scene, request.view);
    const std::int64_t begin_ns = monotonic_ns();
    TracedCapture capture;
    std::vector<float> values, haze;
    std::uint32_t before = 0;  // passes of the parts before
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const auto left = static_cast<double>(parts.size() - i);
        trace::Settings settings = request.settings;
        if (settings.max_seconds > 0.0)  // what is left is shared by the parts that are left
            settings.max_seconds = std::max(1e-3, (settings.max_seconds - seconds_since(begin_ns)) / left);
        const auto traced = trace_part(parts[i], scene, request, settings, stop, [&](trace::Progress progress) {
            progress.passes += before;
            if (left > 1.0) progress.seconds_left.reset();
            each(progress);
        });
        if (!traced) return std::nullopt;
        before += traced->progress.passes;
        haze = traced->haze;
        add(values, traced->values, parts[i].sign);
        if (traced->denoised_noise) capture.denoised_noise = traced->denoised_noise;
        if (i == 0) {
            capture.progress = traced->progress;
            continue;
        }
        capture.progress.passes = std::min(capture.progress.passes, traced->progress.passes);
        capture.progress.noise = std::max(capture.progress.noise, traced->progress.noise);
        capture.progress.noise_reached &= traced->progress.noise_reached;
    }
    capture.picture = develop(values, scene, request);
    if (request.format == "exr" && parts.size() == 1) capture.picture.haze = std::move(haze);
    capture.picture.denoised = request.denoise;
    return capture;
}

CapturedPicture develop(const std::vector<float>& values, const Scene& scene, const CaptureRequest& request) {
    CapturedPicture picture;
    picture.width_px = request.width_px;
    picture.height_px = request.height_px;
    const bool raw = request.format == "exr";
    if (raw)
        picture.values.resize(values.size());
    else
        picture.rgba8.resize(values.size());
    if (!raw && is_false_color(request.view)) {
        develop_false_color(values, scene, request, picture);
        return picture;
    }
    const auto ev100 = static_cast<float>(scene.exposure_ev100);
    const glm::mat3 white(white_balance(scene.look.white_k, scene.look.white_duv));
    for (std::size_t i = 0; i < values.size(); i += 4) {
        const float coverage = values[i + 3];  // of the pixel by surfaces
        const glm::vec3 traced(values[i], values[i + 1], values[i + 2]);
        if (raw) {
            const glm::vec3 value = view_value(traced, request.view, scene.view_gain);
            for (int k = 0; k < 3; ++k) picture.values[i + static_cast<std::size_t>(k)] = value[k];
            picture.values[i + 3] = coverage;
            continue;
        }
        const int x = static_cast<int>(i / 4) % picture.width_px,
                  y = picture.height_px - 1 - static_cast<int>(i / 4) / picture.width_px;
        glm::vec3 encoded(glsl::background_shade());
        if (coverage > 0.0f) {
            const glm::vec3 value = view_value(traced / coverage, request.view, scene.view_gain);
            const glm::vec3 shown =
                look_of(glsl::expose(value, ev100), scene.look.tone, white) + glm::vec3(glsl::display_dither(x, y));
            encoded = glm::mix(encoded, shown, coverage);
        }
        for (int k = 0; k < 3; ++k) picture.rgba8[i + static_cast<std::size_t>(k)] = byte_of(encoded[k]);
        picture.rgba8[i + 3] = 255;
    }
    return picture;
}

}  // namespace gonio
