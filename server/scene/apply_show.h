// Of apply() alone, except the last: a show that takes the place of the scene. Refusals leave as Refused
// (apply_checks.h).
#pragma once

#include "protocol/schema/messages.h"
#include "server/scene/apply.h"

namespace gonio {

void open_show(Scene& scene, const v1::OpenShow& open, const Loaded& loaded);

// Of the render session alone, where a file holds the scene as it was at that revision.
void show_saved(Scene& scene, const std::string& name, Revision rev);

}  // namespace gonio
