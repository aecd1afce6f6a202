#include "tests/gl/look_session.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "shaders/lib/as_cpp.h"
#include "tests/gl/test_context.h"
#include "tests/scenes/show.h"

namespace gonio::test {
namespace {

// The first of each scene is flat and evenly lit.
const std::vector<Window>& windows_of(const std::string& scene) {
    static const std::map<std::string, std::vector<Window>> windows = {
        {"cornell",
         {
             {256, 480, 112, 112},  // back wall
             {448, 304, 64, 64},    // sculpture and what it stands on
             {560, 48, 64, 64},     // foot of the low block in its shadow
             {352, 656, 64, 64},    // canopy
             {176, 112, 64, 64},    // left wall, foot of the tall block
         }},
        {"atrium",
         {
             {288, 48, 112, 112},  // floor
             {208, 416, 64, 64},   // drape, arch
             {688, 448, 64, 64},   // drape, capital
             {192, 224, 64, 64},   // foot of a column
             {400, 304, 64, 64},   // far wall
         }},
    };
    return windows.at(scene);
}

constexpr std::uint32_t kHalfSamples = 128;  // of a pixel's indirect light

float byte_of(float encoded) {
    return std::round(std::clamp(encoded, 0.0f, 1.0f) * 255.0f) / 255.0f;
}

Picture shown(Renderer& renderer, const Scene& scene) {
    renderer.begin_frame(scene, monotonic_ns());
    const FinishedFrame frame = *renderer.finish_frame(true);
    return picture_of_nv12(*frame.nv12, frame.width_px, frame.height_px);
}

Traced trace_window(const trace::World& world, const Scene& scene, const Window& window) {
    Traced traced{window, {}, {}, {}, {}, {}, {}, {}};
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const trace::Geometry& geometry = *world.geometry;
    std::vector<trace::MeterPoint> points;
    std::vector<std::size_t> pixels;
    for (int y = window.bottom; y < window.bottom + window.height; ++y) {
        for (int x = window.left; x < window.left + window.width; ++x) {
            const glm::dvec3 ray =
                ray_through(eye, (x + 0.5) / scene.width_px * 2.0 - 1.0, (y + 0.5) / scene.height_px * 2.0 - 1.0);
            trace::SurfaceHit hit;
            const bool met =
                geometry.closest(geometry.local(eye.position), glm::vec3(glm::normalize(ray)), 0.0f, true, hit);
            if (met) {
                pixels.push_back(traced.hit.size());
                points.push_back({geometry.origin() + glm::dvec3(hit.position), glm::dvec3(hit.normal)});
            }
            traced.hit.push_back(met);
            traced.position.push_back(hit.position);
            traced.normal.push_back(hit.normal);
            traced.albedo.push_back(hit.albedo);
        }
    }
    for (auto* light : {&traced.direct_lx, &traced.half_lx[0], &traced.half_lx[1], &traced.indirect_lx})
        light->assign(traced.hit.size(), glm::vec3(0.0f));
    trace::Settings settings;
    settings.noise = 0.0;
    settings.max_passes = kHalfSamples;
    for (auto& half : traced.half_lx) {
        const std::vector<trace::Reading> readings = trace::measure(world, points, settings);
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            half[pixels[i]] = glm::vec3(readings[i].indirect_lx);
            traced.direct_lx[pixels[i]] = glm::vec3(readings[i].direct_lx);
            traced.indirect_lx[pixels[i]] += 0.5f * half[pixels[i]];
        }
        ++settings.seed;
    }
    return traced;
}

// The same asset for all sessions, which so share surfels that begin at one eye and luminaire: limits are of those.
const std::shared_ptr<const SceneAsset>& asset_of(const std::string& scene) {
    static std::map<std::string, std::shared_ptr<const SceneAsset>> assets;
    auto& asset = assets[scene];
    if (!asset) asset = of_points(**load_scene(scene));
    return asset;
}

}  // namespace

