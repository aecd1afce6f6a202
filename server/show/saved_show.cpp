#include "server/show/saved_show.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>

#include "ies/writers.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/upload_name.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/apply_haze.h"
#include "server/scene/apply_view.h"
#include "server/scene/cue.h"
#include "server/scene/false_color.h"
#include "server/scene/light_tables.h"
#include "server/scene/light_values.h"
#include "server/scene/opening.h"
#include "server/scene/preset.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

// FNV-1a, 64 bits: names a profile within one file.
std::string hash_of(std::string_view text) {
    std::uint64_t hash = 14695981039346656037u;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
    return digits;
}

// A path that means the same file from another folder. Names of built-in scenes and uploads stay as they are, also
// where the working folder has files that are called so.
std::string lasting_name(const std::string& scene) {
    if (is_built_in(scene) || scene.starts_with(kUploadPrefix)) return scene;
    std::error_code error;
    if (!std::filesystem::is_regular_file(scene, error)) return scene;
    const auto path = std::filesystem::weakly_canonical(scene, error);
    return error ? scene : path.string();
}

// Result: the first light of the file with this profile; nullptr: none has it.
const LightSeed* seed_with(const SceneAsset& asset, const std::shared_ptr<const Profile>& profile) {
    const auto at = std::ranges::find(asset.lights, profile, &LightSeed::profile);
    return at == asset.lights.end() ? nullptr : &*at;
}

const LightSeed* seed_named(const SceneAsset& asset, const std::string& name) {
    const auto at = std::ranges::find(asset.lights, name, &LightSeed::name);
    return at == asset.lights.end() ? nullptr : &*at;
}

// Result: the lights of the scene file that are not in the scene any more.
std::vector<std::string> removed_lights(const Scene& scene) {
    std::vector<std::string> removed;
    std::set<int> there;
    for (const Light& light : scene.lights) there.insert(light.seed);
    for (const LightSeed& seed : scene.asset->lights)
        if (!there.contains(static_cast<int>(&seed - scene.asset->lights.data()))) removed.push_back(seed.name);
    return removed;
}

// set: SetCamera or SaveView.
template <typename Set>
void put_camera(const saved::Camera& camera, Set& set) {
    *set.mutable_eye_m() = camera.eye_m();
    *set.mutable_target_m() = camera.target_m();
    set.set_fov_rad(camera.fov_rad());
}

saved::Camera saved_camera(const Camera& camera) {
    saved::Camera out;
    write_numbers(out, "eye_m", {&camera.eye[0], 3});
    write_numbers(out, "target_m", {&camera.target[0], 3});
    out.set_fov_rad(camera.fov_rad);
    return out;
}

class Writer {
public:
    Writer(const Scene& scene, ProfileTexts& texts, saved::Show& show) : scene_(scene), texts_(texts), show_(show) {}

    // In the scene file, of the light that has the name now; of another the same name.
    std::string scene_name_of(const std::string& name) const {
        const Light* light = find_light(scene_, name);
        return light == nullptr || light->seed < 0 ? name
                                                   : scene_.asset->lights[static_cast<std::size_t>(light->seed)].name;
    }
    // light: Light or PresetLight.
    template <typename AnyLight>
    void put_light(const AnyLight& light, saved::Light& out) {
        out.set_name(light.name);
        for (const LightRow& light_row : light_rows())
            write_numbers(out, row_of(light_row.property).field, light_row, numbers_of(light, light_row));
        if (light.gel) out.set_gel(light.gel->name);
        if (light.opening) out.set_opening(print_opening(*light.opening));
        const LightSeed* own = seed_named(*scene_.asset, scene_name_of(light.name));
        if ((own == nullptr || own->profile != light.profile) && light.profile->gobos)
            own = seed_with(*scene_.asset, light.profile);  // a photometric file would not have its wheel
        if (own != nullptr && own->profile == light.profile) {
            out.set_scene_profile(own->name);
            return;
        }
        const ProfileTexts::Text& text = texts_.of(light.profile);
        out.set_profile(text.key);
        if (!written_.insert(text.key).second) return;
        saved::Profile& profile = *show_.add_profiles();
        profile.set_key(text.key);
        profile.set_name(light.profile->name);
        profile.set_photometry(text.lm63);
        profile.set_uploaded(light.profile->uploaded);
    }

private:
    const Scene& scene_;
    ProfileTexts& texts_;
    saved::Show& show_;
    std::set<std::string> written_;
};

