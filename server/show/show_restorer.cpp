#include "server/show/show_restorer.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply_light.h"
#include "server/scene/cue.h"
#include "server/scene/light_tables.h"
#include "server/scene/light_values.h"
#include "server/scene/preset.h"
#include "server/scene/scene.h"
#include "server/show/saved_profile.h"

namespace gonio {
namespace {

// set: SetCamera or SaveView.
template <typename Set>
void put_camera(const saved::Camera& camera, Set& set) {
    *set.mutable_eye_m() = camera.eye_m();
    *set.mutable_target_m() = camera.target_m();
    set.set_fov_rad(camera.fov_rad());
}

}  // namespace

const LightSeed* seed_named(const SceneAsset& asset, const std::string& name) {
    const auto at = std::ranges::find(asset.lights, name, &LightSeed::name);
    return at == asset.lights.end() ? nullptr : &*at;
}

ShowRestorer::ShowRestorer(const saved::Show& show, Scene scene) : show_(show), scene_(std::move(scene)) {}

// Those of lights first, with all that lighting needs of them.
void ShowRestorer::read_profiles(std::chrono::milliseconds profile_time) {
    std::set<std::string> shown;
    for (const saved::Light& light : show_.lights()) shown.insert(light.profile());
    const auto until = std::chrono::steady_clock::now() + profile_time;
    for (const bool lights : {true, false}) {
        for (const saved::Profile& profile : show_.profiles()) {
            if (shown.contains(profile.key()) != lights) continue;
            if (std::chrono::steady_clock::now() >= until) {
                warn("the profile '" + profile.name() + "' is left out: those before it took " +
                     std::to_string(profile_time.count()) + " ms to read");
                continue;
            }
            const auto own = restored_profile(profile, warnings_);
            if (!own) {
                warn("the profile '" + profile.name() + "' cannot be read: " + own.error().text());
                continue;
            }
            if (lights) tables_of(**own);
            profiles_[profile.key()] = *own;
        }
    }
}

void ShowRestorer::warn(std::string text) {
    warnings_.push_back(std::move(text));
}

void ShowRestorer::run(Scene& scene, const v1::Command& command, const Loaded& loaded, const std::string& what) {
    const Revision before = scene.scene_rev;
    const auto applied = apply(scene, command, loaded);
    if (one_revision_) scene.scene_rev = before;
    if (!applied) warn(what + " is not restored: " + applied.error().text());
}

void ShowRestorer::run(const v1::Command& command, const std::string& what) {
    run(scene_, command, {}, what);
}

std::shared_ptr<const Profile> ShowRestorer::profile_of(const saved::Light& light) const {
    if (light.has_scene_profile()) {
        const LightSeed* own = seed_named(*scene_.asset, light.scene_profile());
        return own == nullptr ? nullptr : own->profile;
    }
    const auto found = profiles_.find(light.profile());
    return found == profiles_.end() ? nullptr : found->second;
}

void ShowRestorer::fill(v1::SetLight& set, const saved::Light& light, const std::string& what) {
    set.set_name(light.name());
    if (light.gel().empty() || find_gel(scene_.gels.get(), light.gel()))
        set.set_gel(light.gel());
    else
        warn("the gel of " + what + " is not restored: there is no gel '" + light.gel() + "'");
    if (!light.opening().empty()) set.set_opening(light.opening());
    for (const LightRow& light_row : light_rows()) copy_numbers(light, set, row_of(light_row.property).field);
}

void ShowRestorer::restore_size() {
    v1::Command size;
    size.mutable_set_size()->set_width_px(show_.size_px_size() == 2 ? show_.size_px(0) : 0);
    size.mutable_set_size()->set_height_px(show_.size_px_size() == 2 ? show_.size_px(1) : 0);
    run(size, "the size");
}

void ShowRestorer::restore_technique() {
    v1::Command technique;
    technique.mutable_set_technique()->set_technique(show_.technique());
    technique.mutable_set_technique()->set_samples(show_.samples());
    run(technique, "the technique");
}

void ShowRestorer::restore_presets() {
    Scene empty = scene_;  // of one light at a time, so that its values are checked like any others
    empty.lights.clear();
    empty.groups.clear();
    empty.presets.clear();
    for (const saved::Preset& preset : show_.presets()) {
        v1::Command save;
        save.mutable_save_preset()->set_name(preset.name());
        const Loaded loaded{.preset = content_of(empty, preset.lights(), "preset '" + preset.name() + "'")};
        run(scene_, save, loaded, "preset '" + preset.name() + "'");
    }
    for (const saved::Cue& cue : show_.cues()) {
        v1::Command add;
        v1::CueEdit& edit = *add.mutable_add_cue();
        edit.set_number(cue.cue().number());
        edit.set_label(cue.cue().label());
        edit.set_up_s(cue.cue().up_s());
        edit.set_down_s(cue.cue().down_s());
        edit.set_delay_up_s(cue.cue().delay_up_s());
        edit.set_delay_down_s(cue.cue().delay_down_s());
        if (cue.cue().has_follow_s()) edit.set_follow_s(cue.cue().follow_s());
        if (cue.cue().has_hang_s()) edit.set_hang_s(cue.cue().hang_s());
        edit.set_timecode(cue.cue().timecode());
        const std::string what = "cue " + cue.cue().number();
        Loaded loaded;
        if (!cue.preset().empty())
            edit.set_preset(cue.preset());
        else
            loaded.preset = content_of(empty, cue.lights(), what);
        run(scene_, add, loaded, what);
    }
}

std::shared_ptr<const Preset> ShowRestorer::content_of(const Scene& empty,
                                                       const google::protobuf::RepeatedPtrField<saved::Light>& kept,
                                                       const std::string& what) {
    Preset lights;
    for (const saved::Light& light : kept) {
        Scene stage = empty;
        add(stage, light, "light '" + light.name() + "' of " + what);
        for (PresetLight& one : preset_of(stage)) lights.push_back(std::move(one));
    }
    return std::make_shared<const Preset>(std::move(lights));
}

void ShowRestorer::restore_cue_options() {
    if (const auto active = parse_cue_number(show_.cue_active()); active && show_.has_cue_options()) {
        scene_.cue_active = *active;
        scene_.cue_next = 0;
    }
    if (!show_.has_cue_options()) return;
    v1::Command options;
    *options.mutable_set_cue_options() = show_.cue_options();
    run(options, "how cues are played");
}

void ShowRestorer::add(Scene& scene, const saved::Light& light, const std::string& what) {
    Loaded loaded{.profile = profile_of(light)};
    if (!loaded.profile && light.has_scene_profile())
        return warn(what + " is not restored: the scene file does not have it any more");
    if (!loaded.profile) {
        warn(what + " is dark: its profile is missing");
        const auto named = std::ranges::find(show_.profiles(), light.profile(), &saved::Profile::key);
        loaded.profile =
            unlit_profile(named == show_.profiles().end() || named->name().empty() ? "missing" : named->name(),
                          "missing_file", "the show does not hold this profile");
    }
    v1::Command command;
    fill(*command.mutable_add_light()->mutable_light(), light, what);
    if (light.has_multiplier()) command.mutable_add_light()->set_multiplier(light.multiplier());
    run(scene, command, loaded, what);
    if (Light* const added = find_light(scene, light.name())) restore_kind(*added, light, what);
}

bool ShowRestorer::restore_kind(Light& light, const saved::Light& saved, const std::string& what) {
    const bool had_sun = std::exchange(light.sun, saved.sun());
    glm::dquat mount(1.0, 0.0, 0.0, 0.0);
    if (!saved.mount_xyzw().empty()) {
        const bool whole = saved.mount_xyzw_size() == 4;
        mount = whole ? glm::dquat(saved.mount_xyzw(3), saved.mount_xyzw(0), saved.mount_xyzw(1), saved.mount_xyzw(2))
                      : glm::dquat(0.0, 0.0, 0.0, 0.0);
        const double length = glm::length(mount);
        if (!(length > 1e-6) || !std::isfinite(length)) {
            warn("the mount of " + what + " is not restored: it is no rotation");
            return light.sun != had_sun;
        }
        mount /= length;
    }
    if (mount == light.world_from_mount) return light.sun != had_sun;
    light.world_from_mount = mount;
    light.world_from_light = mount * orientation_of({light.pan_rad, light.tilt_rad, light.roll_rad});
    light.tilt_factor = tilt_factor_of(light);
    return true;
}

void ShowRestorer::restore_names() {
    for (const std::string& name : show_.removed_lights()) {
        if (!find_light(scene_, name)) continue;  // the file does not have it any more: all the better
        v1::Command remove;
        remove.mutable_remove_light()->set_name(name);
        run(remove, "that light '" + name + "' was removed");
    }
    // By way of names of their own: two lights may have exchanged theirs.
    for (const bool last : {false, true}) {
        for (int i = 0; i < show_.lights_size(); ++i) {
            const saved::Light& light = show_.lights(i);
            const std::string between = "renamed light " + std::to_string(i);
            const std::string& from = last ? between : light.scene_name();
            if (light.scene_name().empty() || !find_light(scene_, from)) continue;
            v1::Command rename;
            rename.mutable_rename_light()->set_name(from);
            rename.mutable_rename_light()->set_new_name(last ? light.name() : between);
            run(rename, "the name of light '" + light.name() + "'");
        }
    }
}

void ShowRestorer::restore_lights() {
    if (!show_.recalled().empty()) {
        v1::Command recall;  // the lights get their own values next
        recall.mutable_recall_preset()->set_name(show_.recalled());
        run(recall, "that preset '" + show_.recalled() + "' was recalled");
    }
    for (const saved::Light& light : show_.lights()) {
        const std::string what = "light '" + light.name() + "'";
        if (!find_light(scene_, light.name())) {
            add(scene_, light, what);
            continue;
        }
        const Loaded loaded{.profile = profile_of(light)};
        if (!loaded.profile) warn("the profile of " + what + " is missing: it has the scene file's");
        v1::Command command;
        fill(*command.mutable_set_light(), light, what);
        run(scene_, command, loaded, what);
    }
}

void ShowRestorer::restore_groups() {
    for (const v1::Group& group : show_.groups()) {
        v1::Command command;
        command.mutable_set_group()->set_name(group.name());
        *command.mutable_set_group()->mutable_lights() = group.lights();
        run(command, "group '" + group.name() + "'");
    }
}

void ShowRestorer::restore_camera() {
    v1::Command command;
    put_camera(show_.camera(), *command.mutable_set_camera());
    run(command, "the camera");
}

void ShowRestorer::restore_exposure() {
    v1::Command exposure;
    exposure.mutable_set_exposure()->set_ev100(show_.exposure_ev100());
    exposure.mutable_set_exposure()->set_automatic(show_.exposure_auto());
    run(exposure, "the exposure");
}

void ShowRestorer::restore_view_lights() {
    v1::Command light;
    light.mutable_set_view()->set_light(show_.view_light());
    run(light, "the view's light");
    v1::Command only;
    only.mutable_set_view()->set_only(show_.view_only());
    run(only, "the only light of the view");
}

void ShowRestorer::restore_false_color(const char* name, const v1::FalseColor& color) {
    v1::Command command;
    v1::SetView& set = *command.mutable_set_view();
    set.set_view(name);
    set.set_scale(color.scale());
    set.set_range_low(color.range_low());
    set.set_range_high(color.range_high());
    set.set_range_auto(color.range_auto());
    set.set_steps(color.steps());
    set.set_palette(color.palette());
    set.set_isolux(color.isolux());
    set.set_below(color.below());
    *set.mutable_levels()->mutable_values() = color.levels();
    set.set_compare_range(color.compare_range());
    run(command, std::string("the scale of the view ") + name);
}

void ShowRestorer::restore_haze() {
    if (!show_.has_haze()) return;
    v1::Command command;
    v1::SetHaze& set = *command.mutable_set_haze();
    set.set_extinction_per_m(show_.haze().extinction_per_m());
    set.set_albedo(show_.haze().albedo());
    set.set_g(show_.haze().g());
    set.set_layer_height_m(show_.haze().layer_height_m());
    run(command, "the haze");
}

void ShowRestorer::restore_false_colors() {
    if (show_.has_illuminance()) restore_false_color("illuminance", show_.illuminance());
    if (show_.has_luminance()) restore_false_color("luminance", show_.luminance());
    v1::Command compare;
    compare.mutable_set_view()->set_compare(show_.view_compare());
    run(compare, "what the view compares with");
}

void ShowRestorer::restore_look() {
    if (!show_.has_look()) return;
    v1::Command look;
    look.mutable_set_look()->set_tone(show_.look().tone());
    look.mutable_set_look()->set_white_k(show_.look().white_k());
    look.mutable_set_look()->set_white_duv(show_.look().white_duv());
    run(look, "the look");
}

void ShowRestorer::restore_saved_views() {
    for (const saved::SavedView& view : show_.saved_views()) {
        v1::Command command;
        v1::SaveView& save = *command.mutable_save_view();
        save.set_name(view.name());
        put_camera(view.camera(), save);
        run(command, "view '" + view.name() + "'");
    }
}

void ShowRestorer::restore_grids() {
    for (const v1::Grid& grid : show_.grids()) {
        v1::Command command;
        *command.mutable_set_grid()->mutable_grid() = grid;
        // The saved view that it names may have been removed since.
        const bool lent = !grid.view().empty() && scene_.saved_views.emplace(grid.view(), scene_.camera).second;
        run(command, "grid '" + grid.name() + "'");
        if (lent) scene_.saved_views.erase(grid.view());
    }
}

void ShowRestorer::restore_observers() {
    for (const v1::Observer& observer : show_.observers()) {
        v1::Command command;
        *command.mutable_set_observer()->mutable_observer() = observer;
        run(command, "observer '" + observer.name() + "'");
    }
}

void ShowRestorer::restore_view() {
    v1::Command view;
    view.mutable_set_view()->set_view(show_.view());
    view.mutable_set_view()->set_gain(show_.view_gain());
    view.mutable_set_view()->set_work_light(!show_.no_work_light());
    run(view, "the view");
}

void ShowRestorer::restore_master() {
    v1::Command master;
    master.mutable_set_master()->set_ratio(show_.master_ratio());
    run(master, "the master");
}

void ShowRestorer::restore_patch() {
    if (!show_.has_patch()) return;
    v1::Command patch;
    *patch.mutable_set_patch() = show_.patch();
    run(patch, "the patch");
}

void ShowRestorer::restore_surfaces() {
    if (!show_.has_surfaces()) return;
    v1::Command surfaces;
    *surfaces.mutable_set_surfaces() = show_.surfaces();
    run(surfaces, "the map of the fader boxes");
}

}  // namespace gonio
