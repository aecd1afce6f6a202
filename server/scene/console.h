// What consoles say, in terms of the scene: the patch in force, and values of properties as commands.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/property.h"
#include "protocol/surface/surface_reader.h"

namespace gonio {

struct Scene;

// Result: the scene's patch, or the default one for its lights, with a warning for each row that names nothing here.
v1::Patch patch_in_force(const Scene& scene);

// Result: a sentence for each row of the scene's surfaces that names a light or group that is not there.
std::vector<std::string> surface_warnings(const Scene& scene);

// Result: one command for each light that the values name, one for each profile and one for each property of the scene.
// They are in the order in which they were first named. Later values of a property replace earlier ones. Red, green,
// blue, x, y and z fill up with what the light has. A value that names neither a light nor a group is left out.
std::vector<v1::Command> commands_of(const Scene& scene, std::span<const PropertyValue> values);

// Result: what a button or OSC asks of the cues: "go", "back", "stop", or the number of one to go to.
v1::Command cue_command(const std::string& what);

// Result: what a patch may name: lights and groups by name, with the ids of their lights. A name whose ids differ from
// before has not heard what was said to it.
std::map<std::string, std::vector<std::uint32_t>> targets_of(const Scene& scene);

// Result: what answers with the value of a property as it is now, SI. For a group it is that of the first of its
// lights. It is nothing for properties of three values, of names, and where there is no such target. The scene's lights
// and groups must stay while it is asked.
ValueNow values_now(const Scene& scene);

}  // namespace gonio
