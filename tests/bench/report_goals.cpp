#include <algorithm>
#include <cmath>
#include <tuple>

#include "server/budget.h"
#include "tests/bench/report_parts.h"

namespace gonio::bench {

static std::string met(bool is) {
    return is ? "yes" : "no";
}

double seed_indirect_ms(const Saved& saved, const char* scene) {
    double least =
        row_where(saved.frames, {{"scene", scene}, {"technique", "seed"}, {"samples", 400}}).at("indirect_ms");
    for (const Json& row : saved.pareto.at("rows"))
        if (row.at("scene") == scene && row.at("technique") == "seed" && row.at("samples") == 400)
            least = std::min(least, row.at("indirect_ms").get<double>());
    return least;
}

std::string goals_table(const Saved& saved) {
    const Json &frames = saved.frames, &lights = saved.lights;
    std::string table = head_of({"what", "goal", "here", "met"});
    for (const auto& [scene, fps] : kPaperFps) {
        const Json& own = row_where(frames, {{"scene", scene}, {"technique", "default"}, {"samples", 4096}});
        const double rate = own.at("fps_average"), indirect_ms = own.at("indirect_ms"),
                     seed_ms = seed_indirect_ms(saved, scene);
        table += row_of({std::string(scene) + ", everything anew", fixed(fps, 0) + " frames/s",
                         fixed(rate, 1) + " frames/s", met(rate >= fps)});
        table += row_of({std::string(scene) + ", indirect light against `seed --samples 400`",
                         "1/100: " + fixed(seed_ms / 100.0, 1) + " ms",
                         "1/" + fixed(seed_ms / indirect_ms, 0) + ": " + fixed(indirect_ms, 1) + " ms",
                         met(100.0 * indirect_ms <= seed_ms)});
    }
    for (const Json& row : saved.pareto.at("rows")) {
        if (row.at("technique") != "default" || row.at("samples") != 4096) continue;
        const int many = row.at("lights");
        const std::string count = many > 1 ? ", " + std::to_string(many) + " luminaires" : "";
        const bool strict = row.at("scene") == "cornell" && row.at("profile") == "wide";
        const double most = strict ? 0.08 : 0.13, rmse = row.at("rmse_truth"), rmse99 = row.at("rmse99_truth"),
                     p95 = row.at("p95_truth"), bias = row.at("bias");
        table += row_of({row.at("scene").get<std::string>() + ", " + row.at("profile").get<std::string>() + count +
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
        for (const Json& row : saved.refinement.at("rows")) {
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
        const double rate = row_where(lights, {{"scene", "stage"}, {"change", change}, {"lights", count}}).at("rate");
        table += row_of({"stage, " + (title + std::to_string(count)) + ": frame rate over that of one", fixed(least, 1),
                         fixed(rate, 2), met(rate >= least)});
    }
    for (const char* scene : {"cornell", "atrium", "stage"}) {
        for (const auto& [change, title] :
             {std::pair("level_one", "level"), {"color_one", "colour"}, {"exposure", "exposure"}}) {
            const double ms = row_where(lights, {{"scene", scene}, {"change", change}, {"lights", 1}}).at("frame_ms");
            table += row_of(
                {std::string(scene) + ", one luminaire: " + title, "6 ms", fixed(ms, 1) + " ms", met(ms <= 6.0)});
        }
    }
    return table;
}

}  // namespace gonio::bench
