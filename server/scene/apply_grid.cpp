#include "server/scene/apply_grid.h"

#include <algorithm>
#include <array>

#include "protocol/schema/grid.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/calculation_grid.h"
#include "server/scene/farthest.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "server/scene/target_table.h"

namespace gonio {
namespace {

constexpr double kLeastEdge_m = 0.01, kMostEdge_m = 1000.0;
constexpr double kRightAngle = 1e-3;  // cosine that passes for a right angle
constexpr std::array<std::string_view, 7> kQuantities = {"plane",       "horizontal",    "vertical",        "camera",
                                                         "cylindrical", "cylindrical-4", "semi-cylindrical"};

void check_edge(const glm::dvec3& edge, const auto& field, const std::string& name) {
    if (const double length = glm::length(edge); !(length >= kLeastEdge_m && length <= kMostEdge_m))
        refuse("invalid_argument", name, print_all(field), "an edge is 0.01 to 1000 m long");
}

void check_direction(v1::Grid& grid) {
    const std::string& quantity = grid.quantity();
    const std::string field = "set_grid.grid.direction";
    const bool upright = quantity == "vertical" || quantity == "semi-cylindrical";
    if (grid.direction_size() == 0) {
        if (upright) refuse("invalid_argument", field, "", "the quantity " + quantity + " needs a direction");
        return;
    }
    if (!upright && quantity != "plane")
        refuse("invalid_argument", field, print_all(grid.direction()), "the quantity " + quantity + " has none");
    glm::dvec3 direction = checked_direction(grid.direction(), field);
    if (upright && glm::length(glm::dvec2(direction.x, direction.z)) < 1e-6)
        refuse("invalid_argument", field, print_all(grid.direction()), "must not be straight up or down");
}

// Fills in the row that the target names. field: of the target.
void check_target(v1::Target& target, const std::string& field) {
    const std::pair<bool, double> values[] = {
        {target.has_em_lx(), target.em_lx()}, {target.has_em_modified_lx(), target.em_modified_lx()},
        {target.has_ez_lx(), target.ez_lx()}, {target.has_u0_ratio(), target.u0_ratio()},
        {target.has_ugr(), target.ugr()},     {target.has_ra(), target.ra()}};
    constexpr std::pair<const char*, double> kMost[] = {
        {"em_lx", 1e6}, {"em_modified_lx", 1e6}, {"ez_lx", 1e6}, {"u0_ratio", 1}, {"ugr", 40}, {"ra", 100}};
    bool any = false;
    for (std::size_t i = 0; i < std::size(values); ++i) {
        any = any || values[i].first;
        if (!values[i].first) continue;
        const auto* const number = target.GetDescriptor()->FindFieldByName(kMost[i].first);
        target.GetReflection()->SetDouble(
            &target, number, checked(values[i].second, 0.0, kMost[i].second, field + "." + kMost[i].first));
    }
    if (const TargetRow* row = find_target(target.name())) return put_target(*row, target);
    if (!target.name().empty() && !any)
        refuse("not_found", field + ".name", shortened_text(target.name(), kMaxNameBytes),
               "there is no target of this name, and it has no values of its own");
    for (const auto& [text, name] : {std::pair(target.name(), ".name"), {target.task(), ".task"}})
        if (!text.empty()) checked_name(text, field + name);
    if (!target.edition().empty()) checked_name(target.edition(), field + ".edition");
}

// names: the map of one kind. Adds or replaces an entry.
template <typename Map, typename Message>
void keep(Scene& scene, Map& map, Message message, std::size_t most, const char* what, Revision& rev) {
    const std::string name = message.name();
    if (!map.contains(name) && map.size() >= most)
        refuse(std::string("too_many_") + what,
               std::string("set_") + (most == kMaxGrids ? "grid.grid" : "observer.observer") + ".name", name,
               "a scene keeps at most " + std::to_string(most) + " " + what);
    map[name] = std::make_shared<const Message>(std::move(message));
    rev = scene.scene_rev + 1;
}

}  // namespace

void set_grid(Scene& scene, const v1::Grid& given) {
    const std::string place = "set_grid.grid.";
    v1::Grid grid = given;
    checked_name(grid.name(), place + "name");
    checked_vector(grid.corner_m(), -kFarthest_m, kFarthest_m, place + "corner_m");
    const glm::dvec3 u = checked_vector(grid.u_m(), -kFarthest_m, kFarthest_m, place + "u_m"),
                     v = checked_vector(grid.v_m(), -kFarthest_m, kFarthest_m, place + "v_m");
    check_edge(u, grid.u_m(), place + "u_m");
    check_edge(v, grid.v_m(), place + "v_m");
    if (std::abs(glm::dot(u, v)) > kRightAngle * glm::length(u) * glm::length(v))
        refuse("invalid_argument", place + "v_m", print_all(grid.v_m()), "must be at a right angle to u_m");
    if (grid.quantity().empty()) grid.set_quantity("plane");
    if (std::ranges::find(kQuantities, grid.quantity()) == kQuantities.end())
        refuse("invalid_argument", place + "quantity", shortened_text(grid.quantity(), kMaxNameBytes),
               "must be plane, horizontal, vertical, camera, cylindrical, cylindrical-4 or semi-cylindrical");
    check_direction(grid);
    if (!grid.view().empty() && grid.quantity() != "camera")
        refuse("invalid_argument", place + "view", shortened_text(grid.view(), kMaxNameBytes),
               "only the quantity camera has one");
    if (!grid.view().empty() && !scene.saved_views.contains(grid.view()))
        refuse_unknown(place + "view", grid.view(), "saved view", scene.saved_views);
    if (grid.spacing().empty()) grid.set_spacing("nearest");
    if (grid.spacing() != "nearest" && grid.spacing() != "up")
        refuse("invalid_argument", place + "spacing", shortened_text(grid.spacing(), kMaxNameBytes),
               "must be nearest or up");
    if (grid.count_size() != 0 && (grid.count_size() != 2 || grid.count(0) == 0 || grid.count(1) == 0))
        refuse("invalid_argument", place + "count", print_all(grid.count()), "must be two whole numbers of at least 1");
    const double narrow = std::min(glm::length(u), glm::length(v));
    grid.set_margin_m(checked(grid.margin_m(), 0.0, std::max(0.0, 0.5 * (narrow - kLeastEdge_m)), place + "margin_m"));
    grid.set_maintenance_factor(grid.has_maintenance_factor() ? without_rounding(grid.maintenance_factor(), 0.0, 1.0)
                                                              : 1.0);
    if (!(grid.maintenance_factor() > 0.0 && grid.maintenance_factor() <= 1.0))
        refuse("invalid_argument", place + "maintenance_factor", print_number(grid.maintenance_factor()),
               "must be a number above 0, at most 1");
    if (grid.has_target()) check_target(*grid.mutable_target(), place + "target");
    const GridCounts counts = grid_layout(grid).counts;
    if (counts.u * counts.v > kMaxGridPoints)
        refuse("too_large", place + "count", print_number(counts.u) + "x" + print_number(counts.v),
               "a grid may have at most 4096 points");
    keep(scene, scene.grids, std::move(grid), kMaxGrids, "grids", scene.grids_rev);
}

void remove_grid(Scene& scene, const std::string& name) {
    if (scene.grids.erase(name) == 0) refuse_unknown("remove_grid.name", name, "grid", scene.grids);
    scene.grids_rev = scene.scene_rev + 1;
}

void set_observer(Scene& scene, const v1::Observer& given) {
    const std::string place = "set_observer.observer.";
    v1::Observer observer = given;
    checked_name(observer.name(), place + "name");
    checked_vector(observer.eye_m(), -kFarthest_m, kFarthest_m, place + "eye_m");
    const glm::dvec3 direction = checked_direction(observer.direction(), place + "direction");
    if (glm::length(glm::dvec2(direction.x, direction.z)) < 1e-6)
        refuse("invalid_argument", place + "direction", print_all(observer.direction()),
               "must not be straight up or down");
    if (observer.has_target()) check_target(*observer.mutable_target(), place + "target");
    keep(scene, scene.observers, std::move(observer), kMaxObservers, "observers", scene.observers_rev);
}

void remove_observer(Scene& scene, const std::string& name) {
    if (scene.observers.erase(name) == 0) refuse_unknown("remove_observer.name", name, "observer", scene.observers);
    scene.observers_rev = scene.scene_rev + 1;
}

}  // namespace gonio
