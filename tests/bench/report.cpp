#include "tests/bench/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "server/budget.h"
#include "server/render/effort.h"
#include "server/shade/screen.h"
#include "tests/bench/pareto.h"

namespace gonio::bench {
namespace {

using Json = nlohmann::json;

std::string read_text(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) throw std::runtime_error("cannot read " + path.string());
    return text.str();
}

Json read_json(const std::filesystem::path& path) {
    Json json = Json::parse(read_text(path), nullptr, false);
    if (json.is_discarded()) throw std::runtime_error(path.string() + " is not JSON");
    return json;
}

std::string fixed(double x, int digits) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", digits, x);
    return text;
}
// Digits with a comma at every third: 2092 reads 2,092.
std::string whole(double x) {
    const std::string digits = fixed(std::round(x), 0);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
        text += digits[i];
    }
    return text;
}
// Three figures of numbers below a thousand.
std::string figure(double x) {
    return x >= 99.95 ? whole(x) : fixed(x, x >= 9.995 ? 1 : 2);
}
std::string signed_figure(double x) {
    return (x < 0.0 ? "" : "+") + fixed(x, 3);
}

std::string row_of(const std::vector<std::string>& cells) {
    std::string row = "|";
    for (const std::string& cell : cells) row.append(" ").append(cell).append(cell.empty() ? "|" : " |");
    row += '\n';
    return row;
}
std::string head_of(const std::vector<std::string>& cells) {
    std::string rule = "|";
    for (std::size_t i = 0; i < cells.size(); ++i) rule += "---|";
    return row_of(cells) + rule + "\n";
}

const Json& row_where(const Json& file, const std::map<std::string, Json>& fields) {
    for (const Json& row : file.at("rows")) {
        if (std::all_of(fields.begin(), fields.end(), [&](const auto& f) { return row.at(f.first) == f.second; }))
            return row;
    }
    throw std::runtime_error("the results lack the row " + Json(fields).dump());
}

std::string frames_table(const Json& frames) {
    std::string table =
        head_of({"scene", "technique", "samples", "min FPS", "max FPS", "average FPS", "median ms", "indirect ms"});
    std::string before;
    for (const Json& row : frames.at("rows")) {
        const std::string scene = row.at("scene").get<std::string>();
        table +=
            row_of({scene == before ? "" : scene + ", " + whole(row.at("triangles")) + " triangles",
                    row.at("technique"), whole(row.at("samples")), figure(row.at("fps_min")), figure(row.at("fps_max")),
                    figure(row.at("fps_average")), figure(row.at("frame_ms")), figure(row.at("indirect_ms"))});
        before = scene;
    }
    return table;
}

constexpr const char* kPasses[] = {"gbuffer", "direct", "vpl", "occlusion", "gather", "composite"};

std::string scaling_table(const Json& scaling) {
    std::vector<std::string> head = {"scene", "triangles", "size", "VPLs", "frame ms"};
    head.insert(head.end(), std::begin(kPasses), std::end(kPasses));
    head.insert(head.end(), {"VPL evaluations, 10⁶", "occlusion rays, 10⁶"});
    std::string table = head_of(head);
    for (const Json& row : scaling.at("rows")) {
        std::vector<std::string> cells = {row.at("scene"), whole(row.at("triangles")),
                                          std::to_string(row.at("side_px").get<int>()) + "²", whole(row.at("vpls")),
                                          fixed(row.at("frame_ms"), 1)};
        for (const char* pass : kPasses) cells.push_back(fixed(row.at("pass_ms").value(pass, 0.0), 1));
        cells.push_back(fixed(row.at("vpl_evaluations").get<double>() * 1e-6, 2));
        cells.push_back(fixed(row.at("occlusion_rays").get<double>() * 1e-6, 2));
        table += row_of(cells);
    }
    return table;
}

std::string lights_table(const Json& lights) {
    const std::pair<const char*, const char*> changes[] = {{"level_one", "level of one"},
                                                           {"level_all", "level of all"},
                                                           {"exposure", "exposure"},
                                                           {"move_one", "position of one"},
                                                           {"orbit", "camera"}};
    std::string table = head_of({"what changes", "1", "4", "16", "64", "rate at 16", "rate at 64"});
    for (const auto& [name, title] : changes) {
        std::vector<std::string> cells = {title};
        for (const int count : {1, 4, 16, 64})
            cells.push_back(figure(row_where(lights, {{"change", name}, {"lights", count}}).at("frame_ms")));
        for (const int count : {16, 64})
            cells.push_back(fixed(row_where(lights, {{"change", name}, {"lights", count}}).at("rate"), 2));
        table += row_of(cells);
    }
    return table;
}

