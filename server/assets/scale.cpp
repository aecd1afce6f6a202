#include "server/assets/scale.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>

#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"
#include "server/scene/body.h"

namespace gonio {
namespace {

// Result: the factor that makes a room of it: a file in centimetres or millimetres, else the power of ten that comes
// nearest to 10 m.
double likely_factor(double extent_m) {
    constexpr double kRoom_m = 10.0;
    if (extent_m > kMostExtent_m && extent_m * 0.001 <= kMostExtent_m)
        return extent_m * 0.01 * extent_m * 0.001 <= kRoom_m * kRoom_m ? 0.01 : 0.001;
    return std::pow(10.0, std::round(std::log10(kRoom_m / extent_m)));
}

std::string short_number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, value >= 1000.0 && value < 1e9 ? "%.0f" : "%.3g", value);
    return text;
}

}  // namespace

void scale_scene(SceneAsset& scene, double factor) {
    scene.scale = factor;
    if (factor == 1.0) return;
    scene.exposure_ev100.reset();  // that of another size
    const glm::dmat4 scaling = glm::scale(glm::dmat4(1.0), glm::dvec3(factor));
    for (Instance& instance : scene.instances) instance.world_from_mesh = scaling * instance.world_from_mesh;
    for (LightSeed& light : scene.lights) light.position *= factor;
    if (scene.bodies) {
        auto bodies = std::make_shared<Bodies>(*scene.bodies);
        for (Instance& part : bodies->shown.instances) part.world_from_mesh = scaling * part.world_from_mesh;
        for (BodyMount& mount : bodies->mounts) {
            mount.world_from_fixture[3] = glm::dvec4(factor * glm::dvec3(mount.world_from_fixture[3]), 1.0);
            for (BodyJoint& joint : mount.joints) joint.point *= factor;
        }
        scene.bodies = std::move(bodies);
    }
    for (Camera& camera : scene.cameras) {
        camera.eye *= factor;
        camera.target *= factor;
    }
    if (scene.instances.empty()) return measure_lights(scene);
    scene.bounds.min *= factor;
    scene.bounds.max *= factor;
}

void warn_of_extent(SceneAsset& scene) {
    if (scene.instances.empty()) return;
    const glm::dvec3 sides = scene.bounds.max - scene.bounds.min;
    const double extent_m = std::max({sides.x, sides.y, sides.z});
    if (!(extent_m < kLeastExtent_m || extent_m > kMostExtent_m)) return;
    std::string text = "the scene is " + short_number(extent_m) + " m long, which is no room";
    const double factor = extent_m > 0.0 ? likely_factor(extent_m) : 0.0, scale = scene.scale * factor;
    if (scale >= kLeastScale && scale <= kMostScale)
        text += ": --scale " + short_number(scale) + " makes it " + short_number(factor * extent_m) +
                " m long, and candela stay";
    scene.warnings.insert(scene.warnings.begin(), std::move(text));
}

}  // namespace gonio
