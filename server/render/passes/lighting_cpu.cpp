// The default technique's light: the CPU's passes between the G-buffer and the layers (server/lighting).
#include <algorithm>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>

#include "server/lighting/display.h"
#include "server/lighting/edge_filter.h"
#include "server/lighting/screen.h"
#include "server/lighting/shadow_edges.h"
#include "server/render/passes/passes.h"
#include "server/render/quality_level.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/opening.h"
#include "server/scene/opening_points.h"
#include "server/scene/scene.h"
#include "server/scene/sun.h"
#include "server/scene/web_buffer.h"
#include "server/scene/white_balance.h"

namespace gonio {

namespace {

void set_view(const PassContext& context, lighting::GBuffer& gbuffer) {
    const Target& target = context.target;
    lighting::look_through(context.eye, context.traced, context.geometry.near_m(), target.width_px, target.height_px,
                           gbuffer);
}

void set_grid(const PassContext& context, Surfaces& surfaces) {
    lighting::make_grid(surfaces.gbuffer, kQualityLevels[context.quality_level].own_points, surfaces.grid,
                        context.pool);
}

}  // namespace

PassRun run_raster(const PassContext& context, Surfaces& surfaces) {
    set_view(context, surfaces.gbuffer);
    const unsigned drawn =
        lighting::draw_gbuffer(context.clusters, context.material_table, context.target.emissive, surfaces.gbuffer,
                               surfaces.raster, context.pool, {}, context.posed_bodies());
    set_grid(context, surfaces);
    return {0, drawn};
}

PassRun run_grid(const PassContext& context, Surfaces& surfaces) {
    const Target& target = context.target;
    lighting::GBuffer& s = surfaces.gbuffer;
    set_view(context, s);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glPixelStorei(GL_PACK_ROW_LENGTH, s.row_length);
    const auto bytes = static_cast<GLsizei>(s.depth.size() * 4);
    glGetTextureImage(target.depth.id(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, bytes, s.depth.data());
    glGetTextureImage(target.normal.id(), 0, GL_RG, GL_SHORT, bytes, s.normal.data());
    s.detail.resize(target.detail ? s.depth.size() : 0);
    if (target.detail) glGetTextureImage(target.detail.id(), 0, GL_RG, GL_SHORT, bytes, s.detail.data());
    if (context.layers_on_cpu) {
        lighting::Raster& raster = surfaces.raster;
        raster.albedo.resize(s.depth.size() * 4);
        glGetTextureImage(target.albedo.id(), 0, GL_RGBA, GL_HALF_FLOAT, 2 * bytes, raster.albedo.data());
        if (target.emissive) {
            raster.emission.resize(s.depth.size() * 4);
            glGetTextureImage(target.emission.id(), 0, GL_RGBA, GL_FLOAT, 4 * bytes, raster.emission.data());
        }
    }
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    set_grid(context, surfaces);
    return {};
}

void upload(const gl::Texture& array, const lighting::GBuffer& s, int layer, GLenum format, GLenum type,
            const void* values) {
    glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, s.row_length);
    glTextureSubImage3D(array.id(), 0, 0, 0, layer, s.width, s.height, 1, format, type, values);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
}

double peak_of(const PassContext& context, const Light& light, const LightGpu& gpu) {
    return static_cast<double>(light.sun ? context.geometry.layer_unit_m2() : gpu.web->peak_cd);
}

lighting::DirectLight direct_light_of(const PassContext& context, const Light& light, const LightGpu& gpu, bool fine) {
    const LightSource source = source_of(light, context.traced.asset().bounds);
    lighting::DirectLight direct{context.traced.local(source.position), light_from_world(light),
                                 web_of(gpu.web->tables->words.data()), context.geometry.layer_unit_m2(),
                                 gpu.web->tables->beam_cos};
    direct.sun = light.sun;
    if (!light.sun) direct.air = lighting::air_of(context.haze);
    if (light.sun) direct.unit_m2 = static_cast<float>(source.gain);  // × the layers' unit / peak_of(): 1
    direct.parts = lighting::soft_parts(opening_of(light), direct.light_from_world, fine);
    if (fine) direct.fineness = 8.0f;
    return direct;
}

PassRun run_direct_rays(const PassContext& context, const Light& light, const LightGpu& gpu, int layer,
                        const Surfaces& surfaces, Layers& layers) {
    const Target& target = context.target;
    const lighting::GBuffer& s = surfaces.gbuffer;
    const lighting::DirectLight own = direct_light_of(context, light, gpu, context.each_pixel);
    lighting::Planes& direct = context.scratch.direct;
    direct.resize(1);
    lighting::direct_light(s, surfaces.grid, context.traced, std::span(&own, 1), context.each_pixel, direct,
                           context.scratch.lattice, context.pool);
    if (context.each_pixel && shows_edges(context) && !surfaces.edges.rows.empty()) {
        lighting::sample_shadow_edges(s, context.traced, own, surfaces.edges, context.samples_per_pixel, direct[0],
                                      context.pool);
        lighting::light_mixed_pixels(s, context.traced, std::span(&own, 1), surfaces.edges, direct, context.pool);
    }
    const std::vector<float>& lux = direct[0];
    if (target.kind == TargetKind::precise) {
        upload(target.direct, s, layer, GL_RED, GL_FLOAT, lux.data());
        return {};
    }
    std::vector<std::uint16_t>& halves = context.layers_on_cpu ? layers.at(layer).direct : context.scratch.halves;
    halves.resize(lux.size());
    context.pool.run(s.height, [&](int row) {
        const std::size_t at = row * s.row_length;
        lighting::to_halves(lux.data() + at, s.row_length, halves.data() + at);
    });
    if (!context.layers_on_cpu) upload(target.direct, s, layer, GL_RED, GL_HALF_FLOAT, halves.data());
    return {};
}

namespace {

// Level of an opening's parts that a meter sums, with a ray to each: 256 of them, 64 of a line. Nearer than half its
// longest side less is exact than 0.5 %.
constexpr unsigned kMeterLevel = 4, kMeterLineLevel = 6, kMeterPoints = 256;

// Result: where a luminaire's light comes from, world, m.
std::vector<glm::dvec3> sources_of(const Light& light, const glm::dvec3& position) {
    const ies::Opening opening = opening_of(light);
    std::vector<glm::dvec3> points = opening_parts(opening, kMeterLevel).points;
    if (points.size() < kMeterPoints) points = opening_parts(opening, kMeterLineLevel).points;
    const glm::dmat3 world_from_light(glm::mat3_cast(light.world_from_light));
    for (glm::dvec3& point : points) point = position + world_from_light * point;
    return points;
}

// Result: direct illuminance at the point of a meter per candela of the luminaire's peak, rgb, 1/m². Where some of the
// points are hidden, its error is that of an edge that lies anywhere between two rows of them.
MeterLight::Direct direct_at_point(const PassContext& context, const Light& light, const LightGpu& gpu) {
    if (!(gpu.web->peak_cd > 0.0f)) return {};
    const Eye& eye = context.eye;
    const glm::dvec3 normal = -eye.forward, point = eye.position + eye.forward;
    const LightSource source = source_of(light, context.traced.asset().bounds);
    const glm::dmat3 world_from_light(glm::mat3_cast(light.world_from_light));
    const glm::vec3 local = context.traced.local(point);
    const glm::vec3 from = local + glm::vec3(normal) * (4.0f * context.traced.step_off(local));
    const double gain = light.sun ? source.gain / peak_of(context, light, gpu) : 1.0;
    const glm::dvec3 off = world_from_light * lifted_off(opening_of(light));
    const std::vector<glm::dvec3> sources = sources_of(light, source.position);
    glm::dvec3 sum(0.0), whole(0.0);
    glm::vec3 most(0.0f), least(1.0f);  // that passes
    for (const glm::dvec3& at : sources) {
        const glm::dvec3 d = point - at;
        const double d2 = glm::dot(d, d), cosine = -glm::dot(d, normal) / std::sqrt(d2);
        if (!(d2 > 0.0 && cosine > 0.0)) continue;
        const glm::dvec3 in_light = glm::transpose(world_from_light) * d;
        const double ratio =
            ies::intensity(light.shining()->photometry.web, {in_light.x, in_light.y, in_light.z}).in(cd) /
            light.shining()->peak_cd;
        if (!(ratio > 0.0)) continue;
        const double air = context.haze && !light.sun ? transmittance(context.haze, at - context.traced.origin(),
                                                                      point - context.traced.origin())
                                                      : 1.0;
        const glm::vec3 passes = context.traced.transmittance(from, context.traced.local(at + off));
        most = glm::max(most, passes), least = glm::min(least, passes);
        const double arrives = gain * air * ratio * cosine / d2;
        sum += glm::dvec3(passes) * arrives, whole += glm::dvec3(arrives);
    }
    const auto count = static_cast<double>(sources.size());
    // A shadow's edge lies anywhere between two rows of points, each place as likely: the standard deviation is 1/√12
    // of a row. The points of a line are its rows.
    const double rows = sources.size() < kMeterPoints ? count : std::sqrt(count);
    MeterLight::Direct found{sum / count, glm::dvec3(0.0)};
    if (sources.size() > 1) found.error = whole / count * glm::dvec3(most - least) / (std::sqrt(12.0) * rows);
    return found;
}

}  // namespace

PassRun run_direct_point(const PassContext& context, const Light& light, const LightGpu& gpu, int layer,
                         MeterLight& meter) {
    meter.direct.resize(std::max(meter.direct.size(), static_cast<std::size_t>(layer) + 1));
    meter.direct[layer] = direct_at_point(context, light, gpu);
    const float value = trace::luminous(glm::vec3(meter.direct[layer].light)) * context.geometry.layer_unit_m2();
    glTextureSubImage3D(context.target.direct.id(), 0, 0, 0, layer, 1, 1, 1, GL_RED, GL_FLOAT, &value);
    return {};
}

PassRun run_direct_point_summed(const PassContext& context, std::span<const LightGpu* const> lights,
                                PointLight& found) {
    found = {};
    glm::dvec3 variance(0.0);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (context.layers[i] >= 0) continue;
        const Light& light = context.scene.lights[i];
        const glm::dvec3 weight = glm::dvec3(context.scene.master_ratio * context.weight_in_sum(light, -1)) *
                                  peak_of(context, light, *lights[i]);
        const MeterLight::Direct own = direct_at_point(context, light, *lights[i]);
        found.light += weight * own.light;
        variance += weight * own.error * weight * own.error;
    }
    // Parts with that variance.
    const glm::dvec3 off = glm::sqrt(variance * static_cast<double>(kMeterParts - 1));
    for (unsigned k = 0; k < kMeterParts; ++k) found.parts[k] = found.light + (k % 2 == 0 ? off : -off);
    return {};
}

