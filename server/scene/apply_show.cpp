#include "server/scene/apply_show.h"

#include "protocol/schema/show.pb.h"
#include "server/scene/apply_checks.h"

namespace gonio {

void open_show(Scene& scene, const v1::OpenShow& open, const Loaded& loaded) {
    if (!loaded.opened) refuse("invalid_argument", "open_show.name", open.name(), "no show was read");
    Scene fresh = *loaded.opened;
    const Revision now = scene.scene_rev + 1;
    for (Revision* const part :
         {&fresh.geometry_rev,  &fresh.camera_rev,    &fresh.view_rev,        &fresh.exposure_rev, &fresh.master_rev,
          &fresh.technique_rev, &fresh.size_rev,      &fresh.lights_rev,      &fresh.groups_rev,   &fresh.patch_rev,
          &fresh.surfaces_rev,  &fresh.presets_rev,   &fresh.saved_views_rev, &fresh.look_rev,     &fresh.compare_rev,
          &fresh.grids_rev,     &fresh.observers_rev, &fresh.haze_rev,        &fresh.cues_rev,     &fresh.cue_play_rev})
        *part = now;
    for (Light& light : fresh.lights) {
        light.id += scene.next_light_id;
        light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = light.name_rev = now;
    }
    fresh.next_light_id += scene.next_light_id;
    fresh.scene_rev = scene.scene_rev;
    fresh.gels = scene.gels;
    fresh.show_rev = fresh.show_name.empty() ? 0 : now;  // an upload is no file of the folder yet
    scene = std::move(fresh);
}

void show_saved(Scene& scene, const std::string& name, Revision rev) {
    scene.show_name = name;
    scene.show_rev = rev;
}

}  // namespace gonio
