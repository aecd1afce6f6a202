#include "server/show/saved_show.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>

#include "ies/writers.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/schema/upload_name.h"
#include "protocol/schema/view.pb.h"
#include "server/assets/assets.h"
#include "server/base/sha256.h"
#include "server/scene/apply.h"
#include "server/scene/apply_haze.h"
#include "server/scene/apply_view.h"
#include "server/scene/cue.h"
#include "server/scene/false_color.h"
#include "server/scene/imported.h"
#include "server/scene/light_tables.h"
#include "server/scene/light_values.h"
#include "server/scene/opening.h"
#include "server/scene/preset.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/show/saved_imported.h"
#include "server/show/saved_profile.h"
#include "server/show/show_restorer.h"

namespace gonio {
namespace {

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

// Result: the lights of the scene file that are not in the scene any more.
std::vector<std::string> removed_lights(const Scene& scene) {
    std::vector<std::string> removed;
    std::set<int> there;
    for (const Light& light : scene.lights) there.insert(light.seed);
    for (const LightSeed& seed : scene.asset->lights)
        if (!there.contains(static_cast<int>(&seed - scene.asset->lights.data()))) removed.push_back(seed.name);
    return removed;
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
    Writer(const Scene& scene, ProfileTexts& texts, bool by_content, saved::Show& show)
        : scene_(scene), texts_(texts), by_content_(by_content), show_(show) {}

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
        if (by_content_) {
            // A wheel of the scene's file both sides have: it is named as there, not hashed.
            const LightSeed* same = light.profile->gobos ? seed_with(*scene_.asset, light.profile) : nullptr;
            if (same != nullptr) return out.set_scene_profile(same->name);
            out.set_profile(texts_.hash_of(light.profile));
            return;
        }
        const LightSeed* own = seed_named(*scene_.asset, scene_name_of(light.name));
        if ((own == nullptr || own->profile != light.profile) && light.profile->gobos)
            own = seed_with(*scene_.asset, light.profile);  // a wheel takes much room beside its photometry
        if (own != nullptr && own->profile == light.profile) {
            out.set_scene_profile(own->name);
            return;
        }
        const ProfileTexts::Text& text = texts_.of(light.profile);
        out.set_profile(text.key);
        if (!written_.insert(text.key).second) return;
        texts_.put(light.profile, *show_.add_profiles());
    }

private:
    const Scene& scene_;
    ProfileTexts& texts_;
    bool by_content_;
    saved::Show& show_;
    std::set<std::string> written_;
};

void put_lights(const Scene& scene, Writer& writer, Revision since, saved::Show& show) {
    for (const Light& light : scene.lights) {
        if (newest_rev(light) <= since) continue;
        saved::Light& out = *show.add_lights();
        writer.put_light(light, out);
        if (std::string own = writer.scene_name_of(light.name); own != light.name) out.set_scene_name(std::move(own));
        out.set_missing(light.missing);
        if (light.imported >= 0) out.set_imported(static_cast<std::uint32_t>(light.imported));
        if (light.seed >= 0) continue;
        if (light.multiplier != 1.0) out.set_multiplier(light.multiplier);
        out.set_sun(light.sun);
        const glm::dquat& mount = light.world_from_mount;
        if (mount != glm::dquat(1.0, 0.0, 0.0, 0.0))
            for (const double part : {mount.x, mount.y, mount.z, mount.w}) out.add_mount_xyzw(part);
    }
}

void put_presets(const Scene& scene, Writer& writer, saved::Show& show) {
    for (const auto& [name, lights] : scene.presets) {
        saved::Preset& preset = *show.add_presets();
        preset.set_name(name);
        for (const PresetLight& light : *lights) writer.put_light(light, *preset.add_lights());
    }
    show.set_recalled(scene.recalled);
    if (!scene.cues) return;
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
}

void put_view(const Scene& scene, saved::Show& show) {
    show.set_view(view_name(scene.view));
    show.set_view_gain(scene.view_gain);
    show.set_view_light(scene.view_light);
    put_false_color(scene.false_color[0], false, *show.mutable_illuminance());
    put_false_color(scene.false_color[1], false, *show.mutable_luminance());
    for (v1::FalseColor* color : {show.mutable_illuminance(), show.mutable_luminance()}) color->clear_ticks();
    show.set_view_only(scene.view_only);
    show.set_view_compare(scene.view_compare);
    show.set_no_work_light(!scene.work_light);
}

void put_cue_play(const Scene& scene, saved::Show& show) {
    v1::SetCueOptions& cue_options = *show.mutable_cue_options();
    cue_options.set_guard_s(scene.cue_options.guard_s);
    cue_options.set_back_s(scene.cue_options.back_s);
    cue_options.set_timecode(timecode_source_name(scene.cue_options.timecode));
    cue_options.set_freewheel_s(scene.cue_options.freewheel_s);
    if (scene.cue_next != 0) cue_options.set_next(print_cue_number(scene.cue_next));
    show.set_cue_active(print_cue_number(scene.cue_active));
}

// Parts that are a few fields.
struct SmallPart {
    ShowPart part;
    void (*put)(const Scene& scene, saved::Show& show);
};
constexpr SmallPart kSmallParts[] = {
    {ShowPart::scene,
     [](const Scene& scene, saved::Show& show) {
         show.set_scene(lasting_name(scene.asset->name));
         show.set_scene_scale(scene.asset->scale);
         if (scene.asset->imported) show.set_scene_universe_offset(scene.asset->imported->universe_offset);
     }},
    {ShowPart::groups,
     [](const Scene& scene, saved::Show& show) {
         for (const auto& [name, lights] : scene.groups) {
             v1::Group& group = *show.add_groups();
             group.set_name(name);
             group.mutable_lights()->Add(lights.begin(), lights.end());
         }
     }},
    {ShowPart::cue_play, put_cue_play},
    {ShowPart::camera,
     [](const Scene& scene, saved::Show& show) { *show.mutable_camera() = saved_camera(scene.camera); }},
    {ShowPart::saved_views,
     [](const Scene& scene, saved::Show& show) {
         for (const auto& [name, camera] : scene.saved_views) {
             saved::SavedView& view = *show.add_saved_views();
             view.set_name(name);
             *view.mutable_camera() = saved_camera(camera);
         }
     }},
    {ShowPart::grids,
     [](const Scene& scene, saved::Show& show) {
         for (const auto& [name, grid] : scene.grids) *show.add_grids() = *grid;
     }},
    {ShowPart::observers,
     [](const Scene& scene, saved::Show& show) {
         for (const auto& [name, observer] : scene.observers) *show.add_observers() = *observer;
     }},
    {ShowPart::exposure,
     [](const Scene& scene, saved::Show& show) {
         show.set_exposure_ev100(scene.exposure_ev100);
         show.set_exposure_auto(scene.exposure_auto);
     }},
    {ShowPart::view, put_view},
    {ShowPart::look, [](const Scene& scene, saved::Show& show) { put_look(scene.look, *show.mutable_look()); }},
    {ShowPart::haze, [](const Scene& scene, saved::Show& show) { put_haze(scene.haze, *show.mutable_haze()); }},
    {ShowPart::master, [](const Scene& scene, saved::Show& show) { show.set_master_ratio(scene.master_ratio); }},
    {ShowPart::technique,
     [](const Scene& scene, saved::Show& show) {
         show.set_technique(technique_name(scene.technique));
         show.set_samples(scene.samples);
     }},
    {ShowPart::size,
     [](const Scene& scene, saved::Show& show) {
         show.add_size_px(static_cast<std::uint32_t>(scene.width_px));
         show.add_size_px(static_cast<std::uint32_t>(scene.height_px));
     }},
    {ShowPart::patch,
     [](const Scene& scene, saved::Show& show) {
         if (scene.patch)
             *show.mutable_patch() = *scene.patch;
         else if (scene.asset->patch)  // somebody chose the default patch instead of the file's
             show.mutable_patch()->set_use_default(true);
     }},
    {ShowPart::surfaces,
     [](const Scene& scene, saved::Show& show) {
         if (scene.surfaces) *show.mutable_surfaces() = *scene.surfaces;
     }},
    {ShowPart::file,
     [](const Scene& scene, saved::Show& show) {
         const v1::ShowFile file = show_file(scene);
         show.set_show_name(file.name());
         show.set_show_unsaved(file.unsaved());
     }},
};

std::string photometric_content(const Profile& profile) {
    return profile.name + '\0' + ies::write_lm63(profile.photometry);
}

}  // namespace