namespace {

// out: 3 planes in the shape of the grid.
void grid_floats(const lighting::LightLayer& layer, std::size_t size, lighting::Planes& out, Pool& pool) {
    out.resize(3);
    pool.run(3, [&](int k) {
        out[k].assign(size, 0.0f);
        lighting::from_halves(layer.indirect[k].data(), layer.indirect[k].size(), out[k].data());
    });
}

}  // namespace

PassRun run_layers(const PassContext& context, int layer, const Surfaces& surfaces, Layers& layers) {
    const Target& target = context.target;
    const lighting::GBuffer& s = surfaces.gbuffer;
    const lighting::LightLayer& own = layers.at(layer);
    // A part that no view has asked for yet is empty.
    if (!own.gathered.empty()) upload(target.indirect, s, layer, GL_RGBA, GL_HALF_FLOAT, own.gathered.data());
    if (!own.direct.empty()) upload(target.direct, s, layer, GL_RED, GL_HALF_FLOAT, own.direct.data());
    if (own.indirect[0].empty() || !own.gathered.empty()) return {};
    Scratch& scratch = context.scratch;
    grid_floats(own, surfaces.grid_size(), scratch.grid, context.pool);
    lighting::upsample(s, surfaces.grid, scratch.grid, scratch.halves, context.pool);
    upload(target.indirect, s, layer, GL_RGBA, GL_HALF_FLOAT, scratch.halves.data());
    return {};
}

