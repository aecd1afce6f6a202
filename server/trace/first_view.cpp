#include "server/trace/first_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "server/scene/apply.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/trace/geometry.h"
#include "server/trace/sampler.h"
#include "server/trace/sources.h"

namespace gonio::trace {
namespace {

constexpr float kEye_m = 1.6f;          // above the floor
constexpr float kLeastHeight_m = 1.8f;  // of a room
constexpr double kFov_rad = 1.05;       // vertical, of a camera in a room
constexpr float kSurrounded = 0.7f;     // share of all directions in which a room has surfaces
constexpr unsigned kPoints = 24, kLamps = 8, kAzimuths = 32, kViews = 8, kSides = 4;
constexpr float kMostBack_m = 15.0f;  // from the place to the eye
constexpr float kNear_m = 0.5f;       // surfaces that are nearer stand in the way
constexpr float kBesides = 1.3f;      // so many times better another side must be than the usual one
// Two rays find each place's floor and ceiling, a packet what is around it, one whether it is lit; then 32 look around.
// Each view has a packet, and as many rays to its lamps; reversed_hint() has 32, and as many that pass backs.
static_assert((kPoints + kLamps) * (2 + kPacket + 1) + kAzimuths + 2 * kPacket * kViews + 64 <= kMostFirstViewRays);

glm::vec3 horizontal(unsigned index, unsigned count) {
    const auto angle = static_cast<float>(2.0 * std::numbers::pi * index / count);
    return {std::sin(angle), 0.0f, -std::cos(angle)};
}

// What one ray met: nothing, the front of a surface or its back, which viewers leave out where it has one side.
struct Met {
    bool any = false, back = false, hidden = false;
    float distance_m = 0.0f;
    glm::vec3 at{0.0f};  // local
    unsigned instance = 0;
    bool glows = false;
};

std::array<Met, kPacket> cast(const Geometry& geometry, const RayPacket& rays, unsigned active) {
    HitPacket hits;
    const unsigned met = geometry.closest(rays, active, hits);
    const SceneAsset& asset = geometry.asset();
    std::array<Met, kPacket> result;
    for (int i = 0; i < kPacket; ++i) {
        if ((met >> i & 1u) == 0) continue;
        Met& one = result[static_cast<std::size_t>(i)];
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[hits.instance[i]].mesh)];
        one.any = true;
        one.back = glm::dot(hits.normal(i), rays.along(i)) > 0.0f;
        one.hidden = one.back && asset.materials[static_cast<std::size_t>(mesh.material)].culled_back();
        one.distance_m = hits.distance[i];
        one.at = rays.at(i, hits.distance[i]);
        one.instance = hits.instance[i];
        one.glows = luminance(geometry.emission_at(static_cast<int>(hits.instance[i]),
                                                   static_cast<int>(hits.triangle[i]), hits.u[i], hits.v[i])) > 0.0f;
    }
    return result;
}

struct Ray {
    glm::vec3 from, along;  // local; unit
};

// Asks for the surface of many rays, sixteen at a time.
std::vector<Met> cast_all(const Geometry& geometry, const std::vector<Ray>& rays) {
    std::vector<Met> result;
    for (std::size_t first = 0; first < rays.size(); first += kPacket) {
        RayPacket packet{};
        const std::size_t count = std::min<std::size_t>(kPacket, rays.size() - first);
        for (std::size_t i = 0; i < kPacket; ++i) {
            const Ray& ray = rays[first + std::min(i, count - 1)];
            packet.set(static_cast<int>(i), ray.from, ray.along);
        }
        const auto met = cast(geometry, packet, ~0u >> (32 - count));
        result.insert(result.end(), met.begin(), met.begin() + static_cast<std::ptrdiff_t>(count));
    }
    return result;
}

// What shines, as far as a first look needs it: the strongest luminaires.
class Lamps {
public:
    Lamps(const Scene& scene, const Geometry& geometry) : geometry_(geometry), lamps_(luminaires_of(scene, geometry)) {
        constexpr std::size_t kMostLamps = 64;
        std::ranges::stable_sort(lamps_, std::greater{}, &Luminaire::power);
        if (lamps_.size() > kMostLamps) lamps_.resize(kMostLamps);
    }

