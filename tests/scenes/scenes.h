// Scenes and luminaires whose light is known in closed form, for tests and benches.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "server/scene/apply.h"
#include "server/scene/orientation.h"

namespace gonio::test {

// A Type C profile from a law I(v, h) in cd, radians, on a grid of step degrees over the full sphere.
std::shared_ptr<const Profile> profile_of(const std::string& name, double step_deg,
                                          const std::function<double(double v, double h)>& law);
std::shared_ptr<const Profile> isotropic(double candela);
std::shared_ptr<const Profile> cosine_power(double candela, double power);  // I0 cos^n below the horizon, 1 degree grid

// Result: the same without a luminous opening.
std::shared_ptr<const Profile> as_point(const std::shared_ptr<const Profile>& profile);
// Result: the scene with its luminaires as points.
std::shared_ptr<const SceneAsset> of_points(const SceneAsset& asset);

// Meshes with one material each.
Mesh quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
          const glm::dvec3& d);                  // counter-clockwise from the front
Mesh inward_sphere(double radius_m, int rings);  // normals point to the centre

// A scene of the meshes, each with the reflectance given, and one light.
struct Piece {
    Mesh mesh;
    glm::vec3 reflectance{1.0f};
    glm::vec3 emissive_nit{0.0f};
};
Scene scene_with(std::vector<Piece> pieces, std::shared_ptr<const Profile> profile, const glm::dvec3& light_position,
                 const glm::dquat& orientation = orientation_of({}), const glm::dvec3& offset = glm::dvec3(0.0));

// A square floor at y = 0, normal +Y.
Scene floor_scene(double side_m, float reflectance, std::shared_ptr<const Profile> profile,
                  const glm::dvec3& light_position, const glm::dquat& orientation = orientation_of({}));

// The scene's first light becomes `count`, each with an id and a name of its own. change: of light i, 0 the first.
void repeat_light(Scene& scene, std::size_t count, const std::function<void(Light& light, std::size_t i)>& change);

}  // namespace gonio::test
