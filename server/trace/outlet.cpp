#include "server/trace/outlet.h"

#include <algorithm>
#include <cmath>

#include "server/trace/sampler.h"
#include "server/trace/sources.h"

namespace gonio::trace {
namespace {

constexpr int kOutletRays = 256;
constexpr double kPlane_m = 0.1;  // a plane that runs so near is the one that it is let into, however far a ray goes
constexpr double kLandsAtLeast = 0.005, kStoppedAtLeast = 0.25;  // shares of the flux
constexpr double kOneWay = 0.2;     // length of the mean direction, from which on light has a middle
constexpr double kAboutAxis = 0.9;  // cosine between axis and middle
constexpr std::uint32_t kOutletSeed = 0x0071e7u;

struct Outflow {
    double lands = 0.0, stopped = 0.0;  // shares of the flux
    glm::dvec3 middle{0, -1, 0};        // unit; of light to all sides straight down
};

// Result: the luminaire with its directions; nothing for suns and what is dark.
std::optional<Luminaire> as_source(const Geometry& geometry, const Light& light) {
    if (light.sun) return std::nullopt;
    Luminaire luminaire = luminaire_of(light, geometry);
    take_directions(luminaire);
    if (luminaire.directions->dark()) return std::nullopt;
    return luminaire;
}

// Rays begin two steps off, so that a surface in whose plane the luminaire lies is behind them.
Outflow outflow_of(const Geometry& geometry, const Luminaire& luminaire) {
    Outflow outflow;
    glm::dvec3 sum(0.0);
    double all = 0.0;
    for (int first = 0; first < kOutletRays; first += kPacket) {
        RayPacket rays;
        HitPacket hits;
        double weights[kPacket];
        for (int i = 0; i < kPacket; ++i) {
            Sample sample(kOutletSeed, static_cast<std::uint32_t>(first + i));
            const glm::vec2 place = sample.next(), more = sample.next();
            const glm::dvec3 source = luminaire.point(place, more) + luminaire.lift;
            double density = 0.0;
            const glm::dvec3 along = luminaire.emit(source, sample.next(), density);
            weights[i] = density > 0.0 ? luminaire.intensity_cd(along) / density : 0.0;
            rays.set(i, glm::vec3(source) + glm::vec3(along) * 2.0f * geometry.step_off(glm::vec3(source)),
                     glm::vec3(along));
            sum += weights[i] * along;
            all += weights[i];
        }
        const unsigned met = geometry.closest(rays, (1u << kPacket) - 1u, hits);
        for (int i = 0; i < kPacket; ++i) {
            if ((met >> i & 1u) == 0) continue;
            const glm::dvec3 normal = glm::normalize(glm::dvec3(hits.normal(i)));
            const double distance_m = static_cast<double>(hits.distance[i]);
            const double plane_m = std::abs(glm::dot(normal, glm::dvec3(rays.along(i)))) * distance_m;
            (distance_m > kNear_m && plane_m > kPlane_m ? outflow.lands : outflow.stopped) += weights[i];
        }
        if (outflow.lands > 0.0 && outflow.lands >= kLandsAtLeast * all) break;
        if (first >= 3 * kPacket && outflow.stopped < 0.25 * kStoppedAtLeast * all) break;  // it shines into the open
    }
    if (!(all > 0.0)) return outflow;
    outflow.lands /= all, outflow.stopped /= all;
    if (glm::length(sum) > kOneWay * all) outflow.middle = glm::normalize(sum);
    // Few rays tell it to a few degrees: most luminaires shine about their axis.
    const glm::dvec3 axis = luminaire.world_from_light * glm::dvec3(0, 0, -1);
    if (glm::dot(outflow.middle, axis) > kAboutAxis) outflow.middle = axis;
    return outflow;
}

bool gets_nowhere(const Outflow& outflow) {
    return outflow.lands < kLandsAtLeast && outflow.stopped >= kStoppedAtLeast;
}

}  // namespace

std::optional<Obstacle> obstacle_of(const Geometry& geometry, const Light& light) {
    const auto luminaire = as_source(geometry, light);
    if (!luminaire) return std::nullopt;
    const Outflow outflow = outflow_of(geometry, *luminaire);
    if (!gets_nowhere(outflow)) return std::nullopt;
    const glm::vec3 from(luminaire->position), along(outflow.middle);
    SurfaceHit hit;
    if (!geometry.closest(from, along, geometry.step_off(from), false, hit)) return std::nullopt;
    return Obstacle{static_cast<double>(hit.distance), hit.instance};
}

std::optional<glm::dvec3> recessed_position(const Geometry& geometry, const Light& light) {
    const auto luminaire = as_source(geometry, light);
    if (!luminaire) return std::nullopt;
    const Outflow now = outflow_of(geometry, *luminaire);
    const glm::vec3 from(luminaire->position), along(now.middle);
    SurfaceHit hit;
    if (!gets_nowhere(now)) {
        if (!geometry.closest(from + along * geometry.step_off(from), -along, 0.0f, false, hit) ||
            static_cast<double>(hit.distance) > kRecess_m)
            return std::nullopt;
        return light.position + now.middle * (kInFront_m - static_cast<double>(hit.distance - geometry.step_off(from)));
    }
    // A housing, the ceiling below it, and what else lies upon each other there.
    constexpr int kMostSurfaces = 32;
    float beyond = geometry.step_off(from);
    for (int surface = 0; surface < kMostSurfaces; ++surface) {
        if (!geometry.closest(from, along, beyond, false, hit) || static_cast<double>(hit.distance) > kRecess_m) break;
        Luminaire moved = *luminaire;
        const glm::dvec3 by = now.middle * (static_cast<double>(hit.distance) + kInFront_m);
        moved.position += by;
        if (!gets_nowhere(outflow_of(geometry, moved))) return light.position + by;
        beyond = hit.distance + geometry.step_off(from);
    }
    return std::nullopt;
}

}  // namespace gonio::trace
