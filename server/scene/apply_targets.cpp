#include "server/scene/apply_targets.h"

#include <algorithm>

#include "protocol/schema/console.pb.h"
#include "protocol/schema/surface.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/apply_light.h"
#include "server/scene/apply_rename.h"
#include "server/scene/apply_view.h"
#include "server/scene/cue.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

struct Target {
    Scene& scene;
    const EditKey& key;
    const EditValue& value;
};
// Each sets one kind back. Result: why not; empty where it is as it was.
using Setter = std::string (*)(const Target&, std::vector<std::string>& warnings);

std::string full(const char* what, std::size_t most) {
    return std::string("a scene holds at most ") + std::to_string(most) + " " + what;
}

// A light comes back under its id, and so into its place.
std::string set_light_back(const Target& target, std::vector<std::string>&) {
    Scene& scene = target.scene;
    const Light* there = light_of(scene, target.key.light);
    const auto* existing = std::get_if<ExistingLight>(&target.value);
    if (existing == nullptr) {
        if (there != nullptr) remove_light(scene, std::string(there->name));
        return {};
    }
    if (there != nullptr) return {};
    Light light = *existing->light;
    if (is_taken(scene, light.name)) return "a light or group '" + light.name + "' is there now";
    if (scene.lights.size() >= kMaxLights) return full("lights", kMaxLights);
    light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = light.name_rev = scene.lights_rev =
        scene.scene_rev + 1;
    scene.lights.insert(std::ranges::lower_bound(scene.lights, light.id, {}, &Light::id), std::move(light));
    return {};
}

std::string set_name_back(const Target& target, std::vector<std::string>& warnings) {
    Light& light = *light_of(target.scene, target.key.light);
    const auto& name = std::get<std::string>(target.value);
    if (light.name == name) return {};
    if (is_taken(target.scene, name)) return "a light or group '" + name + "' is there now";
    give_name(target.scene, light, name, warnings);
    return {};
}

std::string set_aim_back(const Target& target, std::vector<std::string>&) {
    Light& light = *light_of(target.scene, target.key.light);
    const auto& aim = std::get<Orientation>(target.value);
    change(target.scene, light.world_from_light, aim.world_from_light, light.aim_rev);
    change(target.scene, light.pan_rad, aim.pan_rad, light.aim_rev);
    change(target.scene, light.tilt_rad, aim.tilt_rad, light.aim_rev);
    change(target.scene, light.roll_rad, aim.roll_rad, light.aim_rev);
    return {};
}

std::string set_numbers_back(const Target& target, std::vector<std::string>&) {
    change(target.scene, *light_of(target.scene, target.key.light), *light_row_of(target.key.property),
           std::get<Numbers>(target.value));
    return {};
}

std::string set_profile_back(const Target& target, std::vector<std::string>&) {
    Light& light = *light_of(target.scene, target.key.light);
    change(target.scene, light.profile, std::get<std::shared_ptr<const Profile>>(target.value), light.profile_rev);
    return {};
}

std::string set_gel_back(const Target& target, std::vector<std::string>&) {
    Light& light = *light_of(target.scene, target.key.light);
    change(target.scene, light.gel, std::get<std::shared_ptr<const Gel>>(target.value), light.level_rev);
    return {};
}

std::string set_opening_back(const Target& target, std::vector<std::string>&) {
    Light& light = *light_of(target.scene, target.key.light);
    change(target.scene, light.opening, std::get<std::optional<ies::Opening>>(target.value), light.profile_rev);
    return {};
}

std::string set_group_back(const Target& target, std::vector<std::string>&) {
    Scene& scene = target.scene;
    const std::string& name = target.key.name;
    const auto* ids = std::get_if<LightIds>(&target.value);
    if (ids == nullptr) {
        if (scene.groups.erase(name) > 0) scene.groups_rev = scene.scene_rev + 1;
        return {};
    }
    std::vector<std::string> lights;
    for (const std::uint32_t id : *ids) {
        const Light* light = light_of(scene, id);
        if (light == nullptr) return "a light of it is gone";
        lights.push_back(light->name);
    }
    if (find_light(scene, name) != nullptr) return "a light '" + name + "' is there now";
    if (!scene.groups.contains(name) && scene.groups.size() >= kMaxGroups) return full("groups", kMaxGroups);
    change(scene, scene.groups[name], lights, scene.groups_rev);
    return {};
}

std::string set_preset_back(const Target& target, std::vector<std::string>&) {
    Scene& scene = target.scene;
    const std::string& name = target.key.name;
    const auto* preset = std::get_if<std::shared_ptr<const Preset>>(&target.value);
    if (preset == nullptr) {
        if (scene.presets.erase(name) > 0) scene.presets_rev = scene.scene_rev + 1;
        if (scene.recalled == name) scene.recalled.clear();
        note_preset(scene, name);
        return {};
    }
    if (!scene.presets.contains(name) && scene.presets.size() >= kMaxPresets) return full("presets", kMaxPresets);
    change(scene, scene.presets[name], *preset, scene.presets_rev);
    note_preset(scene, name);
    return {};
}

