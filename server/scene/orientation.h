// Luminaire orientation: the rules of docs/rendering.md for node frame, pan/tilt/roll and aim.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace gonio {

struct PanTiltRoll {
    double pan_rad = 0.0, tilt_rad = 0.0, roll_rad = 0.0;
};

// Result: world_from_light = R_Y(pan) · R_X(tilt) · R_Y(roll) · R_X(-90°): at zero the aim is -Y, C0 = +X, C90 = -Z;
// tilt +90° aims -Z; roll adds to C.
glm::dquat orientation_of(const PanTiltRoll& angles);
// Result: the angles of an orientation; tilt in 0..pi, pan 0 where the aim is vertical.
PanTiltRoll angles_of(const glm::dquat& world_from_light);
// Result: the roll of an orientation with this pan and tilt.
double roll_of(const glm::dquat& world_from_light, double pan_rad, double tilt_rad);
// Result: the orientation that aims along `aim` (any length > 0): C0 is world +X projected off the aim, world +Z where
// |aim·X| > 1 - 1e-6. It flips when the aim is swept through ±X.
glm::dquat orientation_aiming(const glm::dvec3& aim);

glm::dvec3 aim_of(const glm::dquat& world_from_light);  // world direction of the photometric zero, unit length
glm::dvec3 c0_of(const glm::dquat& world_from_light);   // world direction of the C0 plane, unit length

}  // namespace gonio
