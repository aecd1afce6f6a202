// Meters: a picture of one pixel, and what its layers hold.
#include <algorithm>
#include <cmath>

#include "server/render/coarse_light.h"
#include "server/render/pipeline.h"
#include "server/render/renderer.h"
#include "server/render/timers.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"

namespace gonio {
namespace {

double variance_of(const PointLight& light, const glm::dvec3& weight) {
    double sum = 0.0, squares = 0.0;
    for (const glm::dvec3& part : light.parts) {
        const double part_lx = trace::luminance(weight * part);
        sum += part_lx;
        squares += part_lx * part_lx;
    }
    constexpr double kParts = kMeterParts;
    return std::max(0.0, squares - sum * sum / kParts) / (kParts * (kParts - 1.0));
}

// One metre above the point, straight down at it.
Eye eye_above(const glm::dvec3& point, const glm::dvec3& unit_normal) {
    Eye eye;
    eye.position = point + unit_normal;
    eye.forward = -unit_normal;
    eye.right = glm::normalize(
        glm::cross(unit_normal, std::abs(unit_normal.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
    eye.up = glm::cross(eye.right, eye.forward);
    return eye;
}

struct Sums {
    glm::dvec3 direct_lx{0.0}, indirect_lx{0.0};
    double variance = 0.0, direct_variance = 0.0;  // of the luminance, lx²; luminaires are independent
    unsigned samples = 0;
};

// Adds luminaire i, which has a layer.
void add_light(const FrameInputs& inputs, std::size_t i, const glm::dvec3& point, const glm::dvec3& unit_normal,
               Sums& sums) {
    const bool rsm = inputs.meter == FrameInputs::Meter::rsm, standard = inputs.scene.technique == Technique::standard;
    const Light& light = inputs.scene.lights[i];
    const LightGpu& gpu = *inputs.lights[i];
    const bool dark = light.sun && inputs.scene.technique != Technique::standard;
    const glm::dvec3 weight =
        (dark ? glm::dvec3(0.0) : light_weight(inputs.scene, light)) * peak_of(inputs, light, gpu);
    glm::vec4 indirect(0.0f);
    const int layer = inputs.layers[i];
    const Target& target = inputs.target;
    glGetTextureSubImage(target.indirect.id(), 0, 0, 0, layer, 1, 1, 1, GL_RGBA, GL_FLOAT, sizeof indirect,
                         &indirect[0]);
    const double unit_m2 = static_cast<double>(inputs.geometry.layer_unit_m2());
    if (const auto& by_rays = inputs.screen.meter.direct; by_rays.size() > static_cast<std::size_t>(layer)) {
        const auto& own = by_rays[static_cast<std::size_t>(layer)];
        const double error = trace::luminance(weight * own.error);
        sums.direct_lx += weight * own.light;
        sums.direct_variance += error * error;
    } else {
        float direct = 0.0f;
        glGetTextureSubImage(target.direct.id(), 0, 0, 0, layer, 1, 1, 1, GL_RED, GL_FLOAT, sizeof direct, &direct);
        sums.direct_lx += weight * (static_cast<double>(direct) / unit_m2);
    }
    glm::dvec3 bounced = glm::dvec3(indirect) / unit_m2;
    if (rsm && light.sun) {
        bounced = glm::dvec3(0.0);  // no map is made of it
    } else if (rsm) {
        // Each half of the texels, doubled, is an estimate of its own; half their difference is the mean's error.
        const auto halves = checkerboard_irradiance(gpu.texels, point - light.position, unit_normal);
        bounced = halves[0] + halves[1];
        const double error = trace::luminance(weight * (halves[0] - halves[1]));
        sums.variance += error * error;
        sums.samples += lit_texels(gpu.texels);
    } else if (standard) {
        const PointLight& found = inputs.screen.meter.layers.at(layer);
        bounced = found.light;
        sums.variance += variance_of(found, weight);
    }
    sums.indirect_lx += weight * bounced;
}

// The variance of a meter's indirect light, lx², by what the surfels' light is off by; that of its own links is apart.
// The weights are fitted to the survey of docs/accuracy.md.
double transport_variance(const Discrepancy& found, const FrameInputs& inputs, const ScreenLight& screen,
                          double indirect_lx) {
    constexpr double kLeast = 0.006, kUnknown = 0.05;  // of the light
    // A share of the scene's mean. Rays and cells are rounded, so a little light leaks into places that are closed off.
    constexpr double kScene = 0.001;
    constexpr double kDifference = 0.6, kPatches = 0.2;
    // Left out in haze is what it scatters twice. Each order of scattering is about as large a part of the one before;
    // of what goes on, a tenth leaves at least. Of what it absorbs between two surfaces the mean alone is known, in all
    // legs but the last one; those of the point's own links are off as much.
    constexpr double kTwice = 0.2, kAgain = 0.9;
    const double albedo = inputs.scene.haze.albedo,
                 scattered = kTwice * albedo * found.dimmed / (1.0 - kAgain * albedo * found.dimmed),
                 absorbed = std::min(1.0, (1.0 - albedo) * found.dimmed * found.legs),
                 absorbed_lx = found.known ? found.absorbed_lx : absorbed * indirect_lx;
    double unconverged = 0.0;
    const auto add = [&](const transport::Irradiance& light) {
        const double error = static_cast<double>(light.solved.error);
        unconverged = std::max(unconverged, std::isfinite(error) ? std::min(error, 1.0) : 1.0);
    };
    add(screen.light.summed_list.irradiance);
    for (const LightGpu* gpu : inputs.lights) add(gpu->irradiance);
    if (inputs.transport != nullptr && !inputs.transport->emitted.direct.empty()) add(inputs.transport->emitted);
    // Solves end alike. That of the difference knows which surfels lack light; without it, the worst surfel's share
    // counts.
    const double late = found.known && found.late_share > 0.0
                            ? std::max(1.0, unconverged / found.late_share) * found.late_lx
                            : unconverged * indirect_lx;
    // The reading lacks the light of links that end where no surfel is; the others stand for it. If all links end so,
    // no walk from a luminaire has reached the place, and it is dark.
    const double missing = found.missing / std::max(1.0 - found.missing, 0.01) * indirect_lx;
    double variance = 0.0;
    for (const double off :
         {(found.known ? kLeast : kUnknown) * indirect_lx, late, missing, scattered * indirect_lx, absorbed_lx,
          kScene * found.scene_lx, kDifference * found.difference_lx, kPatches * found.patches_lx})
        variance += off * off;
    return variance;
}

}  // namespace

v1::MeterReading lux_reading(const glm::dvec3& point_m, const glm::dvec3& direct_lx, const glm::dvec3& indirect_lx) {
    v1::MeterReading reading;
    reading.set_direct_lx(trace::luminance(direct_lx));
    reading.set_indirect_lx(trace::luminance(indirect_lx));
    reading.set_total_lx(trace::luminance(direct_lx + indirect_lx));
    for (int k = 0; k < 3; ++k) {
        reading.add_direct_rgb_lx(direct_lx[k]);
        reading.add_indirect_rgb_lx(indirect_lx[k]);
        reading.add_point_m(point_m[k]);
    }
    return reading;
}

v1::MeterReading Renderer::meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& unit_normal,
                                 MeterQuality quality, int bounces) {
    const bool rsm = quality == MeterQuality::rsm;
    Scene metered = scene;
    if (rsm) metered.technique = Technique::standard;
    const bool standard = metered.technique == Technique::standard;
    prepare(metered, false, !rsm);
    const Target target =
        make_target(next_target_++, TargetKind::precise, 1, 1, std::min(metered.lights.size(), kMostLayers), false);
    const Eye eye = eye_above(point, unit_normal);
    ScreenLight screen;
    FrameInputs inputs = inputs_of(metered, target, screen, eye);
    inputs.bounces = bounces;
    inputs.meter = rsm ? FrameInputs::Meter::rsm : FrameInputs::Meter::interactive;
    Timers timers;
    const std::string failure = failure_of(run(inputs, wanted_slots(inputs, false), timers));
    Sums sums;
    for (std::size_t i = 0; i < metered.lights.size(); ++i) {
        if (inputs.layers[i] >= 0) add_light(inputs, i, point, unit_normal, sums);
    }
    if (!rsm && standard) {
        sums.samples = kMeterLinks;
        for (const auto& [direct, bounced] : {screen.meter.emitted, screen.meter.summed}) {
            sums.direct_lx += direct.light;
            sums.indirect_lx += bounced.light;
            sums.direct_variance += variance_of(direct, glm::dvec3(1.0));
            sums.variance += variance_of(bounced, glm::dvec3(1.0));
        }
    }
    pass_cache_.forget_target(target.id);
    if (!failure.empty()) throw gl::ProgramError(failure);
    v1::MeterReading reading = lux_reading(point, sums.direct_lx, sums.indirect_lx);
    if (standard) {
        reading.set_direct_error_lx(
            std::sqrt(sums.direct_variance));  // of luminaires 0 but in penumbras: the web itself, evaluated
        if (!rsm && transport_) {
            if (!coarse_) coarse_ = std::make_unique<CoarseLight>();
            const Discrepancy found =
                discrepancy_of(inputs, transport_, own_->seeds, own_->surfels, !transport_beside_, *coarse_);
            sums.variance += transport_variance(found, inputs, screen, reading.indirect_lx());
        }
        reading.set_indirect_error_lx(std::sqrt(sums.variance));
    }
    reading.set_bounces(rsm || !standard || bounces == 1 ? "1" : bounces == 0 ? "0" : "all");
    reading.set_samples(sums.samples);
    return reading;
}

}  // namespace gonio
