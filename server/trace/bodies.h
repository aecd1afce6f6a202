// Bodies of luminaires (server/scene/body.h) as rays of viewers meet them. No other ray does. Any thread.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "server/scene/body.h"
#include "server/trace/geometry.h"

namespace gonio::trace {

struct BodyGeometry {
    std::shared_ptr<const Geometry>
        geometry;                    // in the local coordinates of the scene's; its instances have lights' names
    std::vector<std::size_t> parts;  // by instance: index into Bodies::parts
};
struct WorldRay {
    glm::dvec3 from{0.0}, along{0.0};  // m
};
// places: of body_places(). of: the scene's. only: with it, of parts whose box the ray meets; those of all are as long
// in the making as a scene's. Result: null: there are none.
std::shared_ptr<const BodyGeometry> body_geometry(const BodyPlaces& places, const Geometry& of,
                                                  const std::optional<WorldRay>& only = std::nullopt);

struct SeenHit : SurfaceHit {
    int part = -1;  // of a body: index into Bodies::parts; -1: it is a surface of the scene
    float surface_m = std::numeric_limits<float>::infinity();  // how far away a surface of the scene is
};
// Geometry::closest for a viewer, with bodies, which may be null. Result: whether it met anything.
bool closest_seen(const Geometry& geometry, const BodyGeometry* bodies, const glm::vec3& from,
                  const glm::vec3& direction, SeenHit& hit, std::uint32_t dice = 0);

}  // namespace gonio::trace
