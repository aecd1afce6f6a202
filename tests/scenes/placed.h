// Scenes put together from meshes with materials of their own, for stress and surveys.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/scene/asset.h"
#include "server/scene/orientation.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::test {

// Gives every part of the scene a revision that no scene had before, so that one renderer can see many scenes.
void renew(Scene& scene);

struct Placed {
    Mesh mesh;
    Material material;
    glm::dmat4 world_from_mesh{1.0};
};
// Returns a scene of the pieces and the lights, 48 × 48 pixels, renewed. Lights without a name get one.
Scene scene_of_pieces(std::vector<Placed> pieces, std::vector<LightSeed> lights, std::vector<Image> images = {});
LightSeed light_seed(std::shared_ptr<const Profile> profile, const glm::dvec3& position,
                     const glm::dquat& orientation = orientation_of({}));
// Double-sided, grey.
Material matte(double reflectance);

// Returns the six faces of a box, seen from outside, or from inside as a room.
std::vector<Placed> box(const glm::dvec3& min, const glm::dvec3& max, double reflectance, bool inwards);

}  // namespace gonio::test
