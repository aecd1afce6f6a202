// Of apply() alone: the commands that lights and groups take. Refusals leave as Refused (apply_checks.h).
#pragma once

#include <optional>
#include <string>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/apply.h"

namespace gonio {

// A light, or every light of a group.
void set_light(Scene& scene, const v1::SetLight& set, const Loaded& loaded);
void add_light(Scene& scene, const v1::AddLight& add, const Loaded& loaded);
// Many at once: what is set and made first, then what is removed.
void edit_lights(Scene& scene, const v1::EditLights& edit, const Loaded& loaded);
// field: that names it, for a refusal.
void remove_light(Scene& scene, const std::string& name, const char* field = "remove_light.name");
void set_group(Scene& scene, const v1::SetGroup& set);
// Of a console, which names no group: what can be set is set. Result: why the first property that cannot was refused.
std::optional<Error> set_light_in_parts(Scene& scene, const v1::SetLight& set);

// Pan, tilt and roll of an orientation that was given otherwise. known: what they are; else angles_of().
void take_angles(Light& light, const std::optional<PanTiltRoll>& known = std::nullopt);
// Result: the lamp's output at this tilt, the angle between the aim and nadir; 1 without a TILT table.
double tilt_factor_of(const Light& light);
// Sets what follows a light's values: its TILT factor and what zoom and gobo make of its profile.
void follow_values(Light& light);

}  // namespace gonio
