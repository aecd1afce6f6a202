#include "tests/bench/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "server/render/light_gpu.h"
#include "server/session/budget.h"
#include "tests/bench/pareto.h"
#include "tests/bench/report_parts.h"

namespace gonio::bench {
namespace {

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
        to.all.rmse = row.at("rmse_all");
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
            points.emplace_back(row->at("frame_ms").get<double>(), row->at("rmse_all").get<double>());
        for (const std::size_t i : pareto_front(points)) (*of_case[i])["front"] = true;
    }
    return all;
}

// Result: the numbers on the line of ies.txt that begins so: files and megabytes a second, times of scanning.
std::vector<double> numbers_of(const std::string& text, const std::string& begin) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(begin)) continue;
        std::vector<double> numbers(3);
        if (std::sscanf(line.c_str() + begin.size(), "%lf files/s %lf MB/s %lf x", &numbers[0], &numbers[1],
                        &numbers[2]) == 3)
            return numbers;
    }
    throw std::runtime_error("ies.txt lacks the line '" + begin + "'");
}

// Figures of the list of limits, and what stands beside tables.
void add_limits(const Saved& saved, std::map<std::string, std::string>& figures) {
    const auto pass_ms = [](const Json& row, const char* pass) { return row.at("pass_ms").at(pass).get<double>(); };
    const Json& atrium = row_where(saved.scaling, {{"scene", "atrium"}, {"side_px", 800}, {"splits", 0}});
    figures["atrium_gbuffer_ms"] = fixed(pass_ms(atrium, "gbuffer"), 1);
    figures["atrium_direct_ms"] = fixed(pass_ms(atrium, "direct"), 1);
    for (const int count : {16, 64}) {
        const Json& orbit = row_where(saved.lights, {{"scene", "stage"}, {"change", "orbit"}, {"lights", count}});
        const std::string name = "camera_" + std::to_string(count);
        figures[name + "_rate"] = fixed(orbit.at("rate"), 2);
        figures[name + "_ms"] = figure(orbit.at("frame_ms"));
        figures[name + "_direct_ms"] = figure(pass_ms(orbit, "direct"));
    }
    const Json& summed = row_where(saved.lights, {{"scene", "stage"}, {"change", "level_all"}, {"lights", 484}});
    figures["summed_ms"] = figure(summed.at("frame_ms"));
    figures["summed_direct_ms"] = figure(pass_ms(summed, "summed-direct"));
    for (const char* profile : {"wide", "beam", "beam12", "beam6"}) {
        const Json& row =
            row_where(saved.pareto, {{"scene", "atrium"}, {"profile", profile}, {"technique", "default"}});
        const std::string name = std::string("atrium_") + profile;
        figures[name + "_rmse"] = fixed(row.at("rmse_all"), 3);
        figures[name + "_rmse99"] = fixed(row.at("rmse99_all"), 3);
        figures[name + "_bias"] = fixed(row.at("bias_all"), 3);
    }
    for (const char* scene : {"cornell", "atrium"}) {
        const Json& row = row_where(saved.transport, {{"scene", scene}});
        figures[std::string(scene) + "_first_s"] = fixed(row.at("first_s"), 1);
        figures[std::string(scene) + "_ready_s"] = fixed(row.at("ready_s"), 1);
    }
    double most = 0.0;
    for (const Json& row : saved.pareto.at("rows"))
        if (row.at("technique") == "default") most = std::max(most, row.at("rmse99_all").get<double>());
    figures["rmse99_most"] = fixed(most, 3);
}

