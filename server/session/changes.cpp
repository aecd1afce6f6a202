#include "server/session/changes.h"

#include <algorithm>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/scene.pb.h"
#include "server/scene/cue.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// Of a light of this name, where there is one. set: which properties; null: all of them.
void touch(const Scene& scene, const std::string& name, const v1::SetLight* set,
           std::vector<TouchedProperty>& touched) {
    const Light* light = find_light(scene, name);
    if (light == nullptr) return;
    const std::string path = "lights." + name + ".";
    const auto add = [&](std::string property, Revision rev) {
        if (touched.empty() || touched.back().path != property) touched.push_back({std::move(property), rev});
    };
    for (const LightRow& light_row : light_rows()) {
        const PropertyRow& row = row_of(light_row.property);
        const bool turns = light_row.stale == &Light::aim_rev;
        const bool said = set == nullptr || has_numbers(*set, row.field) || (turns && set->aim_size() > 0);
        if (said) add(path + std::string(turns ? "aim" : row.state_field), light->*light_row.stale);
    }
    if (set == nullptr || set->has_profile()) add(path + "profile", light->profile_rev);
    if (set == nullptr || set->has_gel()) add(path + "gel", light->level_rev);
    if (set == nullptr || set->has_opening()) add(path + "opening", light->profile_rev);
}

// A light that went, and what named it.
void touch_removed(const Scene& scene, const std::string& name, std::vector<TouchedProperty>& touched) {
    touched.push_back({"lights." + name, scene.lights_rev});
    touch(scene, name, nullptr, touched);
    for (const auto& [group, lights] : scene.groups)
        if (std::ranges::find(lights, name) != lights.end()) touched.push_back({"groups." + group, scene.groups_rev});
    touched.push_back({"view", scene.view_rev});  // shows another light where it showed this one
}

// A light, or every light of a group.
void touch_named(const Scene& scene, const std::string& name, const v1::SetLight& set,
                 std::vector<TouchedProperty>& touched) {
    touch(scene, name, &set, touched);
    const auto group = scene.groups.find(name);
    if (group == scene.groups.end()) return;
    touched.push_back({"groups." + name, scene.groups_rev});
    for (const std::string& member : group->second) touch(scene, member, &set, touched);
}

void touch_added(const Scene& scene, const std::string& name, std::vector<TouchedProperty>& touched) {
    touched.push_back({"lights." + name, scene.lights_rev});
    touch(scene, name, nullptr, touched);
}

std::string cue_path(const std::string& number) {
    return "cues." + print_cue_number(parse_cue_number(number).value_or(0));
}

template <typename Rows>
bool names_light(const std::shared_ptr<const Rows>& rows, const std::string& name) {
    return rows && std::ranges::any_of(rows->rows(), [&](const auto& row) { return row.target() == name; });
}

}  // namespace

bool replaces_scene(const v1::Command& command) {
    return (command.has_load_scene() && !command.load_scene().dry_run()) || command.has_open_show();
}

