// What gonio-bench pareto hands out: a table, JSON, CSV, and the plot.
#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "tests/bench/pareto.h"
#include "tests/bench/plot.h"

namespace gonio::bench {
namespace {

nlohmann::ordered_json json_of(const ParetoRow& row) {
    return {{"scene", row.scene},
            {"lights", row.lights},
            {"profile", row.profile},
            {"technique", row.technique},
            {"samples", row.samples},
            {"frame_ms", row.frame_ms},
            {"frame_p95_ms", row.frame_p95_ms},
            {"indirect_ms", row.indirect_ms},
            {"move_ms", row.move_ms},
            {"move_indirect_ms", row.move_indirect_ms},
            {"motion_over_due", row.motion_over_due},
            {"motion_most", row.motion_most},
            {"rmse_rsm", row.rsm.rmse},
            {"bias_rsm", row.rsm.bias},
            {"rmse_truth", row.truth.rmse},
            {"rmse99_truth", row.truth.rmse99},
            {"p95_truth", row.truth.p95},
            {"p99_truth", row.truth.p99},
            {"bias", row.truth.bias},
            {"reference_noise", row.truth.noise},
            {"rmse_all", row.all.rmse},
            {"rmse99_all", row.all.rmse99},
            {"p95_all", row.all.p95},
            {"p99_all", row.all.p99},
            {"bias_all", row.all.bias},
            {"noise_all", row.all.noise},
            {"frames", row.frames},
            {"triangles", row.triangles},
            {"points", row.points},
            {"empty_pixels", row.empty_pixels},
            {"seam_pixels", row.seam_pixels},
            {"mean_truth_lx", row.mean_lx},
            {"reference_cached", row.cached},
            {"seed_rate_ratio", row.seed_rate_ratio > 0.0 ? nlohmann::ordered_json(row.seed_rate_ratio) : nullptr},
            {"void", row.is_void},
            {"front", row.front}};
}

bool same_case(const ParetoRow& a, const ParetoRow& b) {
    return a.scene == b.scene && a.profile == b.profile && a.lights == b.lights;
}

std::string case_title(const ParetoRow& row) {
    return row.scene + ", " + std::to_string(row.lights) + (row.lights == 1 ? " luminaire, " : " luminaires, ") +
           row.profile;
}

std::string machine_line(const ParetoResult& result) {
    return result.renderer + "; " + result.cpu + ", " + std::to_string(result.threads) + " threads";
}

std::string run_line(const ParetoResult& result) {
    std::ostringstream line;
    line << result.width_px << "×" << result.height_px << "; load average " << std::setprecision(2) << std::fixed
         << result.load_before << " before, " << result.load_after << " at the end"
         << (result.quick ? "; quick: not for reading off" : "");
    const auto left_out = std::count_if(result.rows.begin(), result.rows.end(), [](auto& row) { return row.is_void; });
    if (left_out > 0) line << "; void rows left out: " << left_out;
    return line.str();
}

}  // namespace

void print_pareto(const ParetoResult& result, std::ostream& out) {
    out << machine_line(result) << "; " << run_line(result)
        << "\neverything recomputed in each frame, all luminaires moving (move: one, nothing else); errors while one "
           "moves, "
        << "relative to the mean of all bounces\n";
    const ParetoRow* before = nullptr;
    for (const ParetoRow& row : result.rows) {
        if (before == nullptr || !same_case(*before, row)) {
            out << "\n"
                << case_title(row) << " (" << row.triangles << " triangles, " << row.points << " points, "
                << row.empty_pixels << " empty, " << row.seam_pixels << " on seams, reference noise "
                << std::setprecision(4) << std::fixed << row.all.noise << ")\n"
                << "technique samples  frame ms    p95 ms indirect ms   move ms indirect ms  mm/due | rmse rsm bias "
                   "rsm |"
                   "  rmse  rmse99    p95    p99    bias | rate ratio\n";
        }
        before = &row;
        const auto number = [&](double x, int width, int digits) {
            out << std::setw(width) << std::setprecision(digits) << std::fixed << x;
        };
        out << std::left << std::setw(10) << row.technique << std::right << std::setw(7) << row.samples;
        number(row.frame_ms, 10, 1);
        number(row.frame_p95_ms, 10, 1);
        number(row.indirect_ms, 12, 1);
        number(row.move_ms, 10, 1);
        number(row.move_indirect_ms, 12, 1);
        number(row.motion_over_due, 8, 2);
        number(row.rsm.rmse, 11, 4);
        number(row.rsm.bias, 9, 4);
        number(row.all.rmse, 9, 3);
        number(row.all.rmse99, 7, 3);
        number(row.all.p95, 7, 2);
        number(row.all.p99, 7, 2);
        number(row.all.bias, 8, 3);
        if (row.seed_rate_ratio > 0.0) number(row.seed_rate_ratio, 13, 2);
        out << (row.is_void ? " void" : "") << (row.front ? " *" : "") << "\n";
    }
    out << "* on the front: nothing valid in the same case is both faster and nearer to the reference\n";
}

void write_json(const ParetoResult& result, std::ostream& out) {
    nlohmann::ordered_json json = {
        {"renderer", result.renderer},
        {"cpu", result.cpu},
        {"threads", result.threads},
        {"load_average", {{"before", result.load_before}, {"after", result.load_after}}},
        {"size", {result.width_px, result.height_px}},
        {"quick", result.quick},
        {"reference", {{"noise_wanted", result.noise_wanted}, {"rsm_size", result.rsm_size}, {"bounces", {1, "all"}}}},
        {"rows", nlohmann::ordered_json::array()}};
    for (const ParetoRow& row : result.rows) json["rows"].push_back(json_of(row));
    out << json.dump(1) << "\n";
}

void write_csv(const ParetoResult& result, std::ostream& out) {
    bool header = true;
    for (const ParetoRow& row : result.rows) {
        const nlohmann::ordered_json json = json_of(row);
        if (header) {
            for (auto it = json.begin(); it != json.end(); ++it) out << (it == json.begin() ? "" : ",") << it.key();
            out << "\n";
            header = false;
        }
        for (auto it = json.begin(); it != json.end(); ++it) {
            out << (it == json.begin() ? "" : ",");
            if (!it->is_null()) out << it->dump();
        }
        out << "\n";
    }
}

std::string pareto_svg(const ParetoResult& result) {
    Plot plot{"Error of the indirect light against frame time",
              machine_line(result),
              run_line(result),
              "frame time, ms (median, everything recomputed)",
              "relative rms error against the path tracer (all bounces)",
              "best choice (Pareto front)",
              {}};
    const ParetoRow* before = nullptr;
    for (const ParetoRow& row : result.rows) {
        if (before == nullptr || !same_case(*before, row)) plot.panels.push_back({case_title(row), {}, {}});
        before = &row;
        if (row.is_void) continue;
        PlotPanel& panel = plot.panels.back();
        if (panel.series.empty() || panel.series.back().name != row.technique)
            panel.series.push_back({row.technique, {}});
        const glm::dvec2 at(row.frame_ms, row.all.rmse);
        panel.series.back().points.push_back({at, std::to_string(row.samples)});
        if (row.front) panel.front.push_back(at);
    }
    for (PlotPanel& panel : plot.panels)
        std::sort(panel.front.begin(), panel.front.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
    return plot_svg(plot);
}

}  // namespace gonio::bench