// Single figures of the text.
std::map<std::string, std::string> figures_of(const Saved& saved) {
    const Json &frames = saved.frames, &pareto = saved.pareto, &machine = saved.machine;
    std::map<std::string, std::string> figures = {
        {"renderer", pareto.at("renderer")},
        {"cpu", pareto.at("cpu")},
        {"threads", std::to_string(pareto.at("threads").get<int>())},
        {"gflops", figure(machine.at("flops_per_s").get<double>() * 1e-9)},
        {"gbytes", figure(machine.at("bytes_per_s").get<double>() * 1e-9)},
        {"glinks", figure(machine.at("links_per_s").get<double>() * 1e-9)},
        {"encoder_ms", figure(machine.at("encoder_ms"))},
        {"seed_samples", std::to_string(saved.scaling.at("seed_samples").get<int>())},
        {"rsm_size", std::to_string(kRsmSize)},
        {"pareto_gaps", pareto_gaps(pareto)}};
    for (const auto& [scene, fps] : kPaperFps) {
        const Json& own = row_where(frames, {{"scene", scene}, {"technique", "default"}});
        const std::string name = scene;
        figures[name + "_times"] =
            whole(least_of_seed(saved, scene, "indirect_ms") / own.at("indirect_ms").get<double>());
        figures[name + "_fps"] = fixed(own.at("fps_average"), 1);
        figures[name + "_missing"] = fixed(fps / own.at("fps_average").get<double>(), 1);
        const Json& rays = one_where(machine.at("rays"), {{"scene", scene}});
        figures[name + "_shadow_rate"] = fixed(rays.at("shadow_per_s").get<double>() * 1e-6, 1);
        figures[name + "_link_rate"] = fixed(rays.at("link_per_s").get<double>() * 1e-6, 1);
    }
    add_limits(saved, figures);
    const Json& seed = row_where(pareto, {{"scene", "cornell"}, {"technique", "seed"}, {"samples", 400}});
    const double shown = seed.at("points").get<double>() + seed.at("seam_pixels").get<double>();
    figures["seed_sample_ns"] =
        figure(seed.at("indirect_ms").get<double>() * 1e6 * (shown + seed.at("empty_pixels").get<double>()) /
               (400.0 * shown * pareto.at("size").at(0).get<double>() * pareto.at("size").at(1).get<double>()));
    const std::vector<double> ies = numbers_of(saved.ies, "read_photometry  ");
    figures["ies_rate"] = whole(std::round(ies[0] / 100.0) * 100.0);
    figures["ies_times"] = fixed(ies[2], 2);
    std::vector<double> ratios;
    double least_noise = 1.0, most_noise = 0.0;
    for (const Json& row : pareto.at("rows")) {
        least_noise = std::min(least_noise, row.at("noise_all").get<double>());
        most_noise = std::max(most_noise, row.at("noise_all").get<double>());
        if (!row.at("seed_rate_ratio").is_null()) ratios.push_back(row.at("seed_rate_ratio"));
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

// Result: the template's text with tables and figures in place of their names; `used` gets the names.
std::string filled(const std::filesystem::path& page_template, const std::map<std::string, std::string>& tables,
                   const std::map<std::string, std::string>& figures, std::set<std::string>& used) {
    const std::string text = read_text(page_template);
    std::string page;
    std::size_t at = 0;
    for (std::size_t open; (open = text.find("{{", at)) != std::string::npos;) {
        const std::size_t close = text.find("}}", open);
        const std::string name = text.substr(open + 2, close == std::string::npos ? 20 : close - open - 2);
        const auto table = tables.find(name);
        const auto value = figures.find(name);
        if (close == std::string::npos || (table == tables.end() && value == figures.end()))
            throw std::runtime_error(page_template.string() + ": nothing is called {{" + name + "}}");
        page += text.substr(at, open - at) + (table != tables.end() ? table->second : value->second);
        used.insert(name);
        at = close + 2;
        if (table != tables.end() && at < text.size() && text[at] == '\n') ++at;  // tables end their own lines
    }
    return page + text.substr(at);
}

}  // namespace

Report make_report(const std::filesystem::path& results, const std::filesystem::path& templates) {
    const auto where_run = [&](const char* file) {
        return std::filesystem::exists(results / file) ? read_json(results / file) : Json();
    };
    const Saved saved = {read_json(results / "frames.json"),
                         read_json(results / "lights.json"),
                         read_json(results / "scaling.json"),
                         read_pareto(results),
                         read_json(results / "machine.json"),
                         read_json(results / "refinement.json"),
                         read_json(results / "transport.json"),
                         where_run("stress.json"),
                         where_run("stream.json"),
                         where_run("haze.json"),
                         where_run("lights-haze.json"),
                         where_run("lights-clear.json"),
                         where_run("with-panel.json"),
                         where_run("with-haze.json"),
                         where_run("bake.json"),
                         where_run("bake-reference.json"),
                         read_text(results / "ies.txt")};
    const std::map<std::string, std::string> tables = {
        {"frames", frames_table(saved.frames)},
        {"scaling", scaling_table(saved.scaling)},
        {"rsm", rsm_table(saved.scaling)},
        {"efforts", efforts_table(saved.scaling)},
        {"lights", lights_table(saved.lights)},
        {"goals", goals_table(saved)},
        {"refinement", refinement_table(saved.refinement)},
        {"transport", transport_table(saved.transport)},
        {"accuracy", accuracy_table(saved.pareto)},
        {"pareto", pareto_table(saved.pareto)},
        {"stress", stress_table(saved.stress)},
        {"stream", stream_table(saved.stream)},
        {"beams", beams_table(saved.haze)},
        {"haze_rates", haze_rates_table(saved.clear_lights, saved.haze_lights)},
        {"panels", accuracy_table(saved.with_panel)},
        {"hazy", accuracy_table(saved.with_haze)},
        {"bakes", bakes_table(saved.bake)},
        {"seed_bake", seed_bake_table(saved.bake_reference)}};
    const auto figures = figures_of(saved);
    Report report;
    std::set<std::string> used;
    for (const auto& [page, name] :
         {std::pair("performance.md", "performance.in.md"), std::pair("notebook/performance.md", "notebook.in.md")})
        report.pages[page] = filled(templates / name, tables, figures, used);
    for (const auto& [name, table] : tables) {
        if (!used.contains(name)) throw std::runtime_error(templates.string() + ": no page uses {{" + name + "}}");
    }
    report.pareto_svg = pareto_svg(result_of(saved.pareto));
    return report;
}

void write_report(const Report& report, const std::filesystem::path& docs) {
    const auto write = [](const std::filesystem::path& path, const std::string& text) {
        std::ofstream out(path, std::ios::binary | std::ios::trunc);
        out << text;
        out.close();
        if (!out) throw std::runtime_error("cannot write " + path.string());
    };
    for (const auto& [page, text] : report.pages) write(docs / page, text);
    write(docs / "images" / "pareto.svg", report.pareto_svg);
}

}  // namespace gonio::bench