// A suite for each scene: a renderer keeps the links of the scene before alone.
INSTANTIATE_TEST_SUITE_P(Cornell, Look, testing::Values("cornell"));
INSTANTIATE_TEST_SUITE_P(Atrium, Look, testing::Values("atrium"));

LookSession::LookSession(const std::string& scene)
    : home(scene_of(asset_of(scene))),
      name_(scene),
      windows_(windows_of(scene)),
      renderer_(context(), Renderer::DirectLight::rays) {
    home.traced = trace::geometry_of(home);
    home.camera.eye += glm::dvec3(0.013, 0.007, 0.0);  // else edges run through the centres of pixels
}

Scene LookSession::moved(double turn_rad, double shift_m) const {
    Scene scene = home;
    const glm::dvec3 from = home.camera.eye - home.camera.target;
    const double c = std::cos(turn_rad), s = std::sin(turn_rad);
    scene.camera.eye = home.camera.target + glm::dvec3(c * from.x + s * from.z, from.y, c * from.z - s * from.x);
    scene.lights[0].position.x += shift_m;
    return scene;
}

Scene LookSession::stamped(Scene scene, View view) {
    scene.view = view;
    scene.camera_rev = scene.lights[0].position_rev = scene.view_rev = scene.technique_rev = scene.scene_rev =
        ++revision_;
    return scene;
}

Picture LookSession::live(const Scene& scene, View view) {
    return shown(renderer_, stamped(scene, view));
}

std::vector<glm::vec3> LookSession::live_lx(const Scene& scene) {
    const Scene stamp = stamped(scene, View::beauty);
    show(renderer_, stamp);
    return renderer_.live_illuminance(stamp, true);
}

std::vector<Traced> LookSession::traced(const Scene& scene, std::size_t first, std::size_t last) const {
    const auto world = trace::make_world(scene);
    // Emitters light the path tracer's surfaces, not the live picture's.
    if (!world->emitters.empty()) throw std::logic_error("the scene has emitters");
    std::vector<Traced> all;
    for (std::size_t i = first; i <= last; ++i) all.push_back(trace_window(*world, scene, windows_[i]));
    return all;
}

const std::vector<Traced>& LookSession::traced_home() const {
    static std::map<std::string, std::vector<Traced>> made;
    std::vector<Traced>& traced = made[name_];
    if (traced.empty()) traced = this->traced(home, 0, windows_.size() - 1);
    return traced;
}

Picture shown_of(const Traced& traced, const std::vector<glm::vec3>& indirect_lx, const Scene& scene, View view) {
    Picture picture{traced.window.width, traced.window.height, {}};
    const float gain = view == View::indirect ? static_cast<float>(scene.view_gain) : 1.0f;
    for (int y = picture.height - 1; y >= 0; --y) {
        for (int x = 0; x < picture.width; ++x) {
            const std::size_t at = traced.at(x, y);
            glm::vec3 encoded(glsl::background_shade());
            if (traced.hit[at]) {
                glm::vec3 lx = indirect_lx[at] * gain;
                if (view == View::beauty) lx += traced.direct_lx[at];
                const glm::vec3 nit = traced.albedo[at] * lx * std::numbers::inv_pi_v<float>;
                encoded = glsl::encode_display(glsl::expose(nit, static_cast<float>(scene.exposure_ev100)),
                                               traced.window.left + x, traced.window.bottom + y);
            }
            picture.srgb.emplace_back(byte_of(encoded.r), byte_of(encoded.g), byte_of(encoded.b));
        }
    }
    return picture;
}

Picture part_of(const Picture& whole, const Window& window) {
    Picture part{window.width, window.height, {}};
    for (int y = window.bottom + window.height - 1; y >= window.bottom; --y) {
        const auto from = whole.srgb.begin() + (whole.height - 1 - y) * whole.width + window.left;
        part.srgb.insert(part.srgb.end(), from, from + window.width);
    }
    return part;
}

}  // namespace gonio::test