// What a pass of the default technique must do at the least, of side² pixels.
struct Work {
    const char* pass;
    double flops;  // counted: docs/performance.md says how
    double rays;   // 0: not counted
    double bytes;  // that are read or written at least once
    std::string what;
};
constexpr double kFlopsPerEvaluation = 37.0;
std::vector<Work> work_of(const Json& row) {
    const double side = row.at("side_px"), pixels = side * side, points = pixels / 16.0, nodes = points / 16.0,
                 close = static_cast<double>(kEfforts[0].close_share) * points;
    constexpr shade::Close kClose;
    const double sums = kClose.summed + kClose.listed, rays_of_close = kClose.asked + kClose.near_rays;
    const double evaluations = row.at("vpl_evaluations"), rays = row.at("occlusion_rays");
    return {
        {"gbuffer", 0.0, 0.0, pixels * 16.0, "depth 4, normal 4, albedo 8 bytes a pixel written"},
        {"direct", 0.0, pixels / 4.0, pixels * 14.0,
         "depth and normal read, 4 + 2 bytes a pixel written; a ray for 2 × 2 pixels"},
        {"occlusion", rays * kFlopsPerEvaluation, rays, nodes * 28.0, "a term and a ray for each node and VPL"},
        {"gather", (evaluations + close * sums) * kFlopsPerEvaluation, points + close * rays_of_close, points * 52.0,
         "the sums over the VPLs, in close blocks over " + whole(kClose.summed) + " and " + whole(kClose.listed) +
             " again; a short ray a point, in close blocks " + whole(kClose.near_rays) + " and " + whole(kClose.asked) +
             " to VPLs; points and nodes read, light written"},
        {"composite", 0.0, 0.0, pixels * 35.5,
         "depth, normal, albedo and direct read, indirect brought to the pixels and read, NV12 written"}};
}

std::string limits_table(const Json& scaling, const Json& machine) {
    const Json& row = row_where(scaling, {{"scene", "cornell"}, {"side_px", 800}, {"vpls", 4096}});
    const double flops_per_ms = machine.at("flops_per_s").get<double>() * 1e-3,
                 bytes_per_ms = machine.at("bytes_per_s").get<double>() * 1e-3;
    std::string table = head_of({"pass", "measured ms", "arithmetic, 10⁶ operations", "at the machine's rate, ms",
                                 "memory, MB", "at the machine's rate, ms", "rays, 10⁶", "counted"});
    for (const Work& work : work_of(row)) {
        table +=
            row_of({work.pass, fixed(row.at("pass_ms").value(work.pass, 0.0), 1),
                    work.flops > 0.0 ? fixed(work.flops * 1e-6, 1) : "",
                    work.flops > 0.0 ? fixed(work.flops / flops_per_ms, 2) : "", fixed(work.bytes * 1e-6, 1),
                    fixed(work.bytes / bytes_per_ms, 2), work.rays > 0.0 ? fixed(work.rays * 1e-6, 2) : "", work.what});
    }
    return table;
}

std::string refinement_table(const Json& refinement) {
    std::string table = head_of({"scene", "seconds", "rounds", "rmse", "rmse99", "p95", "bias"});
    std::string before;
    for (const Json& row : refinement.at("rows")) {
        const std::string scene = row.at("scene").get<std::string>();
        table += row_of({scene == before ? "" : scene, fixed(row.at("seconds"), 2), whole(row.at("rounds")),
                         fixed(row.at("rmse"), 3), fixed(row.at("rmse99"), 3), fixed(row.at("p95"), 2),
                         signed_figure(row.at("bias"))});
        before = scene;
    }
    return table;
}

std::string pareto_table(const Json& pareto) {
    std::string table = head_of({"scene, luminaires, profile", "technique", "samples", "median ms", "indirect ms",
                                 "rmse_rsm", "rmse_truth", "rmse99", "p95", "bias", "front"});
    std::string before;
    for (const Json& row : pareto.at("rows")) {
        const std::string title = row.at("scene").get<std::string>() + ", " +
                                  std::to_string(row.at("lights").get<int>()) + ", " +
                                  row.at("profile").get<std::string>();
        table += row_of({title == before ? "" : title, row.at("technique"), whole(row.at("samples")),
                         figure(row.at("frame_ms")), figure(row.at("indirect_ms")), fixed(row.at("rmse_rsm"), 2),
                         fixed(row.at("rmse_truth"), 3), fixed(row.at("rmse99_truth"), 3),
                         fixed(row.at("p95_truth"), 2), signed_figure(row.at("bias")),
                         row.at("void").get<bool>()    ? "void"
                         : row.at("front").get<bool>() ? "yes"
                                                       : ""});
        before = title;
    }
    return table;
}

