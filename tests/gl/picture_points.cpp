#include "tests/gl/picture_points.h"

#include "server/shade/raster.h"
#include "server/shade/screen.h"

namespace gonio::test {

PicturePoints points_of(const Scene& scene, const trace::Geometry& geometry, int step) {
    shade::Surfaces surfaces;
    shade::Raster raster;
    shade::Pool pool;
    shade::look_through(eye_of(scene.camera, scene.width_px, scene.height_px), geometry, 1e-4f, scene.width_px,
                        scene.height_px, surfaces);
    shade::draw_surfaces(shade::make_clusters(geometry), shade::make_looks(geometry), false, surfaces, raster, pool);
    PicturePoints found;
    for (int y = step / 2; y < scene.height_px; y += step) {
        for (int x = step / 2; x < scene.width_px; x += step) {
            const shade::Spot spot = shade::spot_at(surfaces, x, y);
            if (!(spot.depth > 0.0f)) continue;
            found.points.push_back({geometry.origin() + glm::dvec3(spot.position), glm::dvec3(spot.normal)});
            found.pixels.push_back(static_cast<std::size_t>(y * scene.width_px + x));
        }
    }
    return found;
}

}  // namespace gonio::test
