#include "server/scene/state.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <unordered_set>

#include "ies/synthetic.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/apply.h"
#include "server/scene/apply_haze.h"
#include "server/scene/apply_view.h"
#include "server/scene/cue.h"
#include "server/scene/false_color.h"
#include "server/scene/imported.h"
#include "server/scene/light_values.h"
#include "server/scene/opening.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/scene/white.h"

namespace gonio {
namespace {

template <typename Field>
void put(Field* field, const glm::dvec3& v) {
    field->Clear();
    for (int i = 0; i < 3; ++i) field->Add(v[i]);
}

void put(v1::Camera& out, const Camera& camera) {
    put(out.mutable_eye(), camera.eye);
    put(out.mutable_target(), camera.target);
    out.set_fov_rad(camera.fov_rad);
}

void put_light(const Scene& scene, const Light& light, v1::Light& out) {
    out.set_name(light.name);
    for (const LightRow& light_row : light_rows())
        write_numbers(out, row_of(light_row.property).state_field, light_row, numbers_of(light, light_row));
    put(out.mutable_aim(), aim_of(light.world_from_light));
    put(out.mutable_c0(), c0_of(light.world_from_light));
    out.set_multiplier(light.multiplier);
    out.set_sun(light.sun);
    out.set_profile(light.profile->name);
    out.set_product(light.profile->product);
    if (light.gel) out.set_gel(light.gel->name);
    if (light.profile->gobos)
        for (const Gobo& gobo : *light.profile->gobos) out.add_gobos(gobo.name);
    out.set_opening(print_opening(opening_of(light)));
    out.set_opening_of_file(!light.opening);
    out.set_missing(light.missing);
    out.set_fixture(std::string(fixture_of(scene, light)));
    if (light.sun) {  // parallel light has no intensity
        out.set_sun_lx(luminance_of(own_weight(light)));
    } else {
        out.set_max_cd(light.shining()->peak_cd);
        out.set_flux_lm(light.shining()->flux_lm);
    }
}

void put_file_cameras(const SceneAsset& asset, v1::SavedViews& out) {
    for (std::size_t i = 0; i < asset.cameras.size(); ++i) {
        v1::SavedView& view = *out.add_views();
        const std::string name = i < asset.camera_names.size() ? asset.camera_names[i] : "";
        view.set_name(name.empty() ? "Camera " + std::to_string(i + 1) : name);
        put(*view.mutable_camera(), asset.cameras[i]);
    }
}

// Presets of another room's lights are kept until that room is loaded again, and are not listed meanwhile.
void put_presets(const Scene& scene, v1::Presets& out) {
    std::unordered_set<std::string_view> lights;
    for (const Light& light : scene.lights) lights.insert(light.name);
    for (const auto& [name, preset] : scene.presets)
        if (preset->empty() ||
            std::ranges::any_of(*preset, [&](const PresetLight& light) { return lights.contains(light.name); }))
            out.add_names(name);
    out.set_recalled(scene.recalled);
}

// Writes every part whose revision is newer than `since`; 0 writes all.
void put_parts(const Scene& scene, Revision since, v1::State& out) {
    out.set_scene_rev(scene.scene_rev);
    if (scene.geometry_rev > since) {
        out.set_scene(scene.asset->name);
        out.set_scene_scale(scene.asset->scale);
        if (const Bounds& bounds = scene.asset->bounds; bounds.min.x <= bounds.max.x) {
            put(out.mutable_bounds()->mutable_min_m(), bounds.min);
            put(out.mutable_bounds()->mutable_max_m(), bounds.max);
        }
        for (const std::string& warning : scene.asset->warnings) out.add_scene_warnings(warning);
        put(*out.mutable_home_camera(), scene.home);
        put_file_cameras(*scene.asset, *out.mutable_file_cameras());
    }
    for (const Light& light : scene.lights) {
        // A fixture's number is that of the show's file, which comes with the geometry.
        if (std::max({newest_rev(light), light.name_rev, scene.geometry_rev}) > since)
            put_light(scene, light, *out.add_lights());
    }
    if (scene.camera_rev > since) put(*out.mutable_camera(), scene.camera);
    if (scene.view_rev > since) {
        out.set_view(view_name(scene.view));
        out.set_view_gain(scene.view_gain);
        out.set_view_light(scene.view_light);
        put_false_color(scene.false_color[0], shows_difference(scene, View::illuminance), *out.mutable_illuminance());
        put_false_color(scene.false_color[1], shows_difference(scene, View::luminance), *out.mutable_luminance());
        out.set_view_only(scene.view_only);
        out.set_view_compare(scene.view_compare);
    }
    if (scene.look_rev > since) {
        put_look(scene.look, *out.mutable_look());
    }
    if (scene.haze_rev > since) put_haze(scene.haze, *out.mutable_haze());
    if (std::max({scene.view_rev, scene.lights_rev, scene.geometry_rev}) > since) {
        out.set_work_light(scene.work_light);
        out.set_work_light_on(work_light_on(scene));
    }
    if (scene.exposure_rev > since) {
        out.set_exposure_ev100(scene.exposure_ev100);
        out.set_exposure_auto(scene.exposure_auto);
    }
    if (scene.master_rev > since) out.set_master_ratio(scene.master_ratio);
    if (scene.technique_rev > since) {
        out.set_technique(technique_name(scene.technique));
        out.set_samples(scene.samples);
    }
    if (scene.size_rev > since) {
        out.add_size_px(static_cast<std::uint32_t>(scene.width_px));
        out.add_size_px(static_cast<std::uint32_t>(scene.height_px));
        out.set_size_auto(scene.size_auto);
    }
    if (std::max({scene.presets_rev, scene.lights_rev, scene.geometry_rev}) > since)
        put_presets(scene, *out.mutable_presets());
    if (scene.cues_rev > since) {
        v1::Cues& cues = *out.mutable_cues();
        if (scene.cues)
            for (const auto& cue : *scene.cues) put_cue(*cue, *cues.add_cues());
    }
    if (scene.saved_views_rev > since) {
        v1::SavedViews& views = *out.mutable_saved_views();
        for (const auto& [name, camera] : scene.saved_views) {
            v1::SavedView& view = *views.add_views();
            view.set_name(name);
            put(*view.mutable_camera(), camera);
        }
    }
    if (scene.grids_rev > since) {
        v1::Grids& grids = *out.mutable_grids();
        for (const auto& [name, grid] : scene.grids) *grids.add_grids() = *grid;
    }
    if (scene.observers_rev > since) {
        v1::Observers& observers = *out.mutable_observers();
        for (const auto& [name, observer] : scene.observers) *observers.add_observers() = *observer;
    }
    if (scene.groups_rev > since) {
        for (const auto& [name, lights] : scene.groups) {
            v1::Group& group = *out.add_groups();
            group.set_name(name);
            for (const std::string& light : lights) group.add_lights(light);
        }
    }
}

void put_light_list(const Scene& before, const Scene& after, v1::StateChanged& change) {
    std::set<std::string_view> names;
    std::map<std::uint32_t, std::string_view> name_of;
    for (const Light& light : after.lights) {
        change.add_light_order(light.name);
        names.insert(light.name);
        name_of[light.id] = light.name;
    }
    for (const Light& light : before.lights) {
        if (!names.contains(light.name)) change.add_removed_lights(light.name);
        const auto now = name_of.find(light.id);
        if (now == name_of.end() || now->second == light.name) continue;
        v1::RenamedLight& renamed = *change.add_renamed_lights();
        renamed.set_name(light.name);
        renamed.set_new_name(std::string(now->second));
    }
}

}  // namespace

v1::State full_state(const Scene& scene) {
    v1::State state;
    put_parts(scene, 0, state);
    for (const ies::SyntheticLuminaire& luminaire : ies::synthetic_luminaires())
        state.add_profiles(std::string(luminaire.name));
    return state;
}

v1::ShowFile show_file(const Scene& scene) {
    v1::ShowFile file;
    file.set_name(scene.show_name);
    file.set_unsaved(scene.edited_rev > scene.show_rev);
    return file;
}

v1::StateChanged state_change(Revision since, const Scene& scene) {
    v1::StateChanged change;
    change.set_scene_rev(scene.scene_rev);
    put_parts(scene, since, *change.mutable_state());
    return change;
}

v1::StateChanged state_change(const Scene& before, const Scene& after) {
    v1::StateChanged change = state_change(before.scene_rev, after);
    // The same position in the scene is another one in its file.
    if (before.asset->place != after.asset->place) *change.mutable_state() = full_state(after);
    if (after.lights_rev > before.scene_rev) put_light_list(before, after, change);
    for (const auto& [name, lights] : before.groups)
        if (!after.groups.contains(name)) change.add_removed_groups(name);
    return change;
}

}  // namespace gonio
