#include <algorithm>
#include <cmath>
#include <tuple>

#include "server/session/budget.h"
#include "tests/bench/report_parts.h"

namespace gonio::bench {

static std::string met(bool is) {
    return is ? "yes" : "no";
}

// What is asked of the default technique while a luminaire moves: at most such a part of the seed's 400 samples, and of
// the mean of all bounces; motion: ParetoRow::motion_over_due. 0: nothing.
struct Goal {
    const char *scene, *profile;
    double indirect_part, frame_part, rmse, rmse99, bias, motion;
};
static constexpr Goal kGoals[] = {
    {"cornell", "wide", 300, 130, 0.055, 0.04, 0.01, 1.5}, {"cornell", "beam", 300, 130, 0.08, 0.06, 0.01, 1.5},
    {"cornell", "beam12", 90, 0, 0, 0.05, 0.01, 1.5},      {"cornell", "beam6", 90, 0, 0, 0.05, 0.01, 1.5},
    {"atrium", "wide", 150, 90, 0.15, 0.11, 0.045, 1.5},   {"atrium", "beam", 150, 90, 0, 0.17, 0.045, 2.2},
    {"atrium", "beam12", 150, 0, 0, 0.15, 0.045, 2.2},     {"atrium", "beam6", 150, 0, 0, 0.15, 0.045, 2.2}};

// Frames a second with the encoder beside, of pictures that are lit anew whole and of those where a luminaire moves
// (the seed paper's own); passes of 800×800 pixels, ms. 0: nothing.
struct SceneGoal {
    const char* scene;
    double anew_fps, moving_fps, direct_ms, gbuffer_ms;
};
static constexpr SceneGoal kSceneGoals[] = {{"cornell", 45, 49, 5, 0}, {"atrium", 30, 47, 7, 12}};

// Goals that share a row.
struct Cells {
    std::string what, goal, is, not_met;
    void add(const std::string& name, const std::string& wanted, const std::string& figure, bool ok) {
        const auto join = [](std::string& list, const std::string& item) { list += (list.empty() ? "" : ", ") + item; };
        join(what, name), join(goal, wanted), join(is, figure);
        if (!ok) join(not_met, name);
    }
    std::string row(const std::string& title) const {
        return row_of({title + what, goal, is, not_met.empty() ? "yes" : "no: " + not_met});
    }
};

double least_of_seed(const Saved& saved, const char* scene, const char* ms) {
    double least = row_where(saved.frames, {{"scene", scene}, {"technique", "seed"}, {"samples", 400}}).at(ms);
    for (const Json& row : saved.pareto.at("rows"))
        if (row.at("scene") == scene && row.at("technique") == "seed" && row.at("samples") == 400)
            least = std::min(least, row.at(ms).get<double>());
    return least;
}

std::string goals_table(const Saved& saved) {
    const Json &frames = saved.frames, &lights = saved.lights;
    std::string table = head_of({"what", "goal", "here", "met"});
    for (const SceneGoal& goal : kSceneGoals) {
        const std::string scene = goal.scene;
        const auto at_least = [&](const char* what, double fps, double is) {
            table += row_of({scene + what, fixed(fps, 0) + " frames/s", fixed(is, 1) + " frames/s", met(is >= fps)});
        };
        at_least(", everything anew", goal.anew_fps,
                 row_where(frames, {{"scene", scene}, {"technique", "default"}}).at("fps_average"));
        at_least(", wide, a luminaire moves", goal.moving_fps,
                 1e3 / row_where(saved.pareto, {{"scene", scene}, {"profile", "wide"}, {"technique", "default"}})
                           .at("move_ms")
                           .get<double>());
        const Json& passes =
            row_where(saved.scaling, {{"scene", scene}, {"side_px", 800}, {"splits", 0}}).at("pass_ms");
        for (const auto& [pass, title, most] :
             {std::tuple("direct", ", direct light", goal.direct_ms), {"gbuffer", ", G-buffer", goal.gbuffer_ms}}) {
            if (most == 0.0) continue;
            const double is = passes.at(pass);
            table += row_of({scene + title, fixed(most, 0) + " ms", fixed(is, 1) + " ms", met(is <= most)});
        }
    }
    for (const Goal& goal : kGoals) {
        const auto asked = [&](const Json& row) {
            return row.at("scene") == goal.scene && row.at("profile") == goal.profile &&
                   row.at("technique") == "default";
        };
        const Json& rows = saved.pareto.at("rows");
        const auto row = std::find_if(rows.begin(), rows.end(), asked);
        if (row == rows.end()) continue;  // pareto_gaps says so
        const std::string name = std::string(goal.scene) + ", " + goal.profile + ", a luminaire moves: ";
        Cells times, errors;
        const auto part = [&](const char* what, double of, const char* own, const char* seeds) {
            if (of == 0.0) return;
            const double ms = row->at(own), seed_ms = least_of_seed(saved, goal.scene, seeds);
            times.add(what, "1/" + fixed(of, 0) + " (" + fixed(seed_ms / of, 1) + " ms)",
                      "1/" + fixed(seed_ms / ms, 0) + " (" + fixed(ms, 1) + " ms)", of * ms <= seed_ms);
        };
        part("indirect light", goal.indirect_part, "move_indirect_ms", "indirect_ms");
        part("frame", goal.frame_part, "move_ms", "frame_ms");
        const auto error = [&](const char* what, double most, const char* field) {
            const double is = row->at(field);
            if (most > 0.0) errors.add(what, fixed(most, 3), fixed(is, 3), std::abs(is) <= most);
        };
        error("rmse", goal.rmse, "rmse_all");
        error("rmse99", goal.rmse99, "rmse99_all");
        error("bias", goal.bias, "bias_all");
        const double motion = row->at("motion_over_due");
        errors.add("a millimetre", fixed(goal.motion, 1), fixed(motion, 2), motion <= goal.motion);
        table += times.row(name) + errors.row(name);
    }
    // The server waits so long before it refines.
    constexpr double kRest_s = static_cast<double>(Budget::kRestNs) * 1e-9;
    for (const auto& [scene, time_s, most] :
         {std::tuple("cornell", 2.0, 0.04), {"cornell", 10.0, 0.025}, {"atrium", 2.0, 0.12}, {"atrium", 10.0, 0.08}}) {
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
        Cells times;
        for (const auto& [change, title] :
             {std::pair("level_one", "level"), {"color_one", "colour"}, {"exposure", "exposure"}}) {
            const double ms = row_where(lights, {{"scene", scene}, {"change", change}, {"lights", 1}}).at("frame_ms");
            times.add(title, "6 ms", fixed(ms, 1) + " ms", ms <= 6.0);
        }
        times.goal = "6 ms each";
        table += times.row(std::string(scene) + ", one luminaire: ");
    }
    return table;
}

}  // namespace gonio::bench
