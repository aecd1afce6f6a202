// Where commands say that lights are to be mounted, the positions that this comes to. Render thread: casts rays.
#pragma once

#include <optional>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/apply.h"

namespace gonio {

struct Scene;

// Puts positions in the place of a recess_light and of every SetLight::mount of a command. What was said of a group
// becomes an edit_lights of its lights. Other commands stay as they are. loaded: the command's files. Errors: those of
// apply(), and "invalid_argument" for another way of mounting. "not_found" means that there is no such light or group,
// or no surface within half a metre. "unsupported": a sun, or nothing to cast rays in. "conflict": one position for
// lights that are mounted and others.
std::optional<Error> carry_out_mounts(const Scene& scene, v1::Command& command, const Loaded& loaded);

}  // namespace gonio
