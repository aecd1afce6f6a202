// How a picture is looked at.
#pragma once

#include "server/scene/asset.h"

namespace gonio {

// The viewing geometry of a target: the scene's camera, or a meter that looks straight at its point.
struct Eye {
    glm::dvec3 position{0.0};                                   // world, m
    glm::dvec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  // orthonormal, world
    double tan_half_x = 1.0, tan_half_y = 1.0;
    // The part of the view that the target shows: centre and half size in the whole view's -1..1.
    glm::dvec2 window_centre{0.0}, window_half{1.0};
};
// Result: the whole view of a camera on a picture of this size, pixels square.
Eye eye_of(const Camera& camera, int width_px, int height_px);
// Result: the ray through a place of the whole view, -1..1, x to the right and y up: one metre deep, world.
inline glm::dvec3 ray_through(const Eye& eye, double x, double y) {
    return eye.forward + x * eye.tan_half_x * eye.right + y * eye.tan_half_y * eye.up;
}

// Whether a sphere (world, m) may be in the view: its cone's edge is that of the corners.
bool may_see(const Eye& eye, const glm::dvec3& centre, double radius_m);

}  // namespace gonio