const ProfileTexts::Text& ProfileTexts::of(const std::shared_ptr<const Profile>& profile) {
    Entry& entry = texts_[profile];
    entry.used = true;
    if (!entry.text.content) {
        std::string content = photometric_content(*profile);
        if (has_gate(*profile)) {
            saved::Profile gate;
            put_gate(*profile, gate);
            content += '\0' + gate.SerializeAsString();
        }
        entry.text.key = sha256(content);
        entry.text.content = std::make_shared<const std::string>(std::move(content));
    }
    return entry.text;
}

const std::string& ProfileTexts::hash_of(const std::shared_ptr<const Profile>& profile) {
    if (!has_gate(*profile)) return of(profile).key;
    Entry& entry = texts_[profile];
    entry.used = true;
    if (entry.hash.empty()) entry.hash = sha256(photometric_content(*profile) + '\0' + gate_hash(*profile));
    return entry.hash;
}

void ProfileTexts::put(const std::shared_ptr<const Profile>& profile, saved::Profile& saved) {
    const Text& text = of(profile);
    saved.set_key(text.key);
    saved.set_name(profile->name);
    const std::string rest = text.content->substr(profile->name.size() + 1);
    saved.set_photometry(rest.substr(0, rest.find('\0')));
    saved.set_uploaded(profile->uploaded);
    put_gate(*profile, saved);
}

