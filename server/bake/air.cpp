#include "server/bake/air.h"

#include <algorithm>
#include <cmath>

#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kOpeningPoints = 4;  // of a cell of the volume
constexpr int kTile = 256;

}  // namespace

double AirVolume::at(const glm::dvec3& local) const {
    const glm::dvec3 p = glm::clamp((local - low) / cell, glm::dvec3(0.0), glm::dvec3(size - 1));
    const glm::ivec3 a = glm::min(glm::ivec3(p), glm::max(size - 2, glm::ivec3(0)));
    const glm::dvec3 part = p - glm::dvec3(a);
    double sum = 0.0;
    for (int k = 0; k < 8; ++k) {
        const glm::ivec3 step(k & 1, k >> 1 & 1, k >> 2 & 1);
        const glm::ivec3 q = glm::min(a + step, size - 1);
        double weight = 1.0;
        for (int c = 0; c < 3; ++c) weight *= step[c] != 0 ? part[c] : 1.0 - part[c];
        if (weight > 0.0)
            sum += weight * static_cast<double>(passed[static_cast<std::size_t>((q.z * size.y + q.y) * size.x + q.x)]);
    }
    return sum;
}

AirVolume air_volume(const trace::Geometry& geometry, const trace::Luminaire& luminaire, const AirSettings& settings,
                     Work& work) {
    AirVolume volume;
    const Bounds& bounds = geometry.asset().bounds;
    const glm::dvec3 sides = glm::max(bounds.max - bounds.min, glm::dvec3(1e-6));
    const double cell = std::max({sides.x, sides.y, sides.z}) / kVolumeSide;
    volume.size = glm::max(glm::ivec3(glm::ceil(sides / cell)), glm::ivec3(2));
    volume.cell = sides / glm::dvec3(volume.size);
    volume.low = bounds.min - geometry.origin() + 0.5 * volume.cell;
    volume.passed.assign(static_cast<std::size_t>(volume.size.x) * static_cast<std::size_t>(volume.size.y) *
                             static_cast<std::size_t>(volume.size.z),
                         0.0f);
    const bool point = !settings.openings || luminaire.opening.shape == ies::OpeningShape::point;
    const bool whole = work.tiles(static_cast<int>(volume.passed.size()), kTile, [&](int first, int end) {
        for (int i = first; i < end; ++i) {
            const glm::ivec3 at(i % volume.size.x, i / volume.size.x % volume.size.y,
                                i / volume.size.x / volume.size.y);
            const glm::dvec3 p = volume.low + glm::dvec3(at) * volume.cell;
            double sum = 0.0;
            const int points = point ? 1 : kOpeningPoints;
            for (int k = 0; k < points; ++k) {
                trace::Sample sample(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k));
                const glm::vec2 one = sample.next();
                const glm::dvec3 source = point ? luminaire.position : luminaire.point(one, sample.next());
                sum += static_cast<double>(trace::luminous(geometry.transmittance(glm::vec3(p), glm::vec3(source)))) *
                       transmittance(settings.haze, source, p);
            }
            volume.passed[static_cast<std::size_t>(i)] = static_cast<float>(sum / points);
        }
        work.rays += static_cast<std::uint64_t>((end - first) * (point ? 1 : kOpeningPoints));
    });
    if (!whole) volume.passed.clear();
    return volume;
}

// Ray, air and luminaire: nine things that the integral is over.
double scattered_in(const trace::Geometry& geometry, const trace::Luminaire& luminaire, const AirVolume& volume,
                    const AirSettings& settings, const glm::dvec3& from, const glm::dvec3& along, double length,
                    double random, std::uint64_t& rays) {
    const bool point = !settings.openings || luminaire.opening.shape == ies::OpeningShape::point;
    const double foot = glm::dot(luminaire.position - from, along);
    const glm::dvec3 off = luminaire.position - from - foot * along;
    // A ray through an opening passes it, not its middle: nearer than its half it is no point.
    const double near =
        std::max({glm::length(off), point ? 0.0 : 0.5 * luminaire.opening_radius_m, 1e-4 * length, 1e-6});
    const double low = std::atan(-foot / near), high = std::atan((length - foot) / near);
    double sum = 0.0;
    for (int i = 0; i < settings.steps; ++i) {
        const double u = (i + random) / settings.steps;
        double t = u * length, weight = length;
        if (!settings.even) {
            const double angle = low + u * (high - low), tangent = std::tan(angle);
            t = std::clamp(foot + near * tangent, 0.0, length);
            weight = near * (1.0 + tangent * tangent) * (high - low);
        }
        const glm::dvec3 p = from + t * along;
        glm::dvec3 source = luminaire.position;
        if (!point) {
            trace::Sample sample(static_cast<std::uint32_t>(random * 4294967295.0), static_cast<std::uint32_t>(i));
            const glm::vec2 one = sample.next();
            source = luminaire.point(one, sample.next());
        }
        const glm::dvec3 d = p - source;
        const double distance2 = glm::dot(d, d);
        if (!(distance2 > 0.0)) continue;
        const glm::dvec3 travel = d / std::sqrt(distance2);
        const double cd = luminaire.intensity_cd(travel);
        if (!(cd > 0.0)) continue;
        double reaches = 0.0;
        if (settings.shadow_rays) {
            ++rays;
            reaches = static_cast<double>(trace::luminous(geometry.transmittance(glm::vec3(p), glm::vec3(source))));
            if (reaches > 0.0) reaches *= transmittance(settings.haze, source, p);
        } else {
            reaches = volume.at(p);
        }
        if (!(reaches > 0.0)) continue;
        const double phase = henyey_greenstein(settings.haze.g, -glm::dot(travel, along));
        sum += weight * reaches * cd / distance2 * phase * scattering_per_m(settings.haze, p) *
               transmittance(settings.haze, from, p);
    }
    return sum / settings.steps;
}

}  // namespace gonio::bake
