#include "server/trace/path.h"
#include "server/scene/limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::trace {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Where a luminaire's light comes from, for one decision: its own position, or a point that is drawn on its opening.
glm::dvec3 source_point(const Luminaire& luminaire, Sample* openings) {
    if (openings == nullptr || luminaire.is_point()) return luminaire.position;
    const glm::vec2 first = openings->next();
    return luminaire.point(first, openings->next());
}

// Result: unoccluded illuminance from a luminaire that emits from `source`, lux rgb; distance and direction with it.
struct Arrival {
    glm::vec3 illuminance{0.0f};
    glm::dvec3 from_source{0.0};  // unit
    double distance = 0.0;        // m
};
Arrival arrive(const Luminaire& luminaire, const glm::dvec3& source, const Receiver& at) {
    Arrival arrival;
    const glm::dvec3 d = glm::dvec3(at.position) - source;
    arrival.distance = glm::length(d);
    if (!(arrival.distance > 0.0)) return arrival;
    arrival.from_source = d / arrival.distance;
    const double cosine = -glm::dot(arrival.from_source, glm::dvec3(at.normal));
    if (cosine <= 0.0 || glm::dot(arrival.from_source, glm::dvec3(at.geometric)) >= 0.0) return arrival;
    const double lx = luminaire.intensity_cd(arrival.from_source) * cosine / (arrival.distance * arrival.distance);
    arrival.illuminance = luminaire.weight * static_cast<float>(lx);
    return arrival;
}

std::size_t pick(const std::vector<double>& running, double random) {
    const auto above = std::upper_bound(running.begin(), running.end(), random * running.back());
    return std::min<std::size_t>(running.size() - 2,
                                 static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, above - running.begin())) - 1);
}

// How likely a luminaire is chosen at a surface point: about what it can do there, never nothing.
double importance(const Luminaire& luminaire, const Receiver& at) {
    const glm::dvec3 d = glm::dvec3(at.position) - luminaire.position;
    const double d2 = std::max({glm::dot(d, d), luminaire.opening_radius_m * luminaire.opening_radius_m, 1e-12});
    const glm::dvec3 direction = d / std::max(glm::length(d), 1e-12);
    const double cosine = std::max(0.0, -glm::dot(direction, glm::dvec3(at.normal)));
    const double mean_cd = luminaire.profile->flux_lm / (4.0 * std::numbers::pi);
    return static_cast<double>(luminance(luminaire.weight)) *
           (luminaire.intensity_cd(direction) * cosine + 0.05 * mean_cd) / d2;
}

// Which luminaire lights `at`: index and the probability of the choice. With one there is none.
struct Choice {
    std::size_t index = 0;
    double probability = 1.0;
};
// weights: of each. Result: their sum.
double weigh(const World& world, const Receiver& at, double* weights) {
    double total = 0.0;
    for (std::size_t i = 0; i < world.luminaires.size(); ++i) total += weights[i] = importance(world.luminaires[i], at);
    return total;
}
Choice choose(const World& world, const Receiver& at, double random) {
    if (world.luminaires.size() == 1) return {};
    double weights[kMaxLights];
    const double total = weigh(world, at, weights);
    double left = random * total;
    for (std::size_t i = 0; i < world.luminaires.size(); ++i) {
        left -= weights[i];
        if (left < 0.0 || i + 1 == world.luminaires.size()) return {i, weights[i] / total};
    }
    return {};
}
double probability(const World& world, const Receiver& at, std::size_t index) {
    if (world.luminaires.size() == 1) return 1.0;
    double weights[kMaxLights];
    const double total = weigh(world, at, weights);
    return weights[index] / total;
}

// Density per m² at which a luminaire's rays meet a surface point, and of the choice of that luminaire.
double light_density(const World& world, std::size_t index, const glm::dvec3& source, const Arrival& arrival,
                     const Receiver& at) {
    const double chosen = (world.running[index + 1] - world.running[index]) / world.running.back();
    const double cosine = std::max(0.0, -glm::dot(arrival.from_source, glm::dvec3(at.geometric)));
    return chosen * world.luminaires[index].density(source, arrival.from_source) * cosine /
           (arrival.distance * arrival.distance);
}

