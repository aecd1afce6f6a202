#include "tests/bench/report_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <stdexcept>

#include "server/render/quality_level.h"
#include "server/scene/scene.h"
#include "tests/bench/cases.h"

namespace gonio::bench {

std::string fixed(double x, int digits) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", digits, x);
    return text;
}
std::string whole(double x) {
    const std::string digits = fixed(std::round(x), 0);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
        text += digits[i];
    }
    return text;
}
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

const Json& one_where(const Json& rows, const std::map<std::string, Json>& fields) {
    for (const Json& row : rows) {
        if (std::all_of(fields.begin(), fields.end(), [&](const auto& f) { return row.at(f.first) == f.second; }))
            return row;
    }
    throw std::runtime_error("the results lack the row " + Json(fields).dump());
}
const Json& row_where(const Json& file, const std::map<std::string, Json>& fields) {
    return one_where(file.at("rows"), fields);
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

static constexpr const char* kPasses[] = {"gbuffer", "gather-weights", "surfels",  "solve",
                                          "direct",  "gather",         "composite"};

std::string scaling_table(const Json& scaling) {
    std::vector<std::string> head = {"scene", "triangles", "size", "frame ms"};
    head.insert(head.end(), std::begin(kPasses), std::end(kPasses));
    std::string table = head_of(head);
    for (const Json& row : scaling.at("rows")) {
        const int splits = row.at("splits");
        const std::string scene = row.at("scene").get<std::string>() +
                                  (splits > 0 ? ", " + fixed(std::pow(4.0, splits), 0) + " for each triangle" : "");
        std::vector<std::string> cells = {scene, whole(row.at("triangles")),
                                          std::to_string(row.at("side_px").get<int>()) + "²",
                                          fixed(row.at("frame_ms"), 1)};
        for (const char* pass : kPasses) cells.push_back(fixed(row.at("pass_ms").value(pass, 0.0), 1));
        table += row_of(cells);
    }
    return table;
}

std::string rsm_table(const Json& scaling) {
    std::string table = head_of({"texels a face", "in all", "map ms", "flux ms", "cube of depths ms", "seed: map ms",
                                 "seed: gather ms", "seed: frame ms", "its gather as predicted, ms"});
    for (const Json& row : scaling.at("rsm")) {
        const double size = row.at("size");
        std::vector<std::string> cells = {fixed(size, 0) + "²", whole(6.0 * size * size)};
        for (const char* ms :
             {"rsm_ms", "flux_ms", "shadow_ms", "seed_rsm_ms", "seed_gather_ms", "seed_frame_ms", "seed_predicted_ms"})
            cells.push_back(figure(row.at(ms)));
        table += row_of(cells);
    }
    return table;
}

std::string efforts_table(const Json& scaling) {
    std::string table = head_of({"effort", "of the sides", "links of a surfel", "points of pixels' own", "frame ms",
                                 "of the first's time", "reckoned with"});
    std::size_t number = 0;
    for (const Json& row : scaling.at("efforts")) {
        table += row_of({std::to_string(number), figure(row.at("scale")), whole(row.at("links")),
                         row.at("own_points").get<bool>() ? "yes" : "no", figure(row.at("frame_ms")),
                         fixed(row.at("cost"), 2),
                         number < kQualityLevels.size() ? fixed(kQualityLevels[number].cost, 2) : ""});
        ++number;
    }
    return table;
}

std::string lights_table(const Json& lights) {
    const std::pair<const char*, const char*> changes[] = {
        {"level_one", "level of one"}, {"color_one", "colour of one"},  {"level_all", "level of all"},
        {"exposure", "exposure"},      {"move_one", "position of one"}, {"orbit", "camera"}};
    std::string table = head_of({"what changes", "1", "4", "16", "64", "484", "rate at 16", "rate at 64"});
    const auto row = [&](const char* change, int count) -> const Json& {
        return row_where(lights, {{"scene", "stage"}, {"change", change}, {"lights", count}});
    };
    for (const auto& [name, title] : changes) {
        std::vector<std::string> cells = {title};
        for (const int count : {1, 4, 16, 64, 484}) cells.push_back(figure(row(name, count).at("frame_ms")));
        for (const int count : {16, 64}) cells.push_back(fixed(row(name, count).at("rate"), 2));
        table += row_of(cells);
    }
    return table;
}

std::string transport_table(const Json& transport) {
    std::string table =
        head_of({"scene", "triangles", "m", "surfels", "links of each", "MiB", "first after s", "all after s",
                 "frame meanwhile ms", "at most ms", "afterwards ms", "rmse", "rmse99", "bias"});
    for (const Json& row : transport.at("rows"))
        table +=
            row_of({row.at("scene"), whole(row.at("triangles")), figure(row.at("extent_m")), whole(row.at("surfels")),
                    whole(row.at("links")), fixed(row.at("bytes").get<double>() / (1 << 20), 0),
                    fixed(row.at("first_s"), 1), fixed(row.at("ready_s"), 1), figure(row.at("meanwhile_ms")),
                    figure(row.at("longest_ms")), figure(row.at("later_ms")), fixed(row.at("rmse"), 3),
                    fixed(row.at("rmse99"), 3), fixed(row.at("bias"), 3)});
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

std::string stream_table(const Json& stream) {
    if (stream.is_null()) return kNotMeasured;
    struct Row {
        const char *text, *name;
        int digits;
    };
    constexpr Row rows[] = {{"PSNR of Y', dB", "y_db", 1},
                            {"PSNR of R'G'B', dB", "rgb_db", 1},
                            {"FLIP, mean", "flip", 3},
                            {"FLIP of the worst 8×8 block", "block_flip", 3},
                            {"steps between plain 8×8 blocks, codes", "plain_step", 2}};
    std::string table;
    for (const Json& scene : stream.at("rows")) {
        const Json &moving = scene.at("moving"), &rest = scene.at("rest");
        table += head_of({scene.at("scene"), "moving, median", "worst", "at rest"});
        for (const Row& row : rows) {
            const Json& values = moving.at(row.name);
            table += row_of({row.text, fixed(values.at("median"), row.digits), fixed(values.at("worst"), row.digits),
                             fixed(rest.at(row.name), row.digits)});
        }
        table += row_of({"kB a frame", fixed(moving.at("kbytes"), 1), "", ""});
        table += row_of({"encoder, ms a frame", fixed(moving.at("encode_ms"), 2), "", ""});
        const Json& lossless_s = scene.at("lossless_s");
        table +=
            row_of({"visually lossless after", "", "", lossless_s.is_null() ? "never" : fixed(lossless_s, 2) + " s"});
        if (&scene != &stream.at("rows").back()) table += "\n";
    }
    return table;
}

std::string pareto_table(const Json& pareto) {
    std::string table = head_of({"scene, luminaires, profile", "technique", "samples", "median ms", "indirect ms",
                                 "move ms", "its indirect", "rmse_rsm", "rmse", "rmse99", "p95", "bias", "front"});
    std::string before;
    for (const Json& row : pareto.at("rows")) {
        const std::string title = row.at("scene").get<std::string>() + ", " +
                                  std::to_string(row.at("lights").get<int>()) + ", " +
                                  row.at("profile").get<std::string>();
        const auto move = [&](const char* ms) { return row.at(ms) > 0.0 ? figure(row.at(ms)) : ""; };
        table += row_of({title == before ? "" : title, row.at("technique"), whole(row.at("samples")),
                         figure(row.at("frame_ms")), figure(row.at("indirect_ms")), move("move_ms"),
                         move("move_indirect_ms"), fixed(row.at("rmse_rsm"), 2), fixed(row.at("rmse_all"), 3),
                         fixed(row.at("rmse99_all"), 3), fixed(row.at("p95_all"), 2), signed_figure(row.at("bias_all")),
                         row.at("void").get<bool>()    ? "void"
                         : row.at("front").get<bool>() ? "yes"
                                                       : ""});
        before = title;
    }
    return table;
}

std::string accuracy_table(const Json& pareto) {
    std::string table = head_of({"scene, luminaires, profile", "all and the camera move, ms", "one moves, ms",
                                 "its indirect light, ms", "rmse", "rmse99", "p95", "bias"});
    if (pareto.is_null()) return kNotMeasured;
    for (const Json& row : pareto.at("rows")) {
        if (row.at("technique") != "default") continue;
        table += row_of({row.at("scene").get<std::string>() + ", " + std::to_string(row.at("lights").get<int>()) +
                             ", " + row.at("profile").get<std::string>(),
                         figure(row.at("frame_ms")), figure(row.at("move_ms")), figure(row.at("move_indirect_ms")),
                         fixed(row.at("rmse_all"), 3), fixed(row.at("rmse99_all"), 3), fixed(row.at("p95_all"), 2),
                         signed_figure(row.at("bias_all"))});
    }
    return table;
}

std::string stress_table(const Json& stress) {
    if (stress.is_null()) return "`stress.json` is not among the results.\n";
    std::string table = head_of({"case", "checks", "figures within their bound", "nearest to its bound", "of it", "s"});
    std::vector<std::string> names;
    for (const Json& row : stress.at("rows")) {
        if (names.empty() || names.back() != row.at("case")) names.push_back(row.at("case"));
    }
    for (const std::string& name : names) {
        double checks = 0.0, nearest = 0.0;
        int gated = 0, passed = 0;
        std::string what;
        for (const Json& row : stress.at("rows")) {
            if (row.at("case") != name) continue;
            checks += row.at("checks").get<double>();
            if (row.at("verdict") == "measured") continue;
            ++gated;
            passed += row.at("verdict") == "pass" ? 1 : 0;
            const double bound = row.at("bound");
            if (row.at("worst").is_null() || bound <= 0.0) continue;
            if (row.at("worst").get<double>() / bound > nearest) {
                nearest = row.at("worst").get<double>() / bound;
                what = row.at("figure");
            }
        }
        table +=
            row_of({name, whole(checks), std::to_string(passed) + " of " + std::to_string(gated), what,
                    what.empty() ? "" : fixed(100.0 * nearest, 0) + " %", fixed(stress.at("seconds").at(name), 0)});
    }
    return table;
}

std::string pareto_gaps(const Json& pareto) {
    // The seed technique takes its time per luminaire: pareto.cpp leaves it out beyond four.
    constexpr std::size_t kMostSeedLights = 4;
    std::string without_seed, without_any;
    for (const Case& which : bench_cases({})) {
        const std::size_t lights = which.side > 0 ? static_cast<std::size_t>(which.side) * which.side : 1;
        const auto has = [&](const char* technique) {
            return std::any_of(pareto.at("rows").begin(), pareto.at("rows").end(), [&](const Json& row) {
                return row.at("scene") == which.scene && row.at("profile") == which.profile &&
                       row.at("lights") == lights && row.at("technique") == technique;
            });
        };
        const std::string name = which.scene + " " + (which.side > 0 ? std::to_string(lights) : which.profile);
        const auto note = [&](std::string& list) { list += (list.empty() ? "" : ", ") + name; };
        if (!has("default"))
            note(without_any);
        else if (lights <= kMostSeedLights && !has("seed"))
            note(without_seed);
    }
    std::string text;
    if (!without_seed.empty()) text += " Seed rows were not measured of " + without_seed + ".";
    if (!without_any.empty()) text += " No rows were kept of " + without_any + ".";
    return text.empty() ? "All cases are here." : text.substr(1);
}

}  // namespace gonio::bench
