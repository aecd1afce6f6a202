#include "server/scene/eye.h"

#include <algorithm>
#include <cmath>

namespace gonio {

Eye eye_of(const Camera& camera, int width_px, int height_px) {
    Eye eye;
    eye.position = camera.eye;
    eye.forward = glm::normalize(camera.target - camera.eye);
    const glm::dvec3 world_up = std::abs(eye.forward.y) > 0.9999 ? glm::dvec3(0, 0, -1) : glm::dvec3(0, 1, 0);
    eye.right = glm::normalize(glm::cross(eye.forward, world_up));
    eye.up = glm::cross(eye.right, eye.forward);
    eye.tan_half_y = std::tan(camera.fov_rad / 2);
    eye.tan_half_x = eye.tan_half_y * width_px / height_px;
    return eye;
}

bool may_see(const Eye& eye, const glm::dvec3& centre, double radius_m) {
    const glm::dvec3 d = centre - eye.position;
    const double distance = glm::length(d);
    if (distance <= radius_m) return true;
    const double angle = std::acos(std::clamp(glm::dot(d, eye.forward) / distance, -1.0, 1.0));
    return angle <= std::atan(std::hypot(eye.tan_half_x, eye.tan_half_y)) + std::asin(radius_m / distance);
}

}  // namespace gonio
