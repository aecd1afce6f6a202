#include "client/cli/grids.h"

#include <algorithm>
#include <cstdio>

#include "ies/core/printed.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/words.h"

namespace gonio {
namespace {

std::string vector_text(const google::protobuf::RepeatedField<double>& numbers) {
    std::string text;
    for (const double number : numbers) text += (text.empty() ? "" : ",") + print_number(number);
    return text;
}

std::string target_text(const v1::Target& target) {
    std::string text = target.name();
    const auto add = [&](bool there, const char* what, double value) {
        if (there) text += (text.empty() ? "" : " ") + std::string(what) + " " + print_number(value);
    };
    add(target.has_em_lx(), "Em", target.em_lx());
    add(target.has_u0_ratio(), "U0", target.u0_ratio());
    add(target.has_ez_lx(), "Ez", target.ez_lx());
    add(target.has_ugr(), "UGR", target.ugr());
    return text;
}

std::string checks_text(const google::protobuf::RepeatedPtrField<v1::TargetCheck>& checks, const v1::Target& target) {
    std::string text;
    for (const v1::TargetCheck& check : checks)
        text += printed("%-4s %s: %.4g, required %s %.4g\n", check.passed() ? "pass" : "FAIL", check.name().c_str(),
                        check.reached(), check.name() == "UGR" ? "at most" : "at least", check.required());
    if (checks.empty() || target.name().empty()) return text;
    text += "     target " + target.name();
    if (!target.task().empty()) text += ", " + target.task();
    if (!target.edition().empty()) text += " (" + target.edition() + ")";
    return text + "\n";
}

// Result: of each point why it is left out, "" where it counts.
std::vector<std::string> reasons_of(const v1::GridValues& values) {
    std::vector<std::string> reasons(static_cast<std::size_t>(values.values_lx_size()));
    for (const v1::LeftOutPoint& point : values.left_out())
        if (point.point() < reasons.size()) reasons[point.point()] = point.reason();
    return reasons;
}

// Values in whole lux, one decimal where all are small; v up. Dashes where they do not count.
std::string plan_text(const v1::GridValues& values) {
    const auto wide = static_cast<int>(values.count(0)), high = static_cast<int>(values.count(1));
    const int decimals = values.max_lx() < 99.95 ? 1 : 0;
    const int column = std::max(4, static_cast<int>(printed("%.*f", decimals, values.max_lx()).size()) + 1);
    const std::vector<std::string> reasons = reasons_of(values);
    std::string text;
    for (int j = high - 1; j >= 0; --j) {
        for (int i = 0; i < wide; ++i)
            text += reasons[static_cast<std::size_t>(j * wide + i)].empty()
                        ? printed("%*.*f", column, decimals, values.values_lx(j * wide + i))
                        : printed("%*s", column, "-");
        text += "\n";
    }
    return text;
}

}  // namespace

std::string grid_text(const v1::GridValues& values) {
    const v1::Grid& grid = values.grid();
    const char* const symbol = grid.quantity().starts_with("cylindrical") ? "Ez" : "E";
    std::string text =
        printed("%s: %s illuminance, %u x %u points, cells %.3f x %.3f m, %s\n", grid.name().c_str(),
                grid.quantity().c_str(), values.count(0), values.count(1), values.cell_m(0), values.cell_m(1),
                grid.count_size() > 0 ? "counts given" : ("counts rounded " + grid.spacing()).c_str());
    text +=
        printed("%smean %.1f lx  %smin %.1f lx  %smax %.1f lx  U0 %.3f  Ud %.3f\n", symbol, values.mean_lx(), symbol,
                values.min_lx(), symbol, values.max_lx(), values.uniformity_ratio(), values.diversity_ratio());
    text += checks_text(values.checks(), grid.target());
    text += printed("quality %s, bounces %s, maintenance factor %g, scene_rev %u", values.quality().c_str(),
                    values.bounces().c_str(), grid.maintenance_factor(), values.scene_rev());
    text += values.has_error_lx() ? printed(", standard error %.2g lx", values.error_lx()) : ", error not estimated";
    if (values.has_noise_reached() && !values.noise_reached()) text += " (the noise asked for is not reached)";
    text += "\n";
    for (const auto& [reason, where] :
         {std::pair("inside", "inside closed bodies"), {"outside", "outside of the room"}}) {
        const auto count = std::ranges::count_if(
            values.left_out(), [&](const v1::LeftOutPoint& point) { return point.reason() == reason; });
        if (count > 0) text += std::to_string(count) + " points left out: they lie " + where + "\n";
    }
    return text + "\n" + plan_text(values);
}

std::string grid_csv(const v1::GridValues& values) {
    const std::vector<std::string> reasons = reasons_of(values);
    std::string text = "i,j,x_m,y_m,z_m,lx,left_out\n";
    for (int k = 0; k < values.values_lx_size(); ++k) {
        text += std::to_string(k % static_cast<int>(values.count(0))) + "," +
                std::to_string(k / static_cast<int>(values.count(0)));
        for (int axis = 0; axis < 3; ++axis) text += "," + print_number(values.points_m(3 * k + axis));
        text += "," + print_number(values.values_lx(k)) + "," + reasons[static_cast<std::size_t>(k)] + "\n";
    }
    return text;
}

std::string grids_table(const v1::Grids& grids) {
    std::string text;
    for (const v1::Grid& grid : grids.grids()) {
        text += grid.name() + "  " + grid.quantity() + "  corner " + vector_text(grid.corner_m()) + "  u " +
                vector_text(grid.u_m()) + "  v " + vector_text(grid.v_m());
        text += grid.count_size() == 2 ? printed("  %u x %u", grid.count(0), grid.count(1)) : "  " + grid.spacing();
        if (grid.margin_m() > 0) text += "  margin " + print_number(grid.margin_m());
        if (grid.maintenance_factor() != 1) text += "  factor " + print_number(grid.maintenance_factor());
        if (grid.has_target()) text += "  target " + target_text(grid.target());
        text += "\n";
    }
    return text;
}

std::string observers_table(const v1::Observers& observers) {
    std::string text;
    for (const v1::Observer& observer : observers.observers()) {
        text += observer.name() + "  eye " + vector_text(observer.eye_m()) + "  direction " +
                vector_text(observer.direction());
        if (observer.has_target()) text += "  target " + target_text(observer.target());
        text += "\n";
    }
    return text;
}

std::string targets_table(const v1::Targets& targets) {
    std::string text = printed("%-24s %5s %9s %5s %5s %5s %4s  %s\n", "name", "Em", "modified", "U0", "UGR", "Ez", "Ra",
                               "task (edition)");
    const auto cell = [](bool there, double value) { return there ? print_number(value) : std::string("-"); };
    for (const v1::Target& row : targets.targets())
        text += printed("%-24s %5s %9s %5s %5s %5s %4s  %s (%s)\n", row.name().c_str(),
                        cell(row.has_em_lx(), row.em_lx()).c_str(),
                        cell(row.has_em_modified_lx(), row.em_modified_lx()).c_str(),
                        cell(row.has_u0_ratio(), row.u0_ratio()).c_str(), cell(row.has_ugr(), row.ugr()).c_str(),
                        cell(row.has_ez_lx(), row.ez_lx()).c_str(), cell(row.has_ra(), row.ra()).c_str(),
                        row.task().c_str(), row.edition().c_str());
    return text;
}

std::string ugr_text(const v1::Ugr& ugr) {
    std::string text = ugr.observer().name().empty() ? "" : ugr.observer().name() + ": ";
    text += ugr.has_ugr() ? printed("UGR %.1f\n", ugr.ugr())
                          : std::string("no UGR: nothing glares, or no light is indirect\n");
    text += checks_text(ugr.checks(), ugr.observer().target());
    text += printed("background %.4g cd/m² (indirect %.4g lx at the eye", ugr.background_nit(), ugr.indirect_lx());
    if (ugr.has_indirect_error_lx()) text += printed(", standard error %.2g lx", ugr.indirect_error_lx());
    text += "), quality " + ugr.quality() + ", bounces " + ugr.bounces() +
            printed(", new condition, scene_rev %u\n", ugr.scene_rev());
    if (ugr.sources_size() > 0)
        text += printed("%-24s %9s %9s %10s %7s %11s\n", "light", "m", "cd/m²", "sr", "p", "L²ω/p²");
    for (const v1::GlareSource& source : ugr.sources()) {
        text += printed("%-24.128s %9.2f ", source.light().c_str(), source.distance_m());
        text += source.left_out().empty() ? printed("%9.0f %10.6f %7.3f %11.4g\n", source.luminance_nit(),
                                                    source.solid_angle_sr(), source.position_index(), source.term())
                                          : "left out: " + source.left_out() + "\n";
    }
    return text;
}

}  // namespace gonio
