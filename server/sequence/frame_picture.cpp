#include "server/sequence/frame_picture.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/assets/exr.h"
#include "server/scene/apply.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/session/capture_file.h"
#include "server/session/legend.h"
#include "server/session/traced_capture.h"
#include "server/trace/bodies.h"
#include "server/trace/geometry.h"
#include "server/trace/parallel.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::sequence {
namespace {

constexpr std::size_t kMostIdBytes = 1u << 16;  // of the header's list of nodes; more are left out

bool has_view(LayerKind kind) {
    return kind <= LayerKind::luminance;
}
View view_of(LayerKind kind) {
    return static_cast<View>(kind);
}
static_assert(static_cast<int>(View::luminance) == static_cast<int>(LayerKind::luminance));

std::string channel(LayerKind kind, const char* name) {
    return kind == LayerKind::beauty ? name : std::string(kLayerNames[static_cast<std::size_t>(kind)]) + "." + name;
}

ExrLayer layer_of(LayerKind kind, const std::vector<float>& rgba) {
    const bool one = kind == LayerKind::illuminance || kind == LayerKind::luminance;
    ExrLayer layer;
    for (const char* name : {"R", "G", "B"}) layer.channels.push_back(channel(kind, name));
    if (one) layer.channels = {channel(kind, "Y")};
    for (std::size_t i = 0; i < rgba.size(); i += 4)
        layer.values.insert(layer.values.end(), &rgba[i], &rgba[i] + (one ? 1 : 3));
    return layer;
}

// Of a picture of the view beauty.
ExrLayer luminance_of(const std::vector<float>& rgba) {
    ExrLayer layer{{channel(LayerKind::luminance, "Y")}, {}};
    for (std::size_t i = 0; i < rgba.size(); i += 4)
        layer.values.push_back(glsl::luminance(glm::vec3(rgba[i], rgba[i + 1], rgba[i + 2])));
    return layer;
}

void add_surface_layers(const Scene& scene, const Sequence& sequence, int width_px, int height_px,
                        std::vector<ExrLayer>& layers) {
    const auto wants = [&](LayerKind kind) {
        return std::ranges::find(sequence.layers, kind) != sequence.layers.end();
    };
    if (!wants(LayerKind::depth) && !wants(LayerKind::normal) && !wants(LayerKind::id)) return;
    SurfaceLayers surfaces = surface_layers(scene, width_px, height_px);
    if (wants(LayerKind::depth)) layers.push_back({{channel(LayerKind::depth, "Z")}, std::move(surfaces.depth_m)});
    if (wants(LayerKind::normal))
        layers.push_back(
            {{channel(LayerKind::normal, "X"), channel(LayerKind::normal, "Y"), channel(LayerKind::normal, "Z")},
             std::move(surfaces.normal)});
    if (wants(LayerKind::id)) layers.push_back({{channel(LayerKind::id, "Y")}, std::move(surfaces.id)});
}

// "1 floor", a line each.
std::string nodes_of(const SceneAsset& asset) {
    std::string text;
    std::size_t id = 0;
    const auto add = [&](const std::vector<Instance>& instances) {
        for (const Instance& instance : instances) {
            const std::string line = std::to_string(++id) + " " + instance.node + "\n";
            if (text.size() + line.size() <= kMostIdBytes) text += line;
        }
    };
    add(asset.instances);
    if (asset.bodies) add(asset.bodies->shown.instances);
    return text;
}

// What is known of how far off the picture is: of the reference its noise; else what the meter says of the point in its
// middle.
std::string error_text(Renderers& renderers, const Scene& scene, const CaptureRequest& request,
                       std::optional<double> noise) {
    if (noise) return print_number(*noise) + " of the mean, standard error of a pixel";
    if (request.quality == Quality::reference || scene.technique != Technique::standard || request.view >= View::mask)
        return "not known";
    const auto geometry = trace::geometry_of(scene);
    const Eye eye = eye_of(scene.camera, request.width_px, request.height_px);
    trace::SurfaceHit hit;
    if (!geometry->closest(geometry->local(eye.position), glm::vec3(eye.forward), 0.0f, true, hit,
                           trace::Geometry::kDice - 1))
        return "not known";
    const v1::MeterReading reading =
        renderers.renderer().meter(scene, glm::dvec3(hit.position) + geometry->origin(), glm::dvec3(hit.geometric),
                                   LiveRenderer::MeterQuality::interactive);
    return print_number(reading.indirect_error_lx()) + " lx of " + print_number(reading.total_lx()) +
           " lx in the middle of the picture";
}

ExrHeader header_of(const Scene& scene, const Sequence& sequence, int frame, const CaptureRequest& request) {
    ExrHeader header;
    header.date = sequence.date;
    header.texts = {{"gonio:revision", std::to_string(scene.scene_rev)},
                    {"gonio:technique", technique_name(scene.technique)},
                    {"gonio:quality", request.quality == Quality::reference ? "reference" : "interactive"},
                    {"gonio:frame", std::to_string(sequence.first_number + frame)},
                    {"gonio:time_s", print_number(sequence.time_s(frame))}};
    return header;
}

}  // namespace

