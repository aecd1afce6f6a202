#include "server/scene/edit.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>

#include "server/scene/cue.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

bool turns(const LightRow& light_row) {
    return light_row.stale == &Light::aim_rev;
}

Orientation orientation_now(const LightValues& light) {
    return {light.world_from_light, light.pan_rad, light.tilt_rad, light.roll_rad};
}

// Adds the edits between two lights of one id; nullptr: it is not there.
void add_edits(const Light* before, const Light* after, std::vector<Edit>& edits) {
    const std::uint32_t id = (before != nullptr ? before : after)->id;
    const auto existing = [](const Light* light) {
        return light == nullptr ? EditValue() : EditValue(ExistingLight{std::make_shared<const Light>(*light)});
    };
    if (before == nullptr || after == nullptr)
        edits.push_back({{EditKind::light, id, {}, {}}, existing(before), existing(after)});
    const auto value = [](const Light* light, const EditKey& key) {
        if (light == nullptr) return EditValue();
        return key.kind == EditKind::name ? EditValue(light->name) : value_of(*light, key);
    };
    for (EditKey& key : keys_of(id)) {
        EditValue was = value(before, key), is = value(after, key);
        if (was != is) edits.push_back({std::move(key), std::move(was), std::move(is)});
    }
}

void add_light_edits(const Scene& before, const Scene& after, std::vector<Edit>& edits) {
    const Revision since = before.scene_rev;
    auto was = before.lights.begin(), is = after.lights.begin();
    while (was != before.lights.end() || is != after.lights.end()) {  // both in the order of their ids
        const bool gone = is == after.lights.end() || (was != before.lights.end() && was->id < is->id);
        const bool came = !gone && (was == before.lights.end() || is->id < was->id);
        if (gone || came)
            add_edits(gone ? &*was : nullptr, came ? &*is : nullptr, edits);
        else if (std::max({is->position_rev, is->aim_rev, is->profile_rev, is->level_rev, is->name_rev}) > since)
            add_edits(&*was, &*is, edits);
        if (!came) ++was;
        if (!gone) ++is;
    }
}

LightIds ids_of(const Scene& scene, const std::vector<std::string>& names) {
    std::unordered_map<std::string_view, std::uint32_t> id_of;
    for (const Light& light : scene.lights) id_of.emplace(light.name, light.id);
    LightIds ids;
    for (const std::string& name : names) ids.push_back(id_of.at(name));  // a group's lights are there
    return ids;
}

// Adds the edits of a map's entries, by their names.
template <typename Map>
void add_entry_edits(EditKind kind, const Map& before, const Map& after, const Scene& scene_before,
                     const Scene& scene_after, std::vector<Edit>& edits) {
    const auto add = [&](const std::string& name) {
        EditKey key{kind, 0, {}, name};
        EditValue was = value_of(scene_before, key), is = value_of(scene_after, key);
        if (was != is) edits.push_back({std::move(key), std::move(was), std::move(is)});
    };
    for (const auto& [name, entry] : before) {
        const auto now = after.find(name);
        if (now == after.end() || now->second != entry) add(name);
    }
    for (const auto& [name, entry] : after)
        if (!before.contains(name)) add(name);
}

void add_cue_edits(const Scene& before, const Scene& after, std::vector<Edit>& edits) {
    static const CueList none;
    const CueList &was = before.cues ? *before.cues : none, &is = after.cues ? *after.cues : none;
    const auto value = [](const std::shared_ptr<const Cue>* cue) {
        return cue == nullptr ? EditValue() : EditValue(*cue);
    };
    auto old = was.begin();
    auto now = is.begin();
    while (old != was.end() || now != is.end()) {
        const bool gone = now == is.end() || (old != was.end() && (*old)->number < (*now)->number);
        const bool came = !gone && (old == was.end() || (*now)->number < (*old)->number);
        const auto* const before_it = came ? nullptr : &*old++;
        const auto* const after_it = gone ? nullptr : &*now++;
        const CueNumber number = (gone ? *before_it : *after_it)->number;
        if (gone || came || *before_it != *after_it)
            edits.push_back({{EditKind::cue, 0, {}, {}, number}, value(before_it), value(after_it)});
    }
}

}  // namespace

