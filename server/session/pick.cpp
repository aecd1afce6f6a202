#include "server/session/pick.h"

#include <numbers>
#include <utility>

#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/trace/bodies.h"
#include "server/trace/sources.h"

namespace gonio {
namespace {

std::optional<Error> refused(double value, const char* field) {
    if (value >= 0.0 && value <= 1.0) return std::nullopt;
    return Error{"invalid_argument", field, print_number(value), "must be a number from 0 to 1"};
}

}  // namespace

Result<Picked> pick_at(const Scene& scene, const v1::PickQuery& query) {
    if (auto error = refused(query.x(), "pick.x")) return *error;
    if (auto error = refused(query.y(), "pick.y")) return *error;
    const auto geometry = scene.traced ? scene.traced : std::make_shared<const trace::Geometry>(scene.asset);
    const Eye eye = eye_of(scene.camera, scene.width_px, scene.height_px);
    const glm::vec3 from = geometry->local(eye.position);
    const glm::dvec3 along = glm::normalize(ray_through(eye, 2.0 * query.x() - 1.0, 1.0 - 2.0 * query.y()));
    Picked picked;
    picked.pick.set_scene_rev(scene.scene_rev);
    const auto bodies = trace::body_geometry(body_places(scene), *geometry, trace::WorldRay{eye.position, along});
    trace::SeenHit hit;
    if (!trace::closest_seen(*geometry, bodies.get(), from, glm::vec3(along), hit, trace::Geometry::kDice / 2))
        return picked;
    picked.point = {geometry->origin() + glm::dvec3(hit.position), glm::dvec3(hit.normal)};
    picked.reflectance = hit.albedo * hit.tint;
    picked.emission_nit = hit.emission * hit.tint;
    picked.pick.set_hit(true);
    for (int k = 0; k < 3; ++k) {
        picked.pick.add_point_m(picked.point.position[k]);
        picked.pick.add_normal(picked.point.normal[k]);
    }
    picked.pick.set_distance_m(static_cast<double>(hit.distance));
    const SceneAsset& asset = hit.part < 0 ? geometry->asset() : bodies->geometry->asset();
    const Instance& instance = asset.instances.at(static_cast<std::size_t>(hit.instance));
    picked.pick.set_node(instance.node);
    const auto material = static_cast<std::size_t>(asset.meshes.at(static_cast<std::size_t>(instance.mesh)).material);
    picked.pick.set_material(asset.materials.at(material).name);
    return picked;
}

v1::Pick with_reading(const Picked& picked, v1::MeterReading reading) {
    v1::Pick pick = picked.pick;
    glm::dvec3 luminance_nit = picked.emission_nit;
    for (int k = 0; k < 3; ++k)
        luminance_nit[k] +=
            picked.reflectance[k] / std::numbers::pi * (reading.direct_rgb_lx(k) + reading.indirect_rgb_lx(k));
    pick.set_luminance_nit(trace::luminance(luminance_nit));
    *pick.mutable_reading() = std::move(reading);
    return pick;
}

}  // namespace gonio
