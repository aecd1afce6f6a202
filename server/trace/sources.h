// What one scene revision looks like to rays: its surfaces and what emits, luminaires as rays sample them and emissive
// triangles. Local coordinates (geometry.h). Any thread.
#pragma once

#include <algorithm>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "server/scene/body.h"
#include "server/scene/haze.h"
#include "server/scene/light_tables.h"
#include "server/trace/geometry.h"

namespace gonio::trace {

// Result: Rec. 709 luminance of linear rgb.
template <typename T>
T luminance(const glm::vec<3, T>& rgb) {
    return T(0.2126) * rgb.r + T(0.7152) * rgb.g + T(0.0722) * rgb.b;
}

struct Luminaire {
    std::uint32_t light = 0;   // Light::id
    glm::dvec3 position{0.0};  // local, m
    glm::dmat3 world_from_light{1.0};
    glm::vec3 weight{0.0f};                      // level, multiplier, colour, TILT factor and master, per channel
    std::shared_ptr<const Profile> profile;      // with its tables, where it has directions
    const DirectionTable* directions = nullptr;  // of the profile
    float beam_cos = -1.0f;                      // LightTables::beam_cos
    ies::Opening opening;                        // shape point: a point
    double opening_radius_m = 0.0;               // half its diagonal
    glm::dvec3 lift{0.0};                        // where its rays start and end, from a point of it (lifted_off)
    double sun_reach_m = 0.0;  // of a sun: radius of the sphere around the origin that holds the scene
    float power = 0.0f;        // luminance of weight × flux, lm: how often it is chosen

    // Result: a point of the opening, local, m. random: uniform pairs.
    glm::dvec3 point(glm::vec2 random, glm::vec2 more) const;
    bool is_point() const { return opening.shape == ies::OpeningShape::point; }
    // Result: the direction of a ray from `source`, a point of the opening: unit, world axes. density: its probability
    // per steradian, 0 where there is none. random: uniform.
    glm::dvec3 emit(const glm::dvec3& source, glm::vec2 random, double& density) const;
    // Result: that probability of a direction.
    double density(const glm::dvec3& source, const glm::dvec3& direction) const;
    // Result: how far from `source` a ray may begin, m: nothing is nearer.
    double start_m(const glm::dvec3& source) const;
    // Result: I towards a unit direction (world axes) before the weight, cd.
    double intensity_cd(const glm::dvec3& direction) const;
};

// Result: where a light stands and what it shines from; no weight and no power yet, no directions.
Luminaire luminaire_of(const Light& light, const Geometry& geometry);
// Gives it the directions and the beam of its profile.
void take_directions(Luminaire& luminaire);
// The luminaires of a scene. Lights at weight 0 are left out.
std::vector<Luminaire> luminaires_of(const Scene& scene, const Geometry& geometry);

// An emissive triangle.
struct Emitter {
    int instance = 0, triangle = 0;
    std::array<glm::vec3, 3> corner;
    glm::vec3 normal{0.0f};  // front, unit
    bool double_sided = false;
    float area_m2 = 0.0f;
};

struct Emitters {
    std::vector<Emitter> list;
    std::vector<double> running;         // running sums of power, lm; list.size() + 1
    std::vector<int> first_of_instance;  // index into list of an instance's triangle 0, -1: it does not emit

    bool empty() const { return list.empty(); }
    // Result: probability per m² of drawing a point of this emitter.
    double density(std::size_t index) const {
        return (running[index + 1] - running[index]) / running.back() / static_cast<double>(list[index].area_m2);
    }
};
Emitters emitters_of(const Geometry& geometry);
Emitters no_emitters(const SceneAsset& asset);

struct World {
    std::shared_ptr<const Geometry> geometry;
    std::vector<Luminaire> luminaires;
    std::vector<double> running;  // running sums of the luminaires' power; luminaires.size() + 1
    Emitters emitters;
    Haze haze;          // local coordinates
    BodyPlaces bodies;  // that viewers see

    // Result: whether their direct light is exact without sampling.
    bool all_points() const {
        return std::all_of(luminaires.begin(), luminaires.end(), [](const Luminaire& own) { return own.is_point(); });
    }
};

}  // namespace gonio::trace
