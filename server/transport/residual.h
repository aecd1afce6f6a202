// By how much a bounce changes the light of a run of surfels. Any thread.
#pragma once

#include <glm/glm.hpp>
#include <span>

namespace gonio::transport {

// Compares E with F(E), the light after one more bounce. By channel, in the unit of E.
struct Residual {
    glm::vec4 most{0.0f};      // max |F - E|
    glm::vec4 greatest{0.0f};  // max F
    glm::vec4 relative{0.0f};  // max |F - E| / (F + floor); NaN where any value is
    glm::vec4 change{0.0f};    // sum of |F - E|
    glm::vec4 sum{0.0f};       // sum of F
};

// Compares spans of one size. Sums stay exact to 1e-4 up to a few thousand values. `floor` is above 0 and is added to
// what F is divided by; the fourth channel counts for nothing. `r` becomes F - E.
Residual compare(std::span<const glm::vec4> e, std::span<const glm::vec4> f, const glm::vec3& floor,
                 std::span<glm::vec4> r);

}  // namespace gonio::transport
