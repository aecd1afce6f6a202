#include "server/trace/hollows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "server/scene/scene.h"
#include "server/trace/sampler.h"
#include "server/trace/sources.h"

namespace gonio::trace {
namespace {

constexpr int kWalks = 2 * kPacket, kSteps = 8;
constexpr int kReached = 2;                  // walks, so that a crack of a surface is no way out
constexpr std::size_t kMostLandmarks = 32;   // that a point's walks look for
constexpr std::size_t kMostLightsAsked = 8;  // whether they are indoors
constexpr float kRoom_m = 1.9f;              // each way: no smaller room is lived in
constexpr float kBeyond = 1.5f;              // radius of the sphere in half diagonals of the scene
constexpr std::uint32_t kSeed = 0x401105u;
constexpr float kBeforeEnd = 1.0f - 1e-5f;  // a luminaire that is mounted on a surface is not hidden by it

// What walks from a point came upon.
struct Found {
    int lights = 0, eyes = 0, escapes = 0;  // walks
    bool room = false;                      // what is around the point is as large as a room and faces it
};

bool emits_light(const Geometry& geometry, unsigned instance) {
    const SceneAsset& asset = geometry.asset();
    const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[instance].mesh)];
    return asset.materials[static_cast<std::size_t>(mesh.material)].emissive_nit != glm::vec3(0.0f);
}

// Result: distance from `from` along the unit direction to where it leaves the sphere around the scene, 0 where it does
// not come to it.
float to_sphere(const Geometry& geometry, const glm::vec3& from, const glm::vec3& along) {
    const float radius = kBeyond * geometry.extent(), b = glm::dot(from, along);
    const float inside = b * b - glm::dot(from, from) + radius * radius;
    return inside > 0.0f ? std::max(0.0f, std::sqrt(inside) - b) : 0.0f;
}

// Result: at most kMostLandmarks of them: half are the nearest, the others stand for all.
std::vector<glm::vec3> nearest_and_others(std::vector<glm::vec3> all, const glm::vec3& from) {
    if (all.size() <= kMostLandmarks) return all;
    constexpr std::size_t kNearest = kMostLandmarks / 2;
    std::nth_element(all.begin(), all.begin() + kNearest, all.end(), [&](const glm::vec3& a, const glm::vec3& b) {
        return glm::dot(a - from, a - from) < glm::dot(b - from, b - from);
    });
    const std::size_t others = all.size() - kNearest;
    for (std::size_t i = 0; i < kNearest; ++i) all[kNearest + i] = all[kNearest + i * others / kNearest];
    all.resize(kMostLandmarks);
    return all;
}

// Walks from a point, sixteen at a time.
class Walks {
public:
    Walks(const Geometry& geometry, const Landmarks& landmarks, const glm::vec3& from)
        : geometry_(geometry),
          from_(from),
          lights_(nearest_and_others(landmarks.lights, from)),
          eyes_(landmarks.eyes) {}

    // light_ends: whether they end when they have seen a light.
    Found run(bool light_ends) {
        Found found;
        for (int first = 0; first < kWalks; first += kPacket) {
            unsigned lit = 0, seen = 0, escaped = 0;
            std::array<glm::vec3, kPacket> at;
            at.fill(from_);
            for (int step = 0; step < kSteps; ++step) {
                lit |= sighted(lights_, at, first + step);
                seen |= sighted(eyes_, at, first + step);
                if (light_ends && found.lights + std::popcount(lit) >= kReached) break;
                advance(first, step, at, lit, escaped);
            }
            found.lights += std::popcount(lit);
            found.eyes += std::popcount(seen);
            found.escapes += std::popcount(escaped);
            if (light_ends && found.lights >= kReached) return found;
        }
        const glm::vec3 across = most_ - least_;
        found.room = 2 * fronts_ > kWalks && std::min({across.x, across.y, across.z}) >= kRoom_m;
        return found;
    }

private:
    // Result: bits of the walks that see one of the places from where they are: each looks for another one.
    unsigned sighted(const std::vector<glm::vec3>& places, const std::array<glm::vec3, kPacket>& at, int turn) const {
        if (places.empty()) return 0;
        constexpr std::size_t kStride = 5;  // of no number of places that is a power of 2 a divisor
        RayPacket rays;
        for (std::size_t i = 0; i < kPacket; ++i)
            rays.set(static_cast<int>(i), at[i],
                     places[(i + kStride * static_cast<std::size_t>(turn)) % places.size()] - at[i], kBeforeEnd);
        constexpr unsigned kAll = (1u << kPacket) - 1u;
        return ~geometry_.occluded(rays, kAll) & kAll;
    }