std::vector<glm::vec3> cpu_illuminance(const PassContext& context, std::span<const glm::vec3> weights, bool indirect,
                                       const Surfaces& surfaces, PixelLight& light) {
    const lighting::GBuffer& s = surfaces.gbuffer;
    const float layer_unit_m2 = context.geometry.layer_unit_m2();
    Pool& pool = context.pool;
    std::vector<glm::vec3> lux(std::size_t{1} * s.width * s.height);
    const auto for_pixels = [&](const auto& job) {
        pool.run(s.height, [&](int y) {
            for (int x = 0; x < s.width; ++x) job(y * s.row_length + x, lux[std::size_t{1} * y * s.width + x]);
        });
    };
    const auto add_rgb = [&](const std::vector<std::uint16_t>& halves, const glm::vec3& unit_lx) {
        for_pixels([&](std::size_t at, glm::vec3& to) {
            for (int k = 0; k < 3; ++k) to[k] += glm::unpackHalf1x16(halves[4 * at + k]) * unit_lx[k];
        });
    };
    const std::size_t part = indirect ? 1 : 0;
    for (const Besides* besides : {&light.emitted, &light.summed}) {
        const float gain = besides == &light.summed ? static_cast<float>(context.scene.master_ratio) : 1.0f;
        if (besides->unit_lx[part] > 0.0f) add_rgb(besides->pixels[part], glm::vec3(gain * besides->unit_lx[part]));
    }
    if (context.merged) {
        std::vector<std::uint16_t> halves;
        if (indirect) lighting::upsample(s, surfaces.grid, light.merged.indirect, halves, pool);
        add_rgb(indirect ? halves : light.merged.direct, glm::vec3(light.merged.reference / layer_unit_m2));
        return lux;
    }
    // Planes relative to the greatest weight: half floats hold what is brought to the pixels.
    float reference = 0.0f;
    for (const glm::vec3& weight : weights)
        reference = std::max({reference, std::abs(weight.x), std::abs(weight.y), std::abs(weight.z)});
    if (!(reference > 0.0f)) return lux;
    lighting::Planes sum(3, std::vector<float>(surfaces.grid_size(), 0.0f)), own;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const lighting::LightLayer& layer = light.layers.at(static_cast<int>(i));
        if (indirect && !layer.gathered.empty()) {
            add_rgb(layer.gathered, weights[i] / layer_unit_m2);
        } else if (indirect && !layer.indirect[0].empty()) {
            grid_floats(layer, surfaces.grid_size(), own, pool);
            for (int k = 0; k < 3; ++k) {
                const float weight = weights[i][k] / reference;
                for (std::size_t p = 0; p < own[k].size(); ++p) sum[k][p] += own[k][p] * weight;
            }
        } else if (!indirect && !layer.direct.empty()) {
            const glm::vec3 unit_lx = weights[i] / layer_unit_m2;
            for_pixels([&](std::size_t at, glm::vec3& to) { to += unit_lx * glm::unpackHalf1x16(layer.direct[at]); });
        }
    }
    if (!indirect) return lux;
    std::vector<std::uint16_t> halves;
    lighting::upsample(s, surfaces.grid, sum, halves, pool);
    add_rgb(halves, glm::vec3(reference / layer_unit_m2));
    return lux;
}

