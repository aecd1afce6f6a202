#include "server/scene/apply_show.h"

#include <algorithm>
#include <utility>

#include "protocol/schema/show.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/scene.h"

namespace gonio {

void renew_parts(Scene& scene, Revision now) {
    for (Revision* const part :
         {&scene.geometry_rev,  &scene.camera_rev,    &scene.view_rev,        &scene.exposure_rev, &scene.master_rev,
          &scene.technique_rev, &scene.size_rev,      &scene.lights_rev,      &scene.groups_rev,   &scene.patch_rev,
          &scene.surfaces_rev,  &scene.presets_rev,   &scene.saved_views_rev, &scene.look_rev,     &scene.compare_rev,
          &scene.grids_rev,     &scene.observers_rev, &scene.haze_rev,        &scene.cues_rev,     &scene.cue_play_rev})
        *part = now;
    for (Light& light : scene.lights)
        light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = light.name_rev = now;
}

void keep_viewing(const Scene& scene, Scene& fresh) {
    fresh.gels = scene.gels;
    fresh.view = scene.view;
    fresh.view_gain = scene.view_gain;
    fresh.false_color = scene.false_color;
    fresh.look = scene.look;
    fresh.technique = scene.technique;
    fresh.samples = scene.samples;
    fresh.width_px = scene.width_px;
    fresh.height_px = scene.height_px;
    fresh.size_auto = scene.size_auto;
}

void open_show(Scene& scene, const v1::OpenShow& open, const Loaded& loaded) {
    if (!loaded.opened) refuse("invalid_argument", "open_show.name", open.name(), "no show was read");
    Scene fresh = *loaded.opened;
    const Revision now = scene.scene_rev + 1;
    renew_parts(fresh, now);
    for (Light& light : fresh.lights) light.id += scene.next_light_id;
    fresh.next_light_id += scene.next_light_id;
    fresh.scene_rev = scene.scene_rev;
    fresh.gels = scene.gels;
    fresh.show_rev = fresh.show_name.empty() ? 0 : now;  // an upload is no file of the folder yet
    scene = std::move(fresh);
}

void come_back(Scene& scene, const Scene& left) {
    Scene fresh = left;
    const Revision now = scene.scene_rev + 1;
    renew_parts(fresh, now);
    fresh.scene_rev = scene.scene_rev;
    if (left.edited_rev <= left.show_rev) fresh.show_rev = now;  // its file still holds it
    fresh.next_light_id = std::max(scene.next_light_id, left.next_light_id);
    keep_viewing(scene, fresh);
    scene = std::move(fresh);
}

void show_saved(Scene& scene, const std::string& name, Revision rev) {
    scene.show_name = name;
    scene.show_rev = rev;
}

}  // namespace gonio