    // Each walk goes a part of the way to what it meets, or to the sphere.
    void advance(int first, int step, std::array<glm::vec3, kPacket>& at, unsigned& lit, unsigned& escaped) {
        RayPacket rays;
        HitPacket hits;
        float share[kPacket];
        for (int i = 0; i < kPacket; ++i) {
            Sample sample(mix_bits(kSeed, static_cast<std::uint32_t>(step)), static_cast<std::uint32_t>(first + i));
            rays.set(i, at[static_cast<std::size_t>(i)], any_direction(sample.next()));
            share[i] = 0.1f + 0.85f * sample.next().x;
        }
        const unsigned met = geometry_.closest(rays, (1u << kPacket) - 1u, hits);
        for (int i = 0; i < kPacket; ++i) {
            const bool hit = (met >> i & 1u) != 0;
            const float far = hit ? hits.distance[i] : to_sphere(geometry_, rays.from(i), rays.along(i));
            at[static_cast<std::size_t>(i)] = rays.at(i, share[i] * far);
            if (!hit) {
                escaped |= 1u << i;
                continue;
            }
            if (emits_light(geometry_, hits.instance[i])) lit |= 1u << i;
            if (step > 0) continue;
            if (glm::dot(hits.normal(i), rays.along(i)) < 0.0f) ++fronts_;
            least_ = glm::min(least_, rays.at(i, far));
            most_ = glm::max(most_, rays.at(i, far));
        }
    }

    const Geometry& geometry_;
    glm::vec3 from_;
    std::vector<glm::vec3> lights_, eyes_;
    int fronts_ = 0;
    glm::vec3 least_{1e30f}, most_{-1e30f};
};

bool any_emits(const Geometry& geometry) {
    for (std::size_t i = 0; i < geometry.asset().instances.size(); ++i)
        if (emits_light(geometry, static_cast<unsigned>(i))) return true;
    return false;
}

// Result: whether luminaires stand in closed rooms; of some of them.
bool are_indoors(const Geometry& geometry, const Landmarks& landmarks) {
    const std::size_t count = landmarks.lights.size(), asked = std::min(count, kMostLightsAsked);
    for (std::size_t i = 0; i < asked; ++i)
        if (Walks(geometry, landmarks, landmarks.lights[i * count / asked]).run(false).escapes >= kReached)
            return false;
    return count > 0;
}

}  // namespace

Landmarks landmarks_of(const Scene& scene, const Geometry& geometry) {
    constexpr float kHalf = 0.5f, kNothingMet_m = 1.0f;
    Landmarks landmarks;
    for (const Light& light : scene.lights) {
        if (light.sun) {
            landmarks.sun = true;
            continue;
        }
        const Luminaire luminaire = luminaire_of(light, geometry);
        const glm::vec3 from(luminaire.position + luminaire.lift),
            along(luminaire.world_from_light * glm::dvec3(0, 0, -1));
        landmarks.lights.push_back(from);
        // One that stands deep in a tube is seen from few places: where it shines to tells more.
        SurfaceHit hit;
        const bool met = geometry.closest(from, along, geometry.step_off(from), false, hit);
        landmarks.lights.push_back(from + along * (met ? kHalf * hit.distance : kNothingMet_m));
    }
    landmarks.eyes.push_back(geometry.local(scene.camera.eye));
    for (const auto& [name, view] : scene.saved_views) landmarks.eyes.push_back(geometry.local(view.eye));
    return landmarks;
}

std::vector<Place> places_of(const Geometry& geometry, const Landmarks& landmarks, std::span<const glm::vec3> points,
                             std::size_t row) {
    std::vector<Place> places;
    places.reserve(points.size());
    std::optional<bool> lit, indoors;  // made where they decide
    const auto walked = [&](const glm::vec3& from) {
        const Found found = Walks(geometry, landmarks, from).run(true);
        if (found.lights >= kReached) return Place::open;
        if (found.escapes >= kReached) {
            if (!lit) lit = !landmarks.lights.empty() || any_emits(geometry);
            if (!*lit) return Place::open;
            if (!landmarks.sun) return Place::outside;
            if (!indoors) indoors = are_indoors(geometry, landmarks);
            return *indoors ? Place::outside : Place::open;
        }
        return found.eyes >= kReached || found.room ? Place::open : Place::inside;
    };
    std::size_t walks = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto sees = [&](std::size_t other) { return !geometry.occluded(points[i], points[other]); };
        if (i % row != 0 && sees(i - 1))
            places.push_back(places[i - 1]);
        else if (i >= row && sees(i - row))
            places.push_back(places[i - row]);
        else if (++walks <= kMostWalked)
            places.push_back(walked(points[i]));
        else
            places.push_back(places.back());
    }
    return places;
}

}  // namespace gonio::trace
