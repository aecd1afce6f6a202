#include "server/lighting/haze_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/light/lamp.h"
#include "tests/unit/light/made_transport.h"

namespace gonio::lighting {
namespace {

// A beam falls on the floor of a housing that is as large as a patch of haze points. What haze scatters onto the floor
// is brightest below the luminaire and must not be spread over all of it. What each point receives by many rays is
// told by haze_at_point(), which Haze.OntoAMeter compares with a quadrature.
TEST(HazeLight, AHousingsFloorKeepsItsBrightSpot) {
    constexpr float kFar_m = 1e4f;
    const glm::dvec3 a(-0.2, -0.18, -0.27), b(0.2, 0.18, 0.27);
    const auto isotropic = test::isotropic(1.0);
    const transport::Made made(test::scene_of_pieces(test::box(a, b, 0.5, true), {test::light_seed(isotropic, {})}),
                               {.least = 250, .most = 250});
    Lamp lamp(web_of_rings({0, 15, 25, 180}, {1, 1, 0, 0}), made.light, 0.06, 0.0);
    const transport::Surfels& surfels = made.surfels();
    Pool pool;
    std::vector<float> found;
    haze_at_surfels(surfels, haze_points(surfels, pool), *made.geometry, lamp.source, kFar_m, found, pool);
    double error = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < surfels.count; ++i) {
        if (surfels.normal(i).y < 0.5f) continue;
        const glm::vec3 p = surfels.position(i), n = surfels.normal(i),
                        start = p + n * (4.0f * made.geometry->step_off(p));
        const double right = static_cast<double>(haze_at_point(p, n, start, *made.geometry, lamp.source, kFar_m, pool)),
                     area_m2 = static_cast<double>(surfels.area_m2[i]);
        error += area_m2 * std::abs(static_cast<double>(found[i]) - right);
        sum += area_m2 * right;
    }
    EXPECT_LT(error, 0.4 * sum);
}

}  // namespace
}  // namespace gonio::lighting