    // Where the strongest stand, local, a little along their aim so that it lies outside of their housings. A sun
    // stands nowhere.
    std::vector<glm::vec3> places(unsigned most) const {
        std::vector<glm::vec3> result;
        for (const Luminaire& lamp : lamps_)
            if (!(lamp.sun_reach_m > 0.0) && result.size() < most)
                result.emplace_back(lamp.position + lamp.world_from_light * glm::dvec3(0.0, 0.0, -0.1));
        return result;
    }

    // Whether the lamp that could light a point most does. normal: of the surface, or 0 in the air. Takes one ray.
    bool light(const glm::vec3& at, const glm::vec3& normal) const {
        double most_lx = 0.0;
        glm::vec3 from(0.0f);
        for (const Luminaire& lamp : lamps_) {
            const glm::dvec3 way = lamp.position - glm::dvec3(at);
            const double distance_m = glm::length(way);
            if (!(distance_m > 0.0)) continue;
            const double cosine = normal == glm::vec3(0.0f) ? 1.0 : glm::dot(glm::dvec3(normal), way) / distance_m;
            if (!(cosine > 0.0)) continue;
            const double lx = static_cast<double>(luminance(lamp.weight)) * lamp.intensity_cd(-way / distance_m) *
                              cosine / (distance_m * distance_m);
            if (lx > most_lx) most_lx = lx, from = glm::vec3(lamp.position + lamp.lift);
        }
        return most_lx > 0.0 && !geometry_.occluded(from, at + normal * geometry_.step_off(at));
    }

private:
    const Geometry& geometry_;
    std::vector<Luminaire> lamps_;
};

// A place where somebody could stand.
struct Standpoint {
    glm::vec3 eye{0.0f};
    float height_m = 0.0f;  // from floor to ceiling; without a ceiling to the top of the bounds
    float middle = 0.0f;    // the y of half of it
    float score = -1.0f;    // below 0: it is no room
};

struct Box {
    glm::vec3 least, most;
    // Distance at which a ray from inside leaves, m.
    float leaves(const glm::vec3& from, const glm::vec3& along) const {
        float result = std::numeric_limits<float>::infinity();
        for (int k = 0; k < 3; ++k)
            if (along[k] != 0.0f) result = std::min(result, ((along[k] > 0.0f ? most : least)[k] - from[k]) / along[k]);
        return std::max(result, 0.0f);
    }
};

std::vector<glm::vec3> sphere_directions() {
    std::vector<glm::vec3> result;
    for (int i = 0; i < kPacket; ++i) {
        const double y = 1.0 - (2.0 * i + 1.0) / kPacket, angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
        const double wide = std::sqrt(1.0 - y * y);
        result.emplace_back(wide * std::cos(angle), y, wide * std::sin(angle));
    }
    return result;
}

void judge(Standpoint& place, const Geometry& geometry, const Lamps& lamps) {
    if (place.height_m < kLeastHeight_m) return;
    std::vector<Ray> rays;
    for (const glm::vec3& along : sphere_directions()) rays.push_back({place.eye, along});
    float fronts = 0.0f, backs = 0.0f, nearest_m = std::numeric_limits<float>::infinity(), sum_m = 0.0f;
    bool glows = false;
    for (const Met& met : cast_all(geometry, rays)) {
        if (!met.any) continue;
        (met.back ? backs : fronts) += 1.0f / kPacket;
        nearest_m = std::min(nearest_m, met.distance_m);
        sum_m += met.distance_m / kPacket;
        glows |= met.glows && !met.hidden;
    }
    const float around = fronts + backs;
    if (around < kSurrounded || sum_m < 0.5f * kLeastHeight_m) return;
    const bool lit = lamps.light(place.eye, glm::vec3(0.0f));
    if (backs > fronts && !(lit && around > 0.9f)) return;  // the inside of a solid
    place.score = around + (lit ? 1.0f : glows ? 0.5f : 0.0f) + 0.5f * std::min(nearest_m, 1.0f);
}