std::string met(bool is) {
    return is ? "yes" : "no";
}

// What was asked for at the default setting, and what is.
std::string goals_table(const Json& frames, const Json& lights, const Json& pareto, const Json& refinement) {
    std::string table = head_of({"what", "goal", "here", "met"});
    for (const auto& [scene, fps] : {std::pair("cornell", 49.0), {"atrium", 47.0}}) {
        const Json& seed = row_where(frames, {{"scene", scene}, {"technique", "seed"}, {"samples", 400}});
        const Json& own = row_where(frames, {{"scene", scene}, {"technique", "default"}, {"samples", 4096}});
        const double rate = own.at("fps_average"), indirect_ms = own.at("indirect_ms"),
                     seed_ms = seed.at("indirect_ms");
        table += row_of({std::string(scene) + ", everything anew", fixed(fps, 0) + " frames/s",
                         fixed(rate, 1) + " frames/s", met(rate >= fps)});
        table += row_of({std::string(scene) + ", indirect light against `seed --samples 400`",
                         "1/100: " + fixed(seed_ms / 100.0, 1) + " ms",
                         "1/" + fixed(seed_ms / indirect_ms, 0) + ": " + fixed(indirect_ms, 1) + " ms",
                         met(100.0 * indirect_ms <= seed_ms)});
    }
    for (const Json& row : pareto.at("rows")) {
        if (row.at("technique") != "default" || row.at("samples") != 4096) continue;
        const bool strict = row.at("scene") == "cornell" && row.at("profile") == "wide";
        const double most = strict ? 0.08 : 0.13, rmse = row.at("rmse_truth"), rmse99 = row.at("rmse99_truth"),
                     p95 = row.at("p95_truth"), bias = row.at("bias");
        table += row_of({row.at("scene").get<std::string>() + ", " + row.at("profile").get<std::string>() +
                             ": rmse; rmse99; p95; bias",
                         fixed(most, 2) + "; 0.11; 0.35; 0.03",
                         fixed(rmse, 3) + "; " + fixed(rmse99, 3) + "; " + fixed(p95, 2) + "; " + signed_figure(bias),
                         met(rmse <= most) + "; " + met(rmse99 <= 0.11) + "; " + met(p95 <= 0.35) + "; " +
                             met(std::abs(bias) <= 0.03)});
    }
    // The server waits so long before it refines.
    constexpr double kRest_s = static_cast<double>(Budget::kRestNs) * 1e-9;
    for (const auto& [scene, time_s, most] :
         {std::tuple("cornell", 2.0, 0.035), {"cornell", 10.0, 0.02}, {"atrium", 2.0, 0.08}, {"atrium", 10.0, 0.02}}) {
        double shown = 0.0, from_s = 0.0;
        bool comes = false;
        for (const Json& row : refinement.at("rows")) {
            if (row.at("scene") != scene) continue;
            const double at_s = row.at("seconds").get<double>() + kRest_s;
            if (at_s <= time_s) shown = row.at("rmse");
            if (!comes && row.at("rmse") <= most) comes = true, from_s = at_s;
        }
        table +=
            row_of({std::string(scene) + ", wide, " + fixed(time_s, 0) + " s after the last change", fixed(most, 3),
                    fixed(shown, 3) + (shown <= most ? ""
                                       : comes       ? "; there after " + fixed(from_s, 1) + " s"
                                                     : "; never there"),
                    met(shown <= most)});
    }
    for (const auto& [change, title, count, least] : {std::tuple("move_one", "one moves among ", 16, 0.7),
                                                      {"move_one", "one moves among ", 64, 0.7},
                                                      {"orbit", "the camera among ", 16, 0.5},
                                                      {"orbit", "the camera among ", 64, 0.2}}) {
        const double rate = row_where(lights, {{"change", change}, {"lights", count}}).at("rate");
        table += row_of({"stage, " + (title + std::to_string(count)) + ": frame rate over that of one", fixed(least, 1),
                         fixed(rate, 2), met(rate >= least)});
    }
    for (const auto& [change, title] : {std::pair("level_one", "level"), {"exposure", "exposure"}}) {
        const double ms = row_where(lights, {{"change", change}, {"lights", 1}}).at("frame_ms");
        table += row_of({std::string("stage, one luminaire: ") + title, "6 ms", fixed(ms, 1) + " ms", met(ms <= 6.0)});
    }
    return table;
}

