// Where commands say that lights are to be mounted, the positions that this comes to. Render thread: casts rays.
#pragma once

#include <optional>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"

namespace gonio {

// Turns a recess_light, and every SetLight::mount of a command, into the positions that carry them out: an edit_lights,
// or an add_light with a position. Other commands stay as they are. loaded: the command's files. Errors: those of
// apply(); "not_found" (no light or group, no surface within half a metre), "invalid_argument" (another way of
// mounting), "unsupported" (sun, nothing to cast rays in).
std::optional<Error> carry_out_mounts(const Scene& scene, v1::Command& command, const Loaded& loaded);

}  // namespace gonio
