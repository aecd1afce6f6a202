// What haze scatters of a luminaire's light onto surfaces, once: the sum of its airlight over the directions from which
// a surface receives it. Airlight grows without bound towards the luminaire, as 1 / sin of the angle between:
// directions are spread evenly over that angle.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/lighting/airlight.h"
#include "server/transport/transport.h"

namespace gonio::lighting {

// One surfel in about sixteen, of each patch of surface one, and how their values come to the others: the weighted mean
// of those of the patches around. Near sources most surfels are among them. It does not depend on luminaires.
struct HazePoints {
    static constexpr std::size_t kAround = 4;
    std::vector<std::uint16_t> ids;                          // of surfels
    std::vector<std::array<std::uint16_t, kAround>> around;  // by surfel: numbers in `ids`
    std::vector<std::array<float, kAround>> weights;         // likewise; they sum to 1
};
HazePoints haze_points(const transport::Surfels& surfels, Pool& pool);

// out: illuminance at each surfel per candela of peak × unit_m2. Found at the points, along sixteen rays. far_m: how
// far rays go that meet nothing. Render thread.
void haze_at_surfels(const transport::Surfels& surfels, const HazePoints& points, const trace::Geometry& geometry,
                     const AirlightSource& source, float far_m, std::vector<float>& out, Pool& pool);
// The same at one point, along 4,096 rays. start: of its rays, a step off its surface.
float haze_at_point(const glm::vec3& point, const glm::vec3& normal, const glm::vec3& start,
                    const trace::Geometry& geometry, const AirlightSource& source, float far_m, Pool& pool);

}  // namespace gonio::lighting
