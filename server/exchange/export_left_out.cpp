#include "server/exchange/export_left_out.h"

#include <algorithm>
#include <set>

#include "protocol/schema/console.pb.h"
#include "server/exchange/export_parts.h"
#include "server/exchange/import_report.h"
#include "server/scene/body.h"
#include "server/scene/cue.h"
#include "server/scene/scene.h"

namespace gonio::exchange {
namespace {

// What neither format has.
void add_common(const Scene& scene, ImportReport& report) {
    for (const Light& light : scene.lights) {
        const bool has_pictures =
            light.profile && light.profile->gobos &&
            std::ranges::any_of(*light.profile->gobos, [](const Gobo& g) { return g.size_px > 0; });
        if (has_pictures)
            report.add(Outcome::left_out, "gobo wheels; lights keep the picture that they show now", light.name);
        if (light.shutter_ratio != 1.0)
            report.add(Outcome::left_out, "shutters; the level is that with the shutter", light.name);
        if (light.strobe_hz > 0.0) report.add(Outcome::left_out, "strobes; lights are on all the time", light.name);
        if (light.profile && light.profile->photometry.tilt)
            report.add(Outcome::left_out, "that a lamp's output follows its tilt; it stays as it is now", light.name);
    }
    if (scene.asset->bodies) report.add(Outcome::left_out, "bodies of luminaires");
    if (scene.haze.extinction_per_m > 0.0) report.add(Outcome::left_out, "the haze");
    const auto add_names = [&](const auto& named, const char* what) {
        for (const auto& [name, value] : named) report.add(Outcome::left_out, what, name);
    };
    add_names(scene.groups, "groups");
    add_names(scene.presets, "presets");
    add_names(scene.grids, "grids of calculation points");
    add_names(scene.observers, "observers");
    if (scene.cues && !scene.cues->empty()) report.add(Outcome::left_out, "cues");
}

bool is_color(const std::string& property) {
    return property == "red" || property == "green" || property == "blue";
}

// Rows that have a channel of a fixture which reads back: of the three colours it needs all.
std::set<const v1::PatchRow*> saved_rows(const Scene& scene) {
    std::set<const v1::PatchRow*> saved;
    for (const Light& light : scene.lights) {
        if (light.sun) continue;
        const auto rows = patch_of(scene, light).rows;
        const bool all_colors =
            std::ranges::count_if(rows, [](const v1::PatchRow* row) { return is_color(row->property()); }) == 3;
        for (const v1::PatchRow* row : rows)
            if (all_colors || !is_color(row->property())) saved.insert(row);
    }
    return saved;
}

}  // namespace

std::vector<std::string> left_out_of_glb(const Scene& scene) {
    ImportReport report;
    add_common(scene, report);
    if (scene.patch && scene.patch->rows_size() > 0) report.add(Outcome::left_out, "the patch");
    return report_lines(report);
}

std::vector<std::string> left_out_of_mvr(const Scene& scene) {
    ImportReport report;
    for (const Light& light : scene.lights)
        if (light.sun) report.add(Outcome::left_out, "suns, and their light", light.name);
    add_common(scene, report);
    for (const auto& [name, view] : scene.saved_views) report.add(Outcome::left_out, "kept views", name);
    if (scene.patch) {
        const auto saved = saved_rows(scene);
        for (const v1::PatchRow& row : scene.patch->rows())
            if (!saved.contains(&row))
                report.add(Outcome::left_out, "rows of the patch",
                           row.target().empty() ? row.property() : row.target() + " " + row.property());
    }
    return report_lines(report);
}

}  // namespace gonio::exchange
