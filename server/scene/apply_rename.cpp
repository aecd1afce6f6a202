#include "server/scene/apply_rename.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "protocol/schema/console.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/surface.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/cue.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// The new names of lights by their old ones. Names that a light gets are no key here unless their light leaves them.
struct Renamed {
    explicit Renamed(const std::map<std::string, std::string>& new_names) : new_by_old(new_names) {
        for (const auto& [name, new_name] : new_names) fresh.insert(new_name);
    }
    const std::string* new_name_of(const std::string& name) const {
        const auto at = new_by_old.find(name);
        return at == new_by_old.end() ? nullptr : &at->second;
    }
    bool names(const std::string& name) const { return fresh.contains(name) || new_by_old.contains(name); }

    const std::map<std::string, std::string>& new_by_old;
    std::set<std::string_view> fresh;
};

// Result: the rows with the lights' new names as their targets, or nullptr where none has a name of either kind: rows
// that were there for a new one drive the light from now on, and undo must know them.
template <typename Rows>
std::shared_ptr<const Rows> followed(const std::shared_ptr<const Rows>& rows, const Renamed& renamed) {
    if (!rows || std::ranges::none_of(rows->rows(), [&](const auto& row) { return renamed.names(row.target()); }))
        return nullptr;
    auto changed = std::make_shared<Rows>(*rows);
    for (auto& row : *changed->mutable_rows())
        if (const std::string* name = renamed.new_name_of(row.target())) row.set_target(*name);
    return changed;
}

// What a preset or a cue keeps of a light that is gone and had a new name makes place for what it keeps of the light
// that gets it. Result: what it keeps now; nullptr where it has no name of either kind, as in followed().
std::shared_ptr<const Preset> followed(const Preset& preset, const std::string& what, const Renamed& renamed,
                                       std::vector<std::string>& warnings) {
    if (std::ranges::none_of(preset, [&](const PresetLight& kept) { return renamed.names(kept.name); })) return nullptr;
    std::set<std::string> coming;  // new names of lights that it keeps
    for (const PresetLight& kept : preset)
        if (const std::string* name = renamed.new_name_of(kept.name)) coming.insert(*name);
    Preset changed = preset;
    std::erase_if(changed, [&](const PresetLight& kept) {
        if (renamed.new_name_of(kept.name) != nullptr || !coming.contains(kept.name)) return false;
        warnings.push_back(what + " kept another light '" + kept.name + "', which it forgets");
        return true;
    });
    for (PresetLight& kept : changed)
        if (const std::string* name = renamed.new_name_of(kept.name)) kept.name = *name;
    return std::make_shared<const Preset>(std::move(changed));
}

void follow_presets(Scene& scene, const Renamed& renamed, std::vector<std::string>& warnings) {
    std::map<const Preset*, std::shared_ptr<const Preset>> contents;  // of cues that share one, and presets with them
    for (auto& [preset_name, preset] : scene.presets) {
        auto changed = followed(*preset, "preset '" + preset_name + "'", renamed, warnings);
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
        if (fresh) content->second = followed(*cue->content, "cue " + print_cue_number(cue->number), renamed, warnings);
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
    give_names(scene, {{light.name, new_name}}, warnings);
}

void give_names(Scene& scene, const std::map<std::string, std::string>& new_by_old,
                std::vector<std::string>& warnings) {
    if (new_by_old.empty()) return;
    const Renamed renamed(new_by_old);
    const Revision now = scene.scene_rev + 1;
    for (Light& light : scene.lights) {
        const std::string* name = renamed.new_name_of(light.name);
        if (name == nullptr) continue;
        light.name = *name;
        light.name_rev = scene.lights_rev = now;
    }
    for (auto& [group, lights] : scene.groups)
        for (std::string& member : lights) {
            const std::string* name = renamed.new_name_of(member);
            if (name == nullptr) continue;
            member = *name;
            scene.groups_rev = now;
        }
    if (const std::string* name = renamed.new_name_of(scene.view_light))
        change(scene, scene.view_light, *name, scene.view_rev);
    if (const std::string* name = renamed.new_name_of(scene.view_only))
        change(scene, scene.view_only, *name, scene.view_rev);
    follow_presets(scene, renamed, warnings);
    if (auto rows = followed(scene.patch, renamed)) change(scene, scene.patch, rows, scene.patch_rev);
    if (auto rows = followed(scene.surfaces, renamed)) change(scene, scene.surfaces, rows, scene.surfaces_rev);
}

}  // namespace gonio