// Emission of a point drawn on the emitters, seen from x; weighted against meeting it by a cosine-distributed ray.
glm::vec3 emitters_at(const World& world, const Receiver& x, Sample& sample) {
    const glm::vec2 choice = sample.next(), square = sample.next();
    const std::size_t index = pick(world.emitters.running, static_cast<double>(choice.x));
    const Emitter& emitter = world.emitters.list[index];
    const float root = std::sqrt(square.x), u = root * (1.0f - square.y), v = root * square.y;
    const glm::vec3 point = (1.0f - u - v) * emitter.corner[0] + u * emitter.corner[1] + v * emitter.corner[2];
    const glm::vec3 d = point - x.position;
    const float d2 = glm::dot(d, d);
    if (!(d2 > 0.0f)) return glm::vec3(0.0f);
    const glm::vec3 direction = d / std::sqrt(d2);
    const float cos_x = glm::dot(direction, x.normal), facing = -glm::dot(direction, emitter.normal);
    const float cos_y = emitter.double_sided ? std::abs(facing) : facing;
    if (cos_x <= 0.0f || cos_y <= 0.0f || glm::dot(direction, x.geometric) <= 0.0f) return glm::vec3(0.0f);
    const glm::vec3 side = facing > 0.0f ? emitter.normal : -emitter.normal;
    const Geometry& geometry = *world.geometry;
    const glm::vec3 passed = geometry.transmittance(x.from, point + side * geometry.step_off(point));
    if (passed == glm::vec3(0.0f)) return passed;
    const double drawn = world.emitters.density(index), met = static_cast<double>(cos_x * cos_y / (kPi * d2));
    const float covered = 1.0f - geometry.transparency_at(emitter.instance, emitter.triangle, u, v).share;
    return passed * geometry.emission_at(emitter.instance, emitter.triangle, u, v) * covered *
           static_cast<float>(static_cast<double>(cos_x * cos_y / d2) / (drawn + met));
}

}  // namespace

Receiver receiver_of(const Geometry& geometry, const SurfacePoint& point) {
    const auto& [position, normal, geometric] = point;
    return {position, position + geometric * geometry.step_off(position), normal, geometric};
}

glm::vec3 luminaires_direct(const World& world, const Receiver& receiver, Sample* openings) {
    glm::vec3 sum(0.0f);
    for (const Luminaire& luminaire : world.luminaires) {
        const glm::dvec3 source = source_point(luminaire, openings);
        const Arrival arrival = arrive(luminaire, source, receiver);
        if (arrival.illuminance == glm::vec3(0.0f)) continue;
        glm::vec3 passed = world.geometry->transmittance(receiver.from, glm::vec3(source + luminaire.lift));
        if (world.haze && !(luminaire.sun_reach_m > 0.0))
            passed *= static_cast<float>(transmittance(world.haze, glm::dvec3(receiver.position), source));
        sum += arrival.illuminance * passed;
    }
    return sum;
}

