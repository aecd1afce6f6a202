#include "server/session/grid_values.h"

#include <cmath>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/calculation_grid.h"
#include "server/scene/scene.h"
#include "server/scene/vector_field.h"
#include "server/session/grid_plan.h"
#include "server/session/meter_reply.h"
#include "server/trace/hollows.h"

namespace gonio {
namespace {

constexpr glm::dvec3 kUp(0, 1, 0);
constexpr std::size_t kFourReadings = 4;  // of cylindrical-4

glm::dvec3 level(const glm::dvec3& direction) {
    return glm::normalize(glm::dvec3(direction.x, 0.0, direction.z));
}

// Result: the side of the rectangle that is read.
glm::dvec3 plane_normal(const v1::Grid& grid) {
    const glm::dvec3 normal = glm::normalize(glm::cross(vector_of(grid.u_m()), vector_of(grid.v_m())));
    constexpr double kUpright = 1e-6;
    const bool other =
        grid.direction_size() == 3 ? glm::dot(normal, vector_of(grid.direction())) < 0.0 : normal.y < -kUpright;
    return other ? -normal : normal;
}

// Appends the meters of one point.
void add_meters(const v1::Grid& grid, const glm::dvec3& at, const glm::dvec3& eye,
                std::vector<trace::MeterPoint>& points) {
    const std::string& quantity = grid.quantity();
    using enum trace::Receives;
    if (quantity == "cylindrical") {
        points.push_back({at, kUp, cylinder});
    } else if (quantity == "semi-cylindrical") {
        points.push_back({at, level(vector_of(grid.direction())), half_cylinder});
    } else if (quantity == "cylindrical-4") {
        for (const glm::dvec3& facing : {glm::dvec3(1, 0, 0), {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}})
            points.push_back({at, facing});
    } else if (quantity == "vertical") {
        points.push_back({at, level(vector_of(grid.direction()))});
    } else if (quantity == "camera") {
        const double distance = glm::distance(eye, at);
        points.push_back({at, distance > 1e-9 ? (eye - at) / distance : kUp});
    } else {
        points.push_back({at, quantity == "horizontal" ? kUp : plane_normal(grid)});
    }
}

// An upright plane that stands on a floor sees nothing, as its rays begin in the floor: such points are read 1 mm above
// it. Others stay.
void lift_off_floors(const Scene& scene, std::vector<trace::MeterPoint>& points) {
    constexpr double kAbove_m = 0.001, kUpright = 0.5;
    const auto geometry = trace::geometry_of(scene);
    for (trace::MeterPoint& point : points) {
        if (point.by == trace::Receives::plane && std::abs(point.normal.y) > kUpright) continue;
        const glm::vec3 at = geometry->local(point.position), off(0.0f, geometry->step_off(at), 0.0f);
        if (geometry->occluded(at + off, at - off)) point.position.y += kAbove_m;
    }
}

// What of a grid's answer is known before its meters are read.
struct Asked {
    v1::GridValues values;
    std::shared_ptr<const Scene> scene;
    std::vector<trace::MeterPoint> points;  // a meter of each
    std::size_t meters = 1;                 // of a point
    bool plan = false;
    std::vector<PlanLight> lights;
};

// Result: where a meter's rays begin, local, m: off the surface that it lies on. Upright ones may stand on one too.
glm::vec3 lifted(const trace::Geometry& geometry, const trace::MeterPoint& point) {
    constexpr double kUpright = 0.5;  // greatest height of a unit normal
    const glm::vec3 at = geometry.local(point.position);
    glm::dvec3 off = point.by == trace::Receives::plane ? point.normal : kUp;
    if (std::abs(off.y) < kUpright) off += kUp;
    return at + glm::vec3(off) * geometry.step_off(at);
}

// Sets which points do not count. Where none would be left all do, and a warning says so. Result: of each whether it
// counts.
std::vector<char> count_points(const Asked& asked, v1::GridValues& values) {
    std::vector<char> counts(asked.points.size(), 1);
    const auto geometry = trace::geometry_of(*asked.scene);
    std::vector<glm::vec3> points;
    for (const trace::MeterPoint& point : asked.points) points.push_back(lifted(*geometry, point));
    const std::vector<trace::Place> places =
        trace::places_of(*geometry, trace::landmarks_of(*asked.scene, *geometry), points, values.count(0));
    if (std::ranges::find(places, trace::Place::open) == places.end()) {
        values.add_warnings(
            "all points lie inside closed bodies or outside of the room, where no luminaire stands: they count "
            "nevertheless");
        return counts;
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (places[i] == trace::Place::open) continue;
        counts[i] = 0;
        v1::LeftOutPoint& point = *values.add_left_out();
        point.set_point(static_cast<std::uint32_t>(i));
        point.set_reason(places[i] == trace::Place::inside ? "inside" : "outside");
    }
    return counts;
}

v1::ServerMessage answer(const Asked& asked, std::vector<v1::MeterReading> readings) {
    if (asked.meters > 1) {
        std::vector<v1::MeterReading> means;
        for (std::size_t first = 0; first + asked.meters <= readings.size(); first += asked.meters)
            means.push_back(mean_reading(std::span(readings).subspan(first, asked.meters)));
        readings = std::move(means);
    }
    v1::ServerMessage message;
    if (readings.empty()) return message;
    v1::GridValues& values = *message.mutable_grid_values();
    values = asked.values;
    const double factor = values.grid().maintenance_factor();
    for (const v1::MeterReading& reading : readings) {
        for (const double x : reading.point_m()) values.add_points_m(x);
        values.add_values_lx(factor * reading.total_lx());
    }
    const std::vector<char> counts = count_points(asked, values);
    std::size_t next = 0;  // those of a cancelled job are fewer than the points
    std::erase_if(readings, [&](const v1::MeterReading&) { return counts[next++] == 0; });
    if (readings.empty()) return {};
    double error2 = 0.0;
    for (const v1::MeterReading& reading : readings)
        error2 += (reading.direct_error_lx() * reading.direct_error_lx() +
                   reading.indirect_error_lx() * reading.indirect_error_lx()) /
                  static_cast<double>(readings.size());
    if (readings.front().has_indirect_error_lx()) values.set_error_lx(factor * std::sqrt(error2));
    if (const auto reached = noise_reached(readings)) values.set_noise_reached(*reached);
    const Statistics statistics = statistics_of(readings);
    values.set_mean_lx(factor * statistics.mean);
    values.set_min_lx(factor * statistics.least);
    values.set_max_lx(factor * statistics.greatest);
    values.set_uniformity_ratio(statistics.uniformity());
    values.set_diversity_ratio(statistics.diversity());
    values.set_bounces(readings.front().bounces());
    for (v1::TargetCheck& check :
         check_target(values.grid().target(), values.grid().quantity(), values.mean_lx(), values.uniformity_ratio()))
        *values.add_checks() = std::move(check);
    if (asked.plan) values.set_plan_svg(plan_svg(values, asked.lights));
    return message;
}

}  // namespace

bool is_cylindrical(const std::string& quantity) {
    return quantity == "cylindrical" || quantity == "cylindrical-4";
}

std::vector<v1::TargetCheck> check_target(const v1::Target& target, const std::string& quantity, double mean_lx,
                                          double uniformity_ratio) {
    std::vector<v1::TargetCheck> checks;
    const auto add = [&](const char* name, double required, double reached) {
        constexpr double kRounding = 1e-9;
        v1::TargetCheck check;
        check.set_name(name);
        check.set_required(required);
        check.set_reached(reached);
        check.set_passed(reached >= required * (1.0 - kRounding));
        checks.push_back(std::move(check));
    };
    const bool cylinder = is_cylindrical(quantity);
    if (cylinder && target.has_ez_lx()) add("Ez", target.ez_lx(), mean_lx);
    if (!cylinder && target.has_em_lx()) add("Em", target.em_lx(), mean_lx);
    const bool of_ez = target.has_ez_lx() && !target.has_em_lx();
    const bool of_neither = !target.has_ez_lx() && !target.has_em_lx();
    if (target.has_u0_ratio() && (of_neither || of_ez == cylinder)) add("U0", target.u0_ratio(), uniformity_ratio);
    return checks;
}

Result<MeterRequest> check_grid(const Scene& scene, const v1::GridQuery& query) {
    const auto found = scene.grids.find(query.name());
    if (found == scene.grids.end())
        return Error{"not_found", "grid.name", query.name(), "there is no grid of this name"};
    const v1::Grid& grid = *found->second;
    glm::dvec3 eye = scene.camera.eye;
    if (!grid.view().empty()) {
        const auto view = scene.saved_views.find(grid.view());
        if (view == scene.saved_views.end())
            return Error{"not_found", "grid.view", grid.view(), "there is no saved view of this name"};
        eye = view->second.eye;
    }
    auto request = measured_request(query, "grid");
    if (!request) return request.error();
    request->grid = true;
    const GridLayout layout = grid_layout(grid);
    for (double j = 0; j < layout.counts.v; ++j)
        for (double i = 0; i < layout.counts.u; ++i) add_meters(grid, layout.centre(i, j), eye, request->points);

    lift_off_floors(scene, request->points);

    Asked asked;
    asked.meters = grid.quantity() == "cylindrical-4" ? kFourReadings : 1;
    asked.scene = std::make_shared<const Scene>(scene);
    for (std::size_t i = 0; i < request->points.size(); i += asked.meters) asked.points.push_back(request->points[i]);
    *asked.values.mutable_grid() = grid;
    for (const double count : {layout.counts.u, layout.counts.v})
        asked.values.add_count(static_cast<std::uint32_t>(count));
    asked.values.add_cell_m(glm::length(layout.u) / layout.counts.u);
    asked.values.add_cell_m(glm::length(layout.v) / layout.counts.v);
    asked.values.set_quality(request->quality == Quality::reference ? "reference" : "interactive");
    asked.values.set_scene_rev(scene.scene_rev);
    asked.plan = query.plan();
    if (asked.plan)
        for (const Light& light : scene.lights)
            if (!light.sun) asked.lights.push_back({light.name, light.position});
    request->answer = [asked = std::move(asked)](std::vector<v1::MeterReading> readings) {
        return answer(asked, std::move(readings));
    };
    return request;
}

}  // namespace gonio
