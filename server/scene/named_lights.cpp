#include "server/scene/named_lights.h"

#include <algorithm>
#include <string>

#include "ies/core/text.h"
#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/text/did_you_mean.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/imported.h"
#include "server/scene/light_values.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

using Names = std::vector<std::string>;

std::size_t next_character(std::string_view text, std::size_t at) {
    return at + std::max<std::size_t>(utf8_length(text, at), 1);
}

bool is_pattern(std::string_view name) {
    return name.find_first_of("*?") != name.npos;
}

Error no_such_light(const Scene& scene, const char* field, const std::string& name, bool groups_too) {
    std::vector<std::string_view> known;
    for (const Light& light : scene.lights) known.push_back(light.name);
    if (groups_too)
        for (const auto& [group, lights] : scene.groups) known.push_back(group);
    const std::string sentence = std::string("there is no light ") + (groups_too ? "or group " : "") + "of this name";
    return {"not_found", field, shortened_text(name, kMaxNameBytes),
            is_pattern(name) ? sentence : with_hint(sentence, name, known)};
}

bool stays(const Names& names, const std::string& name) {
    return names.size() == 1 && names.front() == name;
}

// The names of one field of a command.
class Spelling {
public:
    Spelling(const Scene& scene, const char* field, bool groups_too)
        : scene_(scene), field_(field), groups_too_(groups_too) {}

    // Result: what the name stands for: itself, or the names of lights. Errors: "not_found".
    Result<Names> of(const std::string& name) const {
        if (is_taken(scene_, name)) return Names{name};
        Names lights = lights_called(scene_, name);
        if (lights.empty()) return no_such_light(scene_, field_, name, groups_too_);
        return lights;
    }
    // Replaces the names in place, where one of them stands for others; then each light is there once.
    template <typename Repeated>
    std::optional<Error> in(Repeated& names) const {
        Names spelt;
        bool same = true;
        for (const std::string& name : names) {
            Result<Names> found = of(name);
            if (!found) return found.error();
            same &= stays(*found, name);
            for (std::string& light : *found)
                if (std::ranges::find(spelt, light) == spelt.end()) spelt.push_back(std::move(light));
        }
        if (!same) names.Assign(spelt.begin(), spelt.end());
        return std::nullopt;
    }

private:
    const Scene& scene_;
    const char* field_;
    const bool groups_too_;
};

// A command of the one light `name` becomes an edit_lights where the name stands for others. fill(names, edit): what it
// then says.
template <typename Fill>
std::optional<Error> spell_out_one(v1::Command& command, const Spelling& spelling, const std::string& name,
                                   const Fill& fill) {
    const Result<Names> lights = spelling.of(name);
    if (!lights) return lights.error();
    if (stays(*lights, name)) return std::nullopt;
    v1::EditLights edit;
    fill(*lights, edit);
    *command.mutable_edit_lights() = std::move(edit);
    return std::nullopt;
}

}  // namespace

bool matches_pattern(std::string_view text, std::string_view pattern) {
    std::size_t t = 0, p = 0, star = pattern.npos, after = 0;  // `after`: what the last * stands for ends there
    while (t < text.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++, after = t;
        } else if (p < pattern.size() && pattern[p] == '?') {
            ++p, t = next_character(text, t);
        } else if (p < pattern.size() && pattern[p] == text[t]) {
            ++p, ++t;
        } else if (star != pattern.npos) {
            p = star + 1, t = after = next_character(text, after);
        } else {
            return false;
        }
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

Names lights_called(const Scene& scene, std::string_view name) {
    Names names;
    for (const Light& light : scene.lights)
        if (name == "all" || (is_pattern(name) && matches_pattern(light.name, name)) ||
            (!name.empty() && fixture_of(scene, light) == name))
            names.push_back(light.name);
    return names;
}

std::optional<Error> spell_out_lights(const Scene& scene, v1::Command& command) {
    if (command.has_set_light())
        return spell_out_one(command, {scene, "set_light.name", true}, command.set_light().name(),
                             [&](const Names& lights, v1::EditLights& edit) {
                                 edit.mutable_names()->Assign(lights.begin(), lights.end());
                                 *edit.mutable_same() = command.set_light();
                                 edit.mutable_same()->clear_name();
                             });
    if (command.has_remove_light())
        return spell_out_one(command, {scene, "remove_light.name", false}, command.remove_light().name(),
                             [](const Names& lights, v1::EditLights& edit) {
                                 edit.mutable_remove()->Assign(lights.begin(), lights.end());
                             });
    if (command.has_recess_light())
        return spell_out_one(command, {scene, "recess_light.name", true}, command.recess_light().name(),
                             [](const Names& lights, v1::EditLights& edit) {
                                 edit.mutable_names()->Assign(lights.begin(), lights.end());
                                 edit.mutable_same()->set_mount("recessed");
                             });
    if (command.has_set_group()) {
        v1::SetGroup& group = *command.mutable_set_group();
        return Spelling(scene, "set_group.lights", false).in(*group.mutable_lights());
    }
    if (!command.has_edit_lights()) return std::nullopt;
    v1::EditLights& edit = *command.mutable_edit_lights();
    if (auto refused = Spelling(scene, "edit_lights.names", true).in(*edit.mutable_names())) return refused;
    return Spelling(scene, "edit_lights.remove", false).in(*edit.mutable_remove());
}

}  // namespace gonio