EditValue value_of(const LightValues& light, const EditKey& key) {
    if (key.kind == EditKind::aim) return orientation_now(light);
    if (key.kind == EditKind::numbers) return numbers_of(light, *light_row_of(key.property));
    if (key.kind == EditKind::profile) return light.profile;
    if (key.kind == EditKind::gel) return light.gel;
    if (key.kind == EditKind::opening) return light.opening;
    return {};
}

EditValue value_of(const Scene& scene, const EditKey& key) {
    switch (key.kind) {
        case EditKind::light:
        case EditKind::name:
        case EditKind::aim:
        case EditKind::numbers:
        case EditKind::profile:
        case EditKind::gel:
        case EditKind::opening: {
            const Light* light = light_of(scene, key.light);
            if (light == nullptr) return {};
            if (key.kind == EditKind::light) return ExistingLight{};
            return key.kind == EditKind::name ? EditValue(light->name) : value_of(*light, key);
        }
        case EditKind::group: {
            const auto group = scene.groups.find(key.name);
            return group == scene.groups.end() ? EditValue() : ids_of(scene, group->second);
        }
        case EditKind::preset: {
            const auto preset = scene.presets.find(key.name);
            return preset == scene.presets.end() ? EditValue() : preset->second;
        }
        case EditKind::cue: {
            auto cue = cue_of(scene, key.cue);
            return cue ? EditValue(std::move(cue)) : EditValue();
        }
        case EditKind::recalled:
            return scene.recalled;
        case EditKind::patch:
            return scene.patch;
        case EditKind::surfaces:
            return scene.surfaces;
        case EditKind::grid: {
            const auto grid = scene.grids.find(key.name);
            return grid == scene.grids.end() ? EditValue() : grid->second;
        }
        case EditKind::observer: {
            const auto observer = scene.observers.find(key.name);
            return observer == scene.observers.end() ? EditValue() : observer->second;
        }
        case EditKind::haze:
            return scene.haze;
        case EditKind::master:
            return scene.master_ratio;
        case EditKind::view_light: {
            const Light* light = find_light(scene, scene.view_light);
            return light == nullptr ? std::uint32_t{0} : light->id;
        }
    }
    return {};
}

std::vector<EditKey> keys_of(std::uint32_t light) {
    std::vector<EditKey> keys{{EditKind::name, light, {}, {}}, {EditKind::aim, light, {}, {}}};
    for (const LightRow& light_row : light_rows())
        if (!turns(light_row)) keys.push_back({EditKind::numbers, light, light_row.property, {}});
    keys.push_back({EditKind::profile, light, {}, {}});
    keys.push_back({EditKind::gel, light, {}, {}});
    keys.push_back({EditKind::opening, light, {}, {}});
    return keys;
}

std::vector<Edit> edits_between(const Scene& before, const Scene& after) {
    const Revision since = before.scene_rev;
    std::vector<Edit> edits;
    add_light_edits(before, after, edits);
    if (after.groups_rev > since) add_entry_edits(EditKind::group, before.groups, after.groups, before, after, edits);
    if (after.presets_rev > since)
        add_entry_edits(EditKind::preset, before.presets, after.presets, before, after, edits);
    if (after.grids_rev > since) add_entry_edits(EditKind::grid, before.grids, after.grids, before, after, edits);
    if (after.observers_rev > since)
        add_entry_edits(EditKind::observer, before.observers, after.observers, before, after, edits);
    if (after.cues_rev > since) add_cue_edits(before, after, edits);
    const auto add = [&](EditKind kind) {
        EditKey key{kind, 0, {}, {}};
        EditValue was = value_of(before, key), is = value_of(after, key);
        if (was != is) edits.push_back({std::move(key), std::move(was), std::move(is)});
    };
    for (const EditKind kind :
         {EditKind::recalled, EditKind::patch, EditKind::surfaces, EditKind::haze, EditKind::master})
        add(kind);
    if (after.view_rev > since) add(EditKind::view_light);
    return edits;
}