PassRun run_merge(const PassContext& context, std::span<const LightGpu* const> lights, Together which, Merged& merged) {
    merged.lights.clear();
    merged.reference = 0.0f;
    const auto weight_of = [&](std::size_t i) {
        const Light& light = context.scene.lights[i];
        glm::dvec3 weight(0.0);
        if (which == Together::summed)
            weight = context.weight_in_sum(light, context.layers[i]);
        else if (context.layers[i] >= 0)
            weight = context.layer_weight(light);
        return glm::vec3(weight * peak_of(context, light, *lights[i]));
    };
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const glm::vec3 weight = glm::abs(weight_of(i));
        merged.reference = std::max({merged.reference, weight.x, weight.y, weight.z});
    }
    std::vector<glm::vec4>&direct = merged.irradiance.direct, &haze = merged.irradiance.haze;
    direct.clear(), haze.clear();
    if (!(merged.reference > 0.0f)) return {};
    const std::size_t surfels = context.transport != nullptr ? context.transport->surface->surfels.count : 0;
    direct.assign(surfels, glm::vec4(0.0f));
    if (context.haze) haze = direct;
    merged.moves = true;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const glm::vec3 weight = weight_of(i) / merged.reference;
        if (weight == glm::vec3(0.0f)) continue;  // its light may be of long ago
        merged.lights.push_back(
            direct_light_of(context, context.scene.lights[i], *lights[i], context.target.kind != TargetKind::live));
        merged.lights.back().weight = weight;
        const std::vector<float>& own = lights[i]->surfel_direct;
        if (own.size() < surfels) continue;
        context.pool.run_chunks(surfels, 4096, [&](std::size_t first, std::size_t count) {
            for (std::size_t k = first; k < first + count; ++k) direct[k] += glm::vec4(weight * own[k], 0.0f);
            if (haze.empty() || lights[i]->surfel_haze.size() < surfels) return;
            for (std::size_t k = first; k < first + count; ++k)
                haze[k] += glm::vec4(weight * lights[i]->surfel_haze[k], 0.0f);
        });
    }
    return {};
}