std::string set_cue_back(const Target& target, std::vector<std::string>&) {
    const auto* cue = std::get_if<std::shared_ptr<const Cue>>(&target.value);
    if (cue == nullptr) {
        erase_cue(target.scene, target.key.cue);
        return {};
    }
    const Cue* there = find_cue(target.scene, target.key.cue);
    if (there == nullptr && target.scene.cues && target.scene.cues->size() >= kMaxCues) return full("cues", kMaxCues);
    const std::size_t before = there == nullptr ? 0 : there->content->size();
    if (cue_lights(target.scene) - before + (*cue)->content->size() > kMaxCueLights)
        return full("lights in its cues", kMaxCueLights);
    if (there != cue->get()) put_cue(target.scene, *cue);
    return {};
}

std::string set_recalled_back(const Target& target, std::vector<std::string>&) {
    const auto& name = std::get<std::string>(target.value);
    if (name.empty() || target.scene.presets.contains(name))
        change(target.scene, target.scene.recalled, name, target.scene.presets_rev);
    return {};
}

std::string set_patch_back(const Target& target, std::vector<std::string>&) {
    change(target.scene, target.scene.patch, std::get<std::shared_ptr<const v1::SetPatch>>(target.value),
           target.scene.patch_rev);
    return {};
}

std::string set_surfaces_back(const Target& target, std::vector<std::string>&) {
    change(target.scene, target.scene.surfaces, std::get<std::shared_ptr<const v1::SetSurfaces>>(target.value),
           target.scene.surfaces_rev);
    return {};
}

// map: of grids or observers.
template <typename Map>
std::string set_entry_back(const Target& target, Map& map, std::size_t most, const char* what, Revision& rev) {
    const std::string& name = target.key.name;
    const auto* entry = std::get_if<typename Map::mapped_type>(&target.value);
    if (entry == nullptr) {
        if (map.erase(name) > 0) rev = target.scene.scene_rev + 1;
        return {};
    }
    if (!map.contains(name) && map.size() >= most) return full(what, most);
    change(target.scene, map[name], *entry, rev);
    return {};
}

std::string set_grid_back(const Target& target, std::vector<std::string>&) {
    return set_entry_back(target, target.scene.grids, kMaxGrids, "grids", target.scene.grids_rev);
}

std::string set_observer_back(const Target& target, std::vector<std::string>&) {
    return set_entry_back(target, target.scene.observers, kMaxObservers, "observers", target.scene.observers_rev);
}

std::string set_haze_back(const Target& target, std::vector<std::string>&) {
    change(target.scene, target.scene.haze, std::get<HazeValues>(target.value), target.scene.haze_rev);
    return {};
}

std::string set_master_back(const Target& target, std::vector<std::string>&) {
    change(target.scene, target.scene.master_ratio, std::get<double>(target.value), target.scene.master_rev);
    return {};
}

std::string set_view_light_back(const Target& target, std::vector<std::string>&) {
    const Light* light = light_of(target.scene, std::get<std::uint32_t>(target.value));
    change(target.scene, target.scene.view_light, light == nullptr ? "" : light->name, target.scene.view_rev);
    return {};
}

constexpr Setter kSetters[] = {
    set_light_back,    set_name_back,  set_aim_back,      set_numbers_back, set_profile_back,  set_gel_back,
    set_opening_back,  set_group_back, set_preset_back,   set_cue_back,     set_recalled_back, set_patch_back,
    set_surfaces_back, set_grid_back,  set_observer_back, set_haze_back,    set_master_back,   set_view_light_back};
static_assert(std::size(kSetters) == static_cast<std::size_t>(EditKind::view_light) + 1);

}  // namespace

void set_back(Scene& scene, const std::vector<EditTarget>& targets, std::vector<std::string>& warnings) {
    bool renamed = true;  // else presets and maps keep the names that they have
    for (const auto& [key, value] : targets) {
        const bool of_light = key.kind > EditKind::light && key.kind <= EditKind::opening;
        if (of_light && light_of(scene, key.light) == nullptr) continue;  // went, or could not come back: it was said
        const bool names_lights = key.kind == EditKind::preset || key.kind == EditKind::cue ||
                                  key.kind == EditKind::patch || key.kind == EditKind::surfaces;
        if (names_lights && !renamed) continue;
        const std::string why = kSetters[static_cast<std::size_t>(key.kind)]({scene, key, value}, warnings);
        if (why.empty()) continue;
        const auto* gone = std::get_if<ExistingLight>(&value);
        warnings.push_back((gone != nullptr ? "light '" + gone->light->name + "'" : words_of(scene, key)) +
                           " is not set back: " + why);
        if (key.kind == EditKind::name) renamed = false;
    }
}

}  // namespace gonio
