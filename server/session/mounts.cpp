#include "server/session/mounts.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"
#include "server/trace/outlet.h"

namespace gonio {
namespace {

// A part of a command that says something of lights.
struct Part {
    v1::SetLight* set;
    std::string prefix;               // of its fields
    std::vector<std::string> lights;  // that it is said of
    bool own;                         // of one light that it names itself
};

std::vector<std::string> lights_of(const Scene& scene, const std::string& name) {
    const auto group = scene.groups.find(name);
    return group == scene.groups.end() ? std::vector<std::string>{name} : group->second;
}

std::vector<Part> parts_of(const Scene& scene, v1::Command& command) {
    std::vector<Part> parts;
    if (command.has_set_light()) {
        v1::SetLight& set = *command.mutable_set_light();
        parts.push_back({&set, "set_light.", lights_of(scene, set.name()), !scene.groups.contains(set.name())});
    } else if (command.has_add_light()) {
        v1::SetLight& set = *command.mutable_add_light()->mutable_light();
        parts.push_back({&set, "add_light.light.", {set.name()}, true});
    } else if (command.has_edit_lights()) {
        v1::EditLights& edit = *command.mutable_edit_lights();
        for (v1::SetLight& set : *edit.mutable_set()) parts.push_back({&set, "edit_lights.set.", {set.name()}, true});
        if (edit.has_same()) {
            Part& same = parts.emplace_back(Part{edit.mutable_same(), "edit_lights.same.", {}, false});
            for (const std::string& name : edit.names())
                for (std::string& light : lights_of(scene, name)) same.lights.push_back(std::move(light));
        }
        for (v1::AddLight& add : *edit.mutable_add())
            parts.push_back({add.mutable_light(), "edit_lights.add.light.", {add.light().name()}, true});
    }
    return parts;
}

// Whether there is anything to do. Faders that move say nothing of mounts, and should not pay for lists of lights.
bool says_mount(const v1::Command& command) {
    const auto has_mount = [](const v1::SetLight& set) { return set.has_mount(); };
    const v1::EditLights& edit = command.edit_lights();
    return command.has_recess_light() || has_mount(command.set_light()) || has_mount(command.add_light().light()) ||
           has_mount(edit.same()) || std::ranges::any_of(edit.set(), has_mount) ||
           std::ranges::any_of(edit.add(), has_mount, &v1::AddLight::light);
}

using Mounted = std::map<std::string, std::string>;  // by name of the light: the field that says so

// Takes all mounts out of a command.
std::optional<Error> take_mounts(const std::vector<Part>& parts, Mounted& mounted) {
    for (const Part& part : parts) {
        if (!part.set->has_mount()) continue;
        const std::string field = part.prefix + "mount";
        if (part.set->mount() != "recessed")
            return Error{"invalid_argument", field, part.set->mount(), "it is \"recessed\" or not said"};
        part.set->clear_mount();
        for (const std::string& light : part.lights) mounted.emplace(light, field);
    }
    return std::nullopt;
}

// The scene as it would be without the mounts. Gobos are left out: they do not change where light goes, and a warning
// about a gobo's picture is given only once, which has to be when the command itself is applied.
Result<Scene> applied_to(const Scene& scene, v1::Command command, const Loaded& loaded) {
    for (const Part& part : parts_of(scene, command)) part.set->clear_gobo();
    Scene after = scene;
    if (auto applied = apply(after, command, loaded); !applied) return applied.error();
    return after;
}

void put(v1::SetLight& set, const glm::dvec3& position) {
    set.clear_position_m();
    for (int k = 0; k < 3; ++k) set.add_position_m(position[k]);
}

// Puts positions in the place of a command's own. A set_light of a group becomes the edit_lights of its lights. Error:
// "conflict" where lights that are mounted and others are to have one position.
std::optional<Error> put_positions(const Scene& scene, v1::Command& command, std::map<std::string, glm::dvec3> left) {
    const auto is_mounted = [&left](const std::string& light) { return left.contains(light); };
    if (command.has_set_light() && scene.groups.contains(command.set_light().name())) {
        v1::EditLights edit;
        *edit.mutable_same() = command.set_light();
        edit.mutable_same()->clear_name();
        for (const std::string& light : lights_of(scene, command.set_light().name())) edit.add_names(light);
        *command.mutable_edit_lights() = std::move(edit);
    }
    const std::vector<Part> parts = parts_of(scene, command);
    for (const Part& part : parts) {
        if (part.set->position_m_size() == 0 || std::ranges::none_of(part.lights, is_mounted)) continue;
        if (!std::ranges::all_of(part.lights, is_mounted))
            return Error{"conflict", part.prefix + "position_m", "",
                         "some of these lights are mounted, others are not"};
        part.set->clear_position_m();
    }
    for (const Part& part : parts) {
        if (!part.own) continue;
        if (const auto found = left.find(part.lights.front()); found != left.end()) {
            put(*part.set, found->second);
            left.erase(found);
        }
    }
    for (const auto& [name, position] : left) {
        v1::SetLight& set = *command.mutable_edit_lights()->add_set();
        set.set_name(name);
        put(set, position);
    }
    return std::nullopt;
}

}  // namespace

std::optional<Error> carry_out_mounts(const Scene& scene, v1::Command& command, const Loaded& loaded) {
    if (!says_mount(command)) return std::nullopt;
    const bool recesses = command.has_recess_light();
    if (recesses) {
        v1::SetLight set;
        set.set_name(command.recess_light().name());
        set.set_mount("recessed");
        *command.mutable_set_light() = std::move(set);
    }
    Mounted mounted;
    if (auto refused = take_mounts(parts_of(scene, command), mounted)) return refused;
    const auto refused = [&](Error error) {
        if (recesses) error.where = "recess_light.name";
        return error;
    };
    const Result<Scene> after = applied_to(scene, command, loaded);
    if (!after) return refused(after.error());
    std::map<std::string, glm::dvec3> positions;
    for (const auto& [name, field] : mounted) {
        const Light* const light = find_light(*after, name);
        if (light == nullptr) continue;  // the same command removes it
        if (light->sun) return refused({"unsupported", field, name, "a sun has no place"});
        if (!after->traced)
            return refused({"unsupported", field, name, "the scene's surfaces are not ready for rays yet"});
        const auto position = trace::recessed_position(*after->traced, *light);
        if (!position)
            return refused(
                {"not_found", field, name,
                 "there is no surface within 0.5 m before or behind it, before which it would shine freely"});
        positions[name] = *position;
    }
    return put_positions(scene, command, std::move(positions));
}

}  // namespace gonio