// As write_json wrote it; what the plot needs.
ParetoResult result_of(const Json& pareto) {
    ParetoResult result;
    result.renderer = pareto.at("renderer");
    result.cpu = pareto.at("cpu");
    result.threads = pareto.at("threads");
    result.load_before = pareto.at("load_average").at("before");
    result.load_after = pareto.at("load_average").at("after");
    result.width_px = pareto.at("size").at(0);
    result.height_px = pareto.at("size").at(1);
    result.quick = pareto.at("quick");
    for (const Json& row : pareto.at("rows")) {
        ParetoRow& to = result.rows.emplace_back();
        to.scene = row.at("scene");
        to.profile = row.at("profile");
        to.technique = row.at("technique");
        to.lights = row.at("lights");
        to.samples = row.at("samples");
        to.frame_ms = row.at("frame_ms");
        to.truth.rmse = row.at("rmse_truth");
        to.is_void = row.at("void");
        to.front = row.at("front");
    }
    return result;
}

// pareto.json, and the rows of pareto-*.json, which were measured anew, instead of or beside its own; fronts of all.
Json read_pareto(const std::filesystem::path& results) {
    Json all = read_json(results / "pareto.json");
    std::set<std::filesystem::path> newer;
    for (const auto& entry : std::filesystem::directory_iterator(results)) {
        if (entry.path().filename().string().starts_with("pareto-") && entry.path().extension() == ".json")
            newer.insert(entry.path());
    }
    const auto key = [](const Json& row) {
        return std::make_tuple(row.at("scene"), row.at("lights"), row.at("profile"), row.at("technique"),
                               row.at("samples"));
    };
    Json& rows = all.at("rows");
    for (const std::filesystem::path& path : newer) {
        const Json file = read_json(path);
        for (const Json& row : file.at("rows")) {
            const auto old = std::find_if(rows.begin(), rows.end(), [&](const Json& r) { return key(r) == key(row); });
            if (old != rows.end())
                *old = row;
            else
                rows.push_back(row);
        }
    }
    std::map<std::string, std::vector<Json*>> cases;
    for (Json& row : rows) {
        row["front"] = false;
        if (!row.at("void").get<bool>())
            cases[Json({row.at("scene"), row.at("lights"), row.at("profile")}).dump()].push_back(&row);
    }
    for (const auto& [name, of_case] : cases) {
        std::vector<glm::dvec2> points;
        for (const Json* row : of_case)
            points.emplace_back(row->at("frame_ms").get<double>(), row->at("rmse_truth").get<double>());
        for (const std::size_t i : pareto_front(points)) (*of_case[i])["front"] = true;
    }
    return all;
}

