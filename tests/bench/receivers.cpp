#include "tests/bench/receivers.h"

#include <algorithm>
#include <atomic>
#include <numbers>
#include <thread>

#include "server/lighting/raster.h"
#include "server/lighting/screen.h"
#include "server/render/passes/passes.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/scene/web_buffer.h"
#include "shaders/lib/as_cpp.h"

namespace gonio::bench {
namespace {

// One lit texel, ready to be summed. Positions relative to the luminaire.
struct Emitter {
    glm::dvec3 position, normal;
    double intensity_lx_m2;  // luminance of flux / pi, at the light's weight
    double area_over_pi_m2;
};

// The same texels and the same sum as gonio::checkerboard_irradiance, decoded once instead of at every receiver.
std::vector<Emitter> emitters_of(const RsmTexels& texels, const glm::dvec3& weight) {
    std::vector<Emitter> emitters;
    for (std::size_t i = 0; i < texels.flux.size(); ++i) {
        const double intensity = glsl64::luminance(glm::dvec3(texels.flux[i]) * weight) / std::numbers::pi;
        if (intensity > 0.0) {
            emitters.push_back(
                {texels.position(i), texels.normal_of(i), intensity, static_cast<double>(texels.flux[i].a)});
        }
    }
    return emitters;
}

void add_light(const std::vector<Emitter>& emitters, const glm::dvec3& light, std::span<const Receiver> receivers,
               std::vector<double>& sum_lx) {
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        constexpr std::size_t kChunk = 16;
        for (std::size_t first = next.fetch_add(kChunk); first < receivers.size(); first = next.fetch_add(kChunk)) {
            for (std::size_t r = first; r < std::min(first + kChunk, receivers.size()); ++r) {
                const glm::dvec3 point = receivers[r].position - light;
                double sum = 0.0;
                for (const Emitter& e : emitters) {
                    sum += e.intensity_lx_m2 *
                           glsl64::vpl_geometry(point - e.position, e.normal, receivers[r].normal, e.area_over_pi_m2);
                }
                sum_lx[r] += sum;
            }
        }
    };
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
}

}  // namespace

std::vector<Receiver> receivers_of(const Scene& scene, std::span<const glm::ivec2> pixels) {
    const GpuScene gpu(scene.asset);
    const trace::Geometry geometry(scene.asset);
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    lighting::GBuffer gbuffer;
    lighting::look_through(eye, geometry, gpu.near_m(), scene.width_px, scene.height_px, gbuffer);
    lighting::Raster raster;
    Pool pool;
    // Where two surfaces meet in the centre of a pixel, the one that the live picture shows.
    lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), false, gbuffer,
                           raster, pool);
    std::vector<Receiver> receivers;
    for (const glm::ivec2& pixel : pixels) {
        const std::size_t at =
            static_cast<std::size_t>(pixel.y) * gbuffer.row_length + static_cast<std::size_t>(pixel.x);
        if (!(gbuffer.depth[at] > 0.0f)) continue;
        // As shaders/lib/surface.glsl, in double.
        const double x = (pixel.x + 0.5) / scene.width_px * 2.0 - 1.0,
                     y = (pixel.y + 0.5) / scene.height_px * 2.0 - 1.0;
        const glm::dvec3 ray = ray_through(eye, x, y);
        const double along = static_cast<double>(gpu.near_m()) / static_cast<double>(gbuffer.depth[at]);
        receivers.push_back(
            {pixel, eye.position + ray * along, glm::dvec3(lighting::spot_at(gbuffer, pixel.x, pixel.y).normal)});
    }
    return receivers;
}

std::vector<double> shown_lx(const std::vector<glm::vec3>& picture, int width_px, std::span<const Receiver> receivers) {
    std::vector<double> values;
    for (const Receiver& r : receivers) {
        values.push_back(glsl64::luminance(
            glm::dvec3(picture[static_cast<std::size_t>(r.pixel.y) * static_cast<std::size_t>(width_px) +
                               static_cast<std::size_t>(r.pixel.x)])));
    }
    return values;
}

std::vector<double> dense_rsm_lx(const Scene& scene, std::span<const Receiver> receivers, int rsm_size) {
    Programs programs;
    const GpuScene geometry(scene.asset);
    const Target target = make_target(1, TargetKind::precise, 1, 1, 1, false);
    const Eye eye;  // light passes look at neither
    const trace::Geometry traced(scene.asset);
    const lighting::MaterialTable looks;
    Pool pool(1);
    Scratch scratch;
    PassCache pass_cache;
    std::vector<double> sum_lx(receivers.size(), 0.0);
    for (const Light& light : scene.lights) {
        LightGpu gpu;
        gpu.profile = light.profile;
        gpu.web = make_web(light.profile);
        gpu.rsm_size = rsm_size;
        const PassContext context{programs, geometry, scene, target, eye, traced, {}, looks, pool, scratch, pass_cache};
        run_rsm(context, light, gpu, 63u);
        run_mask(context, light, gpu);
        run_flux(context, gpu);
        const glm::dvec3 weight = light_weight(scene, light) * static_cast<double>(gpu.web->peak_cd);
        add_light(emitters_of(gpu.texels, weight), light.position, receivers, sum_lx);
    }
    return sum_lx;
}

}  // namespace gonio::bench