// Carries out commands on a scene and keeps their refusals as warnings.
class Restorer {
public:
    Restorer(const saved::Show& show, Scene scene, std::chrono::milliseconds profile_time)
        : show_(show), scene_(std::move(scene)) {
        // Those of lights first, with all that lighting needs of them.
        std::set<std::string> shown;
        for (const saved::Light& light : show.lights()) shown.insert(light.profile());
        const auto until = std::chrono::steady_clock::now() + profile_time;
        for (const bool lights : {true, false}) {
            for (const saved::Profile& profile : show.profiles()) {
                if (shown.contains(profile.key()) != lights) continue;
                if (std::chrono::steady_clock::now() >= until) {
                    warn("the profile '" + profile.name() + "' is left out: those before it took " +
                         std::to_string(profile_time.count()) + " ms to read");
                    continue;
                }
                const auto read = make_profile(profile.name(), profile.photometry());
                if (!read) {
                    warn("the profile '" + profile.name() + "' cannot be read: " + read.error().text());
                    continue;
                }
                auto own = std::make_shared<Profile>(**read);
                own->uploaded = profile.uploaded();
                if (lights) tables_of(*own);
                profiles_[profile.key()] = std::move(own);
            }
        }
    }
    void warn(std::string text) { warnings_.push_back(std::move(text)); }
    void run(Scene& scene, const v1::Command& command, const Loaded& loaded, const std::string& what) {
        const auto applied = apply(scene, command, loaded);
        if (!applied) warn(what + " is not restored: " + applied.error().text());
    }
    void run(const v1::Command& command, const std::string& what) { run(scene_, command, {}, what); }

    std::shared_ptr<const Profile> profile_of(const saved::Light& light) const {
        if (light.has_scene_profile()) {
            const LightSeed* own = seed_named(*scene_.asset, light.scene_profile());
            return own == nullptr ? nullptr : own->profile;
        }
        const auto found = profiles_.find(light.profile());
        return found == profiles_.end() ? nullptr : found->second;
    }
    void fill(v1::SetLight& set, const saved::Light& light, const std::string& what) {
        set.set_name(light.name());
        if (light.gel().empty() || find_gel(scene_.gels.get(), light.gel()))
            set.set_gel(light.gel());
        else
            warn("the gel of " + what + " is not restored: there is no gel '" + light.gel() + "'");
        if (!light.opening().empty()) set.set_opening(light.opening());
        for (const LightRow& light_row : light_rows()) copy_numbers(light, set, row_of(light_row.property).field);
    }

