#include "server/scene/apply_load.h"

#include <algorithm>

#include "protocol/schema/scene.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/apply_checks.h"
#include "server/scene/apply_merge.h"
#include "server/scene/apply_show.h"
#include "server/scene/cue.h"
#include "server/scene/imported.h"

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
    if ((kept.lights || kept.views || kept.grids) && loaded.asset->place != scene.asset->place)
        refuse("unsupported", "load_scene.keep", load.file(),
               "the file lies kilometres from the scene that is shown, so what is kept would be in no room");
    Scene fresh = scene_of(loaded.asset, scene.scene_rev + 1);
    fresh.traced = loaded.traced;
    fresh.drawn = loaded.drawn;
    fresh.camera = loaded.camera.value_or(fresh.camera);
    fresh.exposure_ev100 = loaded.exposure_ev100.value_or(fresh.exposure_ev100);
    fresh.scene_rev = scene.scene_rev;
    fresh.next_light_id += scene.next_light_id;
    for (Light& light : fresh.lights) light.id += scene.next_light_id;
    if (kept.lights) keep_lights(scene, fresh, warnings);
    keep_viewing(scene, fresh);
    const bool anew = scene.asset->name == fresh.asset->name;  // a file that was written anew
    if (anew || kept.lights) fresh.show_name = scene.show_name;
    fresh.show_rev = 0;
    // A patch that came with a scene goes with it; one that somebody set stays.
    if (!fresh.patch && scene.patch != scene.asset->patch) fresh.patch = scene.patch;
    fresh.surfaces = scene.surfaces;
    fresh.presets = scene.presets;  // of lights by name: files are written anew, and scenes come back
    fresh.presets_rev = scene.recalled.empty() ? scene.presets_rev : scene.scene_rev + 1;  // none is recalled now
    fresh.cues = scene.cues;                                                               // likewise
    fresh.cues_rev = scene.cues_rev;
    fresh.cue_options = scene.cue_options;
    fresh.cue_active = kept.cues ? scene.cue_active : 0;
    fresh.cue_next = kept.cues ? scene.cue_next : cue_after(scene, 0);
    // Saved views, grids and observers are places in a room. In another room they would point anywhere, so they stay
    // only where the file is the same one or the client says that the room is.
    if (anew || kept.views) fresh.saved_views = scene.saved_views, fresh.saved_views_rev = scene.saved_views_rev;
    if (kept.views) fresh.camera = scene.camera;
    if (anew || kept.grids) {
        fresh.grids = scene.grids, fresh.grids_rev = scene.grids_rev;
        fresh.observers = scene.observers, fresh.observers_rev = scene.observers_rev;
    }
    if (anew) fresh.haze = scene.haze, fresh.haze_rev = scene.haze_rev;
    fresh.view_compare = scene.view_compare;
    fresh.master_ratio = scene.master_ratio;
    scene = std::move(fresh);
}

}  // namespace gonio