// The best place to stand in a room; nothing where none is in one.
std::optional<Standpoint> best_standpoint(const Geometry& geometry, const Lamps& lamps, const Box& box) {
    std::vector<glm::vec3> points;
    for (unsigned i = 0; i < kPoints; ++i) {
        Sample sample(0x66697273u, i);
        const glm::vec2 xz = sample.next(), y = sample.next();
        points.push_back(glm::mix(box.least, box.most, 0.05f + 0.9f * glm::vec3(xz.x, y.x, xz.y)));
    }
    for (const glm::vec3& at : lamps.places(kLamps)) points.push_back(at);
    std::vector<Ray> rays;
    for (const glm::vec3& point : points) {
        rays.push_back({point, glm::vec3(0.0f, -1.0f, 0.0f)});
        rays.push_back({point, glm::vec3(0.0f, 1.0f, 0.0f)});
    }
    const std::vector<Met> met = cast_all(geometry, rays);
    std::optional<Standpoint> best;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!met[2 * i].any) continue;
        Standpoint place;
        const float floor = met[2 * i].at.y;
        const float ceiling = met[2 * i + 1].any ? met[2 * i + 1].at.y : std::max(box.most.y, floor + 2.0f * kEye_m);
        place.height_m = ceiling - floor;
        place.middle = floor + 0.5f * place.height_m;
        place.eye = {points[i].x, floor + std::min(kEye_m, 0.65f * place.height_m), points[i].z};
        judge(place, geometry, lamps);
        if (place.score >= 0.0f && (!best || place.score > best->score)) best = place;
    }
    return best;
}

// How much a camera shows its viewer: sixteen rays through its picture, and as many to the lamps.
float worth(const Geometry& geometry, const Lamps& lamps, const Camera& camera) {
    const Eye eye = eye_of(camera, 1, 1);
    const glm::vec3 from = geometry.local(eye.position);
    float sum = 0.0f;
    std::set<int> instances;
    for (int i = 0; i < kPacket; ++i) {
        const glm::vec3 along(glm::normalize(ray_through(eye, (i % 4 - 1.5) / 2.0, (i / 4 - 1.5) / 2.0)));
        SurfaceHit hit;
        if (!geometry.closest(from, along, 0.0f, true, hit)) continue;
        sum += hit.distance < kNear_m ? 0.25f : 1.0f;
        instances.insert(hit.instance);
        if (hit.emission != glm::vec3(0.0f) || lamps.light(hit.position, hit.geometric)) sum += 1.0f;
    }
    return sum + 0.5f * static_cast<float>(instances.size());
}

Camera camera_of(const Geometry& geometry, const glm::vec3& eye, const glm::vec3& target) {
    return {geometry.origin() + glm::dvec3(eye), geometry.origin() + glm::dvec3(target), kFov_rad};
}

Camera in_room(const Geometry& geometry, const Lamps& lamps, const Standpoint& place, const Box& box) {
    std::vector<Ray> rays;
    for (unsigned i = 0; i < kAzimuths; ++i) rays.push_back({place.eye, horizontal(i, kAzimuths)});
    const std::vector<Met> met = cast_all(geometry, rays);
    std::array<float, kAzimuths> free_m{};
    for (unsigned i = 0; i < kAzimuths; ++i)
        free_m[i] = met[i].any ? met[i].distance_m : box.leaves(place.eye, rays[i].along);
    // The longest ways through the place, and of each both directions.
    std::array<unsigned, kAzimuths> order{};
    for (unsigned i = 0; i < kAzimuths; ++i) order[i] = i;
    const auto whole_m = [&](unsigned i) { return free_m[i] + free_m[(i + kAzimuths / 2) % kAzimuths]; };
    std::ranges::stable_sort(order, std::greater{}, [&](unsigned i) { return whole_m(i); });
    std::optional<Camera> best;
    float most = -1.0f;
    unsigned tried = 0;
    for (std::size_t next = 0; next < order.size() && tried < kViews; ++next) {
        const unsigned i = order[next];
        const glm::vec3 ahead = rays[i].along;
        const float back_m = std::min(free_m[(i + kAzimuths / 2) % kAzimuths], kMostBack_m);
        const glm::vec3 eye = place.eye - ahead * std::max(0.0f, back_m - std::max(0.3f, 0.1f * back_m));
        const float way_m = std::max(whole_m(i), 1.0f);
        const float rise = std::clamp(place.middle - eye.y, -0.12f * way_m, 0.12f * way_m);
        const glm::vec3 target = eye + 0.5f * way_m * ahead + glm::vec3(0.0f, 0.5f * rise, 0.0f);
        const Camera camera = camera_of(geometry, eye, target);
        const float value = worth(geometry, lamps, camera);
        ++tried;
        if (value <= most) continue;
        most = value;
        best = camera;
    }
    return *best;
}

