// Colour of linear Rec.709 by the figures of the standards, apart from the code that is tested.
#pragma once

#include <glm/glm.hpp>

namespace gonio::test {

// Result: x, y of CIE 1931 of linear Rec.709, by the primaries of ITU-R BT.709.
inline glm::dvec2 xy_of(const glm::dvec3& rgb) {
    const glm::dvec3 xyz = rgb.r * glm::dvec3(0.4124564, 0.2126729, 0.0193339) +
                           rgb.g * glm::dvec3(0.3575761, 0.7151522, 0.1191920) +
                           rgb.b * glm::dvec3(0.1804375, 0.0721750, 0.9503041);
    return {xyz.x / (xyz.x + xyz.y + xyz.z), xyz.y / (xyz.x + xyz.y + xyz.z)};
}

// Result: Y of ITU-R BT.709.
inline double luminance(const glm::dvec3& rgb) {
    return glm::dot(rgb, {0.2126, 0.7152, 0.0722});
}

}  // namespace gonio::test
