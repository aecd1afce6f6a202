#include "server/scene/apply_load.h"

#include <algorithm>

#include "protocol/schema/scene.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/apply_checks.h"
#include "server/scene/apply_merge.h"
#include "server/scene/apply_show.h"
#include "server/scene/cue.h"
#include "server/scene/imported.h"
#include "server/scene/limits.h"
#include "server/scene/moved_scene.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// What of the scene stays when another file is loaded.
struct Kept {
    bool lights = false, cues = false, views = false, grids = false;
};
Kept kept_by(const v1::LoadScene& load) {
    Kept kept;
    for (const std::string& word : load.keep()) {
        bool* const one = word == "lights"  ? &kept.lights
                          : word == "cues"  ? &kept.cues
                          : word == "views" ? &kept.views
                          : word == "grids" ? &kept.grids
                                            : nullptr;
        if (one == nullptr)
            refuse("invalid_argument", "load_scene.keep", shortened_text(word, kMaxNameBytes),
                   "must be lights, cues, views or grids");
        *one = true;
    }
    return kept;
}

// Result: what the show said, once no light is of the scene's file any more: which of them had got other profiles.
std::shared_ptr<const Imported> imported_of_kept(const Scene& scene) {
    if (!scene.imported) return nullptr;
    auto imported = std::make_shared<Imported>(*scene.imported);
    for (const Light& light : scene.lights)
        if (const auto own = static_cast<std::size_t>(light.imported);
            light.seed >= 0 && light.imported >= 0 && own < imported->lights.size())
            imported->lights[own].own_web =
                light.profile != scene.asset->lights[static_cast<std::size_t>(light.seed)].profile;
    return imported;
}

void keep_lights(const Scene& scene, Scene& fresh, std::vector<std::string>& warnings) {
    if (!fresh.lights.empty())
        warnings.push_back("the file's own luminaires are left out: " + std::to_string(fresh.lights.size()));
    const auto of_file = [](const Light& light) { return light.seed >= 0; };
    if (scene.asset->bodies && std::ranges::any_of(scene.lights, of_file))
        warnings.emplace_back("the bodies of fixtures are not kept: they belong to the file before");
    fresh.lights = scene.lights;
    for (Light& light : fresh.lights) light.seed = -1;
    fresh.groups = scene.groups;
    fresh.imported = imported_of_kept(scene);
    fresh.patch = scene.patch;
    fresh.haze = scene.haze;
    fresh.view_light = scene.view_light;
    fresh.view_only = scene.view_only;
    fresh.exposure_auto = scene.exposure_auto;
    fresh.exposure_ev100 = scene.exposure_ev100;
    renew_parts(fresh, scene.scene_rev + 1);
}

}  // namespace

void load_scene(Scene& scene, const v1::LoadScene& load, const Loaded& loaded, std::vector<std::string>& warnings) {
    if (load.merge()) return merge_show(scene, load, loaded, warnings);
    if (load.dry_run()) refuse("invalid_argument", "load_scene.dry_run", "true", "only a merge can be tried");
    if (!loaded.asset) refuse("invalid_argument", "load_scene.file", "", "no scene was loaded");
    const Kept kept = kept_by(load);
    const bool keeps_places = kept.lights || kept.views || kept.grids;
    bool anew = scene.asset->name == loaded.asset->name;  // a file that was written anew
    // Clients know positions as files have them, so what stays of the same room keeps its place there.
    const glm::dvec3 by_m = scene.asset->place - loaded.asset->place;
    const bool moves = by_m != glm::dvec3(0.0) && (keeps_places || anew);
    const std::optional<Scene> moved = moves ? moved_by(scene, by_m) : std::nullopt;
    if (moves && !moved && keeps_places)
        refuse("unsupported", "load_scene.keep", load.file(),
               "the file lies so far from the scene that is shown that what is kept could not be set there");
    if (moves && !moved) anew = false;
    const Scene& from = moved ? *moved : scene;
    Scene fresh = scene_of(loaded.asset, scene.scene_rev + 1);
    fresh.traced = loaded.traced;
    fresh.drawn = loaded.drawn;
    fresh.camera = fresh.home = loaded.camera.value_or(fresh.camera);
    fresh.exposure_ev100 = loaded.exposure_ev100.value_or(fresh.exposure_ev100);
    fresh.scene_rev = scene.scene_rev;
    fresh.next_light_id += scene.next_light_id;
    for (Light& light : fresh.lights) light.id += scene.next_light_id;
    if (kept.lights) keep_lights(from, fresh, warnings);
    keep_viewing(from, fresh);
    if (anew || kept.lights) fresh.show_name = from.show_name;
    fresh.show_rev = 0;
    // A patch that came with a scene goes with it; one that somebody set stays.
    if (!fresh.patch && from.patch != from.asset->patch) fresh.patch = from.patch;
    fresh.surfaces = from.surfaces;
    fresh.presets = from.presets;  // of lights by name: files are written anew, and scenes come back
    fresh.presets_rev = from.recalled.empty() ? from.presets_rev : from.scene_rev + 1;  // none is recalled now
    fresh.cues = from.cues;                                                             // likewise
    fresh.cues_rev = from.cues_rev;
    fresh.cue_options = from.cue_options;
    fresh.cue_active = kept.cues ? from.cue_active : 0;
    fresh.cue_next = kept.cues ? from.cue_next : cue_after(from, 0);
    // Saved views, grids and observers are places in a room. In another room they would point anywhere, so they stay
    // only where the file is the same one or the client says that the room is.
    if (anew || kept.views) fresh.saved_views = from.saved_views, fresh.saved_views_rev = from.saved_views_rev;
    if (kept.views) fresh.camera = from.camera;
    if (anew || kept.grids) {
        fresh.grids = from.grids, fresh.grids_rev = from.grids_rev;
        fresh.observers = from.observers, fresh.observers_rev = from.observers_rev;
    }
    if (anew) fresh.haze = from.haze, fresh.haze_rev = from.haze_rev;
    fresh.view_compare = from.view_compare;
    fresh.master_ratio = from.master_ratio;
    scene = std::move(fresh);
}

}  // namespace gonio