PassRun run_direct_merged(const PassContext& context, const Surfaces& surfaces, Merged& merged, Besides* summed) {
    const lighting::GBuffer& s = surfaces.gbuffer;
    if (summed != nullptr) summed->unit_lx[0] = merged.reference / context.geometry.layer_unit_m2();
    std::vector<std::uint16_t>& out = summed != nullptr ? summed->pixels[0] : merged.direct;
    lighting::Planes& direct = context.scratch.direct;
    direct.resize(3);
    const bool captured = context.target.kind != TargetKind::live;
    if (captured && shows_edges(context) && !surfaces.edges.rows.empty()) {
        lighting::direct_light_with_edges(s, surfaces.grid, context.traced, merged.lights, surfaces.edges,
                                          context.samples_per_pixel, direct, context.pool);
        lighting::light_mixed_pixels(s, context.traced, merged.lights, surfaces.edges, direct, context.pool);
    } else {
        lighting::direct_light(s, surfaces.grid, context.traced, merged.lights, captured, direct,
                               context.scratch.lattice, context.pool);
    }
    if (summed != nullptr && context.target.kind == TargetKind::precise) {
        summed->precise[0].assign(4 * s.depth.size(), 1.0f);
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < s.depth.size(); ++i) summed->precise[0][4 * i + k] = direct[k][i];
        return {};
    }
    out.resize(4 * s.depth.size());
    context.pool.run(s.height, [&](int row) {
        const std::size_t at = row * s.row_length;
        lighting::rgb_to_halves(direct[0].data() + at, direct[1].data() + at, direct[2].data() + at, s.row_length,
                                out.data() + 4 * at);
    });
    return {};
}

