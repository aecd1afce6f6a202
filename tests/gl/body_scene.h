// Scenes with a body. For tests.
#pragma once

#include <glm/gtc/matrix_transform.hpp>

#include "server/assets/mesh_builder.h"
#include "server/scene/body.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {

// Result: the scene, whose first light has a box of so long sides as its body, about `middle`. It turns with the light.
inline std::shared_ptr<const SceneAsset> with_box_body(const SceneAsset& asset, const glm::dvec3& middle, double side_m,
                                                       float reflectance = 0.6f) {
    auto bodies = std::make_shared<Bodies>();
    const glm::dvec3 light = asset.lights.at(0).position;
    Mesh box;
    add_box(box, glm::dvec3(-0.5 * side_m), glm::dvec3(0.5 * side_m));
    const int material = add_material(bodies->shown, "body", glm::vec3(reflectance));
    add_instance(bodies->shown, add_mesh(bodies->shown, std::move(box), material), asset.lights[0].name,
                 glm::translate(glm::dmat4(1.0), middle - light));
    bodies->mounts.push_back({0, glm::translate(glm::dmat4(1.0), light)});
    bodies->parts.push_back({0, 0});
    auto made = std::make_shared<SceneAsset>(asset);
    made->bodies = std::move(bodies);
    return made;
}

}  // namespace gonio::test
