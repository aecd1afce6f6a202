#include "server/assets/far_place.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/scene/body.h"

namespace gonio {
namespace {

constexpr double kWhole_m = 1000.0;

std::string place_text(const glm::dvec3& place) {
    char text[96];
    std::snprintf(text, sizeof text, "%.0f, %.0f, %.0f", place.x, place.y, place.z);
    return text;
}

void move_by(SceneAsset& scene, const glm::dvec3& by) {
    const auto move = [&](glm::dmat4& matrix) { matrix[3] += glm::dvec4(by, 0.0); };
    for (Instance& instance : scene.instances) move(instance.world_from_mesh);
    for (LightSeed& light : scene.lights) light.position += by;
    if (scene.bodies) {
        auto bodies = std::make_shared<Bodies>(*scene.bodies);
        for (BodyMount& mount : bodies->mounts) move(mount.world_from_fixture);
        scene.bodies = std::move(bodies);
    }
    for (Camera& camera : scene.cameras) {
        camera.eye += by;
        camera.target += by;
    }
    scene.bounds.min += by;
    scene.bounds.max += by;
}

}  // namespace

void bring_near(SceneAsset& scene) {
    if (scene.instances.empty()) return;
    const glm::dvec3 farthest = glm::max(glm::abs(scene.bounds.min), glm::abs(scene.bounds.max));
    if (std::max({farthest.x, farthest.y, farthest.z}) <= kFarthest_m) return;
    const glm::dvec3 middle = 0.5 * (scene.bounds.min + scene.bounds.max);
    if (glm::length(middle) <= glm::length(scene.bounds.max - scene.bounds.min)) return;  // it is not far, but large
    const glm::dvec3 place = glm::round(middle / kWhole_m) * kWhole_m;
    move_by(scene, -place);
    scene.place += place;
    scene.warnings.insert(scene.warnings.begin(),
                          "the scene lies over 1000 km from the origin and is computed relative to " +
                              place_text(place) +
                              " m: clients see and enter positions as the file has them; those of consoles and of "
                              "exported files are relative to that place");
}

void warn_of_coarse_vertices(SceneAsset& scene) {
    double coarsest_m = 0.0;
    float farthest = 0.0f;
    for (const Instance& instance : scene.instances) {
        const Bounds& bounds = scene.meshes[static_cast<std::size_t>(instance.mesh)].bounds;
        for (int k = 0; k < 3; ++k) {
            const auto most = static_cast<float>(std::max(std::abs(bounds.min[k]), std::abs(bounds.max[k])));
            const double scale = glm::length(glm::dvec3(instance.world_from_mesh[k]));
            const double step_m = scale * static_cast<double>(std::nextafter(most, 2.0f * most + 1.0f) - most);
            if (step_m > coarsest_m) coarsest_m = step_m, farthest = most;
        }
    }
    if (coarsest_m < kCoarsest_m) return;
    char text[256];
    std::snprintf(text, sizeof text,
                  "vertices lie %.0f units from the origin of their mesh, where the file's single precision has steps "
                  "of %.2g m: walls may be off by as much; place them by their node; changes lux",
                  static_cast<double>(farthest), coarsest_m);
    scene.warnings.emplace_back(text);
}

}  // namespace gonio