// One loop over a path's vertices: cut up it would pass its throughput, densities and sample around.
PathLight trace_path(const World& world, Receiver x, int bounces, Sample& sample) {
    const Geometry& geometry = *world.geometry;
    // Which transmissive surfaces a ray passes is a decision of its own.
    const auto dice = [&] {
        return geometry.transmissive()
                   ? static_cast<std::uint32_t>(sample.next().x * static_cast<float>(Geometry::kDice))
                   : 0u;
    };
    PathLight light;
    glm::vec3 throughput(1.0f);
    for (int k = 0;; ++k) {
        glm::vec3& sum = k == 0 ? light.direct : light.indirect;
        const bool more = bounces < 0 || k < bounces;
        const bool lit = more && !world.luminaires.empty();
        if (!world.emitters.empty()) sum += throughput * emitters_at(world, x, sample);
        if (!more && world.emitters.empty()) break;

        // One bounce more, first way: a ray of a luminaire meets z, which x sees.
        if (lit) {
            const glm::vec2 choice = sample.next();
            const std::size_t index = pick(world.running, static_cast<double>(choice.x));
            const Luminaire& luminaire = world.luminaires[index];
            const glm::dvec3 source = source_point(luminaire, &sample);
            double density = 0.0;
            const glm::dvec3 emitted = luminaire.emit(source, sample.next(), density);
            const glm::vec3 start(source + luminaire.lift + emitted * luminaire.start_m(source));
            SurfaceHit z;
            // A luminaire mounted on a surface does not light the spot it hides.
            const float near = geometry.step_off(start);
            if (density > 0.0 && geometry.closest(start, glm::vec3(emitted), near, false, z, dice())) {
                const Receiver at_z = receiver_of(geometry, z);
                const glm::vec3 d = at_z.position - x.position;
                const float d2 = glm::dot(d, d), length = std::sqrt(d2);
                const float cos_x = glm::dot(d, x.normal) / length, cos_z = -glm::dot(d, z.geometric) / length;
                const Arrival arrival = arrive(luminaire, source, at_z);
                if (d2 > 0.0f && cos_x > 0.0f && cos_z > 0.0f && glm::dot(d, x.geometric) > 0.0f &&
                    arrival.illuminance != glm::vec3(0.0f)) {
                    const glm::vec3 passed = z.tint * geometry.transmittance(x.from, at_z.from);
                    const double by_light = light_density(world, index, source, arrival, at_z);
                    const double by_ray =
                        static_cast<double>(cos_x * cos_z / (kPi * d2)) * probability(world, at_z, index);
                    // rho E / pi · cos cos / d² over the density, times the balance heuristic: one division in all.
                    const double geometry_factor =
                        static_cast<double>(cos_x * cos_z / (kPi * d2)) / (by_light + by_ray);
                    light.indirect +=
                        throughput * passed * z.albedo * arrival.illuminance * static_cast<float>(geometry_factor);
                }
            }
        }

        // Second way: a cosine-distributed ray from x meets y, which a luminaire lights.
        const glm::vec3 direction = around(x.normal, cosine_hemisphere(sample.next()));
        SurfaceHit y;
        if (glm::dot(direction, x.geometric) <= 0.0f || !geometry.closest(x.from, direction, 0.0f, false, y, dice()))
            break;
        throughput *= y.tint;
        const Receiver at_y = receiver_of(geometry, y);
        const float cos_x = glm::dot(direction, x.normal), cos_y = -glm::dot(direction, y.geometric);
        const double met = static_cast<double>(cos_x * cos_y / (kPi * y.distance * y.distance));
        if (!world.emitters.empty() && y.emission != glm::vec3(0.0f) && y.distance > 0.0f) {
            const auto index = static_cast<std::size_t>(
                world.emitters.first_of_instance[static_cast<std::size_t>(y.instance)] + y.triangle);
            const double drawn = world.emitters.density(index);
            sum += throughput * y.emission * static_cast<float>(std::numbers::pi * met / (met + drawn));
        }
        if (!more) break;
        if (lit && y.distance > 0.0f) {
            const Choice choice = choose(world, at_y, static_cast<double>(sample.next().x));
            const Luminaire& luminaire = world.luminaires[choice.index];
            const glm::dvec3 source = source_point(luminaire, &sample);
            const Arrival arrival = arrive(luminaire, source, at_y);
            if (arrival.illuminance != glm::vec3(0.0f)) {
                const glm::vec3 passed = geometry.transmittance(at_y.from, glm::vec3(source + luminaire.lift));
                const double by_light = light_density(world, choice.index, source, arrival, at_y);
                const double weight = met / (met * choice.probability + by_light);
                light.indirect += throughput * passed * y.albedo * arrival.illuminance * static_cast<float>(weight);
            }
        }
        const float survival = std::min(std::max({y.albedo.r, y.albedo.g, y.albedo.b}), kMaxSurvival);
        if (!(sample.next().x < survival)) break;
        throughput *= y.albedo / survival;
        x = at_y;
    }
    return light;
}

}  // namespace gonio::trace