std::vector<TouchedProperty> touched_properties(const Scene& scene, const v1::Command& command) {
    std::vector<TouchedProperty> touched;
    switch (command.command_case()) {
        case v1::Command::kSetLight:
            touch_named(scene, command.set_light().name(), command.set_light(), touched);
            break;
        case v1::Command::kAddLight:
            touch_added(scene, command.add_light().light().name(), touched);
            break;
        case v1::Command::kEditLights: {
            const v1::EditLights& edit = command.edit_lights();
            for (const v1::SetLight& set : edit.set()) touch(scene, set.name(), &set, touched);
            for (const std::string& name : edit.names()) touch_named(scene, name, edit.same(), touched);
            for (const v1::AddLight& add : edit.add()) touch_added(scene, add.light().name(), touched);
            for (const std::string& name : edit.remove()) touch_removed(scene, name, touched);
            break;
        }
        case v1::Command::kRemoveLight:
            touch_removed(scene, command.remove_light().name(), touched);
            break;
        case v1::Command::kRecessLight:  // an edit_lights by then
            break;
        case v1::Command::kRenameLight:
            for (const std::string& name : {command.rename_light().name(), command.rename_light().new_name()}) {
                touched.push_back({"lights." + name, scene.lights_rev});
                for (const auto& [preset_name, preset] : scene.presets)
                    if (std::ranges::find(*preset, name, &PresetLight::name) != preset->end())
                        touched.push_back({"presets." + preset_name, scene.presets_rev});
                if (scene.cues)
                    for (const auto& cue : *scene.cues)
                        if (std::ranges::find(*cue->content, name, &PresetLight::name) != cue->content->end())
                            touched.push_back({"cues." + print_cue_number(cue->number), scene.cues_rev});
                if (names_light(scene.patch, name)) touched.push_back({"patch", scene.patch_rev});
                if (names_light(scene.surfaces, name)) touched.push_back({"surfaces", scene.surfaces_rev});
            }
            break;
        case v1::Command::kRecallPreset: {
            const auto preset = scene.presets.find(command.recall_preset().name());
            if (preset == scene.presets.end()) break;
            touched.push_back({"presets." + preset->first, scene.presets_rev});
            for (const PresetLight& kept : *preset->second) touch(scene, kept.name, nullptr, touched);
            break;
        }
        case v1::Command::kSavePreset:
            return {{"presets." + command.save_preset().name(), scene.presets_rev}};
        case v1::Command::kRemovePreset:
            return {{"presets." + command.remove_preset().name(), scene.presets_rev}};
        case v1::Command::kAddCue:
            return {{cue_path(command.add_cue().number()), scene.cues_rev}};
        case v1::Command::kSetCue:
            return {{cue_path(command.set_cue().number()), scene.cues_rev}};
        case v1::Command::kRemoveCue:
            return {{cue_path(command.remove_cue().number()), scene.cues_rev}};
        case v1::Command::kSetCueOptions:
            return {{"cue_playback", scene.cue_play_rev}};
        case v1::Command::kCueGo:
        case v1::Command::kCueBack:
        case v1::Command::kCueStop:
        case v1::Command::kCueGoto:
        case v1::Command::kCueAssert:
            touched.push_back({"cue_playback", scene.cue_play_rev});
            if (const Cue* cue = find_cue(scene, scene.cue_active))
                for (const PresetLight& kept : *cue->content) touch(scene, kept.name, nullptr, touched);
            break;
        case v1::Command::kLoadScene:
        case v1::Command::kOpenShow:
            return {{"scene", scene.geometry_rev}};
        case v1::Command::kSetTechnique:
            return {{"technique", scene.technique_rev}};
        case v1::Command::kSetView:
            return {{"view", scene.view_rev}};
        case v1::Command::kSetExposure:
            return {{"exposure_ev100", scene.exposure_rev}};
        case v1::Command::kSetLook:
            return {{"look", scene.look_rev}};
        case v1::Command::kSetHaze:
            return {{"haze", scene.haze_rev}};
        case v1::Command::kSetMaster:
            return {{"master_ratio", scene.master_rev}};
        case v1::Command::kSetCamera:
            return {{"camera", scene.camera_rev}};
        case v1::Command::kSaveView:
            return {{"saved_views." + command.save_view().name(), scene.saved_views_rev}};
        case v1::Command::kRecallView:
            return {{"saved_views." + command.recall_view().name(), scene.saved_views_rev},
                    {"camera", scene.camera_rev}};
        case v1::Command::kRemoveView:
            return {{"saved_views." + command.remove_view().name(), scene.saved_views_rev}};
        case v1::Command::kSetGrid:
            return {{"grids." + command.set_grid().grid().name(), scene.grids_rev}};
        case v1::Command::kRemoveGrid:
            return {{"grids." + command.remove_grid().name(), scene.grids_rev}};
        case v1::Command::kSetObserver:
            return {{"observers." + command.set_observer().observer().name(), scene.observers_rev}};
        case v1::Command::kRemoveObserver:
            return {{"observers." + command.remove_observer().name(), scene.observers_rev}};
        case v1::Command::kSetGroup:
            return {{"groups." + command.set_group().name(), scene.groups_rev}};
        case v1::Command::kSetSize:
            return {{"size_px", scene.size_rev}};
        case v1::Command::kSetPatch:
            return {{"patch", scene.patch_rev}};
        case v1::Command::kSetSurfaces:
        case v1::Command::kMapControl:
            return {{"surfaces", scene.surfaces_rev}};
        case v1::Command::kUndo:  // changes nothing that another has changed since
        case v1::Command::kRedo:
        case v1::Command::COMMAND_NOT_SET:
            break;
    }
    return touched;
}

std::optional<Error> Changes::conflict(const Scene& scene, const v1::Command& command, Revision base_rev,
                                       std::uint32_t by) const {
    if (base_rev > scene.scene_rev) {
        return Error{"invalid_argument", "command.base_rev", std::to_string(base_rev),
                     "the scene is at revision " + std::to_string(scene.scene_rev)};
    }
    const auto refused = [&](const std::string& path, const Change& change) -> std::optional<Error> {
        if (change.rev <= base_rev || change.by == by) return std::nullopt;
        return Error{"conflict", path, std::to_string(change.rev),
                     change.by == 0 ? "it was changed after revision " + std::to_string(base_rev)
                                    : "client " + std::to_string(change.by) + " changed it after revision " +
                                          std::to_string(base_rev)};
    };
    if (replaces_scene(command)) {  // replaces everything
        for (const auto& [path, change] : changes_)
            if (auto error = refused(path, change)) return error;
        return refused("scene", floor_);
    }
    for (const TouchedProperty& touched : touched_properties(scene, command)) {
        const auto found = changes_.find(touched.path);
        if (auto error = refused(touched.path, found == changes_.end() ? floor_ : found->second)) return error;
    }
    return std::nullopt;
}

void Changes::note(const Scene& after, Revision before, const v1::Command& command, std::uint32_t by) {
    if (after.scene_rev == before) return;
    if (replaces_scene(command)) return note_replaced(after.scene_rev, by);
    if (command.has_rename_light()) follow(command.rename_light());
    for (const TouchedProperty& touched : touched_properties(after, command))
        if (touched.part_rev > before) note(touched.path, after.scene_rev, by);
}

void Changes::note_replaced(Revision rev, std::uint32_t by) {
    changes_.clear();
    floor_ = {rev, by};
}

void Changes::note(const std::string& path, Revision rev, std::uint32_t by) {
    if (changes_.size() >= kMaxChanges) {
        changes_.clear();
        floor_ = {rev, 0};
    }
    changes_[path] = {rev, by};
}

// What is known of the light's properties goes on under its new name.
void Changes::follow(const v1::RenameLight& rename) {
    const std::string from = "lights." + rename.name() + ".", to = "lights." + rename.new_name() + ".";
    for (auto at = changes_.lower_bound(from); at != changes_.end() && at->first.starts_with(from);) {
        const auto entry = at++;
        const std::string property = entry->first.substr(from.size());
        if (property.find('.') != property.npos) continue;  // of another light, whose name has a dot
        changes_[to + property] = entry->second;
        changes_.erase(entry);
    }
}

}  // namespace gonio
