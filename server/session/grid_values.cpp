#include "server/session/grid_values.h"

#include <cmath>

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/report.pb.h"
#include "server/scene/calculation_grid.h"
#include "server/scene/vector_field.h"
#include "server/session/grid_plan.h"
#include "server/session/meter_reply.h"

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

// What of a grid's answer is known before its meters are read.
struct Asked {
    v1::GridValues values;
    std::size_t meters = 1;  // of a point
    bool plan = false;
    std::vector<PlanLight> lights;
};

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
    double error2 = 0.0;
    for (const v1::MeterReading& reading : readings) {
        for (const double x : reading.point_m()) values.add_points_m(x);
        values.add_values_lx(factor * reading.total_lx());
        error2 += (reading.direct_error_lx() * reading.direct_error_lx() +
                   reading.indirect_error_lx() * reading.indirect_error_lx()) /
                  static_cast<double>(readings.size());
    }
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

    Asked asked;
    asked.meters = grid.quantity() == "cylindrical-4" ? kFourReadings : 1;
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
