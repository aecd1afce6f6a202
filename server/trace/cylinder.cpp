#include "server/trace/cylinder.h"

#include <cmath>
#include <numbers>

namespace gonio::trace {

glm::dvec3 upright_normal(const MeterPoint& point, double turn) {
    const bool half = point.by == Receives::half_cylinder;
    const double first = half ? std::atan2(point.normal.z, point.normal.x) : 0.0;
    const double azimuth = first + std::numbers::pi * (half ? turn - 0.5 : 2.0 * turn);
    return {std::cos(azimuth), 0.0, std::sin(azimuth)};
}

std::vector<MeterPoint> planes_of(const MeterPoint& point) {
    if (point.by == Receives::plane) return {point};
    std::vector<MeterPoint> planes;
    for (int i = 0; i < kAzimuths; ++i)
        planes.push_back({point.position, upright_normal(point, (i + 0.5) / kAzimuths)});
    return planes;
}

glm::dvec3 cylinder_direct(const World& world, const MeterPoint& point) {
    const glm::vec3 position = world.geometry->local(point.position);
    // It stands on what is below it.
    const glm::vec3 from = position + glm::vec3(0.0f, world.geometry->step_off(position), 0.0f);
    glm::dvec3 sum(0.0);
    for (const Luminaire& luminaire : world.luminaires) {
        const glm::dvec3 d = luminaire.position - glm::dvec3(position);
        const double distance = glm::length(d);
        if (!(distance > 0.0)) continue;
        const glm::dvec3 to = d / distance;
        double share = std::hypot(to.x, to.z);
        if (point.by == Receives::half_cylinder) share += glm::dot(to, point.normal);
        if (!(share > 0.0)) continue;
        double lx = luminaire.intensity_cd(-to) * share / (std::numbers::pi * distance * distance);
        if (world.haze && !(luminaire.sun_reach_m > 0.0))
            lx *= transmittance(world.haze, glm::dvec3(position), luminaire.position);
        if (lx > 0.0)
            sum += glm::dvec3(luminaire.weight) * lx *
                   glm::dvec3(world.geometry->transmittance(from, glm::vec3(luminaire.position)));
    }
    return sum;
}

}  // namespace gonio::trace
