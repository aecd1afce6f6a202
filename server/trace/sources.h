// What emits: luminaires as rays sample them, and emissive triangles. Local coordinates (geometry.h). Any thread.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "server/scene/scene.h"
#include "server/trace/geometry.h"

namespace gonio::trace {

// Result: Rec. 709 luminance of linear rgb.
template <typename T>
T luminance(const glm::vec<3, T>& rgb) {
    return T(0.2126) * rgb.r + T(0.7152) * rgb.g + T(0.0722) * rgb.b;
}

// Directions of a profile, drawn nearly in proportion to I(omega): a piecewise constant density over cells of half a
// degree of the angle from the photometric zero and one degree of azimuth, each with the largest intensity seen on its
// corners, edges and centre and on the web's own angles that cross it, so that nothing is too narrow to be met.
class DirectionTable {
public:
    explicit DirectionTable(std::shared_ptr<const Profile> profile);
    const std::shared_ptr<const Profile>& profile() const { return profile_; }

    // Result: a unit direction in the luminaire frame; density: its probability per steradian (> 0).
    glm::dvec3 draw(glm::vec2 random, double& density) const;
    // Result: the density at which draw() would give this unit direction, 1/sr.
    double density(const glm::dvec3& direction) const;
    bool dark() const { return total_ <= 0.0; }
    // The same for all cells, polar × kAzimuth + azimuth.
    static constexpr int kPolar = 360, kAzimuth = 360;
    const std::vector<float>& densities() const { return densities_; }

private:
    std::shared_ptr<const Profile> profile_;
    std::vector<float> densities_;
    std::vector<double> rows_;    // running sums over the polar angle, kPolar + 1
    std::vector<float> columns_;  // per row running sums over the azimuth, normalised to 1, kAzimuth + 1 each
    double total_ = 0.0;
};

struct Luminaire {
    glm::dvec3 position{0.0};  // local, m
    glm::dmat3 world_from_light{1.0};
    glm::vec3 weight{0.0f};  // level, multiplier, colour, TILT factor and master, per channel
    std::shared_ptr<const DirectionTable> table;
    ies::Opening opening;           // shape point: a point
    double opening_radius_m = 0.0;  // half its diagonal
    float power = 0.0f;             // luminance of weight × flux, lm: how often it is chosen

    const Profile& profile() const { return *table->profile(); }
    // Result: a point of the opening, local, m. random: uniform pairs.
    glm::dvec3 point(glm::vec2 random, glm::vec2 more) const;
    // Result: I towards a unit direction (world axes) before the weight, cd.
    double intensity_cd(const glm::dvec3& direction) const;
};

// The luminaires of a scene; profiles' tables are taken over from `known`. Lights at weight 0 are left out.
// openings: whether luminaires keep their luminous opening or are points.
std::vector<Luminaire> luminaires_of(const Scene& scene, const Geometry& geometry, const std::vector<Luminaire>& known);

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

}  // namespace gonio::trace