Result<std::vector<CaptureRequest>> requests_of(const Sequence& sequence, const Scene& scene) {
    std::vector<CaptureRequest> requests;
    if (sequence.layers.empty()) {
        const auto request = check_capture(scene, sequence.query);
        if (!request) return request.error();
        return std::vector{*request};
    }
    if (sequence.query.denoise())
        return Error{"unsupported", "capture.denoise", "true", "only a picture alone is denoised, not layers"};
    const bool beauty = sequence.layers.front() == LayerKind::beauty;
    v1::CaptureQuery query = sequence.query;
    for (const LayerKind kind : sequence.layers) {
        if (!has_view(kind) || (kind == LayerKind::luminance && beauty)) continue;
        query.set_view(view_name(view_of(kind)));
        const auto request = check_capture(scene, query);
        if (!request) return request.error();
        requests.push_back(*request);
    }
    if (requests.empty()) {  // of its size alone
        query.set_view("beauty");
        const auto request = check_capture(scene, query);
        if (!request) return request.error();
    }
    return requests;
}

std::optional<TakenPicture> take_picture(Renderers& renderers, const Scene& scene, const CaptureRequest& request,
                                         const std::stop_token& stop) {
    if (request.quality == Quality::reference) {
        renderers.world = trace::make_world(scene, renderers.world.get());
        auto traced = trace_capture(renderers.world, scene, request, stop, [](const trace::Progress&) {});
        if (!traced) return std::nullopt;
        TakenPicture taken{std::move(traced->picture), traced->progress, std::nullopt};
        if (traced->progress.passes >= trace::kLeastPassesOfNoise)
            taken.noise = traced->denoised_noise.value_or(traced->progress.noise);
        return taken;
    }
    Renderer& renderer = renderers.renderer();
    const auto job =
        renderer.begin_capture(scene, request.view, request.width_px, request.height_px, request.format == "exr");
    job->bounces = request.settings.bounces;
    job->samples_per_pixel = request.samples_per_pixel;
    while (!renderer.continue_capture(*job))
        if (stop.stop_requested()) return std::nullopt;
    if (!job->failure.empty()) throw std::runtime_error(job->failure);
    return TakenPicture{std::move(*job->picture), std::nullopt, std::nullopt};
}

