#include "server/session/glare.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "ies/core/result.h"
#include "ies/glare.h"
#include "ies/quantities.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/edit.h"
#include "server/scene/scene.h"
#include "server/scene/vector_field.h"
#include "server/session/meter_reply.h"
#include "server/trace/sources.h"

namespace gonio {
namespace {

using namespace ies;  // the rating

// The axes of the observer: along the line of sight, across it, and up.
struct Sight {
    glm::dvec3 along, across, up;
};
Sight sight_of(const glm::dvec3& direction) {
    const glm::dvec3 across = glm::normalize(glm::cross(direction, glm::dvec3(0, 1, 0)));
    return {direction, across, glm::cross(across, direction)};
}

// Adds what the luminaire is to an eye that is at d from it, as seen along the axes. Result: why it does not count.
std::string rate(const trace::Luminaire& luminaire, const Sight& sight, const glm::dvec3& d,
                 const trace::Geometry& geometry, const glm::vec3& eye, v1::GlareSource& source) {
    const double distance = glm::length(d);
    source.set_distance_m(distance);
    const double r = -glm::dot(d, sight.along), h = -glm::dot(d, sight.up);
    if (!(r > 0.0)) return "behind the eye";
    if (h < 0.0) return "below the line of sight";
    const glm::dvec3 towards = d / distance, seen = glm::transpose(luminaire.world_from_light) * towards;
    if (luminaire.opening.shape == OpeningShape::point) return "its photometric file has no luminous opening";
    const double area = projected_area(luminaire.opening, {seen.x, seen.y, seen.z}).in(m * m);
    const double weight = static_cast<double>(trace::luminance(luminaire.weight));
    if (!(area > 1e-9)) return "its luminous opening is not seen";
    const double intensity = weight * luminaire.intensity_cd(towards);
    source.set_luminance_nit(intensity / area);
    source.set_solid_angle_sr(area / (distance * distance));
    const auto p = position_index(std::abs(glm::dot(d, sight.across)) / r, h / r);
    if (!p) return "outside of the field that CIE 117 covers";
    source.set_position_index(*p);
    const glm::dvec3 passed(geometry.transmittance(eye, glm::vec3(luminaire.position)));
    const double share = trace::luminance(passed);
    if (!(share > 0.0)) return "hidden";
    source.set_luminance_nit(share * source.luminance_nit());
    source.set_term(source.luminance_nit() * source.luminance_nit() * source.solid_angle_sr() / (*p * *p));
    return source.term() > 0.0 ? "" : "it sends no light to the eye";
}

std::vector<std::string> warnings_of(const Scene& scene, const v1::Ugr& ugr) {
    std::vector<std::string> warnings;
    // Outside of these CIE 117 does not hold: small and large sources are CIE 147's.
    constexpr double kSmall_m2 = 0.005, kLarge_m2 = 1.5;
    for (const v1::GlareSource& source : ugr.sources()) {
        const double area = source.solid_angle_sr() * source.distance_m() * source.distance_m();
        if (source.left_out().starts_with("its photometric file"))
            warnings.push_back("'" + source.light() + "' has no luminous opening: its glare is not rated");
        else if (source.left_out().empty() && (area < kSmall_m2 || area > kLarge_m2))
            warnings.push_back("'" + source.light() + "' is seen as " + (area < kSmall_m2 ? "less" : "more") +
                               " than CIE 117 is meant for, 0.005 to 1.5 m²");
    }
    if (std::ranges::any_of(scene.lights, [](const Light& light) { return light.sun && light.level_ratio > 0; }))
        warnings.push_back("a sun's glare is not rated");
    for (const Material& material : scene.asset->materials)
        if (material.emissive_nit != glm::vec3(0.0f)) {
            warnings.push_back("surfaces that emit light are neither glare sources nor background");
            break;
        }
    return warnings;
}

v1::ServerMessage answer(v1::Ugr ugr, const std::vector<v1::MeterReading>& readings) {
    v1::ServerMessage message;
    if (readings.empty()) return message;
    const v1::MeterReading& reading = readings.front();
    ugr.set_indirect_lx(reading.indirect_lx());
    if (reading.has_indirect_error_lx()) ugr.set_indirect_error_lx(reading.indirect_error_lx());
    if (reading.has_noise_reached()) ugr.set_noise_reached(reading.noise_reached());
    ugr.set_bounces(reading.bounces());
    ugr.set_background_nit(reading.indirect_lx() / std::numbers::pi);
    std::vector<GlareSource> sources;
    for (const v1::GlareSource& source : ugr.sources())
        if (source.left_out().empty())
            sources.push_back({source.luminance_nit() * nit, source.solid_angle_sr() * sr, source.position_index()});
    if (const auto rating = unified_glare_rating(ugr.background_nit() * nit, sources)) ugr.set_ugr(*rating);
    if (ugr.observer().target().has_ugr()) {
        v1::TargetCheck& check = *ugr.add_checks();
        check.set_name("UGR");
        check.set_required(ugr.observer().target().ugr());
        check.set_reached(ugr.ugr());
        // Nothing that glares is no glare; no background is no rating.
        check.set_passed(ugr.has_ugr() ? ugr.ugr() <= check.required() : sources.empty());
    }
    *message.mutable_ugr() = std::move(ugr);
    return message;
}

}  // namespace

std::vector<v1::GlareSource> glare_sources(const Scene& scene, const glm::dvec3& eye, const glm::dvec3& direction) {
    const auto geometry = trace::geometry_of(scene);
    const glm::vec3 from = geometry->local(eye);
    const Sight sight = sight_of(direction);
    std::vector<v1::GlareSource> sources;
    for (const trace::Luminaire& luminaire : trace::luminaires_of(scene, *geometry)) {
        if (luminaire.sun_reach_m > 0.0) continue;
        const glm::dvec3 d = glm::dvec3(from) - luminaire.position;
        if (!(glm::length(d) > 0.0)) continue;
        v1::GlareSource source;
        source.set_light(light_of(scene, luminaire.light)->name);
        source.set_left_out(rate(luminaire, sight, d, *geometry, from, source));
        sources.push_back(std::move(source));
    }
    return sources;
}

Result<MeterRequest> check_ugr(const Scene& scene, const v1::UgrQuery& query) {
    v1::Ugr ugr;
    v1::Observer& observer = *ugr.mutable_observer();
    if (!query.observer().empty()) {
        const auto found = scene.observers.find(query.observer());
        if (found == scene.observers.end())
            return Error{"not_found", "ugr.observer", query.observer(), "there is no observer of this name"};
        if (query.eye_m_size() > 0 || query.direction_size() > 0)
            return Error{"invalid_argument", "ugr.observer", query.observer(), "has an eye and a direction of its own"};
        observer = *found->second;
    } else {
        *observer.mutable_eye_m() = query.eye_m();
        *observer.mutable_direction() = query.direction();
        v1::MeterQuery checked;
        *checked.mutable_point_m() = query.eye_m();
        *checked.mutable_normal() = query.direction();
        if (const auto fine = check_meter(checked); !fine) {
            Error error = fine.error();
            error.where = error.where == "meter.point_m" ? "ugr.eye_m" : "ugr.direction";
            return error;
        }
        const glm::dvec3 direction = vector_of(query.direction());
        if (glm::length(glm::dvec2(direction.x, direction.z)) < 1e-6 * glm::length(direction))
            return Error{"invalid_argument", "ugr.direction",
                         print_number(direction.x) + "," + print_number(direction.y) + "," + print_number(direction.z),
                         "must not be straight up or down"};
    }
    auto request = measured_request(query, "ugr");
    if (!request) return request.error();
    if (request->settings.bounces == 0)
        return Error{"invalid_argument", "ugr.bounces", "0", "the background is light that has bounced at least once"};
    const glm::dvec3 eye = vector_of(observer.eye_m()), direction = glm::normalize(vector_of(observer.direction()));
    request->points = {{eye, direction}};
    for (v1::GlareSource& source : glare_sources(scene, eye, direction)) *ugr.add_sources() = std::move(source);
    ugr.set_quality(request->quality == Quality::reference ? "reference" : "interactive");
    ugr.set_scene_rev(scene.scene_rev);
    for (std::string& warning : warnings_of(scene, ugr)) ugr.add_warnings(std::move(warning));
    request->answer = [ugr = std::move(ugr)](const std::vector<v1::MeterReading>& readings) {
        return answer(ugr, readings);
    };
    return request;
}

}  // namespace gonio
