#include "tests/gl/picture_points.h"

#include <cmath>

#include "server/lighting/raster.h"
#include "server/lighting/screen.h"
#include "server/scene/scene.h"
#include "server/trace/sources.h"

namespace gonio::test {

PicturePoints points_of(const Scene& scene, const trace::Geometry& geometry, int step) {
    lighting::GBuffer gbuffer;
    lighting::Raster raster;
    Pool pool;
    lighting::look_through(eye_of(scene.camera, scene.width_px, scene.height_px), geometry, 1e-4f, scene.width_px,
                           scene.height_px, gbuffer);
    lighting::draw_gbuffer(lighting::make_clusters(geometry), lighting::make_material_table(geometry), false, gbuffer,
                           raster, pool);
    PicturePoints found;
    for (int y = step / 2; y < scene.height_px; y += step) {
        for (int x = step / 2; x < scene.width_px; x += step) {
            const lighting::Spot spot = lighting::spot_at(gbuffer, x, y);
            if (!(spot.depth > 0.0f)) continue;
            found.points.push_back({geometry.origin() + glm::dvec3(spot.position), glm::dvec3(spot.normal)});
            found.pixels.push_back(static_cast<std::size_t>(y * scene.width_px + x));
        }
    }
    return found;
}

TracedPoints traced_points(const Scene& scene, int step, double noise) {
    const auto world = trace::make_world(scene);
    TracedPoints traced{points_of(scene, *world->geometry, step), {}};
    trace::Settings settings;
    settings.bounces = trace::kAllBounces;
    settings.noise = noise;
    traced.truth = trace::measure(*world, traced.points, settings);
    return traced;
}

double rms_of(const TracedPoints& traced, const std::vector<glm::vec3>& shown_lx) {
    double squares = 0.0, mean = 0.0;
    for (std::size_t i = 0; i < traced.points.size(); ++i) {
        const double is = trace::luminance(traced.truth[i].indirect_lx),
                     off = trace::luminance(glm::dvec3(shown_lx[traced.pixels[i]])) - is;
        squares += off * off;
        mean += is;
    }
    const auto count = static_cast<double>(traced.points.size());
    return std::sqrt(squares / count) / (mean / count);
}

}  // namespace gonio::test