Result<std::optional<std::vector<std::byte>>> frame_bytes(Renderers& renderers, const Scene& scene,
                                                          const Sequence& sequence, int frame,
                                                          const std::stop_token& stop) {
    const auto requests = requests_of(sequence, scene);
    if (!requests) return requests.error();
    const auto done = [](Result<std::vector<std::byte>> bytes) -> Result<std::optional<std::vector<std::byte>>> {
        if (!bytes) return bytes.error();
        return std::optional(std::move(*bytes));
    };
    if (sequence.layers.empty()) {
        const CaptureRequest& request = requests->front();
        auto taken = take_picture(renderers, scene, request, stop);
        if (!taken) return std::optional<std::vector<std::byte>>();
        if (request.legend) draw_legend(taken->picture, scene, request.view);
        ExrHeader header = header_of(scene, sequence, frame, request);
        if (request.format == "exr")
            header.texts.emplace_back("gonio:error", error_text(renderers, scene, request, taken->noise));
        return done(encode_capture(taken->picture, request.view, request.format, header));
    }
    int width_px = static_cast<int>(sequence.query.width_px()),
        height_px = static_cast<int>(sequence.query.height_px());
    if (width_px == 0) width_px = scene.width_px, height_px = scene.height_px;
    std::vector<ExrLayer> layers;
    std::optional<ExrLayer> haze;
    std::optional<double> noise;  // of the worst
    for (const CaptureRequest& request : *requests) {
        const auto taken = take_picture(renderers, scene, request, stop);
        if (!taken) return std::optional<std::vector<std::byte>>();
        const CapturedPicture& picture = taken->picture;
        if (taken->noise) noise = std::max(noise.value_or(0.0), *taken->noise);
        layers.push_back(layer_of(static_cast<LayerKind>(request.view), picture.values));
        const bool derives = request.view == View::beauty &&
                             std::ranges::find(sequence.layers, LayerKind::luminance) != sequence.layers.end();
        if (derives) layers.push_back(luminance_of(picture.values));
        if (request.view == View::beauty && !picture.haze.empty())
            haze = ExrLayer{{"haze.R", "haze.G", "haze.B"}, picture.haze};
    }
    if (haze) layers.push_back(std::move(*haze));
    add_surface_layers(scene, sequence, width_px, height_px, layers);
    CaptureRequest shown;
    if (!requests->empty()) shown = requests->front();
    ExrHeader header = header_of(scene, sequence, frame, shown);
    header.texts.emplace_back("gonio:units",
                              "beauty, direct, indirect, luminance, haze: cd/m2; illuminance: lx; depth: m; normal: 1");
    if (!requests->empty()) header.texts.emplace_back("gonio:error", error_text(renderers, scene, shown, noise));
    if (std::ranges::find(sequence.layers, LayerKind::id) != sequence.layers.end())
        header.texts.emplace_back("gonio:nodes", nodes_of(*scene.asset));
    return done(encode_exr_layers(width_px, height_px, layers, header));
}

SurfaceLayers surface_layers(const Scene& scene, int width_px, int height_px) {
    const auto geometry = trace::geometry_of(scene);
    const Eye eye = eye_of(scene.camera, width_px, height_px);
    const glm::vec3 from = geometry->local(eye.position);
    const auto bodies = trace::body_geometry(body_places(scene), *geometry);
    const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
    SurfaceLayers layers{std::vector<float>(pixels), std::vector<float>(3 * pixels), std::vector<float>(pixels)};
    trace::parallel(height_px, 0, false, {}, [&](int y) {
        for (int x = 0; x < width_px; ++x) {
            const glm::dvec3 ray =
                ray_through(eye, (x + 0.5) / width_px * 2.0 - 1.0, 1.0 - (y + 0.5) / height_px * 2.0);
            const double length = glm::length(ray);  // the ray is one metre deep
            trace::SeenHit hit;
            if (!trace::closest_seen(*geometry, bodies.get(), from, glm::vec3(ray / length), hit,
                                     trace::Geometry::kDice - 1))
                continue;
            const std::size_t at =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
            layers.depth_m[at] = static_cast<float>(static_cast<double>(hit.distance) / length);
            for (int k = 0; k < 3; ++k) layers.normal[3 * at + static_cast<std::size_t>(k)] = hit.normal[k];
            const std::size_t own = hit.part < 0 ? static_cast<std::size_t>(hit.instance)
                                                 : scene.asset->instances.size() + static_cast<std::size_t>(hit.part);
            layers.id[at] = static_cast<float>(own + 1);
        }
    });
    return layers;
}

}  // namespace gonio::sequence