Camera from_outside(const Geometry& geometry, const Lamps& lamps) {
    const Camera usual = framing(geometry.asset().bounds);
    const glm::dvec3 away = usual.eye - usual.target;
    Camera best = usual;
    float most = -1.0f;
    for (unsigned side = 0; side < kSides; ++side) {
        const double angle = 2.0 * std::numbers::pi * side / kSides, c = std::cos(angle), s = std::sin(angle);
        Camera camera = usual;
        camera.eye = usual.target + glm::dvec3(c * away.x + s * away.z, away.y, c * away.z - s * away.x);
        const float value = worth(geometry, lamps, camera);
        if (side > 0 && value <= kBesides * most) continue;
        most = value;
        best = camera;
    }
    return best;
}

}  // namespace

FirstView first_view(const Scene& scene) {
    const auto geometry = geometry_of(scene);
    const Bounds& bounds = scene.asset->bounds;
    if (scene.asset->instances.empty()) {  // the bounds are 1 m around the luminaires, whose bodies are smaller
        const double spare_m = scene.asset->lights.empty() ? 0.0 : 0.6;
        return {framing({bounds.min + spare_m, bounds.max - spare_m})};
    }
    const Box box{geometry->local(bounds.min), geometry->local(bounds.max)};
    const Lamps lamps(scene, *geometry);
    if (const auto place = best_standpoint(*geometry, lamps, box))
        return {in_room(*geometry, lamps, *place, box), true};
    return {from_outside(*geometry, lamps)};
}

std::string reversed_hint(const Scene& scene, const Camera& camera, bool inside) {
    const auto geometry = geometry_of(scene);
    const Eye eye = eye_of(camera, 1, 1);
    const glm::vec3 from = geometry->local(eye.position);
    std::vector<Ray> rays;
    for (int i = 0; i < 2 * kPacket; ++i)
        rays.push_back({from, glm::vec3(glm::normalize(ray_through(eye, (i % 8 - 3.5) / 4.0, (i / 8 - 1.5) / 2.0)))});
    const std::vector<Met> met = cast_all(*geometry, rays);
    unsigned any = 0, hidden = 0;
    std::map<unsigned, unsigned> rays_of;  // by instance
    for (std::size_t i = 0; i < met.size(); ++i) {
        if (!met[i].any) continue;
        ++any;
        SurfaceHit hit;
        if (!met[i].hidden || (!inside && geometry->closest(from, rays[i].along, 0.0f, true, hit))) continue;
        ++hidden;
        ++rays_of[met[i].instance];
    }
    if (2 * hidden <= any) return {};
    const unsigned most = std::ranges::max_element(rays_of, {}, [](const auto& row) { return row.second; })->first;
    const Instance& instance = geometry->asset().instances[most];
    const Mesh& mesh = geometry->asset().meshes[static_cast<std::size_t>(instance.mesh)];
    const Material& material = geometry->asset().materials[static_cast<std::size_t>(mesh.material)];
    const auto named = [](const std::string& name) {
        return name.empty() ? std::string("without a name") : "'" + name + "'";
    };
    return "hint: the first camera sees the backs of one-sided surfaces, which viewers leave out, in " +
           std::to_string(hidden) + " of " + std::to_string(any) + " directions; most are of the node " +
           named(instance.node) + ", material " + named(material.name) +
           ". Turn its faces over, make the material double-sided, or start goniod with --backfaces show";
}

std::string take_first_view(Scene& scene) {
    const FirstView view = scene.asset->cameras.empty() ? first_view(scene) : FirstView{scene.camera};
    scene.camera = view.camera;
    return reversed_hint(scene, view.camera, view.inside);
}

}  // namespace gonio::trace
