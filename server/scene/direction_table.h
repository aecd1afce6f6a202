// Directions of a luminaire's light, drawn at random.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "ies/web.h"

namespace gonio {

// Directions drawn nearly in proportion to I(omega). The density is piecewise constant over cells of half a degree of
// the angle from the photometric zero and one degree of azimuth. Each cell has the largest intensity seen on its
// corners, edges and centre and on the web's own angles that cross it. So nothing is too narrow to be met. Immutable.
class DirectionTable {
public:
    explicit DirectionTable(const ies::PhotometricWeb& web);

    // Result: a unit direction in the luminaire frame; density: its probability per steradian (> 0).
    glm::dvec3 draw(glm::vec2 random, double& density) const;
    // Result: the density at which draw() would give this unit direction, 1/sr.
    double density(const glm::dvec3& direction) const;
    bool dark() const { return total_ <= 0.0; }
    // Result: where light goes, on the luminaire's axes, to kLitDirectionsOff: at most some 5,000 directions.
    std::vector<glm::vec3> lit_directions() const;
    // Result: cosine of the angle from photometric zero, -Z, beyond which it is dark, or a little less: at least -1.
    float beam_cosine() const;

private:
    std::vector<float> densities_;  // of cells, 1/sr
    std::vector<double> rows_;      // running sums over the polar angle
    std::vector<float> columns_;    // per row running sums over the azimuth, normalised to 1
    double total_ = 0.0;
};

inline constexpr float kLitDirectionsOff = 0.1f;  // rad

}  // namespace gonio
