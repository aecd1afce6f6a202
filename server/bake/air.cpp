#include "server/bake/air.h"

#include <algorithm>
#include <cmath>

#include "server/scene/opening_points.h"
#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kOpeningPoints = 16;  // of a cell of the volume
constexpr int kAirTile = 256;

// Result: how far a point is from a luminaire's opening, of its bounding box, m.
double beside(const trace::Luminaire& luminaire, bool point, const glm::dvec3& p) {
    const glm::dvec3 d = p - luminaire.position;
    if (point) return glm::length(d);
    const glm::dvec3 half = half_sides(luminaire.opening);
    return glm::length(glm::max(glm::abs(glm::transpose(luminaire.world_from_light) * d) - half, 0.0));
}

}  // namespace

std::optional<double> AirVolume::at(const std::vector<float>& values, const glm::dvec3& local) const {
    const glm::dvec3 where = (local - low) / cell;
    constexpr double kHalf = 0.501;  // rays end on the bounds, to a rounding
    if (glm::any(glm::lessThan(where, glm::dvec3(-kHalf))) ||
        glm::any(glm::greaterThan(where, glm::dvec3(size - 1) + kHalf)))
        return std::nullopt;
    const glm::dvec3 p = glm::clamp(where, glm::dvec3(0.0), glm::dvec3(size - 1));
    const glm::ivec3 a = glm::min(glm::ivec3(p), size - 2);
    const glm::vec3 part(p - glm::dvec3(a));
    const auto row = static_cast<std::size_t>(size.x), layer = row * static_cast<std::size_t>(size.y);
    const float* const v = &values[static_cast<std::size_t>(a.z) * layer + static_cast<std::size_t>(a.y) * row +
                                   static_cast<std::size_t>(a.x)];
    int lit = 0;
    for (const std::size_t corner : {std::size_t{0}, row, layer, layer + row})
        lit += (v[corner] > 0.0f ? 1 : 0) + (v[corner + 1] > 0.0f ? 1 : 0);
    if (lit != 0 && lit != 8) return std::nullopt;
    const auto along = [&](const float* from) { return from[0] + part.x * (from[1] - from[0]); };
    const auto plane = [&](const float* from) {
        const float first = along(from);
        return first + part.y * (along(from + row) - first);
    };
    const float first = plane(v);
    return static_cast<double>(first + part.z * (plane(v + layer) - first));
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
    volume.lx = volume.passed;
    const bool point = !settings.openings || luminaire.is_point();
    const bool whole = work.tiles(static_cast<int>(volume.passed.size()), kAirTile, [&](int first, int end) {
        for (int i = first; i < end; ++i) {
            const glm::ivec3 at(i % volume.size.x, i / volume.size.x % volume.size.y,
                                i / volume.size.x / volume.size.y);
            const glm::dvec3 p = volume.low + glm::dvec3(at) * volume.cell;
            double sum = 0.0, lx = 0.0;
            const int points = point ? 1 : kOpeningPoints;
            for (int k = 0; k < points; ++k) {
                trace::Sample sample(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k));
                const glm::vec2 one = sample.next();
                const glm::dvec3 source = point ? luminaire.position : luminaire.point(one, sample.next());
                const double passed =
                    static_cast<double>(trace::luminous(geometry.transmittance(glm::vec3(p), glm::vec3(source)))) *
                    transmittance(settings.haze, source, p);
                const glm::dvec3 d = p - source;
                const double distance2 = glm::dot(d, d);
                sum += passed;
                if (passed > 0.0 && distance2 > 0.0)
                    lx += passed * luminaire.intensity_cd(d / std::sqrt(distance2)) / distance2;
            }
            volume.passed[static_cast<std::size_t>(i)] = static_cast<float>(sum / points);
            volume.lx[static_cast<std::size_t>(i)] = static_cast<float>(lx / points);
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
    const bool point = !settings.openings || luminaire.is_point();
    const double foot = glm::dot(luminaire.position - from, along);
    const glm::dvec3 off = luminaire.position - from - foot * along;
    // A ray through an opening passes it, not its middle: nearer than its half it is no point.
    const double near =
        std::max({glm::length(off), point ? 0.0 : 0.5 * luminaire.opening_radius_m, 1e-4 * length, 1e-6});
    const double low = std::atan(-foot / near), high = std::atan((length - foot) / near);
    const double near_m = kNearCells * std::max({volume.cell.x, volume.cell.y, volume.cell.z});
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
        double lx = 0.0;  // that the air gets there
        glm::dvec3 source = luminaire.position;
        const bool far = beside(luminaire, point, p) > near_m;
        const double known =  // below 0: it is not
            settings.shadow_rays ? -1.0 : volume.at(far ? volume.lx : volume.passed, p).value_or(-1.0);
        if (far && known >= 0.0) {
            lx = known;
        } else {
            if (!point) {
                trace::Sample sample(static_cast<std::uint32_t>(random * 4294967295.0), static_cast<std::uint32_t>(i));
                const glm::vec2 one = sample.next();
                source = luminaire.point(one, sample.next());
            }
            const glm::dvec3 d = p - source;
            const double distance2 = glm::dot(d, d);
            if (!(distance2 > 0.0)) continue;
            lx = luminaire.intensity_cd(d / std::sqrt(distance2)) / distance2;
            if (!(lx > 0.0)) continue;
            if (known < 0.0) {
                ++rays;
                lx *= static_cast<double>(trace::luminous(geometry.transmittance(glm::vec3(p), glm::vec3(source))));
                if (lx > 0.0) lx *= transmittance(settings.haze, source, p);
            } else {
                lx *= known;
            }
        }
        if (!(lx > 0.0)) continue;
        const double phase = henyey_greenstein(settings.haze.g, -glm::dot(glm::normalize(p - source), along));
        sum += weight * lx * phase * scattering_per_m(settings.haze, p) * transmittance(settings.haze, from, p);
    }
    return sum / settings.steps;
}

}  // namespace gonio::bake
