#include "server/scene/apply_rename.h"

#include <algorithm>

#include "server/scene/apply_checks.h"

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

// What a preset keeps of a light that is gone and had the new name makes place for what it keeps of this one.
void follow_presets(Scene& scene, const std::string& name, const std::string& new_name,
                    std::vector<std::string>& warnings) {
    for (auto& [preset_name, preset] : scene.presets) {
        const auto keeps = [&kept_lights = *preset](const std::string& light) {
            return std::ranges::find(kept_lights, light, &PresetLight::name) != kept_lights.end();
        };
        const bool has = keeps(name), has_another = keeps(new_name);
        if (!has && !has_another) continue;  // as in followed()
        Preset changed = *preset;
        if (has && std::erase_if(changed, [&](const PresetLight& kept) { return kept.name == new_name; }) > 0)
            warnings.push_back("preset '" + preset_name + "' kept another light '" + new_name + "', which it forgets");
        for (PresetLight& kept : changed)
            if (kept.name == name) kept.name = new_name;
        preset = std::make_shared<const Preset>(std::move(changed));
        scene.presets_rev = scene.scene_rev + 1;
    }
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
