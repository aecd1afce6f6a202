#include "server/session/beam.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "protocol/schema/measure.pb.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"
#include "server/trace/geometry.h"

namespace gonio {
namespace {

constexpr double kStep = std::numbers::pi / 360.0;  // half a degree, between which an edge is then sought
constexpr int kHalvings = 12;                       // of that step: to a ten-thousandth of a degree

struct Web {
    const ies::PhotometricWeb& web;
    bool up = false;  // angles count from the direction that is opposite to photometric zero

    glm::dvec3 direction(double v, double h) const {
        const auto d = ies::direction_of(ies::Goniometer::type_c, Angle::radians(up ? std::numbers::pi - v : v),
                                         Angle::radians(h));
        return {d[0], d[1], d[2]};
    }
    double candela(double v, double h) const {
        const glm::dvec3 d = direction(v, h);
        return ies::intensity(web, {d.x, d.y, d.z}).in(cd);
    }
};

// Whether the greatest intensity lies in the upper hemisphere only.
bool shines_up(const ies::PhotometricWeb& web, double peak_cd) {
    double down = 0.0, up = 0.0;
    const std::size_t count = web.v_rad.size();
    for (std::size_t i = 0; i < web.candela.size(); ++i) {
        const auto d = ies::direction_of(web.goniometer, Angle::radians(web.v_rad[i % count]),
                                         Angle::radians(web.h_rad[i / count]));
        double& best = d[2] <= 1e-9 ? down : up;
        best = std::max(best, static_cast<double>(web.candela[i]));
    }
    return up > down && up >= 0.999 * peak_cd;
}

// Result: the outermost angle of the half plane, up to 90°, whose intensity is at least this; nothing where none is.
std::optional<double> edge_angle(const Web& web, double h, double least_cd) {
    int step = static_cast<int>(std::lround(std::numbers::pi / 2 / kStep));
    while (step >= 0 && web.candela(step * kStep, h) < least_cd) --step;
    if (step < 0) return std::nullopt;
    double inside = step * kStep, outside = inside + kStep;
    if (inside >= std::numbers::pi / 2) return inside;
    for (int i = 0; i < kHalvings; ++i) {
        const double middle = (inside + outside) / 2;
        (web.candela(middle, h) >= least_cd ? inside : outside) = middle;
    }
    return inside;
}

}  // namespace

Result<v1::Beam> beam_of(const Scene& scene, const v1::BeamQuery& query) {
    const Light* light = find_light(scene, query.light());
    if (light == nullptr) return Error{"not_found", "beam.light", query.light(), "there is no light of this name"};
    if (light->sun) return Error{"unsupported", "beam.light", query.light(), "the sun's light is parallel"};
    const auto geometry = trace::geometry_of(scene);
    const ies::PhotometricWeb& photometric = light->shining()->photometry.web;
    const Web web{photometric, shines_up(photometric, light->shining()->peak_cd)};
    const glm::vec3 from = geometry->local(light->position);
    const double far_m = 2.0 * static_cast<double>(geometry->extent());
    v1::Beam beam;
    beam.set_light(light->name);
    beam.set_scene_rev(scene.scene_rev);
    for (const double ratio : {0.5, 0.1}) {
        v1::BeamEdge& edge = *beam.add_edges();
        edge.set_ratio(ratio);
        for (int i = 0; i < kBeamHalfPlanes; ++i) {
            const double h = 2.0 * std::numbers::pi * i / kBeamHalfPlanes;
            const auto v = edge_angle(web, h, ratio * light->shining()->peak_cd);
            if (!v) continue;
            const glm::dvec3 along = glm::normalize(light->world_from_light * web.direction(*v, h));
            trace::SurfaceHit hit;
            const bool meets = geometry->closest(from, glm::vec3(along), 0.0f, false, hit, trace::Geometry::kDice / 2);
            const glm::dvec3 point =
                meets ? geometry->origin() + glm::dvec3(hit.position) : light->position + far_m * along;
            for (int k = 0; k < 3; ++k) edge.add_points_m(point[k]);
            edge.add_hit(meets);
        }
    }
    return beam;
}

}  // namespace gonio
