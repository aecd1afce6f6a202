#include "server/scene/apply_light.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/schema/light.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/imported.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/opening.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/scene/shaped_profile.h"

namespace gonio {

void take_angles(Light& light, const std::optional<PanTiltRoll>& known) {
    const PanTiltRoll angles =
        known ? *known : angles_of(glm::inverse(light.world_from_mount) * light.world_from_light);
    light.pan_rad = angles.pan_rad;
    light.tilt_rad = angles.tilt_rad;
    light.roll_rad = angles.roll_rad;
}

double tilt_factor_of(const Light& light) {
    const auto& table = light.profile->photometry.tilt;
    if (!table) return 1.0;
    const double down = std::clamp(-aim_of(light.world_from_light).y, -1.0, 1.0);
    return ies::tilt_factor(*table, Angle::radians(std::acos(down)));
}

void follow_values(Light& light) {
    light.tilt_factor = tilt_factor_of(light);
    follow_shaping(light);
}

namespace {

// Result: the same profile as a light has it already, so that they share what is made of it; or the one given.
std::shared_ptr<const Profile> shared_profile(const Scene& scene, const std::shared_ptr<const Profile>& profile) {
    for (const Light& light : scene.lights) {
        if (light.profile == profile || *light.profile == *profile) return light.profile;
    }
    return profile;
}

// Result: nullptr for no gel.
std::shared_ptr<const Gel> gel_named(const Scene& scene, const std::string& name, const std::string& field) {
    if (name.empty()) return nullptr;
    auto gel = find_gel(scene.gels.get(), name);
    if (!gel) refuse("not_found", field, shortened_text(name, kMaxNameBytes), "there is no gel of this name");
    return gel;
}

// Result: nothing for what the profile says.
std::optional<ies::Opening> opening_named(const std::string& text, const std::string& field) {
    if (text == "file") return std::nullopt;
    const auto opening = parse_opening(text);
    if (!opening)
        refuse("invalid_argument", field, shortened_text(text, kMaxNameBytes),
               "must be file, point, rect LxW, disc D, line L, sphere D or box LxWxH, in metres from 0.001 to 100");
    return opening;
}

void set_one_light(Scene& scene, Light& light, const v1::SetLight& set, const Loaded& loaded,
                   const std::string& prefix) {
    if (set.has_mount())  // that takes rays: the session has put positions in its place
        refuse("unsupported", prefix + "mount", set.mount(), "rays cannot be cast here");
    const bool turns = set.has_pan_rad() || set.has_tilt_rad() || set.has_roll_rad();
    if (set.aim_size() > 0 && turns)
        refuse("conflict", prefix + "aim", print_all(set.aim()), "aim cannot be set together with pan, tilt or roll");
    for (const LightRow& light_row : light_rows()) {
        const PropertyRow& row = row_of(light_row.property);
        if (!has_numbers(set, row.field)) continue;
        const std::vector<double> numbers = read_numbers(set, row.field);
        const std::string field = prefix + std::string(row.field);
        if (light_row.number != nullptr) {
            const double number = checked(numbers[0], row, field);
            change(scene, light.*light_row.number, row.whole ? std::round(number) : number, light.*light_row.stale);
        } else {
            change(scene, light.*light_row.vector, checked_vector(numbers, row.least, row.most, field),
                   light.*light_row.stale);
        }
    }
    if (turns && light.aim_rev == scene.scene_rev + 1)  // the angles that it had turn nothing, not by a last bit either
        light.world_from_light =
            light.world_from_mount * orientation_of({light.pan_rad, light.tilt_rad, light.roll_rad});
    if (set.aim_size() > 0) {
        const glm::dquat orientation = orientation_aiming(checked_direction(set.aim(), prefix + "aim"));
        change(scene, light.world_from_light, orientation, light.aim_rev);
        take_angles(light);
    }
    if (set.has_gel()) change(scene, light.gel, gel_named(scene, set.gel(), prefix + "gel"), light.level_rev);
    if (set.has_opening()) {
        if (light.sun) refuse("unsupported", prefix + "opening", set.opening(), "the sun is seen 0.53 degrees across");
        change(scene, light.opening, opening_named(set.opening(), prefix + "opening"), light.profile_rev);
    }
    if (loaded.profile && light.sun && !(*loaded.profile == *light.profile))
        refuse("unsupported", prefix + "profile", loaded.profile->name, "the sun's light is parallel: it has no web");
    if (loaded.profile && !(*loaded.profile == *light.profile)) note_own_profile(scene, light);
    if (loaded.profile) change(scene, light.profile, shared_profile(scene, loaded.profile), light.profile_rev);
    if (light.sun && (light.zoom_rad != 0.0 || light.gobo != 0.0))
        refuse("unsupported", prefix + (light.zoom_rad != 0.0 ? "zoom_rad" : "gobo"),
               print_number(light.zoom_rad != 0.0 ? light.zoom_rad : light.gobo),
               "the sun's light is parallel: it has no web");
}

// Result: why not; then the light is as before.
std::optional<Error> try_light(Scene& scene, Light& light, const v1::SetLight& set) {
    const Light before = light;
    try {
        set_one_light(scene, light, set, {}, "set_light.");
    } catch (const Refused& refused) {
        light = before;
        return refused.error;
    }
    follow_values(light);
    return std::nullopt;
}

// Result: the command's properties of a light, one each.
std::vector<v1::SetLight> single_properties(const v1::SetLight& set) {
    std::vector<v1::SetLight> single;
    const auto take = [&](std::string_view field) {
        if (has_numbers(set, field)) copy_numbers(set, single.emplace_back(), field);
    };
    for (const LightRow& light_row : light_rows()) take(row_of(light_row.property).field);
    take(row_of(Property::aim).field);
    if (set.has_gel()) single.emplace_back().set_gel(set.gel());
    if (set.has_opening()) single.emplace_back().set_opening(set.opening());
    return single;
}

}  // namespace

// name: a light, or a group for every light of it. prefix, names: where the values and the name come from.
static void set_named(Scene& scene, const std::string& name, const v1::SetLight& set, const Loaded& loaded,
                      const std::string& prefix, const char* names) {
    if (Light* light = find_light(scene, name)) return set_one_light(scene, *light, set, loaded, prefix);
    const auto group = scene.groups.find(name);
    if (group == scene.groups.end()) refuse("not_found", names, name, "there is no light or group of this name");
    for (const std::string& member : group->second)
        set_one_light(scene, *find_light(scene, member), set, loaded, prefix);
}

void set_light(Scene& scene, const v1::SetLight& set, const Loaded& loaded) {
    set_named(scene, set.name(), set, loaded, "set_light.", "set_light.name");
}

namespace {

// Result: what a new light has before its own values: all of the light that it shall be like, or a plain one's.
Light new_light(const Scene& scene, const v1::AddLight& add, const Loaded& loaded, const std::string& prefix) {
    Light light;
    if (!add.like().empty()) {
        const Light* like = find_light(scene, add.like());
        if (like == nullptr) refuse("not_found", prefix + "like", add.like(), "there is no light of this name");
        if (like->sun) refuse("unsupported", prefix + "like", add.like(), "only a scene file has a sun");
        light = *like;
        light.seed = light.imported = -1;
        light.missing = false;
        if (light.world_from_mount != glm::dquat(1.0, 0.0, 0.0, 0.0)) {
            light.world_from_mount = {1.0, 0.0, 0.0, 0.0};
            take_angles(light);
        }
    } else {
        if (!loaded.profile) refuse("invalid_argument", prefix + "light.profile", "", "a new light needs a profile");
        light.profile = shared_profile(scene, loaded.profile);
        light.world_from_light = orientation_of({});
        light.position = (scene.asset->bounds.min + scene.asset->bounds.max) * 0.5;
    }
    return light;
}

void add_one_light(Scene& scene, const v1::AddLight& add, const Loaded& loaded, const std::string& prefix) {
    const v1::SetLight& set = add.light();
    const std::string name = checked_name(set.name(), prefix + "light.name");
    if (is_taken(scene, name))
        refuse("already_exists", prefix + "light.name", name, "a light or group of this name exists");
    if (scene.lights.size() >= kMaxLights)
        refuse("too_many_lights", prefix + "light.name", name,
               "a scene holds at most " + std::to_string(kMaxLights) + " lights");
    Light light = new_light(scene, add, loaded, prefix);
    if (add.has_multiplier()) light.multiplier = checked(add.multiplier(), 0.0, kMostMultiplier, prefix + "multiplier");
    light.id = scene.next_light_id++;
    light.name = name;
    light.position_rev = light.aim_rev = light.profile_rev = light.level_rev = light.name_rev = scene.scene_rev + 1;
    set_one_light(scene, light, set, loaded, prefix + "light.");
    scene.lights.push_back(std::move(light));
    scene.lights_rev = scene.scene_rev + 1;
}

}  // namespace

void add_light(Scene& scene, const v1::AddLight& add, const Loaded& loaded) {
    add_one_light(scene, add, loaded, "add_light.");
}

void edit_lights(Scene& scene, const v1::EditLights& edit, const Loaded& loaded) {
    const auto within = [](int count, const char* field) {
        if (static_cast<std::size_t>(count) <= kMaxLights) return;
        refuse("too_large", std::string("edit_lights.") + field, std::to_string(count),
               "at most " + std::to_string(kMaxLights) + " are changed at once");
    };
    within(edit.set_size(), "set");
    within(edit.names_size(), "names");
    within(edit.add_size(), "add");
    within(edit.remove_size(), "remove");
    for (const v1::SetLight& set : edit.set()) {
        if (set.has_profile())
            refuse("unsupported", "edit_lights.set.profile", set.name(), "only `same` has a profile");
        Light* light = find_light(scene, set.name());
        if (light == nullptr) refuse("not_found", "edit_lights.set.name", set.name(), "there is no light of this name");
        set_one_light(scene, *light, set, {}, "edit_lights.set.");
    }
    for (const std::string& name : edit.names())
        set_named(scene, name, edit.same(), loaded, "edit_lights.same.", "edit_lights.names");
    for (const v1::AddLight& add : edit.add()) {
        if (add.light().has_profile())
            refuse("unsupported", "edit_lights.add.light.profile", add.light().name(), "each is like another light");
        add_one_light(scene, add, {}, "edit_lights.add.");
    }
    for (const std::string& name : edit.remove()) remove_light(scene, name, "edit_lights.remove");
}

void remove_light(Scene& scene, const std::string& name, const char* field) {
    Light* light = find_light(scene, name);
    if (light == nullptr) refuse("not_found", field, name, "there is no light of this name");
    scene.lights.erase(scene.lights.begin() + (light - scene.lights.data()));
    scene.lights_rev = scene.scene_rev + 1;
    for (auto group = scene.groups.begin(); group != scene.groups.end();) {
        if (std::erase(group->second, name) > 0) scene.groups_rev = scene.scene_rev + 1;
        group = group->second.empty() ? scene.groups.erase(group) : std::next(group);
    }
    if (scene.view_light == name) {
        scene.view_light.clear();
        scene.view_rev = scene.scene_rev + 1;
    }
    if (scene.view_only == name) change(scene, scene.view_only, std::string(), scene.view_rev);
}

void set_group(Scene& scene, const v1::SetGroup& set) {
    const std::string name = checked_name(set.name(), "set_group.name");
    if (find_light(scene, name) != nullptr) refuse("already_exists", "set_group.name", name, "a light has this name");
    std::vector<std::string> lights;
    for (const std::string& light : set.lights()) {
        if (find_light(scene, light) == nullptr)
            refuse("not_found", "set_group.lights", light, "there is no light of this name");
        if (std::find(lights.begin(), lights.end(), light) == lights.end()) lights.push_back(light);
    }
    if (lights.empty()) {
        if (scene.groups.erase(name) == 0)
            refuse("not_found", "set_group.name", name, "there is no group of this name");
        scene.groups_rev = scene.scene_rev + 1;
        return;
    }
    if (!scene.groups.contains(name) && scene.groups.size() >= kMaxGroups) {
        refuse("too_many_groups", "set_group.name", name,
               "a scene holds at most " + std::to_string(kMaxGroups) + " groups");
    }
    change(scene, scene.groups[name], lights, scene.groups_rev);
}

std::optional<Error> set_light_in_parts(Scene& scene, const v1::SetLight& set) {
    Light* light = find_light(scene, set.name());
    if (light == nullptr) return Error{"not_found", "set_light.name", set.name(), "there is no light of this name"};
    std::optional<Error> refused = try_light(scene, *light, set);
    if (!refused) return refused;
    const std::vector<v1::SetLight> single = single_properties(set);
    for (const v1::SetLight& one : single)
        if (single.size() > 1) try_light(scene, *light, one);
    return refused;
}

}  // namespace gonio
