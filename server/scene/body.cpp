#include "server/scene/body.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "server/scene/orientation.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Result: the angle about an axis that brings one direction nearest to another; 0 where either goes along it.
double turn_between(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to) {
    const double sine = glm::dot(axis, glm::cross(from, to)),
                 cosine = glm::dot(from, to) - glm::dot(axis, from) * glm::dot(axis, to);
    return std::hypot(sine, cosine) > 1e-7 ? std::atan2(sine, cosine) : 0.0;
}

glm::dvec3 turned(const BodyJoint& joint, double angle_rad, const glm::dvec3& direction) {
    return glm::angleAxis(angle_rad, joint.axis) * direction;
}

glm::dmat4 turn_about(const BodyJoint& joint, double angle_rad) {
    return glm::translate(glm::dmat4(1.0), joint.point) * glm::mat4_cast(glm::angleAxis(angle_rad, joint.axis)) *
           glm::translate(glm::dmat4(1.0), -joint.point);
}

// Two turns that bring mount.aim to `aim`: of the two ways there the one whose last axis is nearer to `side`. Where the
// turned axes meet (Murray, Li and Sastry 1994, Paden-Kahan subproblem 2): z is the aim between both turns, on the cone
// of each axis.
std::array<double, kMostJoints> two_turns(const BodyMount& mount, const glm::dvec3& aim, const glm::dvec3& side) {
    const BodyJoint &first = mount.joints[0], &last = mount.joints[1];
    const glm::dvec3 both = glm::cross(first.axis, last.axis);
    const double cosine = glm::dot(first.axis, last.axis), sine2 = std::max(glm::dot(both, both), 1e-12);
    const double on_first = glm::dot(first.axis, aim), on_last = glm::dot(last.axis, mount.aim);
    const double a = (on_first - cosine * on_last) / sine2, b = (on_last - cosine * on_first) / sine2;
    const double c = std::sqrt(std::max((1.0 - a * a - b * b - 2.0 * a * b * cosine) / sine2, 0.0));
    std::array<double, kMostJoints> best{};
    double nearest = -2.0;
    for (const double sign : {1.0, -1.0}) {
        const glm::dvec3 z = a * first.axis + b * last.axis + sign * c * both;
        std::array<double, kMostJoints> angles = {turn_between(first.axis, z, aim),
                                                  turn_between(last.axis, mount.aim, z)};
        // Along the first axis its angle is what the light's pan says.
        if (glm::length(glm::cross(first.axis, aim)) < 1e-6) angles[0] = turn_between(first.axis, last.axis, side);
        const double near = glm::dot(turned(first, angles[0], last.axis), side);
        if (near > nearest + 1e-9) nearest = near, best = angles;
    }
    return best;
}

}  // namespace

glm::dvec3 tilt_axis(const LightSeed& seed, double pan_rad) {
    return seed.world_from_mount * glm::dvec3(std::cos(pan_rad), 0.0, -std::sin(pan_rad));
}

std::array<double, kMostJoints> joint_angles(const BodyMount& mount, const LightSeed& seed, const LightValues& light) {
    if (mount.joints.empty()) return {};
    const glm::dmat3 fixture_from_world = glm::transpose(glm::dmat3(mount.world_from_fixture));
    const glm::dvec3 aim = fixture_from_world * aim_of(light.world_from_light);
    if (mount.joints.size() == 1) return {turn_between(mount.joints[0].axis, mount.aim, aim), 0.0};
    const glm::dquat as_seed = glm::normalize(seed.world_from_light);
    const bool untouched = std::abs(glm::dot(as_seed, light.world_from_light)) > 1.0 - 1e-12;
    const glm::dvec3 side = untouched ? turned(mount.joints[0], mount.pan_rad, mount.joints[1].axis)
                                      : fixture_from_world * (mount.side * tilt_axis(seed, light.pan_rad));
    return two_turns(mount, aim, side);
}

std::array<glm::dmat4, kMostJoints + 1> body_places(const BodyMount& mount, const LightSeed& seed,
                                                    const LightValues& light) {
    std::array<glm::dmat4, kMostJoints + 1> places;
    if (mount.joints.empty()) {
        const auto pose = [](const glm::dvec3& position, const glm::dquat& turn) {
            return glm::translate(glm::dmat4(1.0), position) * glm::mat4_cast(glm::normalize(turn));
        };
        places.fill(pose(light.position, light.world_from_light) *
                    glm::inverse(pose(seed.position, seed.world_from_light)) * mount.world_from_fixture);
        return places;
    }
    const auto angles = joint_angles(mount, seed, light);
    places.fill(glm::translate(glm::dmat4(1.0), light.position - seed.position) * mount.world_from_fixture);
    for (std::size_t k = 0; k < mount.joints.size(); ++k)
        for (std::size_t later = k + 1; later < places.size(); ++later)
            places[later] = places[later] * turn_about(mount.joints[k], angles[k]);
    return places;
}

BodyPlaces body_places(const Scene& scene) {
    BodyPlaces places;
    const std::shared_ptr<const Bodies>& bodies = scene.asset->bodies;
    if (!bodies) return places;
    const auto& seeds = scene.asset->lights;
    std::vector<const Light*> light_of(seeds.size(), nullptr);
    for (const Light& light : scene.lights)
        if (light.seed >= 0) light_of[static_cast<std::size_t>(light.seed)] = &light;
    std::vector<std::array<glm::dmat4, kMostJoints + 1>> of_mount(bodies->mounts.size());
    for (std::size_t i = 0; i < bodies->mounts.size(); ++i) {
        const auto seed = static_cast<std::size_t>(bodies->mounts[i].seed);
        if (light_of[seed] != nullptr) of_mount[i] = body_places(bodies->mounts[i], seeds[seed], *light_of[seed]);
    }
    for (const BodyPart& part : bodies->parts) {
        const auto mount = static_cast<std::size_t>(part.mount);
        const bool there = light_of[static_cast<std::size_t>(bodies->mounts[mount].seed)] != nullptr;
        places.push_back(there ? std::optional(of_mount[mount][part.joints]) : std::nullopt);
    }
    return places;
}

}  // namespace gonio
