#include "server/scene/orientation.h"

#include <cmath>
#include <numbers>

namespace gonio {
namespace {

const glm::dvec3 kX(1.0, 0.0, 0.0), kY(0.0, 1.0, 0.0), kZ(0.0, 0.0, 1.0);

}  // namespace

glm::dquat orientation_of(const PanTiltRoll& angles) {
    return glm::angleAxis(angles.pan_rad, kY) * glm::angleAxis(angles.tilt_rad, kX) *
           glm::angleAxis(angles.roll_rad, kY) * glm::angleAxis(-std::numbers::pi / 2, kX);
}

PanTiltRoll angles_of(const glm::dquat& world_from_light) {
    // aim = (-sin t sin p, -cos t, -sin t cos p).
    const glm::dvec3 aim = aim_of(world_from_light);
    PanTiltRoll result;
    const double horizontal = std::hypot(aim.x, aim.z);
    result.tilt_rad = std::atan2(horizontal, -aim.y);
    result.pan_rad = horizontal > 1e-9 ? std::atan2(-aim.x, -aim.z) : 0.0;
    result.roll_rad = roll_of(world_from_light, result.pan_rad, result.tilt_rad);
    return result;
}

double roll_of(const glm::dquat& world_from_light, double pan_rad, double tilt_rad) {
    const glm::dquat frame = glm::angleAxis(pan_rad, kY) * glm::angleAxis(tilt_rad, kX);
    const glm::dvec3 c0 = glm::inverse(frame) * c0_of(world_from_light);  // (cos r, 0, -sin r)
    return std::atan2(-c0.z, c0.x);
}

glm::dquat orientation_aiming(const glm::dvec3& direction) {
    const glm::dvec3 aim = glm::normalize(direction);
    const glm::dvec3 reference = std::abs(aim.x) > 1.0 - 1e-6 ? kZ : kX;
    const glm::dvec3 c0 = glm::normalize(reference - aim * glm::dot(reference, aim));
    const glm::dvec3 back = -aim;
    return glm::normalize(glm::quat_cast(glm::dmat3(c0, glm::cross(back, c0), back)));
}

glm::dvec3 aim_of(const glm::dquat& world_from_light) {
    return world_from_light * -kZ;
}
glm::dvec3 c0_of(const glm::dquat& world_from_light) {
    return world_from_light * kX;
}

}  // namespace gonio
