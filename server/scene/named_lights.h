// The lights that a name in a command stands for, where it is no light's and no group's own.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

struct Scene;

// Result: the names of the lights that `name` stands for, in the scene's order; empty: none. "all" stands for every
// light. A pattern stands for the lights whose whole names it matches: * is any characters, ? is one. A number stands
// for the lights of the fixture that has it in the MVR show. A name that a light or a group has is not looked at here.
std::vector<std::string> lights_called(const Scene& scene, std::string_view name);
// Result: whether the pattern matches all of the text. Takes at most pattern × text steps. Both UTF-8.
bool matches_pattern(std::string_view text, std::string_view pattern);

// Spells out lights_called() in the commands that take names of lights: set_light, remove_light and recess_light of
// several lights become an edit_lights. Other commands, and names of lights and groups, stay as they are. Errors:
// "not_found" where nothing has the name, with the nearest name that there is.
std::optional<Error> spell_out_lights(const Scene& scene, v1::Command& command);

}  // namespace gonio
