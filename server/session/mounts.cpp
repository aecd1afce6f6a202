#include "server/session/mounts.h"

#include <map>
#include <string>
#include <vector>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/scene/light_values.h"
#include "server/trace/outlet.h"

namespace gonio {
namespace {

struct Refusal {
    Error error;
};

// Takes `mount` out of what is said of a light. Result: whether it was said.
bool take_mount(v1::SetLight& set, const std::string& prefix) {
    if (!set.has_mount()) return false;
    if (set.mount() != "recessed")
        throw Refusal{{"invalid_argument", prefix + "mount", set.mount(), "it is \"recessed\" or not said"}};
    set.clear_mount();
    return true;
}

void add_lights_of(const Scene& scene, const std::string& name, std::vector<std::string>& names) {
    const auto group = scene.groups.find(name);
    if (group == scene.groups.end())
        names.push_back(name);
    else
        names.insert(names.end(), group->second.begin(), group->second.end());
}

// Takes all mounts out of a command. Result: the lights that are to be mounted.
std::vector<std::string> take_mounts(const Scene& scene, v1::Command& command) {
    std::vector<std::string> names;
    if (command.has_set_light() && take_mount(*command.mutable_set_light(), "set_light.")) {
        add_lights_of(scene, command.set_light().name(), names);
    } else if (command.has_add_light() &&
               take_mount(*command.mutable_add_light()->mutable_light(), "add_light.light.")) {
        names.push_back(command.add_light().light().name());
    } else if (command.has_edit_lights()) {
        v1::EditLights& edit = *command.mutable_edit_lights();
        for (v1::SetLight& set : *edit.mutable_set())
            if (take_mount(set, "edit_lights.set.")) names.push_back(set.name());
        if (edit.has_same() && take_mount(*edit.mutable_same(), "edit_lights.same."))
            for (const std::string& name : edit.names()) add_lights_of(scene, name, names);
        for (v1::AddLight& add : *edit.mutable_add())
            if (take_mount(*add.mutable_light(), "edit_lights.add.light.")) names.push_back(add.light().name());
    }
    return names;
}

// Puts positions in the place of a command's own. A set_light becomes the edit_lights of the same lights.
void put_positions(v1::Command& command, const std::map<std::string, glm::dvec3>& positions) {
    const auto put = [&](v1::SetLight& set, const glm::dvec3& position) {
        set.clear_position_m();
        for (int k = 0; k < 3; ++k) set.add_position_m(position[k]);
    };
    if (command.has_add_light()) return put(*command.mutable_add_light()->mutable_light(), positions.begin()->second);
    if (command.has_set_light()) {
        v1::EditLights edit;
        *edit.mutable_same() = command.set_light();
        edit.add_names(command.set_light().name());
        edit.mutable_same()->clear_name();
        *command.mutable_edit_lights() = std::move(edit);
    }
    v1::EditLights& edit = *command.mutable_edit_lights();
    std::map<std::string, glm::dvec3> left = positions;
    const auto put_own = [&](v1::SetLight& set) {
        const auto own = left.find(set.name());
        if (own == left.end()) return;
        put(set, own->second);
        left.erase(own);
    };
    for (v1::SetLight& set : *edit.mutable_set()) put_own(set);
    for (v1::AddLight& add : *edit.mutable_add()) put_own(*add.mutable_light());
    if (edit.has_same() && !left.empty()) edit.mutable_same()->clear_position_m();
    for (const auto& [name, position] : left) {
        v1::SetLight& set = *edit.add_set();
        set.set_name(name);
        put(set, position);
    }
}

}  // namespace

std::optional<Error> carry_out_mounts(const Scene& scene, v1::Command& command, const Loaded& loaded) {
    std::string field;
    if (command.has_recess_light()) {
        field = "recess_light.name";
        v1::SetLight set;
        set.set_name(command.recess_light().name());
        set.set_mount("recessed");
        *command.mutable_set_light() = std::move(set);
    }
    try {
        const std::vector<std::string> names = take_mounts(scene, command);
        if (names.empty()) return std::nullopt;
        if (field.empty())
            field = command.has_set_light()   ? "set_light.mount"
                    : command.has_add_light() ? "add_light.light.mount"
                                              : "edit_lights.mount";
        Scene after = scene;
        if (auto applied = apply(after, command, loaded); !applied) {
            Error error = applied.error();
            if (field == "recess_light.name") error.where = field;
            return error;
        }
        std::map<std::string, glm::dvec3> positions;
        for (const std::string& name : names) {
            const Light& light = *find_light(after, name);
            if (light.sun) return Error{"unsupported", field, name, "a sun has no place"};
            if (!after.traced)
                return Error{"unsupported", field, name, "the scene's surfaces are not ready for rays yet"};
            const auto position = trace::recessed_position(*after.traced, light);
            if (!position)
                return Error{
                    "not_found", field, name,
                    "there is no surface within 0.5 m before or behind it, before which it would shine freely"};
            positions[name] = *position;
        }
        put_positions(command, positions);
    } catch (const Refusal& refusal) {
        return refusal.error;
    }
    return std::nullopt;
}

}  // namespace gonio