std::map<std::string, std::shared_ptr<const std::string>> ProfileTexts::known() const {
    std::map<std::string, std::shared_ptr<const std::string>> known;
    for (const auto& [profile, entry] : texts_)
        if (entry.text.content) known[entry.text.key] = entry.text.content;
    return known;
}

void ProfileTexts::forget_unused() {
    for (auto entry = texts_.begin(); entry != texts_.end();)
        entry = std::exchange(entry->second.used, false) ? std::next(entry) : texts_.erase(entry);
}

void ProfileTexts::forget_gone() {
    std::erase_if(texts_, [](const auto& entry) { return entry.first.use_count() == 1; });
}

saved::Show show_of(const Scene& scene, ProfileTexts& texts) {
    ShowParts all;
    all.set();
    saved::Show show = show_of(scene, texts, all, 0);
    texts.forget_unused();
    return show;
}

saved::Show show_of(const Scene& scene, ProfileTexts& texts, const ShowParts& parts, Revision values_since,
                    bool by_content) {
    saved::Show show;
    Writer writer(scene, texts, by_content, show);
    show.set_version(kSavedVersion);
    show.set_scene_rev(scene.scene_rev);
    for (const SmallPart& part : kSmallParts)
        if (parts.has(part.part)) part.put(scene, show);
    if (parts.has(ShowPart::lights)) {
        put_lights(scene, writer, 0, show);
        for (std::string& name : removed_lights(scene)) show.add_removed_lights(std::move(name));
        put_imported(scene, show);
    } else if (parts.has(ShowPart::values)) {
        put_lights(scene, writer, values_since, show);
    }
    if (parts.has(ShowPart::presets)) put_presets(scene, writer, show);
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
    if (same_scene) scene.groups.clear();  // the show has its own, also of those that its file brought
    ShowRestorer restorer(show, std::move(scene));
    restorer.read_profiles(profile_time);
    restorer.restore_technique();
    if (same_scene) restorer.restore_names();
    restorer.restore_presets();
    restorer.restore_cue_options();
    if (same_scene) {
        restorer.restore_lights();
        restore_imported(show, restorer.scene());
        restorer.restore_groups();
        restorer.restore_camera();
        restorer.restore_exposure();
        restorer.restore_view_lights();
        restorer.restore_saved_views();
        restorer.restore_grids();
        restorer.restore_observers();
    }
    restorer.restore_size();
    restorer.restore_haze();
    restorer.restore_false_colors();
    restorer.restore_look();
    restorer.restore_view();
    restorer.restore_master();
    restorer.restore_patch();
    restorer.restore_surfaces();
    RestoredShow restored{std::move(restorer.scene()), std::move(restorer.warnings())};
    restored.scene.show_name = same_scene ? show.show_name() : "";
    restored.scene.show_rev = show.show_unsaved() || !same_scene ? 0 : restored.scene.scene_rev;
    return restored;
}

}  // namespace gonio