std::vector<Edit> edits_of_fade(const Scene& scene, const Preset& to) {
    std::unordered_map<std::string_view, const Light*> lights;
    for (const Light& light : scene.lights) lights.emplace(light.name, &light);
    std::vector<Edit> edits;
    for (const PresetLight& kept : to) {
        const auto light = lights.find(kept.name);
        if (light == lights.end()) continue;
        for (EditKey& key : keys_of(light->second->id)) {
            if (key.kind != EditKind::aim && key.kind != EditKind::numbers) continue;
            EditValue was = value_of(*light->second, key), will = value_of(kept, key);
            // A fade turns lights by their angles.
            if (auto* end = std::get_if<Orientation>(&will))
                end->world_from_light =
                    light->second->world_from_mount * orientation_of({end->pan_rad, end->tilt_rad, end->roll_rad});
            if (was != will) edits.push_back({std::move(key), std::move(was), std::move(will)});
        }
    }
    return edits;
}

std::string words_of(const Scene& scene, const EditKey& key) {
    const Light* light = light_of(scene, key.light);
    const std::string of = light == nullptr ? " of a light that is gone" : " of '" + light->name + "'";
    switch (key.kind) {
        case EditKind::light:
            return light == nullptr ? "a light that is gone" : "light '" + light->name + "'";
        case EditKind::name:
            return "name" + of;
        case EditKind::aim:
            return "aim" + of;
        case EditKind::numbers:
            return std::string(row_of(key.property).name) + of;
        case EditKind::profile:
            return "profile" + of;
        case EditKind::gel:
            return "gel" + of;
        case EditKind::opening:
            return "opening" + of;
        case EditKind::group:
            return "group '" + key.name + "'";
        case EditKind::preset:
            return "preset '" + key.name + "'";
        case EditKind::cue:
            return "cue " + print_cue_number(key.cue);
        case EditKind::recalled:
            return "the recalled preset";
        case EditKind::patch:
            return "the patch";
        case EditKind::surfaces:
            return "the map of fader boxes";
        case EditKind::grid:
            return "grid '" + key.name + "'";
        case EditKind::observer:
            return "observer '" + key.name + "'";
        case EditKind::haze:
            return "the haze";
        case EditKind::master:
            return "the master";
        case EditKind::view_light:
            return "the light of the view";
    }
    return {};
}

std::string path_of(const Scene& scene, const EditKey& key) {
    const Light* light = light_of(scene, key.light);
    std::string path = light == nullptr ? "" : "lights." + light->name;
    switch (key.kind) {
        case EditKind::light:
        case EditKind::name:
            return path;
        case EditKind::aim:
            return path.empty() ? path : path + ".aim";
        case EditKind::numbers:
            return path.empty() ? path : path + "." + std::string(row_of(key.property).state_field);
        case EditKind::profile:
            return path.empty() ? path : path + ".profile";
        case EditKind::gel:
            return path.empty() ? path : path + ".gel";
        case EditKind::opening:
            return path.empty() ? path : path + ".opening";
        case EditKind::group:
            return "groups." + key.name;
        case EditKind::preset:
            return "presets." + key.name;
        case EditKind::cue:
            return "cues." + print_cue_number(key.cue);
        case EditKind::recalled:
            return {};
        case EditKind::patch:
            return "patch";
        case EditKind::surfaces:
            return "surfaces";
        case EditKind::grid:
            return "grids." + key.name;
        case EditKind::observer:
            return "observers." + key.name;
        case EditKind::haze:
            return "haze";
        case EditKind::master:
            return "master_ratio";
        case EditKind::view_light:
            return "view";
    }
    return {};
}

}  // namespace gonio