namespace {

// Result: a picture of so many bytes that nobody holds.
std::shared_ptr<std::vector<std::uint8_t>> free_picture(Composed& composed, std::size_t bytes) {
    auto& pictures = composed.pictures;
    std::erase_if(pictures, [&](const auto& picture) { return picture->size() != bytes; });
    const auto free =
        std::find_if(pictures.begin(), pictures.end(), [](const auto& picture) { return picture.use_count() == 1; });
    return free != pictures.end() ? *free : pictures.emplace_back(std::make_shared<std::vector<std::uint8_t>>(bytes));
}

// The cosine between each pixel's surface and the camera.
void shade_to_camera(const lighting::GBuffer& s, std::vector<std::uint16_t>& halves, Pool& pool) {
    halves.resize(4 * s.depth.size());
    pool.run(s.height, [&](int y) {
        static thread_local std::vector<float> cosines;
        cosines.assign(s.row_length, 0.0f);
        for (int x = 0; x < s.width; ++x) {
            const std::size_t at = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x);
            if (!(s.depth[at] > 0.0f)) continue;
            const glm::vec3 ray = glm::normalize(s.rays.corner + static_cast<float>(x) * s.rays.right +
                                                 static_cast<float>(y) * s.rays.up);
            cosines[static_cast<std::size_t>(x)] = std::max(0.0f, -glm::dot(lighting::lit_normal_at(s, x, y), ray));
        }
        lighting::rgb_to_halves(cosines.data(), cosines.data(), cosines.data(), s.row_length,
                                halves.data() + 4 * static_cast<std::size_t>(y) * s.row_length);
    });
}

}  // namespace

