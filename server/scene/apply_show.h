// Of apply() alone, except the last: a show, or a scene that was left, takes the place of the scene. Refusals leave as
// Refused (apply_checks.h).
#pragma once

#include "protocol/schema/messages.h"
#include "server/scene/apply.h"

namespace gonio {

// Each part of the scene becomes new with this revision.
void renew_parts(Scene& scene, Revision now);
// What belongs to the viewers rather than to the scene stays when `fresh` takes its place.
void keep_viewing(const Scene& scene, Scene& fresh);

void open_show(Scene& scene, const v1::OpenShow& open, const Loaded& loaded);

// The scene is again as it was when a load replaced it. Its lights keep their ids.
void come_back(Scene& scene, const Scene& left);

// Of the render session alone, where a file holds the scene as it was at that revision.
void show_saved(Scene& scene, const std::string& name, Revision rev);

}  // namespace gonio
