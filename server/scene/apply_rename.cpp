#include "server/scene/apply_rename.h"

#include <algorithm>
#include <map>

#include "protocol/schema/light.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/cue.h"

namespace gonio {
namespace {

// Result: the rows with the light's new name as their target, or nullptr where none has either name: rows that were
// there for the new one drive the light from now on, and undo must know them.
template <typename Rows>
std::shared_ptr<const Rows> followed(const std::shared_ptr<const Rows>& rows, const std::string& name,
                                     const std::string& new_name) {
    const auto names = [&](const auto& row) { return row.target() == name || row.target() == new_name; };
    if (!rows || std::ranges::none_of(rows->rows(), names)) return nullptr;
    auto changed = std::make_shared<Rows>(*rows);
    for (auto& row : *changed->mutable_rows())
        if (row.target() == name) row.set_target(new_name);
    return changed;
}

// What a preset or a cue keeps of a light that is gone and had the new name makes place for what it keeps of this one.
// Result: what it keeps now; nullptr where it has neither name, as in followed().
std::shared_ptr<const Preset> followed(const Preset& preset, const std::string& what, const std::string& name,
                                       const std::string& new_name, std::vector<std::string>& warnings) {
    const auto keeps = [&](const std::string& light) {
        return std::ranges::find(preset, light, &PresetLight::name) != preset.end();
    };
    const bool has = keeps(name), has_another = keeps(new_name);
    if (!has && !has_another) return nullptr;
    Preset changed = preset;
    if (has && std::erase_if(changed, [&](const PresetLight& kept) { return kept.name == new_name; }) > 0)
        warnings.push_back(what + " kept another light '" + new_name + "', which it forgets");
    for (PresetLight& kept : changed)
        if (kept.name == name) kept.name = new_name;
    return std::make_shared<const Preset>(std::move(changed));
}

void follow_presets(Scene& scene, const std::string& name, const std::string& new_name,
                    std::vector<std::string>& warnings) {
    std::map<const Preset*, std::shared_ptr<const Preset>> contents;  // of cues that share one, and presets with them
    for (auto& [preset_name, preset] : scene.presets) {
        auto changed = followed(*preset, "preset '" + preset_name + "'", name, new_name, warnings);
        if (!changed) continue;
        contents[preset.get()] = changed;
        preset = std::move(changed);
        scene.presets_rev = scene.scene_rev + 1;
    }
    if (!scene.cues) return;
    auto cues = std::make_shared<CueList>(*scene.cues);
    bool any = false;
    for (auto& cue : *cues) {
        auto [content, fresh] = contents.try_emplace(cue->content.get());
        if (fresh)
            content->second = followed(*cue->content, "cue " + print_cue_number(cue->number), name, new_name, warnings);
        if (!content->second) continue;
        auto changed = std::make_shared<Cue>(*cue);
        changed->content = content->second;
        cue = std::move(changed);
        any = true;
    }
    if (!any) return;
    scene.cues = std::move(cues);
    scene.cues_rev = scene.scene_rev + 1;
}

}  // namespace

void rename_light(Scene& scene, const v1::RenameLight& rename, std::vector<std::string>& warnings) {
    Light* light = find_light(scene, rename.name());
    if (light == nullptr) refuse("not_found", "rename_light.name", rename.name(), "there is no light of this name");
    const std::string name = checked_name(rename.new_name(), "rename_light.new_name");
    if (name == light->name) return;
    if (is_taken(scene, name))
        refuse("already_exists", "rename_light.new_name", name, "a light or group of this name exists");
    give_name(scene, *light, name, warnings);
}

void give_name(Scene& scene, Light& light, const std::string& new_name, std::vector<std::string>& warnings) {
    const std::string name = light.name;
    const Revision now = scene.scene_rev + 1;
    light.name = new_name;
    light.name_rev = scene.lights_rev = now;
    for (auto& [group, lights] : scene.groups) {
        const auto at = std::ranges::find(lights, name);
        if (at == lights.end()) continue;
        *at = new_name;
        scene.groups_rev = now;
    }
    if (scene.view_light == name) change(scene, scene.view_light, new_name, scene.view_rev);
    if (scene.view_only == name) change(scene, scene.view_only, new_name, scene.view_rev);
    follow_presets(scene, name, new_name, warnings);
    if (auto rows = followed(scene.patch, name, new_name)) change(scene, scene.patch, rows, scene.patch_rev);
    if (auto rows = followed(scene.surfaces, name, new_name)) change(scene, scene.surfaces, rows, scene.surfaces_rev);
}

}  // namespace gonio