// One Display, part by part: cut up it would pass nine locals around.
PassRun run_composite_cpu(const PassContext& context, View view, std::span<const LightGpu* const> lights,
                          ScreenLight& screen) {
    const Scene& scene = context.scene;
    const Surfaces& surfaces = screen.surfaces;
    PixelLight& light = screen.light;
    Composed& composed = screen.composed;
    const lighting::GBuffer& s = surfaces.gbuffer;
    const lighting::Raster& raster = surfaces.raster;
    lighting::Display display;
    display.width = s.width;
    display.height = s.height;
    display.row_length = s.row_length;
    const bool direct = view != View::indirect, indirect = view != View::direct;
    display.albedo = raster.albedo.data();
    if (context.target.emissive && view == View::beauty) display.emission = raster.emission.data();
    display.depth = s.depth.data();
    if (shows_edges(context)) {
        display.edges = &surfaces.edges;
        display.albedo = surfaces.edges.albedo.data();
        if (display.emission != nullptr) display.emission = surfaces.edges.emission.data();
    }
    display.ev100 = static_cast<float>(scene.exposure_ev100);
    display.tone = scene.look.tone;
    display.white = glm::mat3(white_balance(scene.look.white_k, scene.look.white_duv));
    std::vector<lighting::Display::Others> others;
    // Fixed-point steps of 2^-18 of what an exposure of whole stops shows as 1 on a white surface (lib/display.glsl):
    // far below what 8 bits show, and the same for all exposures in between.
    constexpr double kFixedPointSteps = 0x1p18;
    const double stop = std::floor(scene.exposure_ev100), rest = std::exp2(stop - scene.exposure_ev100);
    const double gain = view == View::indirect ? scene.view_gain : 1.0;
    const double shown_per_lux = gain / (1.2 * std::numbers::pi * std::exp2(stop)),
                 unit = static_cast<double>(context.geometry.layer_unit_m2());
    const bool work_light = view == View::beauty && shows_work_light(context);  // in place of all other light
    if (context.merged && !work_light) {
        const auto factor =
            static_cast<float>(static_cast<double>(light.merged.reference) / unit * shown_per_lux * rest);
        if (direct) others.push_back({light.merged.direct.data(), glm::vec3(factor)});
        if (indirect) display.on_grid = {&s, &surfaces.grid, &light.merged.indirect, factor};
    } else {
        std::vector<lighting::LayerTerm> terms;
        for (std::size_t i = 0; i < lights.size(); ++i) {
            if (work_light || context.layers[i] < 0) continue;
            const glm::dvec3 steps =
                context.layer_weight(scene.lights[i]) *
                (peak_of(context, scene.lights[i], *lights[i]) / unit * shown_per_lux * kFixedPointSteps);
            if (steps == glm::dvec3(0.0)) continue;
            // Nothing times infinity would be no number.
            const auto version_of = [&, id = scene.lights[i].id](Slot slot) {
                return context.pass_cache.version({slot, context.target.id, id});
            };
            terms.push_back({{std::max({version_of(Slot::direct), version_of(Slot::gather), version_of(Slot::refined)}),
                              glm::vec3(glm::clamp(steps, -1e30, 1e30)), direct, indirect},
                             scene.lights[i].id,
                             &light.layers.at(context.layers[i])});
        }
        const bool on_grid =
            std::any_of(terms.begin(), terms.end(), [](const lighting::LayerTerm& term) { return term.on_grid(); });
        lighting::LayerSum& sum = composed.sum;
        sum.take(terms, std::min(lights.size(), kMostLayers), s.depth.size(),
                 surfaces.grid_size() / lighting::kSimdWidth * lighting::kSimdWidth, context.pool);
        display.cap = sum.cap();
        display.per_step = static_cast<float>(rest / kFixedPointSteps);
        display.layers = sum.others();
        for (int k = 0; k < 3; ++k) display.kept_pixels[k] = sum.kept_pixels(k);
        if (on_grid) {
            const SlotRef made{Slot::grid_sum, context.target.id}, grid{Slot::grid, context.target.id};
            const std::vector<std::uint64_t> key = {sum.changes(), context.pass_cache.version(grid)};
            if (!context.pass_cache.holds(made, key)) {
                composed.grid.resize(3);
                for (std::vector<float>& plane : composed.grid) plane.resize(surfaces.grid_size());
                sum.grid(static_cast<float>(1.0 / kFixedPointSteps), composed.grid, context.pool);
                context.pass_cache.hold(made, key);
            }
            display.on_grid = {&s, &surfaces.grid, &composed.grid, static_cast<float>(rest)};
        }
    }
    for (const std::size_t part : {0u, 1u}) {
        if (work_light) break;
        for (const Besides* besides : {&light.emitted, &light.summed}) {
            const float gain_lx =
                (besides == &light.summed ? static_cast<float>(scene.master_ratio) : 1.0f) * besides->unit_lx[part];
            if (gain_lx > 0.0f && (part == 0 ? direct : indirect))
                others.push_back(
                    {besides->pixels[part].data(), glm::vec3(gain_lx * static_cast<float>(shown_per_lux * rest))});
        }
    }
    if (work_light) {
        shade_to_camera(s, composed.work_light, context.pool);
        others.push_back({composed.work_light.data(), glm::vec3(static_cast<float>(kWorkLightShown))});
    }
    if (const lighting::AirPicture* hazy = air_picture(context, view, lights, surfaces, light, screen.air)) {
        display.air = hazy->halves.data();
        display.air_unit = hazy->unit;
    }
    composed.nv12 = free_picture(composed, std::size_t{1} * display.width * display.height / 2 * 3);
    display.others = others;
    const std::vector<lighting::ShiningPixel> openings = shown_openings(context, view, light);
    display.openings = openings;
    lighting::to_nv12(display, composed.nv12->data(), context.pool);
    if (filters_edges(context, view))
        lighting::filter_edges(s.width, s.height, composed.nv12->data(), composed.unfiltered, context.pool);
    return {};
}

}  // namespace gonio
