#include "server/trace/bodies.h"

#include <algorithm>
#include <map>

#include "server/scene/body.h"

namespace gonio::trace {
namespace {

// Whether a ray meets a box, which may be flat; in the box's own coordinates.
bool meets(const Bounds& box, const glm::dvec3& from, const glm::dvec3& along) {
    const double slack = 1e-6 * glm::length(box.max - box.min);
    double near = 0.0, far = 1e300;
    for (int k = 0; k < 3; ++k) {
        const double low = box.min[k] - slack - from[k], high = box.max[k] + slack - from[k];
        if (std::abs(along[k]) < 1e-300) {
            if (low > 0.0 || high < 0.0) return false;
            continue;
        }
        near = std::max(near, std::min(low / along[k], high / along[k]));
        far = std::min(far, std::max(low / along[k], high / along[k]));
    }
    return near <= far;
}

}  // namespace

std::shared_ptr<const BodyGeometry> body_geometry(const BodyPlaces& places, const Geometry& of,
                                                  const std::optional<WorldRay>& only) {
    if (places.empty()) return nullptr;
    const Bodies& bodies = *of.asset().bodies;
    auto posed = std::make_shared<SceneAsset>();
    std::vector<std::size_t> parts;
    std::map<int, int> meshes;  // of those that are met
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (!places[i]) continue;
        const Instance& part = bodies.shown.instances[i];
        const Mesh& mesh = bodies.shown.meshes[static_cast<std::size_t>(part.mesh)];
        const glm::dmat4 world_from_mesh = *places[i] * part.world_from_mesh;
        if (only) {
            const glm::dmat4 mesh_from_world = glm::inverse(world_from_mesh);
            if (!meets(mesh.bounds, glm::dvec3(mesh_from_world * glm::dvec4(only->from, 1.0)),
                       glm::dvec3(mesh_from_world * glm::dvec4(only->along, 0.0))))
                continue;
        }
        const auto [own, fresh] = meshes.try_emplace(part.mesh, static_cast<int>(posed->meshes.size()));
        if (fresh) posed->meshes.push_back(mesh);
        posed->instances.push_back({own->second, world_from_mesh, part.node});
        parts.push_back(i);
    }
    if (parts.empty()) return nullptr;
    posed->materials = bodies.shown.materials;
    posed->images = bodies.shown.images;
    // Of the same middle, so that local coordinates are the same.
    const glm::dvec3 half = 0.5 * (of.asset().bounds.max - of.asset().bounds.min);
    posed->bounds = {of.origin() - half, of.origin() + half};
    return std::make_shared<const BodyGeometry>(
        BodyGeometry{std::make_shared<const Geometry>(std::move(posed)), std::move(parts)});
}

bool closest_seen(const Geometry& geometry, const BodyGeometry* bodies, const glm::vec3& from,
                  const glm::vec3& direction, SeenHit& hit, std::uint32_t dice) {
    bool met = geometry.closest(from, direction, 0.0f, true, hit, dice);
    if (met) hit.surface_m = hit.distance;
    SurfaceHit body;
    if (bodies != nullptr && bodies->geometry->closest(from, direction, 0.0f, true, body, dice) &&
        body.distance < hit.surface_m) {
        static_cast<SurfaceHit&>(hit) = body;
        hit.part = static_cast<int>(bodies->parts[static_cast<std::size_t>(body.instance)]);
        met = true;
    }
    return met;
}

}  // namespace gonio::trace