    // After the lights: how large a picture may be depends on how many there are.
    void restore_size() {
        v1::Command size;
        size.mutable_set_size()->set_width_px(show_.size_px_size() == 2 ? show_.size_px(0) : 0);
        size.mutable_set_size()->set_height_px(show_.size_px_size() == 2 ? show_.size_px(1) : 0);
        run(size, "the size");
    }
    void restore_technique() {
        v1::Command technique;
        technique.mutable_set_technique()->set_technique(show_.technique());
        technique.mutable_set_technique()->set_samples(show_.samples());
        run(technique, "the technique");
    }
    void restore_presets() {
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
    // empty: the scene without lights.
    std::shared_ptr<const Preset> content_of(const Scene& empty,
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
    void restore_cue_options() {
        if (const auto active = parse_cue_number(show_.cue_active()); active && show_.has_cue_options()) {
            scene_.cue_active = *active;
            scene_.cue_next = 0;
        }
        if (!show_.has_cue_options()) return;
        v1::Command options;
        *options.mutable_set_cue_options() = show_.cue_options();
        run(options, "how cues are played");
    }
    void add(Scene& scene, const saved::Light& light, const std::string& what) {
        const Loaded loaded{.profile = profile_of(light)};
        if (!loaded.profile) {
            warn(what + " is not restored: " +
                 (light.has_scene_profile() ? "the scene file does not have it any more" : "its profile is missing"));
            return;
        }
        v1::Command command;
        fill(*command.mutable_add_light()->mutable_light(), light, what);
        if (light.has_multiplier()) command.mutable_add_light()->set_multiplier(light.multiplier());
        run(scene, command, loaded, what);
    }
    // Before anything names a light.
    void restore_names() {
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
    void restore_lights() {
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
        for (const v1::Group& group : show_.groups()) {
            v1::Command command;
            command.mutable_set_group()->set_name(group.name());
            *command.mutable_set_group()->mutable_lights() = group.lights();
            run(command, "group '" + group.name() + "'");
        }
    }
    void restore_camera() {
        v1::Command command;
        put_camera(show_.camera(), *command.mutable_set_camera());
        run(command, "the camera");
        v1::Command exposure;
        exposure.mutable_set_exposure()->set_ev100(show_.exposure_ev100());
        exposure.mutable_set_exposure()->set_automatic(show_.exposure_auto());
        run(exposure, "the exposure");
        v1::Command light;
        light.mutable_set_view()->set_light(show_.view_light());
        run(light, "the view's light");
        v1::Command only;
        only.mutable_set_view()->set_only(show_.view_only());
        run(only, "the only light of the view");
    }
    // Of the view of this name; written before there was one, the defaults stay.
    void restore_false_color(const char* name, const v1::FalseColor& color) {
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
    void restore_haze() {
        if (!show_.has_haze()) return;
        v1::Command command;
        v1::SetHaze& set = *command.mutable_set_haze();
        set.set_extinction_per_m(show_.haze().extinction_per_m());
        set.set_albedo(show_.haze().albedo());
        set.set_g(show_.haze().g());
        set.set_layer_height_m(show_.haze().layer_height_m());
        run(command, "the haze");
    }
    void restore_look() {
        if (show_.has_illuminance()) restore_false_color("illuminance", show_.illuminance());
        if (show_.has_luminance()) restore_false_color("luminance", show_.luminance());
        v1::Command compare;
        compare.mutable_set_view()->set_compare(show_.view_compare());
        run(compare, "what the view compares with");
        if (!show_.has_look()) return;
        v1::Command look;
        look.mutable_set_look()->set_tone(show_.look().tone());
        look.mutable_set_look()->set_white_k(show_.look().white_k());
        look.mutable_set_look()->set_white_duv(show_.look().white_duv());
        run(look, "the look");
    }
    void restore_saved_views() {
        for (const saved::SavedView& view : show_.saved_views()) {
            v1::Command command;
            v1::SaveView& save = *command.mutable_save_view();
            save.set_name(view.name());
            put_camera(view.camera(), save);
            run(command, "view '" + view.name() + "'");
        }
    }
    // After the saved views: a grid may name one.
    void restore_grids() {
        for (const v1::Grid& grid : show_.grids()) {
            v1::Command command;
            *command.mutable_set_grid()->mutable_grid() = grid;
            run(command, "grid '" + grid.name() + "'");
        }
        for (const v1::Observer& observer : show_.observers()) {
            v1::Command command;
            *command.mutable_set_observer()->mutable_observer() = observer;
            run(command, "observer '" + observer.name() + "'");
        }
    }
    void restore_settings() {
        v1::Command view;
        view.mutable_set_view()->set_view(show_.view());
        view.mutable_set_view()->set_gain(show_.view_gain());
        view.mutable_set_view()->set_work_light(!show_.no_work_light());
        run(view, "the view");
        v1::Command master;
        master.mutable_set_master()->set_ratio(show_.master_ratio());
        run(master, "the master");
        if (show_.has_patch()) {
            v1::Command patch;
            *patch.mutable_set_patch() = show_.patch();
            run(patch, "the patch");
        }
        if (show_.has_surfaces()) {
            v1::Command surfaces;
            *surfaces.mutable_set_surfaces() = show_.surfaces();
            run(surfaces, "the map of the fader boxes");
        }
    }
    RestoredShow result() { return {std::move(scene_), std::move(warnings_)}; }

private:
    const saved::Show& show_;
    Scene scene_;
    std::map<std::string, std::shared_ptr<const Profile>> profiles_;
    std::vector<std::string> warnings_;
};

}  // namespace

const ProfileTexts::Text& ProfileTexts::of(const std::shared_ptr<const Profile>& profile) {
    auto [entry, fresh] = texts_.try_emplace(profile);
    entry->second.used = true;
    if (fresh) {
        std::string lm63 = ies::write_lm63(profile->photometry);
        entry->second.text = {hash_of(profile->name + '\0' + lm63), std::move(lm63)};
    }
    return entry->second.text;
}

void ProfileTexts::forget_unused() {
    for (auto entry = texts_.begin(); entry != texts_.end();)
        entry = std::exchange(entry->second.used, false) ? std::next(entry) : texts_.erase(entry);
}

saved::Show show_of(const Scene& scene, ProfileTexts& texts) {
    saved::Show show;
    Writer writer(scene, texts, show);
    show.set_version(kSavedVersion);
    show.set_scene_rev(scene.scene_rev);
    show.set_scene(lasting_name(scene.asset->name));
    show.set_scene_scale(scene.asset->scale);
    show.set_technique(technique_name(scene.technique));
    show.set_samples(scene.samples);
    show.add_size_px(static_cast<std::uint32_t>(scene.width_px));
    show.add_size_px(static_cast<std::uint32_t>(scene.height_px));
    show.set_view(view_name(scene.view));
    show.set_view_gain(scene.view_gain);
    show.set_view_light(scene.view_light);
    put_false_color(scene.false_color[0], false, *show.mutable_illuminance());
    put_false_color(scene.false_color[1], false, *show.mutable_luminance());
    for (v1::FalseColor* color : {show.mutable_illuminance(), show.mutable_luminance()}) color->clear_ticks();
    put_look(scene.look, *show.mutable_look());
    put_haze(scene.haze, *show.mutable_haze());
    show.set_view_only(scene.view_only);
    show.set_view_compare(scene.view_compare);
    show.set_no_work_light(!scene.work_light);
    show.set_exposure_ev100(scene.exposure_ev100);
    show.set_exposure_auto(scene.exposure_auto);
    show.set_master_ratio(scene.master_ratio);
    *show.mutable_camera() = saved_camera(scene.camera);
    for (const auto& [name, camera] : scene.saved_views) {
        saved::SavedView& view = *show.add_saved_views();
        view.set_name(name);
        *view.mutable_camera() = saved_camera(camera);
    }
    for (const auto& [name, grid] : scene.grids) *show.add_grids() = *grid;
    for (const auto& [name, observer] : scene.observers) *show.add_observers() = *observer;
    for (const Light& light : scene.lights) {
        saved::Light& out = *show.add_lights();
        writer.put_light(light, out);
        if (const std::string own = writer.scene_name_of(light.name); own != light.name) out.set_scene_name(own);
        if (light.seed < 0 && light.multiplier != 1.0) out.set_multiplier(light.multiplier);
    }
    for (std::string& name : removed_lights(scene)) show.add_removed_lights(std::move(name));
    for (const auto& [name, lights] : scene.groups) {
        v1::Group& group = *show.add_groups();
        group.set_name(name);
        group.mutable_lights()->Add(lights.begin(), lights.end());
    }
    for (const auto& [name, lights] : scene.presets) {
        saved::Preset& preset = *show.add_presets();
        preset.set_name(name);
        for (const PresetLight& light : *lights) writer.put_light(light, *preset.add_lights());
    }
    show.set_recalled(scene.recalled);
    if (scene.cues)
        for (const auto& cue : *scene.cues) {
            saved::Cue& out = *show.add_cues();
            put_cue(*cue, *out.mutable_cue());
            const auto shared =
                std::ranges::find_if(scene.presets, [&](const auto& preset) { return preset.second == cue->content; });
            if (shared != scene.presets.end()) {
                out.set_preset(shared->first);
                continue;
            }
            for (const PresetLight& light : *cue->content) writer.put_light(light, *out.add_lights());
        }
    v1::SetCueOptions& cue_options = *show.mutable_cue_options();
    cue_options.set_guard_s(scene.cue_options.guard_s);
    cue_options.set_back_s(scene.cue_options.back_s);
    cue_options.set_timecode(timecode_source_name(scene.cue_options.timecode));
    cue_options.set_freewheel_s(scene.cue_options.freewheel_s);
    if (scene.cue_next != 0) cue_options.set_next(print_cue_number(scene.cue_next));
    show.set_cue_active(print_cue_number(scene.cue_active));
    const v1::ShowFile file = show_file(scene);
    show.set_show_name(file.name());
    show.set_show_unsaved(file.unsaved());
    if (scene.patch) *show.mutable_patch() = *scene.patch;
    if (scene.surfaces) *show.mutable_surfaces() = *scene.surfaces;
    texts.forget_unused();
    return show;
}

Result<saved::Show> read_show(std::string_view json) {
    if (json.size() > kMaxSavedBytes)
        return Error{"too_large", "", std::to_string(json.size()) + " bytes", "a saved show has at most 256 MiB"};
    saved::Show show;
    google::protobuf::util::JsonParseOptions options;
    options.ignore_unknown_fields = true;
    const auto status = google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &show, options);
    if (!status.ok()) {
        const std::string why(status.message());  // the lines after the first show the place
        return Error{"bad_state", "", "", "It is not a saved show: " + why.substr(0, why.find('\n'))};
    }
    if (show.version() == 0) return Error{"bad_state", "version", "0", "It is not a saved show."};
    if (show.version() > kSavedVersion) {
        return Error{"unsupported", "version", std::to_string(show.version()),
                     "It was saved by a later version of the program."};
    }
    return show;
}

std::string write_show(const saved::Show& show) {
    google::protobuf::util::JsonPrintOptions options;
    options.add_whitespace = true;
    options.preserve_proto_field_names = true;
    options.always_print_primitive_fields = true;
    std::string json;
    if (!google::protobuf::util::MessageToJsonString(show, &json, options).ok()) json.clear();
    return json;
}

Revision revision_after(const saved::Show& show) {
    const Revision step = show.complete() ? 1 : kUnsavedRevisions;
    return show.scene_rev() >= kMaxSavedRevision ? 1 : show.scene_rev() + step;
}

bool is_scene_of(const saved::Show& show, const std::string& scene) {
    return scene == show.scene() || lasting_name(scene) == show.scene();
}

RestoredShow restore_show(const saved::Show& show, std::shared_ptr<const SceneAsset> asset, bool same_scene,
                          std::chrono::milliseconds profile_time, std::shared_ptr<const Gels> gels) {
    Scene scene = scene_of(std::move(asset), revision_after(show));
    scene.gels = std::move(gels);
    Restorer restorer(show, std::move(scene), profile_time);
    restorer.restore_technique();
    if (same_scene) restorer.restore_names();
    restorer.restore_presets();
    restorer.restore_cue_options();
    if (same_scene) {
        restorer.restore_lights();
        restorer.restore_camera();
        restorer.restore_saved_views();
        restorer.restore_grids();
    }
    restorer.restore_size();
    restorer.restore_haze();
    restorer.restore_look();
    restorer.restore_settings();
    RestoredShow restored = restorer.result();
    restored.scene.show_name = same_scene ? show.show_name() : "";
    restored.scene.show_rev = show.show_unsaved() || !same_scene ? 0 : restored.scene.scene_rev;
    return restored;
}

}  // namespace gonio
