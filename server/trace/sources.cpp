#include "server/trace/sources.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/scene/apply.h"
#include "server/scene/opening.h"
#include "server/scene/opening_points.h"
#include "server/scene/scene.h"
#include "server/scene/sun.h"

namespace gonio::trace {

glm::dvec3 Luminaire::point(glm::vec2 random, glm::vec2 more) const {
    return position + world_from_light * opening_point(opening, glm::dvec2(random), glm::dvec2(more));
}

namespace {

// Of the cone from a sun's point that holds the scene: 1 - its cosine, which is small. sin: of its half angle.
double versine(double sin) {
    return sin * sin / (1.0 + std::sqrt(1.0 - sin * sin));
}

}  // namespace

glm::dvec3 Luminaire::emit(const glm::dvec3& source, glm::vec2 random, double& density_per_sr) const {
    if (!(sun_reach_m > 0.0)) return world_from_light * directions->draw(random, density_per_sr);
    const double distance_m = glm::length(source), whole = versine(sun_reach_m / distance_m);
    density_per_sr = 1.0 / (2.0 * std::numbers::pi * whole);
    const glm::dvec2 u(random);
    const double off = u.x * whole, sin = std::sqrt(off * (2.0 - off)), turn = 2.0 * std::numbers::pi * u.y;
    const glm::dvec3 axis = -source / distance_m,
                     x = glm::normalize(
                         glm::cross(axis, std::abs(axis.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
    return glm::normalize(axis * (1.0 - off) + sin * (std::cos(turn) * x + std::sin(turn) * glm::cross(axis, x)));
}

double Luminaire::density(const glm::dvec3& source, const glm::dvec3& direction) const {
    if (!(sun_reach_m > 0.0)) return directions->density(glm::transpose(world_from_light) * direction);
    const double distance_m = glm::length(source), sin = sun_reach_m / distance_m;
    return glm::length(glm::cross(direction, source / distance_m)) <= sin
               ? 1.0 / (2.0 * std::numbers::pi * versine(sin))
               : 0.0;
}

double Luminaire::start_m(const glm::dvec3& source) const {
    return sun_reach_m > 0.0 ? std::max(0.0, glm::length(source) - 2.0 * sun_reach_m) : 0.0;
}

double Luminaire::intensity_cd(const glm::dvec3& direction) const {
    const glm::dvec3 d = glm::transpose(world_from_light) * direction;
    return ies::intensity(profile->photometry.web, {d.x, d.y, d.z}).in(cd);
}

Luminaire luminaire_of(const Light& light, const Geometry& geometry) {
    Luminaire luminaire;
    luminaire.light = light.id;
    const LightSource source = gonio::source_of(light, geometry.asset().bounds);
    luminaire.position = source.position - geometry.origin();
    luminaire.world_from_light = glm::mat3_cast(light.world_from_light);
    luminaire.profile = light.shining();
    luminaire.opening = opening_of(light);
    if (light.sun) {
        const Length disc = 2.0 * std::tan(0.5 * kSunDiameter_rad) * std::sqrt(source.gain) * m;
        luminaire.opening = {ies::OpeningShape::ellipse, disc, disc, 0.0 * m};
        luminaire.sun_reach_m = static_cast<double>(geometry.extent());
    }
    luminaire.opening_radius_m = glm::length(half_sides(luminaire.opening));
    if (!light.sun) luminaire.lift = luminaire.world_from_light * lifted_off(luminaire.opening);
    return luminaire;
}

void take_directions(Luminaire& luminaire) {
    auto tables = shared_tables_of(*luminaire.profile);
    luminaire.directions = &tables->directions;
    luminaire.beam_cos = tables->beam_cos;
    luminaire.profile = with_tables(std::move(luminaire.profile), std::move(tables));
}

std::vector<Luminaire> luminaires_of(const Scene& scene, const Geometry& geometry) {
    std::vector<Luminaire> result;
    for (const Light& light : scene.lights) {
        Luminaire luminaire = luminaire_of(light, geometry);
        const LightSource source = gonio::source_of(light, geometry.asset().bounds);
        luminaire.weight = glm::vec3(light_weight(scene, light) * source.gain);
        const double flux_lm = light.sun
                                   ? std::numbers::pi * luminaire.sun_reach_m * luminaire.sun_reach_m / source.gain
                                   : light.shining()->flux_lm;  // for a weight of 1
        luminaire.power = static_cast<float>(luminance(glm::dvec3(luminaire.weight)) * flux_lm);
        if (!(luminaire.power > 0.0f)) continue;
        take_directions(luminaire);
        if (!luminaire.directions->dark()) result.push_back(std::move(luminaire));
    }
    return result;
}

Emitters emitters_of(const Geometry& geometry) {
    const SceneAsset& asset = geometry.asset();
    Emitters emitters;
    emitters.running.push_back(0.0);
    emitters.first_of_instance.assign(asset.instances.size(), -1);
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        const Material& material = asset.materials[static_cast<std::size_t>(mesh.material)];
        if (material.emissive_nit == glm::vec3(0.0f)) continue;
        emitters.first_of_instance[i] = static_cast<int>(emitters.list.size());
        for (int triangle = 0; triangle < static_cast<int>(mesh.indices.size() / 3); ++triangle) {
            Emitter emitter;
            emitter.instance = static_cast<int>(i);
            emitter.triangle = triangle;
            emitter.corner = geometry.corners(emitter.instance, triangle);
            const glm::dvec3 cross = glm::cross(glm::dvec3(emitter.corner[1] - emitter.corner[0]),
                                                glm::dvec3(emitter.corner[2] - emitter.corner[0]));
            const double twice = glm::length(cross);
            emitter.area_m2 = static_cast<float>(0.5 * twice);
            if (twice > 0.0) emitter.normal = glm::vec3(cross / twice);
            emitter.double_sided = material.double_sided;
            // A textured emitter is chosen by the mean of its corners, middle and edges, and now and then where they
            // are all dark.
            glm::dvec3 sum(0.0);
            for (const glm::vec2 uv :
                 {glm::vec2(0, 0), {1, 0}, {0, 1}, {0.5, 0}, {0, 0.5}, {0.5, 0.5}, {1 / 3.0, 1 / 3.0}}) {
                sum += glm::dvec3(geometry.emission_at(emitter.instance, triangle, uv.x, uv.y)) / 7.0;
            }
            const double power = (luminance(sum) + 0.01 * luminance(glm::dvec3(material.emissive_nit))) * 0.5 * twice;
            emitters.list.push_back(emitter);
            emitters.running.push_back(emitters.running.back() + (std::isfinite(power) ? power : 0.0));
        }
    }
    return emitters.running.back() > 0.0 ? emitters : no_emitters(asset);
}

Emitters no_emitters(const SceneAsset& asset) {
    return {{}, {0.0}, std::vector<int>(asset.instances.size(), -1)};
}

}  // namespace gonio::trace