// Single figures of the text.
std::map<std::string, std::string> figures_of(const Json& frames, const Json& scaling, const Json& pareto,
                                              const Json& machine) {
    std::map<std::string, std::string> figures = {
        {"renderer", pareto.at("renderer")},
        {"cpu", pareto.at("cpu")},
        {"threads", std::to_string(pareto.at("threads").get<int>())},
        {"gflops", figure(machine.at("flops_per_s").get<double>() * 1e-9)},
        {"gbytes", figure(machine.at("bytes_per_s").get<double>() * 1e-9)},
        {"gevaluations", figure(machine.at("vpl_evaluations_per_s").get<double>() * 1e-9)},
        {"flops_per_evaluation", fixed(kFlopsPerEvaluation, 0)},
        {"kernel_share", fixed(100.0 * machine.at("vpl_evaluations_per_s").get<double>() * kFlopsPerEvaluation /
                                   machine.at("flops_per_s").get<double>(),
                               0)}};
    for (const char* scene : {"cornell", "atrium"}) {
        const Json& seed = row_where(frames, {{"scene", scene}, {"technique", "seed"}, {"samples", 400}});
        const Json& own = row_where(frames, {{"scene", scene}, {"technique", "default"}, {"samples", 4096}});
        const std::string name = scene;
        figures[name + "_times"] = whole(seed.at("indirect_ms").get<double>() / own.at("indirect_ms").get<double>());
        figures[name + "_fps"] = figure(own.at("fps_average"));
        figures[name + "_missing"] =
            fixed((scene == std::string("cornell") ? 49.0 : 47.0) / own.at("fps_average").get<double>(), 1);
        const Json& passes = row_where(scaling, {{"scene", scene}, {"side_px", 800}, {"vpls", 4096}});
        figures[name + "_frame_ms"] = fixed(passes.at("frame_ms"), 1);
        figures[name + "_gbuffer_ms"] = fixed(passes.at("pass_ms").at("gbuffer"), 1);
        figures[name + "_occlusion_rate"] = figure(passes.at("occlusion_rays").get<double>() * 1e-3 /
                                                   passes.at("pass_ms").at("occlusion").get<double>());
    }
    std::vector<double> ratios;
    double least_noise = 1.0, most_noise = 0.0;
    for (const Json& row : pareto.at("rows")) {
        least_noise = std::min(least_noise, row.at("reference_noise").get<double>());
        most_noise = std::max(most_noise, row.at("reference_noise").get<double>());
        if (!row.at("seed_rate_ratio").is_null()) ratios.push_back(row.at("seed_rate_ratio"));
        if (row.at("technique") != "default" || row.at("samples") != 4096) continue;
        const std::string name = "_" + row.at("scene").get<std::string>() + "_" + row.at("profile").get<std::string>() +
                                 "_" + std::to_string(row.at("lights").get<int>());
        figures["error" + name] = fixed(row.at("rmse_truth"), 3);
        figures["error99" + name] = fixed(row.at("rmse99_truth"), 3);
        figures["p95" + name] = fixed(row.at("p95_truth"), 2);
        if (name == "_cornell_wide_1")
            figures["pareto_slower"] = fixed(
                row.at("frame_ms").get<double>() /
                    row_where(frames, {{"scene", "cornell"}, {"technique", "default"}}).at("frame_ms").get<double>(),
                1);
    }
    figures["noise_least"] = fixed(least_noise, 4);
    figures["noise_most"] = fixed(most_noise, 4);
    figures["rest_s"] = fixed(static_cast<double>(Budget::kRestNs) * 1e-9, 1);
    if (!ratios.empty()) {
        figures["seed_rate_least"] = fixed(*std::min_element(ratios.begin(), ratios.end()), 2);
        figures["seed_rate_most"] = fixed(*std::max_element(ratios.begin(), ratios.end()), 2);
    }
    return figures;
}

}  // namespace

Report make_report(const std::filesystem::path& results, const std::filesystem::path& page_template) {
    const Json frames = read_json(results / "frames.json"), lights = read_json(results / "lights.json"),
               scaling = read_json(results / "scaling.json"), pareto = read_pareto(results),
               machine = read_json(results / "machine.json"), refinement = read_json(results / "refinement.json");
    const std::map<std::string, std::string> tables = {{"frames", frames_table(frames)},
                                                       {"scaling", scaling_table(scaling)},
                                                       {"lights", lights_table(lights)},
                                                       {"goals", goals_table(frames, lights, pareto, refinement)},
                                                       {"limits", limits_table(scaling, machine)},
                                                       {"refinement", refinement_table(refinement)},
                                                       {"pareto", pareto_table(pareto)}};
    const auto figures = figures_of(frames, scaling, pareto, machine);
    const std::string text = read_text(page_template);
    Report report;
    std::set<std::string> used;
    std::size_t at = 0;
    for (std::size_t open; (open = text.find("{{", at)) != std::string::npos;) {
        const std::size_t close = text.find("}}", open);
        const std::string name = text.substr(open + 2, close == std::string::npos ? 20 : close - open - 2);
        const auto table = tables.find(name);
        const auto value = figures.find(name);
        if (close == std::string::npos || (table == tables.end() && value == figures.end()))
            throw std::runtime_error(page_template.string() + ": nothing is called {{" + name + "}}");
        report.markdown += text.substr(at, open - at) + (table != tables.end() ? table->second : value->second);
        used.insert(name);
        at = close + 2;
        if (table != tables.end() && at < text.size() && text[at] == '\n') ++at;  // tables end their own lines
    }
    report.markdown += text.substr(at);
    for (const auto& [name, table] : tables) {
        if (!used.contains(name)) throw std::runtime_error(page_template.string() + " does not use {{" + name + "}}");
    }
    report.pareto_svg = pareto_svg(result_of(pareto));
    return report;
}

void write_report(const Report& report, const std::filesystem::path& docs) {
    const auto write = [](const std::filesystem::path& path, const std::string& text) {
        std::ofstream out(path, std::ios::binary | std::ios::trunc);
        out << text;
        out.close();
        if (!out) throw std::runtime_error("cannot write " + path.string());
    };
    write(docs / "performance.md", report.markdown);
    write(docs / "images" / "pareto.svg", report.pareto_svg);
}

}  // namespace gonio::bench
