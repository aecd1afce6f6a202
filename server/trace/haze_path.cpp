#include "server/trace/haze_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/scene/haze.h"
#include "server/scene/limits.h"

namespace gonio::trace {
namespace {

constexpr float kMostScattered = 0.99f;
constexpr float kFarthest = 8.0f;  // radii of the scene

// Of a ray from its start on, m.
struct Span {
    double begin, end;
};

// What of a ray lies in a luminaire's beam, a cone about its photometric zero. w: from the luminaire to the ray's
// start, d: its direction, unit, both in the luminaire's frame.
Span within_beam(const glm::dvec3& w, const glm::dvec3& d, double cosine, const Span& whole) {
    if (!(cosine > 0.0)) return whole;
    const double c2 = cosine * cosine, a = d.z * d.z - c2, b = d.z * w.z - c2 * glm::dot(w, d),
                 c = w.z * w.z - c2 * glm::dot(w, w), rest = b * b - a * c;
    if (std::abs(a) < 1e-12) return whole;
    if (a < 0.0 && rest <= 0.0) return {0.0, 0.0};
    const double root = std::sqrt(std::max(0.0, rest)), low = std::min((-b - root) / a, (root - b) / a),
                 high = std::max((-b - root) / a, (root - b) / a);
    if (a < 0.0)  // between the two, unless that is behind it
        return w.z + d.z * 0.5 * (low + high) < 0.0 ? Span{std::max(low, whole.begin), std::min(high, whole.end)}
                                                    : Span{0.0, 0.0};
    return d.z < 0.0 ? Span{std::max(high, whole.begin), whole.end} : Span{whole.begin, std::min(low, whole.end)};
}

// The angles about a luminaire under which it sees a span of a ray: theta = atan((t - foot) / off).
struct Angles {
    double foot = 0.0, off = 1.0, first = 0.0, last = 0.0;
    double share() const { return (last - first) / off; }
};
Angles angles_of(const Luminaire& luminaire, const glm::dvec3& source, const glm::dvec3& from, const glm::dvec3& along,
                 double far) {
    const glm::dvec3 w = from - source;
    Angles angles;
    const glm::dmat3 light_from_world = glm::transpose(luminaire.world_from_light);
    // A point of an opening shines into its beam too.
    const Span part = within_beam(light_from_world * w, light_from_world * along,
                                  static_cast<double>(luminaire.beam_cos), {0.0, far});
    if (!(part.end > part.begin)) return angles;
    angles.foot = -glm::dot(w, along);
    angles.off = std::max(glm::length(w + along * angles.foot), 1e-6);
    angles.first = std::atan2(part.begin - angles.foot, angles.off);
    angles.last = std::isfinite(part.end) ? std::atan2(part.end - angles.foot, angles.off) : std::numbers::pi / 2;
    return angles;
}

// A luminaire, by a draw from weights, and the probability of the draw; of weights that are all 0 none.
struct Drawn {
    const Luminaire* luminaire = nullptr;
    double probability = 1.0;
};
template <typename Weight>
Drawn draw(const World& world, Weight weight, Sample& sample) {
    const std::size_t count = world.luminaires.size();
    if (count == 0) return {};
    double weights[kMaxLights], total = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const Luminaire& one = world.luminaires[i];
        total += weights[i] = one.sun_reach_m > 0.0 ? 0.0 : static_cast<double>(one.power) * weight(one);
    }
    if (!(total > 0.0)) return {};
    std::size_t index = 0;
    double left = count > 1 ? static_cast<double>(sample.next().x) * total : 0.0;
    while (index + 1 < count && left >= weights[index]) left -= weights[index++];
    return {&world.luminaires[index], weights[index] / total};
}

glm::dvec3 point_of(const Luminaire& luminaire, Sample& sample) {
    if (luminaire.is_point()) return luminaire.position;
    const glm::vec2 first = sample.next();
    return luminaire.point(first, sample.next());
}

// One luminaire's light, scattered once on the way to `from`, cd/m².
glm::vec3 scattered_once(const World& world, const Luminaire& luminaire, const glm::dvec3& source,
                         const glm::vec3& from, const glm::vec3& along, float far, Sample& sample) {
    const Angles angles = angles_of(luminaire, source, glm::dvec3(from), glm::dvec3(along), static_cast<double>(far));
    if (!(angles.last > angles.first)) return glm::vec3(0.0f);
    const double theta = angles.first + static_cast<double>(sample.next().x) * (angles.last - angles.first),
                 r = angles.off / std::cos(theta), t = angles.foot + r * std::sin(theta);
    const glm::dvec3 p = glm::dvec3(from) + glm::dvec3(along) * t, to = (p - source) / r;
    const double cd_there = luminaire.intensity_cd(to);
    if (!(cd_there > 0.0)) return glm::vec3(0.0f);
    const Haze& haze = world.haze;
    const double nit = scattering_per_m(haze, p) * henyey_greenstein(haze.g, -glm::dot(to, glm::dvec3(along))) *
                       cd_there * std::exp(-optical_depth(haze, glm::dvec3(from), p) - optical_depth(haze, p, source)) *
                       angles.share();
    if (!(nit > 0.0)) return glm::vec3(0.0f);
    return luminaire.weight * static_cast<float>(nit) *
           world.geometry->transmittance(glm::vec3(p), glm::vec3(source + luminaire.lift));
}

// The same of any luminaire.
glm::vec3 scattered_once(const World& world, const glm::vec3& from, const glm::vec3& along, float far, Sample& sample) {
    // Which one: about what it can do along the ray.
    const Drawn drawn = draw(
        world,
        [&](const Luminaire& one) {
            return angles_of(one, one.position, glm::dvec3(from), glm::dvec3(along), static_cast<double>(far)).share() +
                   1e-6;
        },
        sample);
    if (drawn.luminaire == nullptr) return glm::vec3(0.0f);
    const glm::dvec3 source = point_of(*drawn.luminaire, sample);
    return scattered_once(world, *drawn.luminaire, source, from, along, far, sample) /
           static_cast<float>(drawn.probability);
}

std::uint32_t dice_of(const Geometry& geometry, Sample& sample) {
    return geometry.transmissive() ? static_cast<std::uint32_t>(sample.next().x * static_cast<float>(Geometry::kDice))
                                   : 0u;
}

// What is scattered once onto a surface, lux. It grows as 1 / sin of the angle from the luminaire: directions are drawn
// evenly over that angle.
glm::vec3 scattered_onto(const World& world, const Receiver& at, Sample& sample) {
    const Drawn drawn = draw(
        world,
        [&](const Luminaire& one) {
            return 1.0 / std::max(glm::distance(glm::dvec3(at.position), one.position), 1e-3);
        },
        sample);
    if (drawn.luminaire == nullptr) return glm::vec3(0.0f);
    const glm::dvec3 source = point_of(*drawn.luminaire, sample);
    const glm::vec2 random = sample.next();
    const float angle = std::numbers::pi_v<float> * random.x, turn = 2.0f * std::numbers::pi_v<float> * random.y,
                sine = std::sin(angle);
    const glm::vec3 to = glm::normalize(glm::vec3(source) - at.position),
                    along = around(to, {sine * std::cos(turn), sine * std::sin(turn), std::cos(angle)});
    const float cosine = glm::dot(along, at.normal);
    if (!(cosine > 0.0f) || glm::dot(along, at.geometric) <= 0.0f) return glm::vec3(0.0f);
    SurfaceHit hit;
    const bool met = world.geometry->closest(at.from, along, 0.0f, false, hit, dice_of(*world.geometry, sample));
    const float far = met ? hit.distance : std::numeric_limits<float>::infinity();
    const float per_density = 2.0f * std::numbers::pi_v<float> * std::numbers::pi_v<float> * sine;
    return scattered_once(world, *drawn.luminaire, source, at.from, along, far, sample) *
           (cosine * per_density / static_cast<float>(drawn.probability));
}

// Result: how far a ray goes until the optical depth, m; infinite where it is never reached before `far`.
double distance_at(const Haze& haze, const glm::dvec3& from, const glm::dvec3& along, double depth, double far) {
    if (!(haze.layer_height_m > 0.0)) return depth / haze.extinction_per_m;
    double low = 0.0, high = std::min(far, 1e6);
    if (optical_depth(haze, from, from + along * high) < depth) return std::numeric_limits<double>::infinity();
    for (int i = 0; i < 48; ++i) {
        const double middle = 0.5 * (low + high);
        (optical_depth(haze, from, from + along * middle) < depth ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

// Result: a direction about the unit vector d, as Henyey and Greenstein's phase function has it.
glm::vec3 scattered_about(const glm::vec3& d, double g, glm::vec2 random) {
    const double u = static_cast<double>(random.x);
    double cosine = 1.0 - 2.0 * u;
    if (std::abs(g) > 1e-4) {
        const double root = (1.0 - g * g) / (1.0 - g + 2.0 * g * (1.0 - u));
        cosine = (1.0 + g * g - root * root) / (2.0 * g);
    }
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine)),
                 turn = 2.0 * std::numbers::pi * static_cast<double>(random.y);
    return around(d, glm::vec3(glm::dvec3(sine * std::cos(turn), sine * std::sin(turn), cosine)));
}

// A ray that looks for light. throughput: of pi × radiance.
struct Looking {
    glm::vec3 from, along;
    glm::vec3 throughput{1.0f};
    int events = 0;            // before it, on surfaces and in the air
    bool from_surface = true;  // what is scattered once onto it is known already
};

// Adds what the ray finds, and those after it. One loop over a path's vertices, as trace_path().
void look(const World& world, Looking ray, int bounces, Sample& sample, PathLight& light) {
    const Geometry& geometry = *world.geometry;
    const Haze& haze = world.haze;
    constexpr float kPi = std::numbers::pi_v<float>;
    for (;; ++ray.events) {
        const bool more = bounces < 0 || ray.events < bounces;
        SurfaceHit hit;
        const bool met = geometry.closest(ray.from, ray.along, 0.0f, false, hit, dice_of(geometry, sample));
        const float far = met ? hit.distance : std::numeric_limits<float>::infinity();
        if (more && !ray.from_surface)
            light.indirect += ray.throughput * kPi * scattered_once(world, ray.from, ray.along, far, sample);
        const double depth = -std::log(1.0 - static_cast<double>(sample.next().x)),
                     free = distance_at(haze, glm::dvec3(ray.from), glm::dvec3(ray.along), depth,
                                        static_cast<double>(far));
        if (free < static_cast<double>(far)) {
            // As on surfaces: between two losses a path has a hundred scatterings or so.
            const float survival = std::min(static_cast<float>(haze.albedo), kMostScattered);
            if (!more || !(sample.next().x < survival)) return;
            ray.throughput *= static_cast<float>(haze.albedo) / survival;
            ray.from += ray.along * static_cast<float>(free);
            // Out in the open it would wander for ever: what is so far away comes back no more.
            if (glm::length(ray.from) > kFarthest * geometry.extent()) return;
            ray.along = scattered_about(ray.along, haze.g, sample.next());
            ray.from_surface = false;
            continue;
        }
        if (!met) return;
        ray.throughput *= hit.tint;
        if (!world.emitters.empty())
            (ray.events == 0 ? light.direct : light.indirect) += ray.throughput * kPi * hit.emission;
        if (!more) return;
        const Receiver at = receiver_of(geometry, hit);
        if (!world.luminaires.empty())
            light.indirect += ray.throughput * hit.albedo * luminaires_direct(world, at, &sample);
        const float survival = std::min(std::max({hit.albedo.r, hit.albedo.g, hit.albedo.b}), kMaxSurvival);
        if (!(sample.next().x < survival)) return;
        ray.throughput *= hit.albedo / survival;
        if (bounces < 0 || ray.events + 1 < bounces)
            light.indirect += ray.throughput * scattered_onto(world, at, sample);
        ray.from_surface = true;
        ray.along = around(at.normal, cosine_hemisphere(sample.next()));
        if (glm::dot(ray.along, at.geometric) <= 0.0f) return;
        ray.from = at.from;
    }
}

}  // namespace

PathLight trace_path_in_haze(const World& world, Receiver receiver, int bounces, Sample& sample) {
    PathLight light;
    if (bounces != 0) light.indirect += scattered_onto(world, receiver, sample);
    const glm::vec3 along = around(receiver.normal, cosine_hemisphere(sample.next()));
    if (glm::dot(along, receiver.geometric) > 0.0f) look(world, {receiver.from, along}, bounces, sample, light);
    return light;
}

glm::vec3 scattered_light(const World& world, const glm::vec3& from, const glm::vec3& direction, float far, int bounces,
                          Sample& sample) {
    if (bounces == 0) return glm::vec3(0.0f);
    const Haze& haze = world.haze;
    glm::vec3 light = scattered_once(world, from, direction, far, sample);
    // What reaches a place on the ray otherwise than straight from a luminaire; the place where the ray is scattered.
    const double end = std::isfinite(far) ? static_cast<double>(far) : 1e6;
    const double share = -std::expm1(
                     -optical_depth(haze, glm::dvec3(from), glm::dvec3(from) + glm::dvec3(direction) * end)),
                 depth = -std::log1p(-static_cast<double>(sample.next().x) * share),
                 at = std::min(distance_at(haze, glm::dvec3(from), glm::dvec3(direction), depth, end), end);
    PathLight other;
    look(world,
         {from + direction * static_cast<float>(at), scattered_about(direction, haze.g, sample.next()), glm::vec3(1.0f),
          1},
         bounces, sample, other);
    return light + (other.direct + other.indirect) * static_cast<float>(haze.albedo * share / std::numbers::pi);
}

}  // namespace gonio::trace
