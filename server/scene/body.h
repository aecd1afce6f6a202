// Bodies of luminaires: what is seen of them beside their light. Each part stands as its luminaire does. Of a moving
// head the base stands still while yoke and head turn about their axes, so that the head looks where the light aims.
// Bodies are seen and lit. They stop no light and reflect none: a luminaire's light begins inside its own body.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "server/scene/asset.h"
#include "server/scene/light.h"

namespace gonio {

struct Scene;

inline constexpr std::size_t kMostBodyParts = 4096;                      // of a scene
inline constexpr std::size_t kMostBodyTriangles = std::size_t{1} << 20;  // likewise, counted for each part
inline constexpr std::size_t kMostJoints = 2;                            // above a luminaire's beam

// An axis that a part turns about, of the fixture's axes at home: no angle is turned.
struct BodyJoint {
    glm::dvec3 point{0.0}, axis{0.0, 0.0, 1.0};  // m; unit
};

// How bodies follow a light.
struct BodyMount {
    int seed = 0;                        // the light: index into SceneAsset::lights
    glm::dmat4 world_from_fixture{1.0};  // rigid; as the light's seed stands
    std::vector<BodyJoint> joints;       // from the base on; none: all of it turns with the light
    glm::dvec3 aim{0.0, 0.0, -1.0};      // of the light at home, of the fixture's axes, unit
    double pan_rad = 0.0;                // about the first joint, as the light's seed aims
    double side = 1.0;                   // -1: where the light's pan is 0 the last joint's axis goes along -X, not +X
};

struct BodyPart {
    int mount = 0;
    std::size_t joints = 0;  // of its mount's, that turn it
};

// All bodies of a scene. Immutable.
struct Bodies {
    SceneAsset
        shown;  // its instances are the parts: world_from_mesh is of the fixture's axes at home. It has no lights
    std::vector<BodyMount> mounts;
    std::vector<BodyPart> parts;  // like shown.instances
};

// Result: about what a light's tilt turns it at this pan (orientation.h), world, unit.
glm::dvec3 tilt_axis(const LightSeed& seed, double pan_rad);
// Result: angles about the mount's joints, rad, with which its beam aims as the light does, or as nearly as it can. Of
// two ways there is the one whose last axis is where the light's pan has it.
std::array<double, kMostJoints> joint_angles(const BodyMount& mount, const LightSeed& seed, const LightValues& light);

// Result: world_from_home of parts that so many joints turn, the index: rigid, from where they are at home, of the
// fixture's axes.
std::array<glm::dmat4, kMostJoints + 1> body_places(const BodyMount& mount, const LightSeed& seed,
                                                    const LightValues& light);

// world_from_home by part; nothing where its light is not there any more. Empty: the scene has no bodies.
using BodyPlaces = std::vector<std::optional<glm::dmat4>>;
BodyPlaces body_places(const Scene& scene);

}  // namespace gonio
